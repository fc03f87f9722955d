// SPDX-License-Identifier: Apache-2.0
//
// A program of ours, run from the outside in a folder of its own: what it prints and how it ends.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace zkd::test {

inline std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

inline std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

// A tetrahedron: closed, four triangles, vertices shared.
inline constexpr const char* tetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// A test whose folder has a tetra.obj and goes away at the end.
class ProgramTest : public testing::Test {
 protected:
  struct Outcome {
    int status = -1;
    std::string out;
    std::string err;
  };

  /// `name` is what the program calls itself in its errors.
  ProgramTest(std::string path, std::string name)
      : path_(std::move(path)), name_(std::move(name)) {}

  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "zkd-test-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    write(folder_ / "tetra.obj", tetrahedron);
  }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  // Runs the program in the test's folder. Standard output is read through a pipe.
  Outcome run(const std::string& arguments, const std::string& environment = "") const {
    const std::filesystem::path err = folder_ / "stderr";
    const std::string command = "cd '" + folder_.string() + "' && " + environment + " exec '" +
                                path_ + "' " + arguments + " 2>'" + err.string() + "'";
    Outcome outcome;
    FILE* const pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) return outcome;
    char buffer[4096];
    for (std::size_t read = 0; (read = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) {
      outcome.out.append(buffer, read);
    }
    const int status = pclose(pipe);
    outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    outcome.err = contents(err);
    return outcome;
  }

  // Exit status as given, and exactly one line on stderr that says `naming`.
  void expect_error(const std::string& arguments, int status, const std::string& naming) const {
    SCOPED_TRACE(arguments);
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.status, status);
    EXPECT_EQ(lines_of(outcome.err), 1u) << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with(name_ + ": error: ")) << outcome.err;
    EXPECT_NE(outcome.err.find(naming), std::string::npos) << outcome.err;
  }

  nlohmann::json run_json(const std::string& arguments) const {
    const Outcome outcome = run(arguments + " --json -");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }

  std::filesystem::path folder_;

 private:
  std::string path_;
  std::string name_;
};

inline void expect_keys(const nlohmann::json& object, const std::vector<std::string>& keys) {
  ASSERT_TRUE(object.is_object()) << object.dump();
  for (const std::string& key : keys) EXPECT_TRUE(object.contains(key)) << key;
}

}  // namespace zkd::test
