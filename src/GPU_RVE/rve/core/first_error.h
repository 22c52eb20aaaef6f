// SPDX-License-Identifier: GPL-2.0-only
// Passes an exception from a parallel loop to the code after the loop, since an exception that
// leaves an OpenMP region ends the program.

#pragma once

#include <exception>
#include <mutex>

namespace rve {

/// Stores an exception of a parallel loop until the loop has ended. If several items throw, it
/// keeps the exception of the item with the lowest index.
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
