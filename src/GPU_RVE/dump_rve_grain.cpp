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

#include "dump_rve_grain.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix_rve.h"
#include "group.h"
#include "rve/engine/contact_network.h"
#include "rve_columns.h"
#include "update.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

/// The RVE as it is when a frame is written.
struct Frame {
  rve::RveState state;
  std::vector<double> positions;
  std::vector<int> contacts;                  // of each grain
  std::vector<rve::Vec<double, 2>> forces;    // of the springs on each grain
  tagint atom;

  Frame() = default;
  Frame(rve::RveState _state, tagint _atom) :
      state(std::move(_state)), positions(state.positions()), contacts(state.num_grains(), 0),
      forces(state.num_grains(), rve::Vec<double, 2>{{0.0, 0.0}}), atom(_atom)
  {
    for (const rve::SpringContact &contact : rve::find_spring_contacts(state)) {
      const int first = contact.geometry.first, second = contact.geometry.second;
      contacts[first]++;
      contacts[second]++;
      forces[first] = forces[first] + contact.force_on_first;
      forces[second] = forces[second] - contact.force_on_first;
    }
  }
};

struct Column {
  const char *name;
  bool is_integer;
  double (*of)(const Frame &, int grain);
};

// clang-format off
constexpr Column COLUMNS[] = {
    {"id", true, [](const Frame &, int i) { return double(i + 1); }},
    {"type", true, [](const Frame &, int) { return 1.0; }},
    {"atom", true, [](const Frame &f, int) { return double(f.atom); }},
    {"x", false, [](const Frame &f, int i) { return f.positions[2 * i]; }},
    {"y", false, [](const Frame &f, int i) { return f.positions[2 * i + 1]; }},
    {"z", false, [](const Frame &, int) { return 0.0; }},
    {"radius", false, [](const Frame &f, int i) { return f.state.radius[i]; }},
    {"vx", false, [](const Frame &f, int i) { return f.state.velocity[2 * i]; }},
    {"vy", false, [](const Frame &f, int i) { return f.state.velocity[2 * i + 1]; }},
    {"vz", false, [](const Frame &, int) { return 0.0; }},
    {"omegaz", false, [](const Frame &f, int i) { return f.state.spin[i]; }},
    {"fx", false, [](const Frame &f, int i) { return f.forces[i][0]; }},
    {"fy", false, [](const Frame &f, int i) { return f.forces[i][1]; }},
    {"contacts", true, [](const Frame &f, int i) { return double(f.contacts[i]); }},
};
// clang-format on

}    // namespace

struct DumpRveGrain::Impl {
  std::vector<std::string> words;    // what dump custom gets: as many columns as there are here
  std::vector<char *> arguments;
  std::vector<const Column *> columns;
  std::string fix_id;    // empty: the only fix rve there is
  FixRve *fix = nullptr;

  Frame frame;         // on the rank that has the RVE
  double cell[4];      // H, rows first, on all ranks [length]
  double half_slab;    // largest radius, on all ranks [length]

  Impl(LAMMPS *lmp, int narg, char **arg)
  {
    columns = read_columns(lmp, "dump rve/grain", arg[0], "column", COLUMNS, 5, narg, arg, fix_id);
    words.assign(arg, arg + 5);
    words.resize(5 + columns.size(), "id");
    for (std::string &word : words) arguments.push_back(word.data());
  }
};

/* ----------------------------------------------------------------------
   a dump custom whose columns are filled here: it knows files, ranks, formats and names
------------------------------------------------------------------------- */

DumpRveGrain::DumpRveGrain(LAMMPS *lmp, int narg, char **arg) :
    DumpRveGrain(lmp, std::make_unique<Impl>(lmp, narg, arg))
{
}

