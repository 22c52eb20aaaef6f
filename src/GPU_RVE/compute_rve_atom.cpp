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

#include "compute_rve_atom.h"

#include "atom.h"
#include "lammps/rve_columns.h"
#include "macro/quantities.h"
#include "update.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

using Rves = FixRve::Impl;

// of the answer of an RVE, of the contacts of its state, or of the RVE of a local atom
struct Column {
  const char *name;
  const macro::Quantity *of_result;
  const macro::ContactQuantity *of_contacts;
  double (*of_atom)(const Rves &, int);

  bool is_of(int dimension) const
  {
    if (of_atom) return true;
    return of_result ? of_result->is_of(dimension) : of_contacts->is_of(dimension);
  }
};

constexpr Column of_atom(const char *name, double (*value)(const Rves &, int))
{
  return {name, nullptr, nullptr, value};
}

constexpr Column OF_ATOMS[] = {
    of_atom("servo_error", [](const Rves &rves, int i) { return rves.servo_error(i); }),
    of_atom("path_stage", [](const Rves &rves, int i) { return rves.path_report(i).stage; }),
    of_atom("path_time", [](const Rves &rves, int i) { return rves.path_report(i).time; }),
    of_atom("path_cycles", [](const Rves &rves, int i) { return rves.path_report(i).cycles; }),
    of_atom("path_ended", [](const Rves &rves, int i) { return rves.path_report(i).ended; }),
    of_atom("inertial", [](const Rves &rves, int i) { return rves.inertial_number(i); }),
    of_atom("copies", [](const Rves &rves, int i) { return rves.copies(i); }),
    of_atom("renewals", [](const Rves &rves, int i) { return rves.renewals(i); }),
};

const std::vector<Column> &columns()
{
  static const std::vector<Column> all = [] {
    std::vector<Column> list(std::begin(OF_ATOMS), std::end(OF_ATOMS));
    for (const macro::Quantity &quantity : macro::quantities::all())
      list.push_back({quantity.name.c_str(), &quantity, nullptr, nullptr});
    for (const macro::ContactQuantity &quantity : macro::quantities::of_contacts())
      list.push_back({quantity.name.c_str(), nullptr, &quantity, nullptr});
    return list;
  }();
  return all;
}

// the columns of a local atom; its contacts are found once, and only if a column is of them
template <int D>
void fill_row(const FixRve::ImplOf<D> &rves, int i, const std::vector<const Column *> &columns,
              double *row)
{
  std::optional<rve::ContactMeasuresOf<D>> contacts;
  for (const Column *column : columns) {
    if (column->of_atom) {
      *row++ = column->of_atom(rves, i);
    } else if (column->of_result) {
      *row++ = column->of_result->of(rves.point(i).result);
    } else {
      if (!contacts) contacts = rve::contact_measures(rves.state(i));
      *row++ = column->of_contacts->of(*contacts);
    }
  }
}

constexpr const char *STYLE = "compute rve/atom";

}    // namespace

struct ComputeRveAtom::Impl {
  std::vector<const Column *> quantities;
  std::string fix_id;    // empty: the only fix rve there is
  FixRve *fix = nullptr;
  ColumnValues values;
};

ComputeRveAtom::ComputeRveAtom(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), impl(std::make_unique<Impl>())
{
  impl->quantities =
      read_columns(lmp, STYLE, id, "quantity", columns(), 3, narg, arg, impl->fix_id);
  impl->values = ColumnValues(impl->quantities.size());
  peratom_flag = 1;
  size_peratom_cols = impl->values.num_columns();
}

ComputeRveAtom::~ComputeRveAtom() = default;

void ComputeRveAtom::init()
{
  impl->fix = fix_of_columns(lmp, STYLE, id, impl->fix_id, impl->quantities);
}

void ComputeRveAtom::compute_peratom()
{
  invoked_peratom = update->ntimestep;
  impl->values.resize(atom->nmax, vector_atom, array_atom);
  with_rves(*impl->fix, [&](const auto &rves) {
    for (int i = 0; i < atom->nlocal; i++) {
      double *const row = impl->values.row(i);
      if ((atom->mask[i] & groupbit) && rves.slot[i] >= 0)
        fill_row(rves, i, impl->quantities, row);
      else
        std::fill_n(row, impl->quantities.size(), 0.0);
    }
  });
}

double ComputeRveAtom::memory_usage()
{
  return impl->values.bytes();
}
