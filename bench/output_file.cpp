// SPDX-License-Identifier: Apache-2.0
#include "output_file.hpp"

#include <unistd.h>

#include <fstream>
#include <system_error>
#include <utility>

#include "usage_error.hpp"

namespace zkd::bench {
namespace {

namespace fs = std::filesystem;

// False if not all of it was written.
bool put(const fs::path& path, std::string_view text) {
  std::ofstream file(path, std::ios::trunc | std::ios::binary);
  file << text << std::flush;
  return file.good();
}

}  // namespace

OutputFile::OutputFile(std::string option, fs::path path)
    : option_(std::move(option)), path_(std::move(path)) {
  std::error_code error;
  const fs::file_status status = fs::status(path_, error);
  if (path_.empty() || fs::is_directory(status)) fail();
  if (fs::exists(status) && access(path_.c_str(), W_OK) != 0) fail();
  replaced_ = !fs::exists(status) || fs::is_regular_file(status);
  target_ = replaced_ ? fs::weakly_canonical(path_, error) : path_;
  if (!replaced_) return;
  if (error) fail();
  temporary_ = target_;
  temporary_ += "." + std::to_string(getpid()) + ".part";
  const bool writable = put(temporary_, "");
  fs::remove(temporary_, error);
  if (!writable) fail();
}

void OutputFile::must_not_be(const fs::path& input) const {
  std::error_code error;
  if (fs::equivalent(target_, input, error))
    throw UsageError(option_ + ": " + path_.string() + " is a scene, which would be overwritten");
}

void OutputFile::write(std::string_view text) const {
  if (!replaced_) {
    if (!put(target_, text)) fail();
    return;
  }
  std::error_code error;
  const bool written = put(temporary_, text);
  if (written) fs::rename(temporary_, target_, error);
  if (!written || error) {
    fs::remove(temporary_, error);
    fail();
  }
}

void OutputFile::fail() const {
  throw UsageError(option_ + ": cannot write " +
                   (path_.empty() ? "to a file without a name" : path_.string()));
}

}  // namespace zkd::bench
