// Wrong input ends in this exception, before anything runs. The styles turn it into error->all().

#ifndef RVE_CORE_ERROR_H
#define RVE_CORE_ERROR_H

#include <cstdio>
#include <stdexcept>
#include <string>

namespace rve {

/// The message names what is wrong, the value with its unit, and the allowed range.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws InputError with `message` unless `condition` holds.
inline void require(bool condition, const std::string &message)
{
  if (!condition) throw InputError(message);
}

/// A number for a message: as short as it can be said without losing what matters.
inline std::string number(double value)
{
  char text[32];
  snprintf(text, sizeof(text), "%.9g", value);
  return text;
}

}    // namespace rve

#endif
