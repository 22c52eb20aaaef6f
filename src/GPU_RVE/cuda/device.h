// SPDX-License-Identifier: GPL-2.0-only
// Device of RVEs and points, as a user chooses it.

#pragma once

namespace rve {

/// Auto: a CUDA device if there is a usable one.
enum class Device { Auto, Cpu, Cuda };

}    // namespace rve
