// SPDX-License-Identifier: Apache-2.0
//
// All eleven stages on the platform, one after the other, each fed with what the one before it
// made.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>
#include <zkd/options.hpp>
#include <zkd/stages.hpp>
#include <zkd/tree.hpp>

#include "support/platform.hpp"

namespace zkd::test {

/// What they found, in host memory.
struct Composition {
  Box bounds;
  Lattice lattice;
  bool split = false;  ///< triangles, into fragments
  std::uint32_t crowded = 0;
  std::vector<std::uint32_t> first;  ///< of each trunk
  Link root;
  std::vector<Link> children;
  std::vector<std::uint32_t> axes;
  std::vector<float> planes;
  std::vector<std::uint32_t> leaf_offsets;
  std::vector<std::uint32_t> references;
  std::vector<Node> nodes;
};

template <class T>
std::vector<T> at_positions(const std::vector<T>& values,
                            const std::vector<std::uint32_t>& positions) {
  std::vector<T> picked;
  for (const std::uint32_t position : positions) picked.push_back(values[position]);
  return picked;
}

inline Composition compose(const Executor& executor, const TriangleView& triangles,
                           const BuildOptions& options) {
  Composition out;
  const auto& uploaded = upload(triangles);
  Array<Box> boxes(triangles.triangle_count);
  const stages::SceneSummary scene =
      stages::triangle_boxes(executor, uploaded, options.invalid_triangles, boxes);
  out.bounds = scene.bounds;
  std::uint32_t leaf_size = options.leaf_size;
  if (leaf_size == 0) leaf_size = options.references == References::all ? 12 : 4;
  std::uint32_t width = options.code_bits;
  if (width == 0) width = scene.valid < (1u << 22) ? 32 : 64;
  out.lattice = stages::make_lattice(scene.bounds, width, options.axis_order);

  // What is coded: triangles, or fragments.
  out.split = stages::pays_to_split(executor, boxes, options.references);
  const auto cut = [&](std::span<Box> to, std::span<std::uint32_t> owners) {
    return stages::split_triangles(executor, uploaded, boxes, out.lattice, options.budget, to,
                                   owners);
  };
  const stages::Fragments fragments =
      out.split ? cut({}, {}) : stages::Fragments{scene.valid, scene.valid};
  Array<Box> fragment_boxes(out.split ? fragments.places : 0);
  Array<std::uint32_t> owners(out.split ? fragments.places : 0);
  if (out.split) (void)cut(fragment_boxes, owners);
  const Array<Box>& coded = out.split ? fragment_boxes : boxes;
  const std::size_t n = fragments.count;

  Array<std::uint64_t> codes(n);
  Array<std::uint32_t> ids(n);
  stages::morton_encode(executor, coded, out.lattice, codes, ids);
  (void)stages::radix_sort(executor, codes, ids, 64);

  Array<stages::TrunkKey> keys(n);
  Array<std::uint32_t> crowd(n);
  Array<Lattice> lattices(n);
  out.crowded =
      stages::recode_crowded(executor, coded, out.lattice, codes, ids, leaf_size,
                             options.axis_order, options.recode_crowded, keys, crowd, lattices);
  Array<std::uint32_t> found(n);
  const std::uint32_t trunks = stages::find_trunks(executor, keys, leaf_size, found);
  out.first = found.download();
  out.first.resize(trunks);

  const std::size_t node_count = std::max<std::size_t>(trunks, 1) - 1;
  const Array<stages::TrunkKey> trunk_keys = upload(at_positions(keys.download(), out.first));
  Array<std::uint8_t> levels(node_count);
  stages::essential_nodes(executor, trunk_keys, levels);
  Array<Link> children(2 * node_count);
  out.root = stages::path_compression(executor, trunk_keys, levels, children);
  out.children = children.download();
  Array<std::uint32_t> axes(node_count);
  Array<float> planes(node_count);
  stages::split_planes(executor, trunk_keys, levels,
                       upload(at_positions(crowd.download(), out.first)), out.lattice, lattices,
                       axes, planes);
  out.axes = axes.download();
  out.planes = planes.download();

  const Array<std::uint32_t> first = upload(out.first);
  const stages::Skeleton skeleton{ids, first, levels, children, out.root, axes, planes, owners};
  Array<std::uint32_t> leaf_offsets(trunks + std::size_t{1});
  Array<std::uint32_t> none(0);
  const References policy =
      options.references == References::all ? References::all : References::once;
  const std::uint64_t needed = stages::list_references(executor, uploaded, boxes, skeleton,
                                                       out.lattice, policy, leaf_offsets, none);
  Array<std::uint32_t> references(needed);
  Array<Box> inside(policy == References::all ? needed : 0);
  (void)stages::list_references(executor, uploaded, boxes, skeleton, out.lattice, policy,
                                leaf_offsets, references, inside);
  if (policy == References::once) {
    Array<Node> nodes(node_count);
    std::vector<std::uint32_t> ends = out.first;
    ends.push_back(static_cast<std::uint32_t>(n));
    if (out.split)
      stages::tight_boxes(executor, coded, skeleton, upload(ends), ids, nodes);
    else
      stages::tight_boxes(executor, boxes, skeleton, leaf_offsets, references, nodes);
    out.leaf_offsets = leaf_offsets.download();
    out.references = references.download();
    out.nodes = nodes.download();
    return out;
  }
  const auto split = [&](const stages::StrictArrays& arrays) {
    return stages::split_crowded_leaves(executor, uploaded, boxes, trunk_keys, skeleton,
                                        leaf_offsets, references, inside, leaf_size,
                                        options.axis_order, arrays);
  };
  const stages::SplitLeaves strict = split({});
  Array<Node> nodes(std::max<std::size_t>(strict.leaves, 1) - 1);
  Array<std::uint32_t> strict_offsets(strict.leaves + std::size_t{1});
  Array<std::uint32_t> strict_references(strict.references);
  Array<Box> strict_inside(strict.references);
  (void)split({nodes, strict_offsets, strict_references, strict_inside});
  stages::tight_boxes(executor, strict.root, strict_offsets, strict_inside, nodes);
  out.root = strict.root;
  out.leaf_offsets = strict_offsets.download();
  out.references = strict_references.download();
  out.nodes = nodes.download();
  return out;
}

}  // namespace zkd::test
