// SPDX-License-Identifier: GPL-2.0-only
// A record of a run: a hash of all bits of its results, and a few results that show the size of a
// change.

#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace golden {

struct Record {
  std::string name;    ///< for example "engine/plain/fast/states"
  std::uint64_t hash = 0;
  std::vector<std::pair<std::string, double>> numbers;    ///< name and value
};

}    // namespace golden
