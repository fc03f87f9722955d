// SPDX-License-Identifier: Apache-2.0
//
// The stress matrix in its small form, a case for each row: bench/stress has the large one.
#include <gtest/gtest.h>

#include <cctype>
#include <ostream>
#include <string>

#include "stress/run.hpp"

namespace zkd::stress {

void PrintTo(const Row& row, std::ostream* out) { *out << row.number << ' ' << row.name; }

namespace {

class Stress : public testing::TestWithParam<Row> {};

TEST_P(Stress, Row) {
  const Report report = run_row(GetParam(), Setting{});
  std::puts(to_line(report).c_str());
  RecordProperty("rays", std::to_string(report.findings.rays));
  RecordProperty("in_band", std::to_string(report.findings.in_band));
  for (const std::string& failure : report.findings.failures()) ADD_FAILURE() << failure;
  EXPECT_TRUE(report.findings.ok()) << report.findings.failure_count() << " failures";
  EXPECT_GT(report.findings.cases, 0u);
  if (!report.findings.skipped().empty()) GTEST_SKIP() << report.findings.skipped();
}

std::string name_of(const testing::TestParamInfo<Row>& info) {
  std::string name = (info.param.number < 10 ? "0" : "") + std::to_string(info.param.number) + "_";
  for (const char c : std::string(info.param.name)) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      name += c;
    } else if (name.back() != '_') {
      name += '_';
    }
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(Matrix, Stress, testing::ValuesIn(rows().begin(), rows().end()), name_of);

TEST(StressMatrix, HasEveryRowOnce) {
  int number = 0;
  for (const Row& row : rows()) EXPECT_EQ(row.number, ++number) << row.name;
  EXPECT_EQ(number, 52);
}

}  // namespace
}  // namespace zkd::stress
