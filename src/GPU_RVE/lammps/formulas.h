// SPDX-License-Identifier: GPL-2.0-only

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
