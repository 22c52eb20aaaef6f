// SPDX-License-Identifier: GPL-2.0-only
// Conditions under which other parts of LAMMPS may read the state of points or RVEs. A fix updates
// that state only if it may be read, because LAMMPS reads arrays of fixes without a request.

#pragma once

#include <string>

namespace LAMMPS_NS {

class LAMMPS;

/// Returns false if the value of a variable is known to follow from time, positions and velocities
/// alone. Returns true if it may depend on a fix, a compute or anything else: for a formula with an
/// unknown word, and for a variable without a formula.
bool may_read_results(LAMMPS *lmp, const std::string &variable);

/// Returns true if anything may read the state of points or RVEs after this step and before the
/// next one: an output that is due, the end of the run, or a fix that works in this step or reads
/// variables in each step.
bool state_may_be_read(LAMMPS *lmp);

}    // namespace LAMMPS_NS
