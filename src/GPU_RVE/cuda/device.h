// SPDX-License-Identifier: GPL-2.0-only
// Kind of device that the user selects for RVEs and material points.

#pragma once

namespace rve {

/// Auto: a CUDA device if there is a usable one.
enum class Device { Auto, Cpu, Cuda };

}    // namespace rve
