// SPDX-License-Identifier: Apache-2.0
//
// The owner of a tree in device memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>

#include <zkd/config.hpp>
#include <zkd/cuda/executor.hpp>
#include <zkd/geometry.hpp>
#include <zkd/lattice.hpp>
#include <zkd/options.hpp>
#include <zkd/statistics.hpp>
#include <zkd/tree.hpp>

namespace zkd::core {
struct BuildState;
}

namespace zkd::cuda {

/// Owns a tree in device memory: one block from the memory resource it was built with, and a copy
/// of the triangles if they were given in host memory.
///
/// build() returns it before the device has finished. view() may be passed to whatever is enqueued
/// on the same stream, at once; everything here that says "waits" blocks until the stream has come
/// that far, and throws what went wrong in the build. A build that failed leaves an empty tree,
/// which every ray misses.
///
/// Movable, not copyable. Its memory is given back in the order of the stream it was built on,
/// which must outlive it. The destructor does not wait. With several devices: what is asked of a
/// tree goes to the device that it was built on, whichever is current; a MemoryResource of the
/// caller's has to see to that itself.
class ZKD_API Tree {
 public:
  /// An empty tree: every ray misses.
  Tree() = default;
  Tree(Tree&& other) noexcept;
  Tree& operator=(Tree&& other) noexcept;
  Tree(const Tree&) = delete;             // a tree is megabytes: copies are spelled out
  Tree& operator=(const Tree&) = delete;  // likewise
  ~Tree();

  /// What queries and kernels take, by value. Pointers are device pointers: on the host, only pass
  /// it on. Valid until this tree is destroyed, assigned or moved from; a rebuild() keeps it.
  [[nodiscard]] const TreeView& view() const noexcept { return view_; }

  /// The triangles as queries on the device take them: the view that the tree was built from, or
  /// the tree's own copy of it if that was host memory.
  [[nodiscard]] const TriangleView& triangles() const noexcept { return triangles_; }

  /// The options it was built with. `backend` is cuda; `code_bits` as given, since only the device
  /// knows how many triangles were valid: see statistics().
  [[nodiscard]] const BuildOptions& options() const noexcept { return options_; }

  /// Waits. Throws Error if the build failed: index_out_of_range, non_finite_vertex,
  /// too_many_references, reference_capacity, with the text that the CPU has; or device_failure,
  /// also where a rebuild() threw half-way and left the tree in no state.
  /// `stream`: where the build was enqueued, if not on the stream it was first built on (a graph
  /// that replays it).
  void check() const;
  void check(Stream stream) const;

  /// Waits. What the last build found and made, as Tree::statistics() has it. Times are 0 (see
  /// StageTimer); workspace_bytes is what was asked for beforehand. Throws as check().
  [[nodiscard]] Statistics statistics() const;

  /// Waits. The lattice of the first round of codes. Throws as check().
  [[nodiscard]] Lattice lattice() const;

  /// Waits. The same bytes in host memory, from `memory` (null: the default resource).
  /// Throws as check(), and out_of_memory.
  [[nodiscard]] zkd::Tree to_host(std::pmr::memory_resource* memory = nullptr) const;

  /// Device memory held: the tree with room for any scene of its size, and the copy of the
  /// triangles.
  [[nodiscard]] std::size_t tree_bytes() const noexcept { return block_.bytes; }
  [[nodiscard]] std::size_t triangle_bytes() const noexcept { return triangle_block_.bytes; }

 private:
  friend struct TreeAccess;
  struct Block {
    void* data = nullptr;
    std::size_t bytes = 0;
  };
  void swap(Tree& other) noexcept;

  TreeView view_;
  TriangleView triangles_;
  BuildOptions options_;
  Block block_;
  Block triangle_block_;
  core::BuildState* record_ = nullptr;  // what the last build found, in block_
  std::uint64_t triangle_capacity_ = 0;
  std::size_t workspace_bytes_ = 0;  // that the build needed
  bool incomplete_ = false;          // a rebuild could not be enqueued whole
  MemoryResource* memory_ = nullptr;
  Stream stream_ = nullptr;
  int device_ = 0;
};

}  // namespace zkd::cuda
