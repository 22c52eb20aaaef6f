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

#include "write_rve.h"

#include "atom.h"
#include "error.h"
#include "lammps/collective_error.h"
#include "lammps/rve_columns.h"
#include "lammps/script_arguments.h"
#include "modify.h"
#include "rve/engine/packing_io.h"

#include <string>

using namespace LAMMPS_NS;

namespace {

struct FileRequest {
  tagint id = 0;
  std::string path;
  bool native = false;
};

const ScriptKeyword<FileRequest> KEYWORDS[] = {
    {"atom", "ID",
     [](ScriptArguments &words, FileRequest &request) {
       request.id = words.whole("ID", 1, MAXTAGINT);
     }},
    {"file", "path",
     [](ScriptArguments &words, FileRequest &request) { request.path = words.next(); }},
    {"format", "rve | lammps",
     into(one_of<bool>({{"rve", true}, {"lammps", false}}), &FileRequest::native)}};

}    // namespace

/// Syntax: write_rve fix-ID atom ID file path [format lammps|rve]
void WriteRve::command(int narg, char **arg)
{
  ScriptArguments words(lmp, "write_rve", narg, arg, 0);
  const std::string fix_id = words.next("fix ID");
  auto *fix = dynamic_cast<FixRve *>(modify->get_fix_by_id(fix_id));
  if (!fix) error->all(FLERR, "write_rve: fix {} of style rve does not exist", fix_id);

  FileRequest request;
  words.set_keywords(names_of(KEYWORDS));
  while (words.next_keyword()) words.read(KEYWORDS, request);
  for (const char *needed : {"atom", "file"})
    if (!words.has(needed)) error->all(FLERR, "write_rve: the keyword {} must be given", needed);

  fix->rves().attach();
  int mine = 0, found;
  collectively(lmp, "write_rve", [&] {
    with_rves(*fix, [&](const auto &rves) {
      for (int i = 0; i < atom->nlocal; i++) {
        if (atom->tag[i] != request.id || rves.slot[i] < 0) continue;
        mine = 1;
        if (request.native)
          rve::write_packing(request.path, rves.state(i));
        else
          rve::write_lammps_data(request.path, rves.state(i));
      }
    });
  });
  MPI_Allreduce(&mine, &found, 1, MPI_INT, MPI_MAX, world);
  if (!found) error->all(FLERR, "write_rve: atom {} has no RVE of fix {}", request.id, fix_id);
}
