// The messages of errors.

#ifndef RVE_UNITTEST_SUPPORT_MESSAGES_H
#define RVE_UNITTEST_SUPPORT_MESSAGES_H

#include "rve/core/error.h"

#include <string>

namespace rve_test {

/// What the error of class `Error` says in which the call ends; "no error" if it returns.
template <class Error = rve::InputError, class Call> std::string message_of(const Call &call)
{
  try {
    call();
  } catch (const Error &error) {
    return error.what();
  }
  return "no error";
}

}    // namespace rve_test

#endif
