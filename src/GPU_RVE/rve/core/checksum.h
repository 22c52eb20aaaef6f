// SPDX-License-Identifier: GPL-2.0-only
// Checksum of files and of states that are stored as bytes.

#pragma once

#include <cstddef>
#include <cstdint>

namespace rve {

/// FNV-1a checksum of 64 bits. Different bytes turn one sum into different sums, and equal bytes
/// keep different sums different. A change of one byte therefore always changes the checksum.
class Checksum {
 public:
  void add(const void *data, std::size_t size)
  {
    const auto *bytes = static_cast<const unsigned char *>(data);
    for (std::size_t k = 0; k < size; ++k) sum = (sum ^ bytes[k]) * 0x100000001b3u;
  }

  std::uint64_t value() const { return sum; }

 private:
  std::uint64_t sum = 0xcbf29ce484222325u;
};

inline std::uint64_t checksum_of(const void *data, std::size_t size)
{
  Checksum checksum;
  checksum.add(data, size);
  return checksum.value();
}

}    // namespace rve
