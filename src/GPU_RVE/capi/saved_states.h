// SPDX-License-Identifier: GPL-2.0-only
// Bytes of rve_save and rve_packing_save: a header, then for each RVE the size of its record and the record (rve::serialize).

#pragma once

#include "rve/engine/state.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace capi {

struct SavedHeader {
  char magic[8];
  std::uint64_t dimension, count, bytes, checksum;
};

/// Bytes of `count` RVEs of this dimension, the k-th of which has the record record_of(k).
std::vector<char> saved(int dimension, std::size_t count,
                        const std::function<std::vector<char>(std::size_t k)> &record_of);

/// Throws InputError unless these are whole bytes of RVEs of dimension 2 or 3.
SavedHeader header_of(const char *bytes, std::size_t size);

/// The states in bytes with this header. Throws InputError unless the records after it are exactly those of header.count sound states.
template <int D>
std::vector<rve::RveStateOf<D>> states_in(const char *bytes, const SavedHeader &header);

}    // namespace capi
