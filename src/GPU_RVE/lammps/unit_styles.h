// SPDX-License-Identifier: GPL-2.0-only
// Which unit styles of LAMMPS suit styles of mechanics.

#pragma once

#include <string>

namespace LAMMPS_NS {

class LAMMPS;

/// Ends with error->all unless forces are masses times accelerations, without factors; `command` begins the message.
void require_mechanical_units(LAMMPS *lmp, const std::string &command);

}    // namespace LAMMPS_NS
