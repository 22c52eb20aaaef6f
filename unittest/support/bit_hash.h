// SPDX-License-Identifier: GPL-2.0-only
// A 64-bit hash of the bits of numbers (FNV-1a over bytes). Tests compare the hashes of two runs to
// compare the bits of their results.

#pragma once

#include "rve/core/checksum.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

namespace rve_test {

class BitHash {
 public:
  /// Adds a number or a structure without padding.
  template <class T> BitHash &add(const T &value)
  {
    static_assert(std::is_trivially_copyable_v<T>, "its bytes are its value");
    return add_bytes(&value, sizeof(T));
  }

  template <class T> BitHash &add(const std::vector<T> &values)
  {
    static_assert(std::is_trivially_copyable_v<T>, "its bytes are its value");
    add(static_cast<std::uint64_t>(values.size()));
    return add_bytes(values.data(), values.size() * sizeof(T));
  }

  BitHash &add(const std::string &text) { return add_bytes(text.data(), text.size()); }

  std::uint64_t value() const { return checksum.value(); }

 private:
  rve::Checksum checksum;

  BitHash &add_bytes(const void *data, std::size_t size)
  {
    checksum.add(data, size);
    return *this;
  }
};

}    // namespace rve_test
