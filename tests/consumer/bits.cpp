// SPDX-License-Identifier: Apache-2.0
//
// Builds trees and traces rays, and prints every result as bits. Whatever flags this file is
// compiled with, the text must be the same: all input is made from integers, without arithmetic
// that a flag may change.
#include <zkd/stages.hpp>
#include <zkd/zkd.hpp>

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

namespace {

// Splitmix64, Steele, Lea, Flood (OOPSLA 2014): integers only.
struct Random {
  std::uint64_t state;
  std::uint32_t operator()() {
    std::uint64_t z = state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return static_cast<std::uint32_t>((z ^ (z >> 31)) >> 32);
  }
  int below(int n) { return static_cast<int>((std::uint64_t{(*this)()} * n) >> 32); }
};

// A whole number times the smallest denormal, 2^-149: no instruction that flushes it is involved.
float denormal(int whole) {
  const auto magnitude = static_cast<std::uint32_t>(whole < 0 ? -whole : whole);
  return std::bit_cast<float>(magnitude | (whole < 0 ? 0x80000000u : 0u));
}

float ordinary(int whole) { return static_cast<float>(whole); }

void print(const char* name, float (*coordinate)(int), zkd::References references) {
  Random random{42};
  struct Whole {
    int x, y, z;
  };
  const auto near = [&](int around, int reach) {
    const auto one = [&] { return around + random.below(2 * reach + 1) - reach; };
    const int x = one();
    const int y = one();
    return Whole{x, y, one()};
  };
  const auto vector = [&](Whole w) {
    return glm::vec3(coordinate(w.x), coordinate(w.y), coordinate(w.z));
  };

  std::vector<glm::vec3> corners;
  for (int i = 0; i < 1000; ++i) {
    const int around = random.below(20001) - 10000;
    for (int corner = 0; corner < 3; ++corner) corners.push_back(vector(near(around, 4000)));
  }
  const zkd::TriangleView triangles{corners};

  zkd::BuildOptions options;
  options.references = references;
  const zkd::Tree tree = zkd::build(triangles, options);
  for (const zkd::Node& node : tree.nodes()) {
    std::uint32_t words[sizeof(zkd::Node) / 4];
    std::memcpy(words, &node, sizeof(words));
    for (const std::uint32_t word : words) std::printf("%08x ", word);
    std::printf("\n");
  }

  for (int i = 0; i < 5000; ++i) {
    const Whole from = near(0, 30000);
    const int diagonal = random.below(20001) - 10000;
    const Whole to = near(diagonal, 3000);
    zkd::Ray ray;
    ray.origin = vector(from);
    ray.direction = vector({to.x - from.x, to.y - from.y, to.z - from.z});
    const auto hit = zkd::closest_hit(tree.view(), triangles, ray);
    const bool any = zkd::any_hit(tree.view(), triangles, ray);
    if (hit) {
      std::printf("%s %d: %u %08x %08x %08x %d\n", name, i, hit->triangle,
                  std::bit_cast<std::uint32_t>(hit->t), std::bit_cast<std::uint32_t>(hit->u),
                  std::bit_cast<std::uint32_t>(hit->v), any);
    } else {
      std::printf("%s %d: miss %d\n", name, i, any);
    }
    zkd::for_each_hit(tree.view(), triangles, ray, [](const zkd::Hit& each) {
      std::printf("%u %08x ", each.triangle, std::bit_cast<std::uint32_t>(each.t));
    });
    std::printf("\n");
  }
}

}  // namespace

int main() {
  print("once", ordinary, zkd::References::once);
  print("all", ordinary, zkd::References::all);
  print("denormal", denormal, zkd::References::once);
}
