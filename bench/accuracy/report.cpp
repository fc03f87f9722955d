// SPDX-License-Identifier: Apache-2.0
//
// What the measurements add up to.
#include "report.hpp"

#include <algorithm>

namespace zkd::bench::accuracy {

void Report::add_errors(const std::vector<Point>& of_scene) {
  for (const Point& point : of_scene) {
    if (!point.by_intersector && !point.peer) continue;
    const auto found = std::find_if(errors.begin(), errors.end(), [&](const ErrorsOf& one) {
      return one.name == point.setting && one.rays == point.rays;
    });
    ErrorsOf& sum = found != errors.end() ? *found : errors.emplace_back();
    sum.name = point.setting;
    sum.rays = point.rays;
    sum.peer = point.peer;
    const auto note = [&](std::string& text, const std::optional<Ray>& ray) {
      if (text.empty() && ray) text = point.scene + ": " + describe(*ray);
    };
    note(sum.first_offender, point.score.first_offender);
    note(sum.first_above_bound, point.score.first_above_bound);
    sum.score.add(point.score);
  }
}

std::vector<std::string> Report::failures() const {
  std::vector<std::string> found;
  const auto count = [&](std::uint64_t number, const std::string& what) {
    if (number > 0) found.push_back(std::to_string(number) + " " + what);
  };
  for (const ErrorsOf& one : errors) {
    if (!one.peer) {
      count(one.score.total().outside_band(), one.name + " answers to " + one.rays +
                                                  " rays outside the error band; " +
                                                  one.first_offender);
      count(one.score.above_bound.value_or(0),
            one.name + " t, u or v beyond the published bound; " + one.first_above_bound);
    }
  }
  if (e3)
    count(e3->different(), "differences between tree and brute force: " + e3->first_difference);
  if (e5) {
    for (const LeaksOf& one : e5->of) {
      if (one.watertight) count(one.total().leaks, one.name + " leaks: " + one.first_leak);
    }
  }
  if (e7) count(e7->hashes_too_many, "hashes too many: " + e7->first_offender);
  return found;
}

}  // namespace zkd::bench::accuracy
