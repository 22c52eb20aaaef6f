// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/no_pairs.h"

#include "atom.h"
#include "comm.h"
#include "force.h"
#include "lammps.h"
#include "neighbor.h"

using namespace LAMMPS_NS;

void LAMMPS_NS::set_up_without_pairs(LAMMPS *lmp)
{
  if (lmp->force->pair || lmp->force->bond) return;
  if (lmp->atom->userbinsize == 0.0) lmp->atom->sortfreq = 0;
  if (lmp->comm->cutghostuser == 0.0) lmp->comm->cutghostuser = lmp->neighbor->skin;
}
