// SPDX-License-Identifier: Apache-2.0
//
// The other forms of a tree on the CPU, asked in one way, and held to a loop over all triangles.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <zkd/cpu/plane_tree.hpp>
#include <zkd/cpu/wide_tree.hpp>
#include <zkd/zkd.hpp>

#include "support/hits.hpp"
#include "support/rays.hpp"

namespace zkd::test {

inline constexpr Intersector all_intersectors[] = {
    Intersector::watertight, Intersector::fast, Intersector::single_precision,
    Intersector::double_precision, Intersector::exact};

/// A cpu::WideTree.
struct WideForm {
  cpu::WideTreeView tree;

  void closest_hit(const cpu::Executor& executor, std::span<const Ray> rays, std::span<Hit> hits,
                   std::span<TraversalCost> costs, Intersector intersector) const {
    cpu::closest_hit(executor, tree, rays, hits, costs, intersector);
  }
  void any_hit(const cpu::Executor& executor, std::span<const Ray> rays,
               std::span<std::uint8_t> occluded, std::span<TraversalCost> costs,
               Intersector intersector) const {
    cpu::any_hit(executor, tree, rays, occluded, costs, intersector);
  }
  [[nodiscard]] std::optional<Hit> closest_hit(const Ray& ray, Intersector intersector) const {
    return cpu::closest_hit(tree, ray, intersector);
  }
  [[nodiscard]] bool any_hit(const Ray& ray, Intersector intersector) const {
    return cpu::any_hit(tree, ray, intersector);
  }
};

/// A cpu::PlaneTree and its triangles.
struct PlaneForm {
  cpu::PlaneTreeView tree;
  TriangleView triangles;

  void closest_hit(const cpu::Executor& executor, std::span<const Ray> rays, std::span<Hit> hits,
                   std::span<TraversalCost> costs, Intersector intersector) const {
    cpu::closest_hit(executor, tree, triangles, rays, hits, costs, intersector);
  }
  void any_hit(const cpu::Executor& executor, std::span<const Ray> rays,
               std::span<std::uint8_t> occluded, std::span<TraversalCost> costs,
               Intersector intersector) const {
    cpu::any_hit(executor, tree, triangles, rays, occluded, costs, intersector);
  }
  [[nodiscard]] std::optional<Hit> closest_hit(const Ray& ray, Intersector intersector) const {
    return cpu::closest_hit(tree, triangles, ray, intersector);
  }
  [[nodiscard]] bool any_hit(const Ray& ray, Intersector intersector) const {
    return cpu::any_hit(tree, triangles, ray, intersector);
  }
};

/// Every form of a query against a loop over all triangles and the walk of the tree.
template <class Form>
void expect_same_answers(const Tree& tree, const Form& form, const TriangleView& triangles,
                         const std::vector<Ray>& rays, Intersector intersector) {
  SCOPED_TRACE(to_string(intersector));
  const std::vector<Hit> want = brute_force(tree.view(), triangles, rays, {}, intersector);
  const std::vector<Hit> narrow = closest(tree.view(), triangles, rays, {}, intersector);
  for (const cpu::InstructionSet set :
       {cpu::InstructionSet::portable, cpu::InstructionSet::automatic}) {
    SCOPED_TRACE(cpu::to_string(set));
    const cpu::Executor executor{.threads = 2, .instructions = set};
    std::vector<Hit> hits(rays.size());
    std::vector<TraversalCost> costs(rays.size());
    form.closest_hit(executor, rays, hits, costs, intersector);
    std::vector<std::uint8_t> occluded(rays.size());
    form.any_hit(executor, rays, occluded, {}, intersector);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_TRUE(same_bits(narrow[i], want[i])) << "the tree itself, ray " << i;
      ASSERT_TRUE(same_bits(hits[i], want[i]))
          << "ray " << i << " " << print(rays[i]) << ": " << print(hits[i]) << " instead of "
          << print(want[i]);
      ASSERT_EQ(occluded[i], is_hit(want[i]) ? 1 : 0) << "ray " << i << print(rays[i]);
      ASSERT_TRUE(!is_hit(want[i]) || costs[i].triangle_tests > 0);
    }
  }
  for (std::size_t i = 0; i < rays.size(); i += 3) {
    ASSERT_TRUE(same_bits(or_miss(form.closest_hit(rays[i], intersector)), want[i]));
    ASSERT_EQ(form.any_hit(rays[i], intersector), is_hit(want[i]));
  }
}

/// The same through an empty one.
template <class Form>
void expect_misses(const Form& form) {
  const Ray ray{{0, 0, -1}, 0, {0, 0, 1}};
  for (const Intersector intersector : all_intersectors) {
    EXPECT_FALSE(form.closest_hit(ray, intersector));
    EXPECT_FALSE(form.any_hit(ray, intersector));
  }
  std::vector<Hit> hits(1, Hit{1, 2, 3, 4});
  std::vector<TraversalCost> costs(1, TraversalCost{5, 6});
  form.closest_hit({}, std::span(&ray, 1), hits, costs, Intersector::watertight);
  EXPECT_TRUE(same_bits(hits[0], Hit{}));
  EXPECT_EQ(costs[0].node_visits + costs[0].triangle_tests, 0u);
}

/// Of spans of different lengths the shortest counts.
template <class Form>
void expect_shorter_spans_end_the_work(const Form& form, const std::vector<Ray>& rays,
                                       const std::vector<Hit>& want) {
  const Hit untouched{-1, -2, -3, 12345};
  for (const std::size_t length : {std::size_t{0}, std::size_t{1}, std::size_t{37}, rays.size()}) {
    std::vector<Hit> hits(rays.size(), untouched);
    form.closest_hit({}, rays, std::span(hits).first(length), {}, Intersector::watertight);
    std::vector<Hit> fewer(rays.size(), untouched);
    std::vector<TraversalCost> costs(std::max<std::size_t>(length, 1));
    form.closest_hit({}, rays, fewer, costs, Intersector::watertight);
    std::vector<std::uint8_t> occluded(rays.size(), 9);
    form.any_hit({}, rays, std::span(occluded).first(length), {}, Intersector::watertight);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      EXPECT_TRUE(same_bits(hits[i], i < length ? want[i] : untouched));
      EXPECT_TRUE(same_bits(fewer[i], i < costs.size() ? want[i] : untouched));
      EXPECT_EQ(occluded[i], i < length ? (is_hit(want[i]) ? 1 : 0) : 9);
    }
  }
}

}  // namespace zkd::test
