// SPDX-License-Identifier: Apache-2.0
//
// Starting this program again and reading what it prints, without a shell in between.
#include "cold_start.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "options.hpp"

namespace zkd::bench {
namespace {

// What the program printed, if it ended well.
std::optional<std::string> output_of(std::vector<std::string> command) {
  std::vector<char*> arguments;
  for (std::string& word : command) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  int pipe_ends[2];
  if (pipe2(pipe_ends, O_CLOEXEC) != 0) return std::nullopt;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipe_ends[1], STDOUT_FILENO);
  pid_t child = 0;
  const int error =
      posix_spawn(&child, "/proc/self/exe", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(pipe_ends[1]);
  std::string text;
  if (error == 0) {
    std::array<char, 512> buffer{};
    ssize_t size = 0;
    while ((size = read(pipe_ends[0], buffer.data(), buffer.size())) != 0) {
      if (size > 0) text.append(buffer.data(), static_cast<std::size_t>(size));
      if (size < 0 && errno != EINTR) break;
    }
  }
  close(pipe_ends[0]);
  if (error != 0) return std::nullopt;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return std::nullopt;
  return text;
}

}  // namespace

std::optional<ColdBuild> cold_build_elsewhere(const std::filesystem::path& mesh,
                                              const BuildOptions& options) {
  std::vector<std::string> command{"zkd-bench", "--cold"};
  for (std::string& flag : flags_of(options)) command.push_back(std::move(flag));
  command.push_back(std::filesystem::absolute(mesh).string());
  if (const std::optional<std::string> text = output_of(std::move(command))) {
    const nlohmann::json json = nlohmann::json::parse(*text, nullptr, false);
    if (json.is_object() && json.contains("context_ms") && json.contains("cold_ms")) {
      return ColdBuild{json["context_ms"].get<double>(), json["cold_ms"].get<double>()};
    }
  }
  std::cerr << "zkd-bench: note: no cold build of " << mesh.string()
            << ": the second process failed" << std::endl;
  return std::nullopt;
}

}  // namespace zkd::bench
