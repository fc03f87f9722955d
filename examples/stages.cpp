// SPDX-License-Identifier: Apache-2.0
//
// The poster, step by step: calls each stage by itself over eight triangles and prints what it
// finds, then checks that build() made the same planes.
#include <bitset>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include <zkd/stages.hpp>
#include <zkd/zkd.hpp>

namespace {

// Eight small triangles along a curve, ever farther apart.
std::vector<glm::vec3> scattered_triangles() {
  std::vector<glm::vec3> corners;
  for (int i = 0; i < 8; ++i) {
    const auto at = static_cast<float>(i * i);
    const auto side = static_cast<float>(i % 3);
    corners.insert(corners.end(), {{at, side, 0}, {at + 0.5F, side, 0}, {at, side + 0.5F, 1}});
  }
  return corners;
}

std::string name(zkd::Link link) {
  return (link.is_leaf() ? "trunk " : "node ") + std::to_string(link.index());
}

}  // namespace

int main() try {
  namespace stages = zkd::stages;
  constexpr std::uint32_t code_bits = 16;
  constexpr std::uint32_t leaf_size = 1;

  const std::vector<glm::vec3> corners = scattered_triangles();
  const zkd::TriangleView triangles{corners};
  const zkd::cpu::Executor cpu;

  // 1, 2. The box of each triangle and of the scene, and the lattice over it.
  std::vector<zkd::Box> boxes(triangles.triangle_count);
  const stages::SceneSummary scene =
      stages::triangle_boxes(cpu, triangles, zkd::InvalidTriangles::error, boxes);
  const zkd::Lattice lattice = stages::make_lattice(scene.bounds, code_bits);
  std::printf("axes of the code's bits: ");
  for (std::uint32_t level = 0; level < lattice.code_bits; ++level) {
    std::putchar("xyz"[lattice.axis[level]]);
  }

  // 3, 4. Morton codes of the centres, sorted.
  std::vector<std::uint64_t> codes(scene.valid);
  std::vector<std::uint32_t> ids(scene.valid);
  stages::morton_encode(cpu, boxes, lattice, codes, ids);
  stages::radix_sort(cpu, codes, ids, lattice.code_bits);
  std::printf("\n\nsorted codes\n");
  for (std::size_t i = 0; i < codes.size(); ++i) {
    std::printf("  %s  triangle %u\n", std::bitset<code_bits>(codes[i]).to_string().c_str(),
                ids[i]);
  }

  // 5, 6. Keys, and the trunks: ranges of keys that become leaves.
  std::vector<stages::TrunkKey> keys(codes.size());
  std::vector<std::uint32_t> crowd(codes.size());
  std::vector<zkd::Lattice> crowd_lattices(codes.size());
  stages::recode_crowded(cpu, boxes, lattice, codes, ids, leaf_size, zkd::AxisOrder::by_extent,
                         true, keys, crowd, crowd_lattices);
  std::vector<std::uint32_t> first(keys.size());
  first.resize(stages::find_trunks(cpu, keys, leaf_size, first));

  std::vector<stages::TrunkKey> trunk_keys;
  std::vector<std::uint32_t> trunk_crowd;
  for (const std::uint32_t position : first) {
    trunk_keys.push_back(keys[position]);
    trunk_crowd.push_back(crowd[position]);
  }

  // 7, 8. Essential nodes, linked directly.
  std::vector<std::uint8_t> levels(first.size() - 1);
  stages::essential_nodes(cpu, trunk_keys, levels);
  std::vector<zkd::Link> children(2 * levels.size());
  const zkd::Link root = stages::path_compression(cpu, trunk_keys, levels, children);

  // 9. The plane of each.
  std::vector<std::uint32_t> axes(levels.size());
  std::vector<float> planes(levels.size());
  stages::split_planes(cpu, trunk_keys, levels, trunk_crowd, lattice, crowd_lattices, axes, planes);

  std::printf("\nessential nodes (root: %s)\n", name(root).c_str());
  for (std::size_t j = 0; j < levels.size(); ++j) {
    std::printf("  node %zu  level %2d  %c = %-8g  below: %-8s above: %s\n", j, levels[j],
                "xyz"[axes[j]], static_cast<double>(planes[j]), name(children[2 * j]).c_str(),
                name(children[2 * j + 1]).c_str());
  }

  // build() is the same stages and two more: references and tight boxes.
  const zkd::Tree tree =
      zkd::build(cpu, triangles, {.leaf_size = leaf_size, .code_bits = code_bits});
  bool same = tree.nodes().size() == planes.size();
  for (std::size_t j = 0; same && j < planes.size(); ++j) {
    same = tree.nodes()[j].plane == planes[j] * tree.view().scale() &&
           tree.nodes()[j].axis == axes[j] && tree.nodes()[j].child[0] == children[2 * j];
  }
  std::printf("\nbuild() has %s planes\n", same ? "the same" : "other");
  return same ? 0 : 1;
} catch (const zkd::Error& error) {
  std::fprintf(stderr, "%s: %s\n", zkd::to_string(error.code()), error.what());
  return 1;
}
