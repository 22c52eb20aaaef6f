// SPDX-License-Identifier: GPL-2.0-only
/* -*- c++ -*- ----------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

// The only place for differences between LAMMPS versions, 4Feb2025 to the newest. A style that needs one of the calls below
// includes this header; all other calls that the styles use are the same in every version of that range.

#pragma once

// yyyymmdd, from LAMMPS' version.h; the build defines it
#ifndef LAMMPS_VERSION_NUMBER
#error "LAMMPS_VERSION_NUMBER is not defined: build GPU_RVE with its CMakeLists.txt"
#endif

static_assert(LAMMPS_VERSION_NUMBER >= 20250204, "GPU_RVE needs LAMMPS 4Feb2025 or newer");
