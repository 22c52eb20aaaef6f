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

#include "write_rve.h"

#include "atom.h"
#include "collective_error.h"
#include "comm.h"
#include "error.h"
#include "fix_rve.h"
#include "modify.h"
#include "rve/core/error.h"
#include "rve/core/suggestion.h"
#include "rve/engine/packing_io.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <string>

using namespace LAMMPS_NS;

// write_rve fix-ID atom ID file path [format lammps|rve]
void WriteRve::command(int narg, char **arg)
{
  if (narg < 5) utils::missing_cmd_args(FLERR, "write_rve", error);
  auto *fix = dynamic_cast<FixRve *>(modify->get_fix_by_id(arg[0]));
  if (!fix) error->all(FLERR, "write_rve: there is no fix {} of style rve", arg[0]);

  std::set<std::string> given;
  tagint id = 0;
  std::string path;
  bool native = false;
  const rve::Words keywords = {"atom", "file", "format"};
  for (int iarg = 1; iarg < narg; iarg += 2) {
    if (std::find(keywords.begin(), keywords.end(), arg[iarg]) == keywords.end())
      error->all(FLERR, "write_rve: {}", rve::unknown_keyword(arg[iarg], keywords));
    if (iarg + 1 == narg)
      utils::missing_cmd_args(FLERR, std::string("write_rve ") + arg[iarg], error);
    if (!given.insert(arg[iarg]).second)
      error->all(FLERR, "write_rve: keyword {} is given twice", arg[iarg]);
    const char *value = arg[iarg + 1];
    if (strcmp(arg[iarg], "atom") == 0) {
      id = utils::tnumeric(FLERR, value, false, lmp);
    } else if (strcmp(arg[iarg], "file") == 0) {
      path = value;
    } else {    // format
      native = strcmp(value, "rve") == 0;
      if (!native && strcmp(value, "lammps") != 0)
        error->all(FLERR, "write_rve: format is '{}'; it must be rve or lammps", value);
    }
  }
  if (id < 1) error->all(FLERR, "write_rve: atom ID is {}; it must be at least 1", id);
  if (path.empty()) error->all(FLERR, "write_rve: no file is given");

  fix->attach();
  int mine = 0, found;
  std::string failure;
  for (int i = 0; i < atom->nlocal; i++) {
    if (atom->tag[i] != id || fix->slot(i) < 0) continue;
    mine = 1;
    try {
      const rve::RveState state = fix->state(i);
      if (native)
        rve::write_packing(path, state);
      else
        rve::write_lammps_data(path, state);
    } catch (const rve::InputError &e) {
      failure = fmt::format("write_rve: {}", e.what());
    }
  }
  error_if_any(lmp, failure);
  MPI_Allreduce(&mine, &found, 1, MPI_INT, MPI_MAX, world);
  if (!found) error->all(FLERR, "write_rve: atom {} has no RVE of fix {}", id, arg[0]);
}
