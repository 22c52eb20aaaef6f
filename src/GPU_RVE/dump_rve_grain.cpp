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

#include "dump_rve_grain.h"

#include "atom.h"
#include "error.h"
#include "group.h"
#include "lammps/rve_columns.h"
#include "rve/engine/contact_network.h"
#include "update.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

/// The state of the RVE when a frame is written.
template <int D> struct Frame {
  rve::RveStateOf<D> state;
  std::vector<double> positions;
  std::vector<int> contacts;                  // number of contacts of each grain
  std::vector<rve::Vec<double, D>> forces;    // sum of contact spring forces on each grain [force]
  tagint atom;

  Frame(rve::RveStateOf<D> _state, tagint _atom) :
      state(std::move(_state)), positions(state.positions()), contacts(state.num_grains(), 0),
      forces(state.num_grains(), rve::Vec<double, D>::zero()), atom(_atom)
  {
    for (const rve::SpringContactOf<D> &contact : rve::find_spring_contacts(state)) {
      const int first = contact.geometry.first, second = contact.geometry.second;
      contacts[first]++;
      contacts[second]++;
      forces[first] = forces[first] + contact.force_on_first;
      forces[second] = forces[second] - contact.force_on_first;
    }
  }
};

/// A grain of the frame.
template <int D> struct Grain {
  const Frame<D> &frame;
  int i;

  double position(int axis) const { return frame.positions[D * i + axis]; }
  double velocity(int axis) const { return frame.state.velocity[D * i + axis]; }
  double spin(int axis) const { return frame.state.spin[rve::Space<D>::spins * i + axis]; }
  double force(int axis) const { return frame.forces[i][axis]; }
};

struct Column : ColumnOf<Grain> {
  bool is_integer = false;
};

template <class Of> Column both(const char *name, Of of, bool is_integer = false)
{
  return {{name, of, of}, is_integer};
}
double zero(const Grain<2> &)
{
  return 0.0;
}

// clang-format off
const Column COLUMNS[] = {
    both("id", [](const auto &g) { return double(g.i + 1); }, true),
    both("type", [](const auto &) { return 1.0; }, true),
    both("atom", [](const auto &g) { return double(g.frame.atom); }, true),
    both("x", [](const auto &g) { return g.position(0); }),
    both("y", [](const auto &g) { return g.position(1); }),
    {{"z", zero, [](const Grain<3> &g) { return g.position(2); }}},
    both("radius", [](const auto &g) { return g.frame.state.radius[g.i]; }),
    both("vx", [](const auto &g) { return g.velocity(0); }),
    both("vy", [](const auto &g) { return g.velocity(1); }),
    {{"vz", zero, [](const Grain<3> &g) { return g.velocity(2); }}},
    {{"omegax", nullptr, [](const Grain<3> &g) { return g.spin(0); }}},
    {{"omegay", nullptr, [](const Grain<3> &g) { return g.spin(1); }}},
    {{"omegaz",
      [](const Grain<2> &g) { return g.spin(0); },
      [](const Grain<3> &g) { return g.spin(2); }}},
    both("fx", [](const auto &g) { return g.force(0); }),
    both("fy", [](const auto &g) { return g.force(1); }),
    {{"fz", nullptr, [](const Grain<3> &g) { return g.force(2); }}},
    both("contacts", [](const auto &g) { return double(g.frame.contacts[g.i]); }, true),
};
// clang-format on

}    // namespace

struct DumpRveGrain::Impl {
  std::vector<std::string> words;    // arguments of dump custom, with the same number of columns
  std::vector<char *> arguments;
  std::vector<const Column *> columns;
  std::string fix_id;    // empty for the only fix rve
  FixRve *fix = nullptr;

  // data of the frame on the rank of the RVE; other ranks have no grains
  int num_grains = 0;
  std::vector<double> rows;
  // data of the frame on all ranks
  double cell[9];      // cell matrix H in three dimensions, row by row [length]
  double half_slab;    // largest radius, for the height of a box of disks [length]

  Impl(LAMMPS *lmp, int narg, char **arg)
  {
    columns = read_columns(lmp, "dump rve/grain", arg[0], "column", COLUMNS, 5, narg, arg, fix_id);
    words.assign(arg, arg + 5);
    words.resize(5 + columns.size(), "id");
    for (std::string &word : words) arguments.push_back(word.data());
  }

  template <int D> void take(const Frame<D> &frame)
  {
    const rve::RveStateOf<D> &state = frame.state;
    num_grains = state.num_grains();
    for (int i = 0; i < num_grains; i++)
      for (const Column *column : columns) rows.push_back(column->of(Grain<D>{frame, i}));
    for (int a = 0; a < D; a++)
      for (int b = 0; b < D; b++) cell[3 * a + b] = state.cell(a, b);
    half_slab = *std::max_element(state.radius.begin(), state.radius.end());
  }
};

