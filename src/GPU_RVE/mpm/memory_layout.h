// SPDX-License-Identifier: GPL-2.0-only
// What is in the rows of memory of a scene's points: the state variables of each of its laws.
//
// For those who keep the rows, write them to files and show them. Knows laws by words, as law_table.h does.

#pragma once

#include "mpm/constitutive.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace mpm {

class MemoryLayout {
 public:
  /// Adds a law, unless it is there, and returns its number. Models of one law with different parameters share it.
  int add(const std::string &law, StateVariables variables)
  {
    const int there = find(law);
    if (there >= 0) return there;
    width_ = std::max(width_, static_cast<int>(variables.size()));
    laws_.push_back({law, std::move(variables)});
    return num_laws() - 1;
  }

  /// The number of a law, -1 if it is not there.
  int find(const std::string &law) const
  {
    for (int k = 0; k < num_laws(); ++k)
      if (laws_[k].word == law) return k;
    return -1;
  }

  int num_laws() const { return static_cast<int>(laws_.size()); }
  const std::string &word(int law) const { return laws_.at(law).word; }
  const StateVariables &variables(int law) const { return laws_.at(law).variables; }

  /// Doubles of a row.
  int width() const { return width_; }

  /// Where the rows of a law have this variable; -1 if it has none of the name.
  int place(int law, const std::string &name) const
  {
    const StateVariables &all = variables(law);
    for (std::size_t k = 0; k < all.size(); ++k)
      if (all[k].name == name) return static_cast<int>(k);
    return -1;
  }

  /// "name name ..." of a law.
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
