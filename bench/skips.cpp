// SPDX-License-Identifier: Apache-2.0
//
// What a build left out, in words.
#include "skips.hpp"

#include <cstddef>

namespace zkd::bench {
namespace {

// nullptr: the amount says nothing
const char* unit_of(Skip skip) {
  switch (skip) {
    case Skip::radix_passes:
      return "passes";
    case Skip::flat_axes:
      return "axes";
    case Skip::wide_codes:
      return "bits";
    case Skip::splitting:
    case Skip::recoding:
    case Skip::compaction:
    case Skip::subtrees:
    case Skip::count:
      break;
  }
  return nullptr;
}

}  // namespace

std::vector<SkippedWork> skips_considered(const Statistics& statistics) {
  std::vector<SkippedWork> list;
  for (std::size_t i = 0; i < statistics.skips.size(); ++i) {
    const SkipReport& report = statistics.skips[i];
    if (!report.considered) continue;
    const auto skip = static_cast<Skip>(i);
    SkippedWork entry{
        to_string(skip), report.taken, {}, reason(skip, report.taken), report.saved_ms};
    const char* const unit = unit_of(skip);
    if (report.taken && unit != nullptr) entry.amount = std::to_string(report.amount) + " " + unit;
    list.push_back(entry);
  }
  return list;
}

std::vector<SkippedWork> skipped_work(const Statistics& statistics) {
  std::vector<SkippedWork> list = skips_considered(statistics);
  std::erase_if(list, [](const SkippedWork& work) { return !work.taken; });
  return list;
}

}  // namespace zkd::bench
