// SPDX-License-Identifier: GPL-2.0-only
// The only place for differences between LAMMPS versions, 4Feb2025 to the newest. A style that needs one of the calls below
// includes this header; all other calls that the styles use are the same in every version of that range.

#pragma once

// yyyymmdd, from LAMMPS' version.h; the build defines it
#ifndef LAMMPS_VERSION_NUMBER
#error "LAMMPS_VERSION_NUMBER is not defined: build GPU_RVE with its CMakeLists.txt"
#endif

static_assert(LAMMPS_VERSION_NUMBER >= 20250204, "GPU_RVE needs LAMMPS 4Feb2025 or newer");
