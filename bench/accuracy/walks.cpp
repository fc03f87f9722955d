// SPDX-License-Identifier: Apache-2.0
//
// The walks. Compiled without contraction, as the library is; tree and ray are the library's too.
#include "walks.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <zkd/traversal/intersect.hpp>
#include <zkd/traversal/traverse.hpp>

#include "cpu/threads.hpp"
#include "literal_walk.hpp"

namespace zkd::bench::accuracy {
namespace {

using core::Entries;
using core::PreparedRay;
using core::Real;
using Intersect = core::Watertight;
using Candidate = Intersect::Candidate;

constexpr std::uint32_t rays_at_once = 64;

// A ray against two boxes without slabs. What rounding does to t is made up for by `exit_factor`
// where the ray leaves (1: not at all).
class PlainBoxes {
 public:
  PlainBoxes(const PreparedRay& ray, float exit_factor) : ray_(ray), exit_factor_(exit_factor) {}

  struct Span {
    Real near;
    Real far;
    [[nodiscard]] bool met() const { return near <= far; }
  };

  [[nodiscard]] Span operator()(const Node& node, int child, Real first, Real last) const {
    Span span{first, last};
    for (int a = 0; a < 3; ++a) {
      const bool negative = ray_.is_negative(static_cast<std::uint32_t>(a));
      const Real at_near = negative ? node.hi(child, a) : node.lo(child, a);
      const Real at_far = negative ? node.lo(child, a) : node.hi(child, a);
      span.near = core::larger(span.near, (at_near - ray_.origin[a]) * ray_.inverse[a]);
      span.far =
          core::smaller(span.far, (at_far - ray_.origin[a]) * ray_.inverse[a] * Real(exit_factor_));
    }
    return span;
  }

 private:
  const PreparedRay& ray_;
  float exit_factor_;
};

// Boxes for core::traverse: near as it is, far 3 ulp further out.
class PaddedBoxTest {
 public:
  explicit PaddedBoxTest(const PreparedRay& ray) : ray_(ray), boxes_(ray, 1.0F + 3.0F * 0x1p-23F) {}

  [[nodiscard]] static const Node& read(const Node& node) { return node; }

  Entries operator()(const Node& node, Real last) const {
    const PlainBoxes::Span below = boxes_(node, 0, ray_.first, last);
    const PlainBoxes::Span above = boxes_(node, 1, ray_.first, last);
    return {{below.near.value, above.near.value},
            (below.met() ? 1u : 0u) | (above.met() ? 2u : 0u)};
  }

 private:
  const PreparedRay& ray_;
  PlainBoxes boxes_;
};

struct Waiting {
  std::uint32_t link;
  float near;
  float far;
};

Candidate walk_naively(const TreeView& tree, const TriangleView& triangles, const PreparedRay& ray,
                       const Intersect& intersect) {
  const PlainBoxes boxes(ray, 1.0F);
  Candidate best;
  Waiting stack[max_depth + 1];
  std::size_t waiting = 0;
  // A tree of one leaf has no box of its own: its interval is the ray's.
  stack[waiting++] = {tree.root().bits, ray.first.value, ray.last.value};
  while (waiting > 0) {
    const Waiting entry = stack[--waiting];
    if (entry.near > best.limit.value) continue;
    const Link link{entry.link};
    if (link.is_leaf()) {
      intersect_within(tree, triangles, intersect, link.index(), entry.near, entry.far, best);
      continue;
    }
    const Node& node = tree.nodes[link.index()];
    const PlainBoxes::Span span[2] = {boxes(node, 0, ray.first, ray.last),
                                      boxes(node, 1, ray.first, ray.last)};
    const int near = span[1].near < span[0].near ? 1 : 0;
    for (const int child : {1 - near, near}) {
      if (span[child].met()) {
        stack[waiting++] = {node.child[child].bits, span[child].near.value, span[child].far.value};
      }
    }
  }
  return best;
}

template <class Trace>
void for_each_ray(const cpu::Executor& executor, const TreeView& tree, std::span<const Ray> rays,
                  std::span<Hit> hits, Trace trace) {
  const auto count = static_cast<std::uint32_t>(rays.size());
  cpu::Threads(executor).share(count, rays_at_once, [=](cpu::Range range) {
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const PreparedRay prepared(tree, rays[i], Intersect::hit_distance);
      hits[i] =
          prepared.valid ? core::to_hit(trace(prepared, Intersect(prepared, rays[i]))) : Hit{};
    }
  });
}

// core::BoxTest that keeps count of what waits in core::traverse: the walk pushes the far child of
// a node whose children are both met, and an entry whose turn has come is the next node to be
// tested (leaves are not seen; what waited above such a node is gone with them).
class StackMeter {
 public:
  explicit StackMeter(const PreparedRay& ray) : ray_(ray), boxes_(ray) {}
  ~StackMeter() { deepest_seen = std::max(deepest_seen, deepest_); }
  StackMeter(const StackMeter&) = delete;             // reports when it ends
  StackMeter& operator=(const StackMeter&) = delete;  // likewise

