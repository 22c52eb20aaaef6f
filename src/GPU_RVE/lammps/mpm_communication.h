// SPDX-License-Identifier: GPL-2.0-only
// Sums, maxima and messages of the material point method over the ranks of LAMMPS.

#pragma once

#include "mpm/solver_options.h"

namespace LAMMPS_NS {

class LAMMPS;

/// Returns the communication between the ranks of the world of `lmp`.
mpm::Communication mpm_communication(LAMMPS *lmp);

}    // namespace LAMMPS_NS
