// SPDX-License-Identifier: Apache-2.0
//
// Reading a file whole, numbers from its text, and saying where it is wrong.
#include "scene/source_file.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <system_error>

namespace zkd::scene {
namespace {

// Names and words from a file may hold anything.
std::string in_one_line(std::string message) {
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7F'; };
  std::replace_if(message.begin(), message.end(), is_control, '?');
  return message;
}

}  // namespace

SourceFile::SourceFile(std::filesystem::path path, Progress& progress) : path_(std::move(path)) {
  std::error_code error;
  const auto status = std::filesystem::status(path_, error);
  if (!std::filesystem::exists(status)) {
    fail(error && error != std::errc::no_such_file_or_directory ? error.message() : "no such file");
  }
  if (std::filesystem::is_directory(status)) fail("is a directory, not a mesh file");
  if (!std::filesystem::is_regular_file(status)) fail("is not a regular file");

  errno = 0;
  std::ifstream stream(path_, std::ios::binary);
  if (!stream) fail(std::string("cannot be opened: ") + std::strerror(errno));
  const std::uintmax_t size = std::filesystem::file_size(path_, error);
  if (error) fail("cannot be read: " + error.message());
  if (size == 0) fail("is empty");

  constexpr std::size_t chunk = std::size_t{4} << 20;
  bytes_.resize(size);
  for (std::size_t at = 0; at < bytes_.size();) {
    const std::size_t wanted = std::min(chunk, bytes_.size() - at);
    stream.read(bytes_.data() + at, static_cast<std::streamsize>(wanted));
    if (static_cast<std::size_t>(stream.gcount()) != wanted) fail("cannot be read to its end");
    at += wanted;
    progress.advance(wanted);
  }
}

std::size_t SourceFile::line_of(std::size_t offset) const {
  std::size_t line = 1;
  const std::size_t end = std::min(offset, bytes_.size());
  for (std::size_t i = 0; i < end; ++i) {
    const bool cr_of_crlf = bytes_[i] == '\r' && i + 1 < bytes_.size() && bytes_[i + 1] == '\n';
    if (bytes_[i] == '\n' || (bytes_[i] == '\r' && !cr_of_crlf)) ++line;
  }
  return line;
}

void SourceFile::fail_in_line(std::size_t line, const std::string& message) const {
  throw LoadError(path_.string() + ":" + std::to_string(line) + ": " + in_one_line(message));
}

void SourceFile::fail_at_byte(std::size_t offset, const std::string& message) const {
  throw LoadError(path_.string() + ": byte " + std::to_string(offset) + ": " +
                  in_one_line(message));
}

void SourceFile::fail(const std::string& message) const {
  throw LoadError(path_.string() + ": " + in_one_line(message));
}

const char* parse_coordinate(std::string_view token, float& value) {
  constexpr const char* malformed = "is not a number";
  constexpr const char* not_finite = "is not a finite number in single precision";
  if (token.size() > 1 && token[0] == '+' && token[1] != '-') token.remove_prefix(1);
  const char* const end = token.data() + token.size();
  const auto [stop, error] = std::from_chars(token.data(), end, value);
  if (error == std::errc::invalid_argument || stop != end) return malformed;
  if (error == std::errc::result_out_of_range) {
    // Out of float's range on either side; double tells which, down to its own range.
    double wide = 0.0;
    if (std::from_chars(token.data(), end, wide).ec == std::errc()) {
      if (std::fabs(wide) > 1.0) return not_finite;
      value = static_cast<float>(wide);
      return nullptr;
    }
    const std::size_t exponent = token.find_first_of("eE");
    const bool tiny = exponent != std::string_view::npos && token.substr(exponent + 1, 1) == "-";
    if (!tiny) return not_finite;
    value = token[0] == '-' ? -0.0F : 0.0F;
    return nullptr;
  }
  return std::isfinite(value) ? nullptr : not_finite;
}

std::string in_quotes(std::string_view token) {
  constexpr std::size_t longest = 32;
  return "'" + std::string(token.substr(0, longest)) + (token.size() > longest ? "...'" : "'");
}

}  // namespace zkd::scene
