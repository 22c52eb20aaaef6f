// SPDX-License-Identifier: GPL-2.0-only
// Check that each rank has its own device.

#pragma once

#include "mpm/solver_options.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mpm {

/// Unique name of a device; zeros if there is none.
using DeviceName = std::array<std::int64_t, 2>;

/// Returns true if all ranks have devices and no two ranks share one. Collective, also for ranks
/// without a device. `own` names the device of this rank.
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
