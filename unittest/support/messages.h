// SPDX-License-Identifier: GPL-2.0-only
// Messages of errors.

#pragma once

#include "rve/core/error.h"

#include <string>

namespace rve_test {

/// Returns the message of the exception of class `Error` that the call throws; "no error" if the
/// call returns.
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
