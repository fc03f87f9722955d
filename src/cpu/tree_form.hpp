// SPDX-License-Identifier: Apache-2.0
//
// Makes the owner of another form of a tree.
#pragma once

#include <zkd/cpu/tree_form.hpp>

#include "core/arena.hpp"
#include "core/host_block.hpp"

namespace zkd::cpu {

struct TreeFormAssembler {
  /// Takes the block, in which lies all that `view` names.
  template <class View>
  static TreeForm<View> assemble(const View& view, core::HostBlock& block) {
    static_assert(TreeForm<View>::alignment == core::Arena::alignment);
    TreeForm<View> form;
    form.view_ = view;
    form.memory_ = block.memory();
    form.bytes_ = block.bytes();
    form.data_ = block.release();
    return form;
  }
};

}  // namespace zkd::cpu
