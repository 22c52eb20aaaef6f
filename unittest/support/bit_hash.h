// A 64-bit hash of the bits of numbers (FNV-1a, by bytes): two runs with the same hash had the same bits.

#ifndef RVE_UNITTEST_SUPPORT_BIT_HASH_H
#define RVE_UNITTEST_SUPPORT_BIT_HASH_H

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

namespace rve_test {

class BitHash {
 public:
  /// A number, or a structure without padding.
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

  std::uint64_t value() const { return hash; }

 private:
  std::uint64_t hash = 14695981039346656037ull;

  BitHash &add_bytes(const void *data, std::size_t size)
  {
    const auto *byte = static_cast<const unsigned char *>(data);
    for (std::size_t k = 0; k < size; ++k) hash = (hash ^ byte[k]) * 1099511628211ull;
    return *this;
  }
};

}    // namespace rve_test

#endif
