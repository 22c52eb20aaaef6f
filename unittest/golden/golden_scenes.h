// SPDX-License-Identifier: GPL-2.0-only
// The runs whose bits are kept.

#pragma once

#include "golden_record.h"

#include <string>
#include <vector>

namespace golden {

enum class Device { Cpu, Cuda };

/// The engine in all formats of the device, packings that it makes, and the material point method: those runs whose names have `part` in
/// them, "engine/dmt/fast/" or "mpm/"; all have "".
std::vector<Record> device_records(Device device, const std::string &part);

/// What only the host computes: images of packings, bounds of time steps, random fields, records and files.
std::vector<Record> host_records();

}    // namespace golden
