// SPDX-License-Identifier: Apache-2.0
//
// Packed meshes unpacked into the build folder, once. Private to the catalogue.
#pragma once

#include <filesystem>

namespace zkd::scene {

/// The unpacked copy of `packed` (a .zst file), made by the program zstd unless it is there
/// already. A packed file that has changed since is unpacked again. Processes that do this at once
/// do not disturb each other. Throws LoadError.
[[nodiscard]] std::filesystem::path unpacked_file(const std::filesystem::path& packed);

/// As above for a file of a folder that brings its own unpack.sh (which checks sums) and a list
/// UNPACKED.sizes; all its files are unpacked together.
[[nodiscard]] std::filesystem::path unpacked_by_script(const std::filesystem::path& packed);

}  // namespace zkd::scene
