// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/state_readers.h"

#include "fix_gravity.h"
#include "fix_mpm.h"
#include "fix_rve.h"
#include "lammps/formulas.h"

#include "fix.h"
#include "lammps.h"
#include "modify.h"
#include "output.h"
#include "update.h"

#include <cstring>

using namespace LAMMPS_NS;

namespace {

/// The variables of a fix gravity, which it keeps for its descendants.
struct Gravity : FixGravity {
  static bool reads_results(const Fix *fix, LAMMPS *lmp)
  {
    const auto *gravity = dynamic_cast<const FixGravity *>(fix);
    if (!gravity) return true;    // of another make
    for (char *FixGravity::*variable :
         {&Gravity::mstr, &Gravity::vstr, &Gravity::pstr, &Gravity::tstr, &Gravity::xstr,
          &Gravity::ystr, &Gravity::zstr})
      if (gravity->*variable && may_read_results(lmp, gravity->*variable)) return true;
    return false;
  }
};

/// Whether a fix that needs nothing but positions and masses of atoms besides reads a variable in each step that needs more.
bool reads_by_variables(const Fix *fix, LAMMPS *lmp)
{
  if (const auto *mpm = dynamic_cast<const FixMpm *>(fix)) return mpm->reads_results();
  if (const auto *rve = dynamic_cast<const FixRve *>(fix)) return rve->reads_results();
  return Gravity::reads_results(fix, lmp);
}

}    // namespace

bool LAMMPS_NS::state_may_be_read(LAMMPS *lmp)
{
  const bigint step = lmp->update->ntimestep;
  if (step == lmp->update->laststep || step == lmp->output->next) return true;
  for (const Fix *fix : lmp->modify->get_fix_list()) {
    // not by patterns, which LAMMPS reads anew each time: this is asked in each step
    const auto begins = [fix](const char *word) {
      return std::strncmp(fix->style, word, std::strlen(word)) == 0;
    };
    if (std::strcmp(fix->style, "mpm") == 0 || std::strcmp(fix->style, "rve") == 0 ||
        begins("gravity")) {
      if (reads_by_variables(fix, lmp)) return true;
      continue;
    }
    // weighs atoms before it deals them out, in the beginning of a step
    if (begins("balance")) {
      if (fix->force_reneighbor && step + 1 >= fix->next_reneighbor) return true;
      continue;
    }
    const int hooks = lmp->modify->get_fix_mask(const_cast<Fix *>(fix)) & ~FixConst::POST_RUN;
    if (hooks == 0) continue;
    if (hooks != FixConst::END_OF_STEP || fix->nevery <= 0 || step % fix->nevery == 0) return true;
  }
  return false;
}
