// SPDX-License-Identifier: GPL-2.0-only
// Where RVEs and points are advanced, as a user says.

#pragma once

namespace rve {

/// Auto: on a CUDA device if there is one that serves.
enum class Device { Auto, Cpu, Cuda };

}    // namespace rve
