// SPDX-License-Identifier: GPL-2.0-only
// Wrong input ends in this exception, before anything runs. The styles turn it into error->all().

#pragma once

#include <cstdio>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace rve {

/// The message names what is wrong, the value with its unit, and the allowed range.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws InputError with `message` unless `condition` holds. The message is text, or a function that returns it: where thousands
/// of things are checked in every call, putting words together would cost more than the checks.
template <class Message> void require(bool condition, const Message &message)
{
  if (condition) return;
  if constexpr (std::is_invocable_v<Message>)
    throw InputError(message());
  else
    throw InputError(message);
}

/// A number for a message: as short as it can be said without losing what matters.
inline std::string number(double value)
{
  char text[32];
  snprintf(text, sizeof(text), "%.9g", value);
  return text;
}

/// A measured number for a message: what is beyond a limit, by about how much.
inline std::string rounded(double value)
{
  char text[32];
  snprintf(text, sizeof(text), "%.4g", value);
  return text;
}

}    // namespace rve