DumpRveGrain::DumpRveGrain(LAMMPS *lmp, std::unique_ptr<Impl> _impl) :
    DumpCustom(lmp, static_cast<int>(_impl->arguments.size()), _impl->arguments.data()),
    impl(std::move(_impl))
{
  if (binary)
    error->all(FLERR,
               "dump rve/grain {}: file {} would be binary; write text, for example grains.dump",
               id, filename);
  std::string names, formats;
  key2col.clear();
  for (int k = 0; k < nfield; k++) {
    const Column &column = *impl->columns[k];
    const std::string separator = k ? " " : "";
    names += separator + column.name;
    formats += separator + (column.is_integer ? "%d" : "%g");
    vtype[k] = column.is_integer ? Dump::INT : Dump::DOUBLE;
    key2col[column.name] = k;
  }
  delete[] columns_default;
  columns_default = utils::strdup(names);
  delete[] format_default;
  format_default = utils::strdup(formats);
}

DumpRveGrain::~DumpRveGrain() = default;

/* ---------------------------------------------------------------------- */

void DumpRveGrain::init_style()
{
  impl->fix = FixRve::find(lmp, impl->fix_id, std::string("dump rve/grain ") + id);
  impl->fix->attach();
  // one rank has all grains, in the order of their IDs
  if (sortcol == 0) sort_flag = 0;
  DumpCustom::init_style();
}

/* ---------------------------------------------------------------------- */

int DumpRveGrain::modify_param(int narg, char **arg)
{
  for (const char *word : {"region", "thresh", "triclinic/general"})
    if (strcmp(arg[0], word) == 0)
      error->all(
          FLERR,
          "dump_modify {}: {} is of atoms and of the simulation box; dump rve/grain writes all "
          "grains of an RVE in its own cell",
          id, word);
  return DumpCustom::modify_param(narg, arg);
}

/* ----------------------------------------------------------------------
   takes the frame, and tells all ranks the cell: the first one writes the header
------------------------------------------------------------------------- */

int DumpRveGrain::count()
{
  impl->frame = Frame();
  int mine = 0, found;
  double cell[4] = {0.0, 0.0, 0.0, 0.0}, half_slab = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & group->bitmask[igroup]) || impl->fix->slot(i) < 0) continue;
    if (mine++) continue;
    impl->frame = Frame(impl->fix->state<2>(i), atom->tag[i]);
    const rve::RveState &state = impl->frame.state;
    for (int k = 0; k < 4; k++) cell[k] = state.cell(k / 2, k % 2);
    half_slab = *std::max_element(state.radius.begin(), state.radius.end());
  }
  MPI_Allreduce(&mine, &found, 1, MPI_INT, MPI_SUM, world);
  if (found != 1)
    error->all(
        FLERR,
        "dump rve/grain {}: {} atoms of group {} have an RVE of fix {}; it must be one, as a "
        "frame has one cell; choose it as in: group look id 17",
        id, found, group->names[igroup], impl->fix->id);
  MPI_Allreduce(cell, impl->cell, 4, MPI_DOUBLE, MPI_SUM, world);
  MPI_Allreduce(&half_slab, &impl->half_slab, 1, MPI_DOUBLE, MPI_SUM, world);
  return impl->frame.state.num_grains();
}

/* ---------------------------------------------------------------------- */

void DumpRveGrain::pack(tagint *)
{
  int m = 0;
  for (int i = 0; i < impl->frame.state.num_grains(); i++)
    for (const Column *column : impl->columns) buf[m++] = column->of(impl->frame, i);
}

/* ----------------------------------------------------------------------
   as of a general triclinic box: the axes of the grains are those of the script, whichever way the cell has turned
------------------------------------------------------------------------- */

void DumpRveGrain::write_header(bigint ndump)
{
  if (unit_flag && !unit_count) {
    ++unit_count;
    utils::print(fp, "ITEM: UNITS\n{}\n", update->unit_style);
  }
  if (time_flag) utils::print(fp, "ITEM: TIME\n{:.16}\n", compute_time());
  const double *h = impl->cell, slab = impl->half_slab;
  utils::print(fp,
               "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n{}\n"
               "ITEM: BOX BOUNDS abc origin pp pp ff\n"
               "{:>1.16e} {:>1.16e} 0 0\n{:>1.16e} {:>1.16e} 0 0\n0 0 {:>1.16e} {:>1.16e}\n"
               "ITEM: ATOMS {}\n",
               update->ntimestep, ndump, h[0], h[2], h[1], h[3], 2.0 * slab, -slab, columns);
}
