// SPDX-License-Identifier: GPL-2.0-only
// Exception for wrong input, thrown before the engine runs. The LAMMPS styles report it by
// error->all().

#pragma once

#include <cstdio>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace rve {

/// Error in the input. The message names the cause, the value with its unit, and the allowed range.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Formats a number for a message, with up to nine digits.
inline std::string number(double value)
{
  char text[32];
  snprintf(text, sizeof(text), "%.9g", value);
  return text;
}

/// Joins parts to one text. A part is a text, a character, a number, or a function that returns a
/// text. number() formats floating-point numbers, and std::to_string() formats integers.
template <class... Parts> std::string concat(const Parts &...parts)
{
  std::string text;
  const auto append = [&text](const auto &part) {
    using Part = std::decay_t<decltype(part)>;
    if constexpr (std::is_invocable_v<Part>)
      text += part();
    else if constexpr (std::is_floating_point_v<Part>)
      text += number(part);
    else if constexpr (std::is_integral_v<Part> && !std::is_same_v<Part, char>)
      text += std::to_string(part);
    else
      text += part;
  };
  (append(parts), ...);
  return text;
}

/// Throws InputError with the text of the parts unless `condition` holds. The text is composed only
/// if the exception is thrown, since thousands of items are checked in each call of the engine. A
/// part that is expensive to compute is passed as a function.
template <class... Parts> void require(bool condition, const Parts &...parts)
{
  if (!condition) throw InputError(concat(parts...));
}

/// Formats a measured number for a message, with four digits.
inline std::string rounded(double value)
{
  char text[32];
  snprintf(text, sizeof(text), "%.4g", value);
  return text;
}

}    // namespace rve
