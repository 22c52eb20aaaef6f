/* ----------------------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

#include "restart_record.h"

#include "atom.h"
#include "error.h"
#include "lammps.h"

#include <cmath>

using namespace LAMMPS_NS;

RestartRecord LAMMPS_NS::restart_record(LAMMPS *lmp, const std::string &whose, int i, int nth,
                                        int least)
{
  const Atom *atom = lmp->atom;
  RestartRecord record{atom->extra[i], 0};
  for (int k = 0; k <= nth; k++) {
    record.values += record.size;
    const auto left = static_cast<double>(atom->extra[i] + atom->nextra_store - record.values);
    const double size = left > 0.0 ? record.values[0] : 0.0;
    if (!(size >= (k == nth ? least : 1) && size <= left && size == std::floor(size)))
      lmp->error->one(
          FLERR,
          "{}: the record of atom {} in the restart file is damaged: part {} of it says "
          "that it has {} numbers, and {} are left. Use an earlier file",
          whose, atom->tag[i], k + 1, size, left);
    record.size = static_cast<int>(size);
  }
  return record;
}
