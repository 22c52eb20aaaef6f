// SPDX-License-Identifier: GPL-2.0-only
// Kind of device that the user selects for RVEs and material points.

#pragma once

namespace rve {

/// Auto: a CUDA device if one is usable, otherwise the CPU.
enum class Device { Auto, Cpu, Cuda };

}    // namespace rve
