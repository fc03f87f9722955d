// SPDX-License-Identifier: Apache-2.0
//
// What the command lines of our programs have in common: one-line errors, whole numbers, names and
// lists of names.
#pragma once

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "usage_error.hpp"

namespace zkd::bench {

/// The last lines of --help.
inline constexpr const char* exit_status_help =
    "Exit status: 0 done; 1 a check failed; 2 bad input or usage; 3 device or memory failure.";

/// CLI11 says some things on several lines; scripts want one.
[[nodiscard]] inline std::string one_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// False: --help or --version was given and has been answered. Throws UsageError.
[[nodiscard]] inline bool parse(CLI::App& app, int argc, const char* const* argv) {
  // CLI11 would take what stands behind it, such as a mesh, for the value: of --json=$NOTHING.
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument.starts_with('-') && argument.ends_with('='))
      throw UsageError(std::string(argument) + " has no value");
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& done) {
    app.exit(done);
    return false;
  } catch (const CLI::ParseError& error) {
    throw UsageError(one_line(error.what()));
  }
  return true;
}

/// Adds an option that takes a whole number from `lowest` to `highest`, and nothing else.
inline CLI::Option* add_whole_number(CLI::App& app, const char* name, std::int64_t& value,
                                     const std::string& help, std::int64_t lowest,
                                     std::int64_t highest) {
  return app.add_option(name, value, help)
      ->type_name("N")
      ->capture_default_str()
      ->check([lowest, highest](const std::string& given) {
        std::int64_t read = 0;
        const auto [end, error] = std::from_chars(given.data(), given.data() + given.size(), read);
        if (error == std::errc() && end == given.data() + given.size() && read >= lowest &&
            read <= highest) {
          return std::string();
        }
        return "'" + given + "' is not a whole number from " + std::to_string(lowest) + " to " +
               std::to_string(highest);
      });
}

/// The names of some values, by the to_string of their namespace.
template <class Enum, std::size_t N>
[[nodiscard]] std::string names_of(const std::array<Enum, N>& values, const char* separator) {
  std::string names;
  for (const Enum value : values) {
    if (!names.empty()) names += separator;
    names += to_string(value);
  }
  return names;
}

/// The value of that name. Throws UsageError.
template <class Enum, std::size_t N>
[[nodiscard]] Enum value_named(const std::array<Enum, N>& values, const std::string& option,
                               std::string_view name) {
  for (const Enum value : values) {
    if (name == to_string(value)) return value;
  }
  throw UsageError(option + ": '" + std::string(name) + "' is not one of " +
                   names_of(values, ", "));
}

/// The parts of a comma-separated list; at least one, which may be empty.
[[nodiscard]] inline std::vector<std::string_view> parts_of(std::string_view list) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t comma = list.find(',');
    parts.push_back(list.substr(0, comma));
    if (comma == std::string_view::npos) return parts;
    list.remove_prefix(comma + 1);
  }
}

/// The values of a comma-separated list of names, without repetitions. Throws UsageError.
template <class Enum, std::size_t N>
[[nodiscard]] std::vector<Enum> values_listed(const std::array<Enum, N>& values,
                                              const std::string& option, std::string_view list) {
  std::vector<Enum> found;
  for (const std::string_view name : parts_of(list)) {
    const Enum value = value_named(values, option, name);
    if (std::find(found.begin(), found.end(), value) == found.end()) found.push_back(value);
  }
  return found;
}

}  // namespace zkd::bench
