// SPDX-License-Identifier: GPL-2.0-only
// Exceptions of a team of threads. An exception that leaves an OpenMP region ends the program.

#pragma once

#include <exception>
#include <mutex>

namespace rve {

/// Stores the exception of the lowest item of a parallel loop until the loop has ended.
class FirstError {
 public:
  /// Runs body() and stores its exception for `item`. Several threads may call it.
  template <class Body> void guard(long item, const Body &body)
  {
    try {
      body();
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (error && item >= item_of_error) return;
      error = std::current_exception();
      item_of_error = item;
    }
  }

  /// Throws the stored exception, if there is one.
  void rethrow() const
  {
    if (error) std::rethrow_exception(error);
  }

 private:
  std::mutex mutex;
  std::exception_ptr error;
  long item_of_error = 0;
};

}    // namespace rve