/// The base class, dump custom, handles files, ranks, formats and names. This class fills the
/// columns.
DumpRveGrain::DumpRveGrain(LAMMPS *lmp, int narg, char **arg) :
    DumpRveGrain(lmp, std::make_unique<Impl>(lmp, narg, arg))
{
}

DumpRveGrain::DumpRveGrain(LAMMPS *lmp, std::unique_ptr<Impl> _impl) :
    DumpCustom(lmp, static_cast<int>(_impl->arguments.size()), _impl->arguments.data()),
    impl(std::move(_impl))
{
  if (binary)
    error->all(
        FLERR,
        "dump rve/grain {}: file {} would be binary; use a text file, for example grains.dump", id,
        filename);
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

void DumpRveGrain::init_style()
{
  impl->fix = fix_of_columns(lmp, "dump rve/grain", id, impl->fix_id, impl->columns);
  impl->fix->rves().attach();
  // one rank has all grains in the order of their IDs, so that no sort is needed
  if (sortcol == 0) sort_flag = 0;
  DumpCustom::init_style();
}

int DumpRveGrain::modify_param(int narg, char **arg)
{
  for (const char *word : {"region", "thresh", "triclinic/general"})
    if (strcmp(arg[0], word) == 0)
      error->all(FLERR,
                 "dump_modify {}: {} is not supported by dump rve/grain, which writes all grains "
                 "of an RVE in its own cell",
                 id, word);
  return DumpCustom::modify_param(narg, arg);
}

/// Stores the frame and sends the cell to all ranks, because rank 0 writes the header.
int DumpRveGrain::count()
{
  impl->num_grains = 0;
  impl->rows.clear();
  std::fill_n(impl->cell, 9, 0.0);
  impl->half_slab = 0.0;
  int mine = 0, found;
  with_rves(*impl->fix, [&](const auto &rves) {
    for (int i = 0; i < atom->nlocal; i++) {
      if (!(atom->mask[i] & group->bitmask[igroup]) || rves.slot[i] < 0) continue;
      if (mine++ == 0) impl->take(Frame(rves.state(i), atom->tag[i]));
    }
  });
  MPI_Allreduce(&mine, &found, 1, MPI_INT, MPI_SUM, world);
  if (found != 1)
    error->all(
        FLERR,
        "dump rve/grain {}: {} atoms of group {} have an RVE of fix {}; there must be exactly one, "
        "because a frame has one cell: choose it, for example with group look id 17",
        id, found, group->names[igroup], impl->fix->id);
  MPI_Allreduce(MPI_IN_PLACE, impl->cell, 9, MPI_DOUBLE, MPI_SUM, world);
  MPI_Allreduce(MPI_IN_PLACE, &impl->half_slab, 1, MPI_DOUBLE, MPI_SUM, world);
  return impl->num_grains;
}

void DumpRveGrain::pack(tagint *)
{
  std::copy(impl->rows.begin(), impl->rows.end(), buf);
}

/// The header describes a general triclinic box, so that positions refer to the axes of the script
/// even if the cell has rotated.
void DumpRveGrain::write_header(bigint ndump)
{
  if (unit_flag && !unit_count) {
    ++unit_count;
    utils::print(fp, "ITEM: UNITS\n{}\n", update->unit_style);
  }
  if (time_flag) utils::print(fp, "ITEM: TIME\n{:.16}\n", compute_time());
  const double *h = impl->cell, slab = impl->half_slab;
  const bool is_plane = impl->fix->rves().dimension == 2;
  utils::print(fp,
               "ITEM: TIMESTEP\n{}\nITEM: NUMBER OF ATOMS\n{}\n"
               "ITEM: BOX BOUNDS abc origin pp pp {}\n",
               update->ntimestep, ndump, is_plane ? "ff" : "pp");
  if (is_plane)
    utils::print(fp, "{:>1.16e} {:>1.16e} 0 0\n{:>1.16e} {:>1.16e} 0 0\n0 0 {:>1.16e} {:>1.16e}\n",
                 h[0], h[3], h[1], h[4], 2.0 * slab, -slab);
  else
    for (int b = 0; b < 3; b++)
      utils::print(fp, "{:>1.16e} {:>1.16e} {:>1.16e} 0\n", h[b], h[3 + b], h[6 + b]);
  utils::print(fp, "ITEM: ATOMS {}\n", columns);
}
