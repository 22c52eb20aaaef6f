// SPDX-License-Identifier: GPL-2.0-only
// Whether ranks have devices that can work for them side by side.

#pragma once

#include "mpm/solver_options.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mpm {

/// No two devices have the same; zeros: none.
using DeviceName = std::array<std::int64_t, 2>;

/// All ranks call it together, those without a device as well.
inline bool each_rank_has_its_device(const Communication &communication, const DeviceName &own)
{
  std::vector<std::int64_t> words(own.size() * communication.ranks, 0);
  std::copy(own.begin(), own.end(), words.begin() + own.size() * communication.rank);
  if (communication.ranks > 1) communication.sum_over_ranks(words.data(), words.size());
  std::vector<DeviceName> names = {DeviceName{}};
  for (std::size_t k = 0; k < words.size(); k += own.size())
    names.push_back({words[k], words[k + 1]});
  std::sort(names.begin(), names.end());
  return std::adjacent_find(names.begin(), names.end()) == names.end();
}

}    // namespace mpm
