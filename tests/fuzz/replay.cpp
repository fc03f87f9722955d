// SPDX-License-Identifier: Apache-2.0
//
// Runs a fuzz target over files, and over the files in folders: with any compiler, without
// libFuzzer. What fails aborts; the file is named first where it is asked for (-v).
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

std::vector<std::filesystem::path> files_of(const std::filesystem::path& path) {
  if (!std::filesystem::is_directory(path)) return {path};
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(path)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

int main(int count, char** arguments) {
  bool verbose = false;
  std::size_t done = 0;
  for (int i = 1; i < count; ++i) {
    if (std::strcmp(arguments[i], "--help") == 0) {
      std::printf("Usage: %s [-v] FILE|FOLDER...\nRuns this fuzz target over each file.\n",
                  arguments[0]);
      return 0;
    }
    if (std::strcmp(arguments[i], "-v") == 0) {
      verbose = true;
      continue;
    }
    for (const std::filesystem::path& file : files_of(arguments[i])) {
      std::ifstream stream(file, std::ios::binary);
      if (!stream) {
        std::fprintf(stderr, "%s: cannot be opened\n", file.c_str());
        return 2;
      }
      const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
      if (verbose) std::fprintf(stderr, "%s\n", file.c_str());
      LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
      ++done;
    }
  }
  if (done == 0) {
    std::fprintf(stderr, "%s: no file to run\n", arguments[0]);
    return 2;
  }
  std::printf("%zu inputs\n", done);
  return 0;
}
