// SPDX-License-Identifier: GPL-2.0-only

// Who may read the state that a fix keeps up to date for others only. LAMMPS reads arrays of fixes without asking first.

#pragma once

namespace LAMMPS_NS {

class LAMMPS;

/// Whether anything may read the state of points or RVEs after this step and before the next one: an output that is due, the end
/// of the run, or a fix that works then or reads variables in each step. A fix that works at the ends of some steps reads in those only.
bool state_may_be_read(LAMMPS *lmp);

}    // namespace LAMMPS_NS
