// SPDX-License-Identifier: Apache-2.0
//
// A part, and all that comes of it, by one thread, depth first, in memory it was given.
#pragma once

#include <cstdint>

#include <zkd/options.hpp>
#include <zkd/tree.hpp>

#include "core/sah/clip.hpp"
#include "cpu/sah/memory.hpp"
#include "cpu/sah/part.hpp"
#include "cpu/sah/sweep.hpp"

namespace zkd::cpu::sah {

/// Nodes and leaves of a subtree, numbered from its first leaf as in a tree: node j separates leaf
/// j from leaf j + 1.
struct Subtree {
  Node* nodes = nullptr;               ///< leaf_count - 1
  std::uint32_t* leaf_ends = nullptr;  ///< where the references of each leaf end
  std::uint32_t* references = nullptr;
  Link root;
  std::uint32_t leaf_count = 0;
  std::uint32_t reference_count = 0;
};

/// Writes the boxes and links of a node.
void write_node(Node& node, const Split& split, const Box (&boxes)[2], const Link (&children)[2]);

/// Builds subtrees one after the other into arrays of its own.
class SubtreeBuilder {
 public:
  /// Room for subtrees: so many leaves and references, all of them together.
  struct Output {
    Node* nodes;
    std::uint32_t* leaf_ends;
    std::uint32_t* references;
    std::size_t leaves;
    std::size_t reference_count;
  };

  SubtreeBuilder(const SahOptions& options, const Clipper& clip, const Room& room,
                 const Output& output)
      : options_(options), clip_(clip), room_(room), left_(output) {}

  /// False: there was not enough room, and nothing has changed. The part is left as it was.
  bool build(const Part& part, Subtree& subtree);

  [[nodiscard]] const Output& left() const { return left_; }

 private:
  bool grow(const Part& part, Link& link);
  bool add_leaf(const Part& part, Link& link);
  bool find_split(const Part& part, Split& split);

  const SahOptions& options_;
  const Clipper& clip_;
  Room room_;
  Output left_;
  Subtree subtree_;
};

}  // namespace zkd::cpu::sah
