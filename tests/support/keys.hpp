// SPDX-License-Identifier: Apache-2.0
//
// Sorted keys that are hard on trunks, essential nodes and path compression.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <zkd/stages.hpp>

#include "support/random.hpp"

namespace zkd::test {

using Keys = std::vector<stages::TrunkKey>;

struct NamedKeys {
  std::string name;
  Keys keys;
};

inline std::uint64_t top_bits(std::uint64_t value, std::uint32_t bits) {
  return bits == 0 ? 0 : value & (~std::uint64_t{0} << (64 - bits));
}

/// Random codes of `bits` bits; some share a code and then have a second round.
inline Keys random_keys(std::uint64_t seed, std::size_t count, std::uint32_t bits,
                        std::uint32_t fine_bits, std::uint32_t different_codes) {
  Random random(seed);
  std::vector<std::uint64_t> codes(different_codes);
  for (std::uint64_t& code : codes) code = top_bits(random.bits64(), bits);
  Keys keys(count);
  for (stages::TrunkKey& key : keys) {
    key.code = codes[random.below(different_codes)];
    key.fine = top_bits(random.bits64(), fine_bits);
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

/// 0, 1, 10, 100, ... up to level 0: every key shares one bit less with 0 than the last. Each
/// `times` times.
inline Keys staircase_keys(std::uint32_t lowest_level, std::size_t times) {
  Keys keys(times);
  for (std::uint32_t step = 0; step <= lowest_level; ++step) {
    const std::uint32_t level = lowest_level - step;
    stages::TrunkKey key;
    (level < 64 ? key.code : key.fine) = std::uint64_t{1} << (63 - level % 64);
    keys.insert(keys.end(), times, key);
  }
  return keys;
}

/// The mirror image: 11..1, 11..10, 11..100, ...
inline Keys falling_staircase_keys(std::uint32_t lowest_level) {
  Keys keys = staircase_keys(lowest_level, 1);
  const std::uint64_t code_mask = top_bits(~std::uint64_t{0}, std::min(lowest_level + 1, 64u));
  const std::uint64_t fine_mask =
      lowest_level < 64 ? 0 : top_bits(~std::uint64_t{0}, lowest_level - 63);
  for (stages::TrunkKey& key : keys) key = {~key.code & code_mask, ~key.fine & fine_mask};
  std::sort(keys.begin(), keys.end());
  return keys;
}

inline Keys without_duplicates(Keys keys) {
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

/// Sorted, duplicates included.
inline std::vector<NamedKeys> hard_keys() {
  std::vector<NamedKeys> all;
  const auto add = [&all](std::string name, Keys keys) {
    all.push_back({std::move(name), std::move(keys)});
  };
  for (std::size_t n = 0; n <= 9; ++n) {
    add("few, " + std::to_string(n), random_keys(n, n, 64, 0, 4));
    add("equal, " + std::to_string(n), Keys(n, {0x8123456789ABCDEFu, 0}));
  }
  add("all equal", Keys(5000, {0, 0}));
  add("all equal and full", Keys(5000, {~std::uint64_t{0}, ~std::uint64_t{0} << 32}));
  std::uint64_t seed = 100;
  for (const std::size_t n : {10u, 33u, 100u, 1000u, 20000u}) {
    for (const std::uint32_t bits : {1u, 3u, 8u, 16u, 32u, 64u}) {
      add("random, " + std::to_string(n) + " of " + std::to_string(bits) + " bits",
          random_keys(++seed, n, bits, 0, static_cast<std::uint32_t>(n)));
      add("crowded, " + std::to_string(n) + " of " + std::to_string(bits) + " bits",
          random_keys(++seed, n, bits, 32, 1 + static_cast<std::uint32_t>(n) / 50));
      add("crowded, few fine bits, " + std::to_string(n) + " of " + std::to_string(bits) + " bits",
          random_keys(++seed, n, bits, 3, 1 + static_cast<std::uint32_t>(n) / 50));
    }
  }
  for (const std::uint32_t lowest : {0u, 1u, 31u, 62u, 63u, 64u, 94u, 95u}) {
    for (const std::size_t times : {1u, 2u, 3u, 20u}) {
      add("staircase of level " + std::to_string(lowest) + ", each " + std::to_string(times) +
              " times",
          staircase_keys(lowest, times));
    }
    add("falling staircase of level " + std::to_string(lowest), falling_staircase_keys(lowest));
  }
  Keys mixed = random_keys(7, 3000, 64, 32, 200);
  const Keys stairs = staircase_keys(95, 2);
  mixed.insert(mixed.end(), stairs.begin(), stairs.end());
  std::sort(mixed.begin(), mixed.end());
  add("staircase among random keys", mixed);
  return all;
}

}  // namespace zkd::test
