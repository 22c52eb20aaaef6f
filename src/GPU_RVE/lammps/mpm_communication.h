// SPDX-License-Identifier: GPL-2.0-only
// Sums, largest values and messages of the material point method over the ranks of LAMMPS.

#pragma once

#include "mpm/solver_options.h"

namespace LAMMPS_NS {

class LAMMPS;

mpm::Communication mpm_communication(LAMMPS *lmp);

}    // namespace LAMMPS_NS
