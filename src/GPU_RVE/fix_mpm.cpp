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

#include "fix_mpm_impl.h"

#include "lammps/no_pairs.h"
#include "lammps/restart_record.h"
#include "lammps/unit_styles.h"

#include "atom.h"
#include "domain.h"
#include "error.h"
#include "group.h"
#include "input.h"
#include "modify.h"
#include "update.h"

#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;

FixMpm::FixMpm(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg)
{
  require_mechanical_units(lmp, fmt::format("fix mpm {}", id));
  const bool has_z = domain->dimension == 3;
  if (domain->xperiodic || domain->yperiodic || (has_z && domain->zperiodic))
    error->all(FLERR, "fix mpm {}: the grid is not periodic; use boundary f, s or m in {}", id,
               has_z ? "x, y and z" : "x and y");
  if (atom->tag_enable == 0) error->all(FLERR, "fix mpm {}: atoms must have IDs", id);

  time_integrate = 1;
  scalar_flag = vector_flag = peratom_flag = 1;
  global_freq = peratom_freq = 1;
  extscalar = extvector = 0;
  restart_peratom = restart_global = 1;
  create_attribute = 1;
  // callbacks are added at the end, because no destructor runs if an error ends the constructor
  if (has_z)
    impl = std::make_unique<ImplOf<3>>(this, narg, arg);
  else
    impl = std::make_unique<ImplOf<2>>(this, narg, arg);
  warn_of_dropped_records(lmp, fmt::format("fix mpm {}", id));

  FixMpm::grow_arrays(atom->nmax);
  for (int i = 0; i < atom->nlocal; i++) FixMpm::set_arrays(i);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
}

FixMpm::~FixMpm()
{
  atom->delete_callback(id, Atom::GROW);
  atom->delete_callback(id, Atom::RESTART);
}

int FixMpm::setmask()
{
  return PRE_FORCE | FINAL_INTEGRATE | POST_RUN;
}

/// Checks the settings and fixes that the script can define after this fix.
void FixMpm::init()
{
  if (update->whichflag == 2)
    error->all(
        FLERR,
        "fix mpm {}: minimize cannot be used, because material points have no energy; use run", id);
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "fix mpm {}: run_style respa is not supported; use run_style verlet", id);
  if (input->command && strcmp(input->command, "rerun") == 0)
    error->all(FLERR,
               "fix mpm {}: rerun cannot be used, because stresses depend on the whole history of "
               "the points, which a dump file does not contain",
               id);

  set_up_without_pairs(lmp);
  const bigint members = group->count(igroup);
  if (members == 0)
    error->all(FLERR, "fix mpm {}: group {} has no atoms", id, group->names[igroup]);
  if (members != atom->natoms)
    error->all(FLERR,
               "fix mpm {}: {} of {} atoms are not in group {}; the group of the fix must contain "
               "all atoms",
               id, atom->natoms - members, atom->natoms, group->names[igroup]);

  for (const auto &other : modify->get_fix_list()) {
    if (other == this || group->count(other->igroup) == 0) continue;
    // a fix rve can have time_integrate set, but it moves no atoms
    if (other->time_integrate && !dynamic_cast<FixRve *>(other))
      error->all(FLERR,
                 "fix mpm {}: fix {} (style {}) integrates the same atoms; delete it, because fix "
                 "mpm moves all points",
                 id, other->id, other->style);
    if (other->box_change & ~BOX_CHANGE_DOMAIN)
      error->all(
          FLERR,
          "fix mpm {}: fix {} (style {}) changes the box and moves atoms with it, which strains of "
          "material points would not include; deform the material by boundary, rigid or traction",
          id, other->id, other->style);
    if (utils::strmatch(other->style, "^setforce") || utils::strmatch(other->style, "^freeze"))
      error->all(FLERR,
                 "fix mpm {}: fix {} (style {}) sets forces on material points, which does not "
                 "hold a continuum; prescribe velocities with the keyword rigid or boundary",
                 id, other->id, other->style);
  }

  impl->find_models();
}
