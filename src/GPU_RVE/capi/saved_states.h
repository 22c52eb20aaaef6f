// SPDX-License-Identifier: GPL-2.0-only
// Layout of the bytes that rve_save and rve_packing_save write: a header, then for each RVE the
// size of its record (8 bytes) and the record (rve::serialize).

#pragma once

#include "rve/engine/state.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace capi {

/// `bytes` is the size of the header and all records [bytes]. The checksum covers the header, with
/// its member `checksum` set to 0, and all records.
struct SavedHeader {
  char magic[8];
  std::uint64_t dimension, count, bytes, checksum;
};

/// Returns the bytes of `count` RVEs of this dimension, whose records are record_of(k).
std::vector<char> saved(int dimension, std::size_t count,
                        const std::function<std::vector<char>(std::size_t k)> &record_of);

/// Returns the header. Throws InputError unless `bytes` are complete, have the right checksum and
/// have RVEs of dimension 2 or 3.
SavedHeader header_of(const char *bytes, std::size_t size);

/// Returns the states in `bytes`, which begin with this header. Throws InputError unless the bytes
/// contain exactly header.count records of valid states.
template <int D>
std::vector<rve::RveStateOf<D>> states_in(const char *bytes, const SavedHeader &header);

}    // namespace capi
