// SPDX-License-Identifier: Apache-2.0
//
// Running zstd or a folder's unpack.sh, without a shell in between.
#include "scene/unpack.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <system_error>
#include <vector>

#include "scene/load.hpp"
#include "scene/progress.hpp"

namespace zkd::scene {
namespace {

namespace fs = std::filesystem;

fs::path unpack_folder() { return fs::path(ZKD_BUILD_DIR) / "scenes"; }

[[noreturn]] void fail(const fs::path& packed, const std::string& why) {
  throw LoadError(packed.string() + ": cannot be unpacked: " + why);
}

/// Runs a program on behalf of `packed`, to its end. Its output is dropped (tools print results
/// there); when it fails, the last line of what it said on stderr becomes the error.
void run(const fs::path& packed, const std::vector<std::string>& command) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);

  int said[2];
  if (pipe2(said, O_CLOEXEC) != 0) fail(packed, std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, said[1], STDERR_FILENO);
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(said[1]);
  if (error != 0) {
    close(said[0]);
    const char* hint = command[0] == "zstd" ? " (Debian package zstd)" : "";
    fail(packed, command[0] + ": " + std::strerror(error) + hint);
  }

  // Until the pipe is closed, which is when the program ends.
  Progress progress("unpacking " + packed.filename().string(), 0);
  std::string words;
  pollfd waiting{said[0], POLLIN, 0};
  for (ssize_t size = 1; size != 0;) {
    progress.advance(0);
    if (poll(&waiting, 1, 100) <= 0) continue;
    char buffer[512];
    size = read(said[0], buffer, sizeof(buffer));
    if (size < 0 && errno != EINTR) break;
    if (size > 0) words.append(buffer, static_cast<std::size_t>(size));
  }
  close(said[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  while (!words.empty() && (words.back() == '\n' || words.back() == ' ')) words.pop_back();
  words.erase(0, words.rfind('\n') + 1);
  fail(packed, words.empty() ? command[0] + " failed" : words);
}

void make_folder(const fs::path& packed, const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) fail(packed, folder.string() + ": " + error.message());
}

/// FNV-1a: names a folder after a file's place, size and time.
std::string fingerprint(const fs::path& packed) {
  std::error_code error;
  const fs::path whole = fs::weakly_canonical(packed, error);
  const std::string text =
      whole.string() + '|' + std::to_string(fs::file_size(packed, error)) + '|' +
      std::to_string(fs::last_write_time(packed, error).time_since_epoch().count());
  if (error) fail(packed, error.message());
  std::uint64_t hash = 0xCBF29CE484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001B3u;
  std::string digits;
  for (int shift = 60; shift >= 0; shift -= 4) digits += "0123456789abcdef"[(hash >> shift) & 15u];
  return digits;
}

/// The size UNPACKED.sizes gives for a file; 0 when it names none.
std::uintmax_t listed_size(const fs::path& folder, const std::string& name) {
  std::ifstream list(folder / "UNPACKED.sizes");
  std::uintmax_t size = 0;
  std::string entry;
  while (list >> size >> entry) {
    if (entry == name) return size;
  }
  return 0;
}

}  // namespace

fs::path unpacked_file(const fs::path& packed) {
  const fs::path folder = unpack_folder() / fingerprint(packed);
  const fs::path target = folder / packed.stem();
  std::error_code error;
  if (fs::is_regular_file(target, error)) return target;
  make_folder(packed, folder);
  // Under a name of this process first: what has the final name is always whole.
  const fs::path part = target.string() + "." + std::to_string(getpid()) + ".part";
  try {
    run(packed, {"zstd", "-dqf", "--long=27", "-o", part.string(), "--", packed.string()});
  } catch (...) {
    fs::remove(part, error);
    throw;
  }
  fs::rename(part, target, error);
  if (error) fail(packed, target.string() + ": " + error.message());
  return target;
}

fs::path unpacked_by_script(const fs::path& packed) {
  const fs::path source = packed.parent_path();
  const fs::path folder = unpack_folder() / "shared";
  const fs::path target = folder / packed.stem();
  const std::uintmax_t size = listed_size(source, packed.stem().string());
  std::error_code error;
  if (size > 0 && fs::is_regular_file(target, error) && fs::file_size(target, error) == size) {
    return target;
  }
  make_folder(packed, folder);
  run(packed, {(source / "unpack.sh").string(), folder.string()});
  if (!fs::is_regular_file(target, error))
    fail(packed, "unpack.sh did not make " + target.string());
  return target;
}

}  // namespace zkd::scene
