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

// What the formulas of variables may read.

#pragma once

#include <string>

namespace LAMMPS_NS {

class LAMMPS;

/// Whether the value of a variable may depend on a fix, a compute or anything else that is not known to follow from time, positions
/// and velocities alone. Says yes where it does not know: a formula with any other word than those known, or a variable without a formula
/// that runs code.
bool may_read_results(LAMMPS *lmp, const std::string &variable);

}    // namespace LAMMPS_NS
