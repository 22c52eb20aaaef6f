// SPDX-License-Identifier: GPL-2.0-only
// Parser of a contact law in the syntax of LAMMPS' pair_coeff with pair_style granular, without the
// two atom types. Scripts and the C interface use it.

#pragma once

#include "rve/core/suggestion.h"
#include "rve/engine/given_material.h"
#include "rve/engine/options.h"

#include <cstddef>
#include <string>

namespace rve {

/// Words that follow *contact* in an input. Errors begin with "contact" and a `part`, such as
/// "tangential k_t".
class ContactWords {
 public:
  virtual bool empty() const = 0;
  /// Returns the word that is `ahead` words after the next one, or "" after the last one.
  virtual std::string peek(int ahead = 0) const = 0;
  /// Returns true if this word is a number.
  virtual bool is_number(int ahead) const = 0;

  // These functions take the next word. A missing or wrong word is an error.
  virtual std::string next(const std::string &part = "") = 0;
  virtual double number(const std::string &part) = 0;
  double positive(const std::string &part, const char *unit);
  /// Returns the index of the next word among `choices`.
  int choice(const std::string &part, const Words &choices);
  /// Returns the value of the next word among `choices`.
  template <class T, std::size_t N> T choice(const std::string &part, const Choice<T> (&choices)[N])
  {
    Words names;
    for (const Choice<T> &some : choices) names.emplace_back(some.word);
    return choices[choice(part, names)].value;
  }

  /// Sets the form of the values for messages about missing words.
  virtual void set_form(const std::string &form) = 0;
  /// Reports an error of the input, and throws InputError with its message if it returns.
  [[noreturn]] void refuse(const std::string &message) const;

 protected:
  ~ContactWords() = default;
  /// Reports an error in the way of the program. Need not return.
  virtual void report(const std::string &) const {}
};

/// Reads the values of *contact* up to the first word that belongs to no part of it. Contact
/// parameters that the input does not give become 0.
void read_contact(ContactWords &words, GivenMaterial &material);

}    // namespace rve
