// SPDX-License-Identifier: GPL-2.0-only
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

#include "no_pairs.h"

#include "atom.h"
#include "comm.h"
#include "force.h"
#include "lammps.h"
#include "neighbor.h"

using namespace LAMMPS_NS;

void LAMMPS_NS::settle_without_pairs(LAMMPS *lmp)
{
  if (lmp->force->pair || lmp->force->bond) return;
  if (lmp->atom->userbinsize == 0.0) lmp->atom->sortfreq = 0;
  if (lmp->comm->cutghostuser == 0.0) lmp->comm->cutghostuser = lmp->neighbor->skin;
}
