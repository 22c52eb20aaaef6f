// SPDX-License-Identifier: GPL-2.0-only
// Differences between LAMMPS versions from 4Feb2025 to the newest belong in this header. There are
// none now: all calls that the styles use are the same in every version of that range.

#pragma once

// The build defines the version as yyyymmdd, from LAMMPS' version.h.
#ifndef LAMMPS_VERSION_NUMBER
#error "LAMMPS_VERSION_NUMBER is not defined: build GPU_RVE with its CMakeLists.txt"
#endif

static_assert(LAMMPS_VERSION_NUMBER >= 20250204, "GPU_RVE needs LAMMPS 4Feb2025 or newer");