  [[nodiscard]] static const Node& read(const Node& node) { return node; }

  Entries operator()(const Node& node, Real last) const {
    const auto here = static_cast<std::uint32_t>(&node - nodes);
    if (!(expected_ == Link::node(here))) {
      while (waiting_ > 0 && !(stack_[waiting_ - 1] == Link::node(here))) --waiting_;
      if (waiting_ > 0) --waiting_;
    }
    const Entries entries = boxes_(node, last);
    const bool upper_first = entries.t[1] < entries.t[0] ||
                             (entries.t[1] == entries.t[0] && ray_.is_negative(node.axis));
    if (entries.hit == 3) {
      stack_[waiting_++] = node.child[upper_first ? 0 : 1];
      expected_ = node.child[upper_first ? 1 : 0];
    } else {
      expected_ = entries.hit == 0 ? Link{} : node.child[entries.hit - 1];
    }
    deepest_ = std::max(deepest_, waiting_);
    return entries;
  }

  static thread_local const Node* nodes;           // of the tree that is walked
  static thread_local std::uint32_t deepest_seen;  // by the walks of this thread

 private:
  const PreparedRay& ray_;
  core::BoxTest boxes_;
  mutable Link stack_[max_depth];
  mutable Link expected_;
  mutable std::uint32_t waiting_ = 0;
  mutable std::uint32_t deepest_ = 0;
};
thread_local const Node* StackMeter::nodes = nullptr;
thread_local std::uint32_t StackMeter::deepest_seen = 0;

}  // namespace

const char* to_string(Walk value) noexcept {
  switch (value) {
    case Walk::library:
      return "library";
    case Walk::slab:
      return "slab";
    case Walk::padded:
      return "padded";
    case Walk::naive:
      return "naive";
    case Walk::literal:
      return "literal";
  }
  return "library";
}

void closest_hit(Walk walk, Intersector intersector, const cpu::Executor& executor,
                 const TreeView& tree, const TriangleView& triangles, std::span<const Ray> rays,
                 std::span<Hit> hits) {
  switch (walk) {
    case Walk::library:
      zkd::closest_hit(executor, tree, triangles, rays, hits, {}, intersector);
      return;
    case Walk::slab:
      for_each_ray(
          executor, tree, rays, hits, [=](const PreparedRay& ray, const Intersect& intersect) {
            return core::traverse<false, core::BoxTest>(tree, triangles, ray, intersect, nullptr);
          });
      return;
    case Walk::padded:
      for_each_ray(
          executor, tree, rays, hits, [=](const PreparedRay& ray, const Intersect& intersect) {
            return core::traverse<false, PaddedBoxTest>(tree, triangles, ray, intersect, nullptr);
          });
      return;
    case Walk::naive:
      for_each_ray(executor, tree, rays, hits,
                   [=](const PreparedRay& ray, const Intersect& intersect) {
                     return walk_naively(tree, triangles, ray, intersect);
                   });
      return;
    case Walk::literal:
      closest_hit_literally(executor, tree, triangles, rays, hits);
      return;
  }
}

std::uint32_t deepest_stack(const cpu::Executor& executor, const TreeView& tree,
                            const TriangleView& triangles, std::span<const Ray> rays) {
  std::vector<std::uint32_t> deepest(rays.size());
  const std::span<std::uint32_t> written(deepest);
  const auto count = static_cast<std::uint32_t>(rays.size());
  cpu::Threads(executor).share(count, rays_at_once, [=](cpu::Range range) {
    for (std::uint32_t i = range.begin; i < range.end; ++i) {
      const PreparedRay prepared(tree, rays[i], Intersect::hit_distance);
      StackMeter::nodes = tree.nodes;
      StackMeter::deepest_seen = 0;
      if (prepared.valid) {
        const Intersect intersect(prepared, rays[i]);
        (void)core::traverse<false, StackMeter>(tree, triangles, prepared, intersect, nullptr);
      }
      written[i] = StackMeter::deepest_seen;
    }
  });
  return deepest.empty() ? 0 : *std::max_element(deepest.begin(), deepest.end());
}

}  // namespace zkd::bench::accuracy
