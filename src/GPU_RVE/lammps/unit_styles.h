// SPDX-License-Identifier: GPL-2.0-only
// Check of the unit style of LAMMPS.

#pragma once

#include <string>

namespace LAMMPS_NS {

class LAMMPS;

/// Ends with error->all unless force = mass * acceleration holds without a conversion factor in the
/// unit style of the script. The message begins with `command`.
void require_mechanical_units(LAMMPS *lmp, const std::string &command);

}    // namespace LAMMPS_NS
