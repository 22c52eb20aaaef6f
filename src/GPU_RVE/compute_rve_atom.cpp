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
#include <optional>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

/// Source of the columns of an atom: its RVE. The first call of contacts() measures the contacts.
template <int D> struct Row {
  const FixRve::ImplOf<D> &rves;
  int atom;
  mutable std::optional<rve::ContactMeasuresOf<D>> measures;

  Row(const FixRve::ImplOf<D> &_rves, int _atom) : rves(_rves), atom(_atom) {}
  const rve::ContactMeasuresOf<D> &contacts() const
  {
    if (!measures) measures = rve::contact_measures(rves.state(atom));
    return *measures;
  }
};

using Table = macro::quantities::Table<Row>;
using Column = ColumnOf<Row>;

/// Adds `quantities`, a table whose functions take a Known<D>, to `table`. part(row) returns the
/// Known<D> of a row.
template <template <int> class Known, class Part>
void add_all(Table &table, const macro::quantities::Table<Known> &quantities, Part part)
{
  for (const macro::QuantityOf<Known> &quantity : quantities) {
    table.add(quantity.name.c_str(), [=](const auto &row) { return quantity.of(part(row)); });
    if (!quantity.of_disks) table.back().of_disks = nullptr;
    if (!quantity.of_spheres) table.back().of_spheres = nullptr;
  }
}

const Table &columns()
{
  static const Table table = [] {
    Table t;
    t.add("servo_error", [](const auto &r) { return r.rves.servo_error(r.atom); });
    t.add("path_stage", [](const auto &r) { return r.rves.path_report(r.atom).stage; });
    t.add("path_time", [](const auto &r) { return r.rves.path_report(r.atom).time; });
    t.add("path_cycles", [](const auto &r) { return r.rves.path_report(r.atom).cycles; });
    t.add("path_ended", [](const auto &r) { return r.rves.path_report(r.atom).ended; });
    t.add("inertial", [](const auto &r) { return r.rves.inertial_number(r.atom); });
    t.add("copies", [](const auto &r) { return r.rves.points->copies(r.rves.slot[r.atom]); });
    t.add("renewals", [](const auto &r) { return r.rves.points->renewals(r.rves.slot[r.atom]); });
    add_all(
        t, macro::quantities::all(),
        [](const auto &r) -> const auto & { return r.rves.point(r.atom).result; });
    add_all(
        t, macro::quantities::of_contacts(),
        [](const auto &r) -> const auto & { return r.contacts(); });
    return t;
  }();
  return table;
}

constexpr const char *STYLE = "compute rve/atom";

}    // namespace

struct ComputeRveAtom::Impl {
  std::vector<const Column *> quantities;
  std::string fix_id;    // empty for the only fix rve
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
      std::fill_n(row, impl->quantities.size(), 0.0);
      if (!(atom->mask[i] & groupbit) || rves.slot[i] < 0) continue;
      const Row of_atom(rves, i);
      for (std::size_t k = 0; k < impl->quantities.size(); ++k)
        row[k] = impl->quantities[k]->of(of_atom);
    }
  });
}

double ComputeRveAtom::memory_usage()
{
  return impl->values.bytes();
}
