// SPDX-License-Identifier: GPL-2.0-only
// The constitutive laws in closed form, by the words that scripts have for them: a new law is a line here and files of its own.

#pragma once

#include "mpm/constitutive.h"

#include <memory>
#include <string>
#include <vector>

namespace mpm {

template <int D> struct LawEntry {
  std::string word;
  std::vector<std::string> arguments;    ///< numbers, in the order of a script: their names
  /// The law with these arguments; rve::InputError where they are wrong.
  std::shared_ptr<Constitutive<D>> (*make)(const double *arguments);
  /// Divides the strength in the arguments by a factor above 0; null: the law has no strength.
  void (*reduce_strength)(double *arguments, double factor) = nullptr;
};

/// The laws that there are in D dimensions. A program may add laws of its own before it reads scripts.
template <int D> std::vector<LawEntry<D>> &law_table();

}    // namespace mpm
