// SPDX-License-Identifier: GPL-2.0-only
#include "capi/saved_states.h"

#include "rve/core/checksum.h"
#include "rve/core/error.h"

#include <cstring>
#include <string>
#include <type_traits>

namespace capi {

using rve::require;

namespace {

  static_assert(std::has_unique_object_representations_v<SavedHeader>, "it is copied as bytes");
  constexpr char MAGIC[8] = {'l', 'i', 'b', 'r', 'v', 'e', ' ', '2'};
  /// Magic of the first version, whose checksum does not cover the header.
  constexpr char FIRST_MAGIC[8] = {'l', 'i', 'b', 'r', 'v', 'e', ' ', '1'};

  bool has_magic(const SavedHeader &header, const char (&magic)[8])
  {
    return std::memcmp(header.magic, magic, sizeof(magic)) == 0;
  }

  /// Returns the checksum of the header, with its member `checksum` set to 0, and of the records.
  std::uint64_t checksum_of(SavedHeader header, const char *records, std::size_t size)
  {
    if (has_magic(header, FIRST_MAGIC)) return rve::checksum_of(records, size);
    header.checksum = 0;
    rve::Checksum checksum;
    checksum.add(&header, sizeof(header));
    checksum.add(records, size);
    return checksum.value();
  }

}    // namespace

std::vector<char> saved(int dimension, std::size_t count,
                        const std::function<std::vector<char>(std::size_t)> &record_of)
{
  std::vector<char> bytes(sizeof(SavedHeader));
  for (std::size_t k = 0; k < count; ++k) {
    const std::vector<char> record = record_of(k);
    const std::uint64_t length = record.size();
    const char *begin = reinterpret_cast<const char *>(&length);
    bytes.insert(bytes.end(), begin, begin + sizeof(length));
    bytes.insert(bytes.end(), record.begin(), record.end());
  }
  SavedHeader header{};
  std::memcpy(header.magic, MAGIC, sizeof(header.magic));
  header.dimension = static_cast<std::uint64_t>(dimension);
  header.count = count;
  header.bytes = bytes.size();
  header.checksum =
      checksum_of(header, bytes.data() + sizeof(header), bytes.size() - sizeof(header));
  std::memcpy(bytes.data(), &header, sizeof(header));
  return bytes;
}

SavedHeader header_of(const char *bytes, std::size_t size)
{
  SavedHeader header{};
  require(size >= sizeof(header), "the bytes are not saved RVEs: there are too few of them");
  std::memcpy(&header, bytes, sizeof(header));
  require(has_magic(header, MAGIC) || has_magic(header, FIRST_MAGIC),
          "the bytes are not those of rve_save, or have the byte order of another machine");
  require(header.bytes == size &&
              header.checksum == checksum_of(header, bytes + sizeof(header), size - sizeof(header)),
          "the saved RVEs are damaged");
  require(header.dimension == 2 || header.dimension == 3,
          "the saved RVEs are damaged: their dimension is ", header.dimension,
          "; it must be 2 or 3");
  return header;
}

template <int D>
std::vector<rve::RveStateOf<D>> states_in(const char *bytes, const SavedHeader &header)
{
  std::vector<rve::RveStateOf<D>> states;
  std::size_t offset = sizeof(header);
  for (std::size_t k = 0; k < header.count; ++k) {
    std::uint64_t length = 0;
    const bool has_length = header.bytes - offset >= sizeof(length);
    if (has_length) {
      std::memcpy(&length, bytes + offset, sizeof(length));
      offset += sizeof(length);
    }
    require(has_length && length <= header.bytes - offset,
            "the saved RVEs are damaged: the bytes end in RVE ", k, " of ", header.count);
    states.push_back(rve::deserialize<D>(bytes + offset, length));
    states.back().check();
    offset += length;
  }
  require(offset == header.bytes, "the saved RVEs are damaged: ", header.bytes - offset,
          " bytes are left over after ", header.count, " RVEs");
  return states;
}

template std::vector<rve::RveStateOf<2>> states_in(const char *, const SavedHeader &);
template std::vector<rve::RveStateOf<3>> states_in(const char *, const SavedHeader &);

}    // namespace capi
