// SPDX-License-Identifier: GPL-2.0-only
// Runs whose results golden_bits.cpp compares with stored results, bit by bit.

#pragma once

#include "golden_record.h"

#include <string>
#include <vector>

namespace golden {

enum class Device { Cpu, Cuda };

/// Returns records of three kinds of runs on the device: runs of the engine in all number formats,
/// preparations of packings, and runs of the material point method. `part` selects runs by a part
/// of their names, for example "engine/dmt/fast/" or "mpm/"; "" selects all.
std::vector<Record> device_records(Device device, const std::string &part);

/// Returns records of code that runs on the host only: images of packings, bounds of time steps,
/// random fields, serialised states and files.
std::vector<Record> host_records();

}    // namespace golden
