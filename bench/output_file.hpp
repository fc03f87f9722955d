// SPDX-License-Identifier: Apache-2.0
//
// Results that go into a file: known to be writable before anything is measured, and whole or not
// there afterwards.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace zkd::bench {

/// A file named by an option, which need not exist yet.
///
/// A regular file keeps what is in it until write() has everything that takes its place. Anything
/// else that can be written to (a pipe, /dev/null) is written to as it is.
class OutputFile {
 public:
  /// Leaves no trace. Throws UsageError, naming option and path, where nothing could be written:
  /// a folder, a place that does not exist or is not ours.
  OutputFile(std::string option, std::filesystem::path path);

  /// Throws UsageError if that is what the file would overwrite.
  void must_not_be(const std::filesystem::path& input) const;

  /// The whole of its new contents. Throws UsageError if not all of it could be written: then the
  /// file is as it was. May be called again.
  void write(std::string_view text) const;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] bool is_replaced() const { return replaced_; }

 private:
  [[noreturn]] void fail() const;

  std::string option_;
  std::filesystem::path path_;       ///< as given
  std::filesystem::path target_;     ///< where links lead
  std::filesystem::path temporary_;  ///< beside it
  bool replaced_ = true;
};

}  // namespace zkd::bench
