// SPDX-License-Identifier: GPL-2.0-only
// Tests whether other parts of LAMMPS can read the state of points or RVEs. LAMMPS reads the arrays
// of a fix without a request to the fix. A fix therefore updates its arrays at the end of a step if
// anything can read them before the next step. Otherwise it skips the update.

#pragma once

#include <string>

namespace LAMMPS_NS {

class LAMMPS;

/// Returns false if the value of a variable is known to follow from time, positions and velocities
/// alone. Returns true if the value can depend on a fix, a compute or anything else. This is
/// assumed for a formula with an unknown word, and for a variable without a formula.
bool may_read_results(LAMMPS *lmp, const std::string &variable);

/// Returns true if anything can read the state of points or RVEs between this step and the next
/// one. Such readers are an output that is due, the end of the run, a fix that works in this step,
/// and a fix that reads variables in each step.
bool state_may_be_read(LAMMPS *lmp);

}    // namespace LAMMPS_NS
