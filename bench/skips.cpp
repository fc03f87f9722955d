// SPDX-License-Identifier: Apache-2.0
//
// What a build left out, in words.
#include "skips.hpp"

#include <cstddef>

namespace zkd::bench {
namespace {

struct Words {
  const char* unit;  // nullptr: the amount says nothing
  const char* why;
};

Words words_for(Skip skip) {
  switch (skip) {
    case Skip::radix_passes:
      return {"passes", "every code has the same digit there"};
    case Skip::flat_axes:
      return {"axes", "nothing extends along them"};
    case Skip::wide_codes:
      return {"bits", "few triangles: short codes tell them apart"};
    case Skip::recoding:
      return {nullptr, "no crowded trunk"};
    case Skip::compaction:
      return {nullptr, "no triangle left out"};
    case Skip::count:
      break;
  }
  return {nullptr, ""};
}

}  // namespace

std::vector<SkippedWork> skipped_work(const Statistics& statistics) {
  std::vector<SkippedWork> list;
  for (std::size_t i = 0; i < statistics.skips.size(); ++i) {
    if (!statistics.skips[i].taken) continue;
    const auto skip = static_cast<Skip>(i);
    const Words words = words_for(skip);
    SkippedWork entry;
    entry.what = to_string(skip);
    if (words.unit != nullptr) {
      entry.amount = std::to_string(statistics.skips[i].amount) + " " + words.unit;
    }
    entry.why = words.why;
    list.push_back(entry);
  }
  return list;
}

}  // namespace zkd::bench
