// SPDX-License-Identifier: GPL-2.0-only
// Table of the constitutive laws in closed form, with their names in scripts. A new law needs a
// row of the table and its own files.

#pragma once

#include "mpm/constitutive.h"

#include <memory>
#include <string>
#include <vector>

namespace mpm {

/// A law of the table.
template <int D> struct LawEntry {
  std::string word;                      ///< name in scripts
  std::vector<std::string> arguments;    ///< names of the arguments, which are numbers
  /// Makes the law with these arguments. Throws rve::InputError for wrong arguments.
  std::shared_ptr<Constitutive<D>> (*make)(const double *arguments);
  /// Divides the strength in the arguments by a positive factor; null if the law has no strength.
  void (*reduce_strength)(double *arguments, double factor) = nullptr;
};

/// Returns the laws in D dimensions. A program may add its own laws before it reads scripts.
template <int D> std::vector<LawEntry<D>> &law_table();

}    // namespace mpm
