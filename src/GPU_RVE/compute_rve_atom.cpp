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
#include "fix_rve.h"
#include "lammps/rve_columns.h"
#include "macro/quantities.h"
#include "memory.h"
#include "update.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

// of the answer of an RVE, of the contacts of its state, or of the RVE of a local atom
struct Column {
  const char *name;
  const macro::Quantity *of_result;
  const macro::ContactQuantity *of_contacts;
  double (FixRve::*of_atom)(int) const;

  bool is_of(int dimension) const
  {
    if (of_atom) return true;
    return of_result ? of_result->is_of(dimension) : of_contacts->is_of(dimension);
  }
};

constexpr Column OF_ATOMS[] = {
    {"servo_error", nullptr, nullptr, &FixRve::servo_error},
    {"path_stage", nullptr, nullptr, &FixRve::path_stage},
    {"path_time", nullptr, nullptr, &FixRve::path_time},
    {"path_cycles", nullptr, nullptr, &FixRve::path_cycles},
    {"path_ended", nullptr, nullptr, &FixRve::path_ended},
    {"inertial", nullptr, nullptr, &FixRve::inertial_number},
    {"copies", nullptr, nullptr, &FixRve::copies},
    {"renewals", nullptr, nullptr, &FixRve::renewals},
};

const std::vector<Column> &columns()
{
  static const std::vector<Column> all = [] {
    std::vector<Column> list(std::begin(OF_ATOMS), std::end(OF_ATOMS));
    for (const macro::Quantity &quantity : macro::quantities::ALL)
      list.push_back({quantity.name, &quantity, nullptr, nullptr});
    for (const macro::ContactQuantity &quantity : macro::quantities::OF_CONTACTS)
      list.push_back({quantity.name, nullptr, &quantity, nullptr});
    return list;
  }();
  return all;
}

// the columns of a local atom; its contacts are looked at once, and only if a column is of them
template <int D>
void fill_row(const FixRve &fix, int i, const std::vector<const Column *> &columns, double *row)
{
  std::optional<rve::ContactMeasuresOf<D>> contacts;
  for (const Column *column : columns) {
    if (column->of_atom) {
      *row++ = (fix.*column->of_atom)(i);
    } else if (column->of_result) {
      *row++ = column->of_result->of(fix.result<D>(i));
    } else {
      if (!contacts) contacts = rve::contact_measures(fix.state<D>(i));
      *row++ = column->of_contacts->of(*contacts);
    }
  }
}

}    // namespace

struct ComputeRveAtom::Impl {
  std::vector<const Column *> quantities;
  std::string fix_id;    // empty: the only fix rve there is
  FixRve *fix = nullptr;
  int nmax = 0;
};

/* ---------------------------------------------------------------------- */

ComputeRveAtom::ComputeRveAtom(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), impl(std::make_unique<Impl>())
{
  impl->quantities =
      read_columns(lmp, "compute rve/atom", id, "quantity", columns(), 3, narg, arg, impl->fix_id);

  peratom_flag = 1;
  size_peratom_cols = impl->quantities.size() == 1 ? 0 : static_cast<int>(impl->quantities.size());
}

/* ---------------------------------------------------------------------- */

ComputeRveAtom::~ComputeRveAtom()
{
  memory->destroy(vector_atom);
  memory->destroy(array_atom);
}

/* ---------------------------------------------------------------------- */

void ComputeRveAtom::init()
{
  impl->fix = FixRve::find(lmp, impl->fix_id, std::string("compute rve/atom ") + id);
  require_columns_of(*impl->fix, lmp, "compute rve/atom", id, impl->quantities);
}

/* ---------------------------------------------------------------------- */

void ComputeRveAtom::compute_peratom()
{
  invoked_peratom = update->ntimestep;
  const int columns = static_cast<int>(impl->quantities.size());
  if (atom->nmax > impl->nmax) {
    impl->nmax = atom->nmax;
    memory->destroy(vector_atom);
    memory->destroy(array_atom);
    if (columns == 1)
      memory->create(vector_atom, impl->nmax, "rve/atom:vector");
    else
      memory->create(array_atom, impl->nmax, columns, "rve/atom:array");
  }
  for (int i = 0; i < atom->nlocal; i++) {
    double *row = columns == 1 ? &vector_atom[i] : array_atom[i];
    if (!(atom->mask[i] & groupbit) || impl->fix->slot(i) < 0)
      std::fill_n(row, columns, 0.0);
    else if (impl->fix->dimension() == 3)
      fill_row<3>(*impl->fix, i, impl->quantities, row);
    else
      fill_row<2>(*impl->fix, i, impl->quantities, row);
  }
}

/* ---------------------------------------------------------------------- */

double ComputeRveAtom::memory_usage()
{
  return static_cast<double>(impl->nmax) * impl->quantities.size() * sizeof(double);
}
