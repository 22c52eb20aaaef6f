/* -*- c++ -*- ----------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

// The columns that a command is asked for by name, and the fix rve that they are of.

#ifndef LMP_RVE_COLUMNS_H
#define LMP_RVE_COLUMNS_H

#include "error.h"
#include "lammps.h"
#include "rve/core/suggestion.h"
#include "utils.h"

#include <cstddef>
#include <cstring>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Entries of `table`, which have a `name`, as the words from arg[first] on name them; *fix ID* among them sets `fix_id`, which stays empty
/// without. An error, which begins with `style` and `id`, for other words, a fix given twice, and no column. `kind`: what one is called.
template <class Entry, std::size_t N>
std::vector<const Entry *> read_columns(LAMMPS *lmp, const std::string &style, const char *id,
                                        const char *kind, const Entry (&table)[N], int first,
                                        int narg, char **arg, std::string &fix_id)
{
  Error *error = lmp->error;
  if (narg <= first) utils::missing_cmd_args(FLERR, style, error);
  std::vector<const Entry *> columns;
  for (int iarg = first; iarg < narg; iarg++) {
    if (strcmp(arg[iarg], "fix") == 0) {
      if (++iarg == narg) utils::missing_cmd_args(FLERR, style + " fix", error);
      if (!fix_id.empty())
        error->all(FLERR, "{} {}: fix is given twice, as {} and as {}; give it once", style, id,
                   fix_id, arg[iarg]);
      fix_id = arg[iarg];
      continue;
    }
    const Entry *found = nullptr;
    rve::Words names;
    for (const Entry &entry : table) {
      if (strcmp(arg[iarg], entry.name) == 0) found = &entry;
      names.emplace_back(entry.name);
    }
    names.emplace_back("fix");
    if (!found)
      error->all(FLERR, "{} {}: there is no {} '{}'{}", style, id, kind, arg[iarg],
                 rve::did_you_mean(arg[iarg], names, "there are"));
    columns.push_back(found);
  }
  if (columns.empty()) error->all(FLERR, "{} needs at least one {}", style, kind);
  return columns;
}

}    // namespace LAMMPS_NS

#endif
