// SPDX-License-Identifier: Apache-2.0
//
// What the command lines of our programs have in common: one-line errors and whole numbers.
#pragma once

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdint>
#include <string>

namespace zkd::bench {

/// CLI11 says some things on several lines; scripts want one.
[[nodiscard]] inline std::string one_line(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
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
        if (CLI::detail::lexical_cast(given, read) && read >= lowest && read <= highest) {
          return std::string();
        }
        return "'" + given + "' is not a whole number from " + std::to_string(lowest) + " to " +
               std::to_string(highest);
      });
}

}  // namespace zkd::bench
