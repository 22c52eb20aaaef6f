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

#include "readers.h"

#include "fix.h"
#include "lammps.h"
#include "modify.h"
#include "output.h"
#include "update.h"
#include "utils.h"

using namespace LAMMPS_NS;

bool LAMMPS_NS::somebody_may_look(LAMMPS *lmp)
{
  const bigint step = lmp->update->ntimestep;
  if (step == lmp->update->laststep || step == lmp->output->next) return true;
  for (const Fix *fix : lmp->modify->get_fix_list()) {
    // these read positions and masses of atoms at most
    if (utils::strmatch(fix->style, "^mpm$") || utils::strmatch(fix->style, "^rve$") ||
        utils::strmatch(fix->style, "^gravity"))
      continue;
    // weighs atoms before it deals them out, in the beginning of a step
    if (utils::strmatch(fix->style, "^balance")) {
      if (fix->force_reneighbor && step + 1 >= fix->next_reneighbor) return true;
      continue;
    }
    const int hooks = lmp->modify->get_fix_mask(const_cast<Fix *>(fix)) & ~FixConst::POST_RUN;
    if (hooks == 0) continue;
    if (hooks != FixConst::END_OF_STEP || fix->nevery <= 0 || step % fix->nevery == 0) return true;
  }
  return false;
}
