// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/unit_styles.h"

#include "error.h"
#include "lammps.h"
#include "update.h"

#include <algorithm>

using namespace LAMMPS_NS;

void LAMMPS_NS::require_mechanical_units(LAMMPS *lmp, const std::string &command)
{
  constexpr const char *STYLES[] = {"lj", "si", "cgs", "micro"};
  const std::string units = lmp->update->unit_style;
  if (std::find(std::begin(STYLES), std::end(STYLES), units) == std::end(STYLES))
    lmp->error->all(
        FLERR,
        "{}: units are {}; they must be lj, si, cgs or micro, in which a force is a mass "
        "times an acceleration",
        command, units);
}
