// SPDX-License-Identifier: GPL-2.0-only
// Layout of the rows of state variables of points (MemoryRows), for restart files and output. Laws
// are identified by their names in scripts (LawEntry::word).

#pragma once

#include "mpm/constitutive.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace mpm {

/// State variables of each law.
class MemoryLayout {
 public:
  /// Adds a law if it is new and returns its index. Models of one law with different parameters
  /// share the index.
  int add(const std::string &law, StateVariables variables)
  {
    const int there = find(law);
    if (there >= 0) return there;
    width_ = std::max(width_, static_cast<int>(variables.size()));
    laws_.push_back({law, std::move(variables)});
    return num_laws() - 1;
  }

  /// Returns the index of a law, or -1 if there is no such law.
  int find(const std::string &law) const
  {
    for (int k = 0; k < num_laws(); ++k)
      if (laws_[k].word == law) return k;
    return -1;
  }

  int num_laws() const { return static_cast<int>(laws_.size()); }
  const std::string &word(int law) const { return laws_.at(law).word; }
  const StateVariables &variables(int law) const { return laws_.at(law).variables; }

  /// Number of doubles of a row.
  int width() const { return width_; }

  /// Returns the index of a variable in the rows of a law, or -1 if the law has no such variable.
  int place(int law, const std::string &name) const
  {
    const StateVariables &all = variables(law);
    for (std::size_t k = 0; k < all.size(); ++k)
      if (all[k].name == name) return static_cast<int>(k);
    return -1;
  }

  /// Returns the names of the variables of a law, separated by blanks.
  std::string names(int law) const
  {
    std::string text;
    for (const StateVariable &variable : variables(law))
      text += (text.empty() ? "" : " ") + variable.name;
    return text;
  }

 private:
  struct Law {
    std::string word;
    StateVariables variables;
  };
  std::vector<Law> laws_;
  int width_ = 0;
};

}    // namespace mpm
