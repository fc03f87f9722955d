// SPDX-License-Identifier: Apache-2.0
//
// The top of the tree, a generation at a time by all threads, and the subtrees below it, each by
// one thread. Which thread does what, and how often memory ran out on the way, does not show in the
// tree.
#pragma once

#include <cstdint>
#include <utility>

#include <zkd/options.hpp>
#include <zkd/tree.hpp>

#include "cpu/sah/memory.hpp"
#include "cpu/sah/subtree.hpp"
#include "cpu/sah/sweep.hpp"
#include "cpu/threads.hpp"

namespace zkd::cpu::sah {

/// A node of the top of the tree: divided, or the root of a subtree.
struct Top {
  static constexpr std::uint32_t none = 0xFFFFFFFFu;

  explicit Top(Block&& memory) : block(std::move(memory)) {}

  Part part{};
  Block block;  ///< that `part` lies in
  bool divided = false;
  Split split;  ///< if divided
  std::uint32_t child[2] = {none, none};
  Box box;          ///< of its references
  Subtree subtree;  ///< if not
  bool finished = false;
};

class Front {
 public:
  Front(const Threads& threads, Memory& memory, const SahOptions& options, const Clipper& clip)
      : threads_(threads),
        memory_(memory),
        options_(options),
        clip_(clip),
        tops_(memory),
        outputs_(memory) {}

  /// Builds everything that comes of the part that lies in `block`. Throws Error out_of_memory,
  /// too_many_references.
  void build(Block block, const Part& root);

  /// The root is the first. Valid after build().
  [[nodiscard]] const List<Top>& tops() const { return tops_; }

 private:
  struct Division;

  void divide_large();
  void divide_generation(std::uint32_t begin, std::uint32_t end);
  void finish_subtrees();
  void finish_large_leaf(Top& top);
  /// Whether a subtree ran out of room.
  bool finish_some(List<std::uint32_t>& waiting, double plenty);

  const Threads& threads_;
  Memory& memory_;
  const SahOptions& options_;
  const Clipper& clip_;
  List<Top> tops_;
  List<Block> outputs_;  ///< that finished subtrees lie in
};

}  // namespace zkd::cpu::sah
