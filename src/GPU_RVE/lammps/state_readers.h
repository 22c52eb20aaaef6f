// SPDX-License-Identifier: GPL-2.0-only
// Who may read the state that a fix keeps up to date for others only, in a step or by the formulas
// of variables. LAMMPS reads arrays of fixes without asking first.

#pragma once

#include <string>

namespace LAMMPS_NS {

class LAMMPS;

/// Whether the value of a variable may depend on a fix, a compute or anything else that is not
/// known to follow from time, positions and velocities alone. Says yes where it does not know: a
/// formula with any other word than those known, or a variable without a formula that runs code.
bool may_read_results(LAMMPS *lmp, const std::string &variable);

/// Whether anything may read the state of points or RVEs after this step and before the next one:
/// an output that is due, the end of the run, or a fix that works then or reads variables in each
/// step. A fix that works at the ends of some steps reads in those only.
bool state_may_be_read(LAMMPS *lmp);

}    // namespace LAMMPS_NS
