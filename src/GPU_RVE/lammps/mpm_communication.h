// SPDX-License-Identifier: GPL-2.0-only
// Sums, maxima and messages of the material point method over the ranks of LAMMPS.

#pragma once

#include "mpm/solver_options.h"

#include <string>

namespace LAMMPS_NS {

class LAMMPS;

/// Returns the communication between the ranks of the world of `lmp`.
/// Errors of ranks begin with `who`.
mpm::Communication mpm_communication(LAMMPS *lmp, const std::string &who);

}    // namespace LAMMPS_NS
