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
#include "macro/quantities.h"
#include "memory.h"
#include "rve_columns.h"
#include "update.h"

#include <iterator>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

// of the answer of an RVE, or of the RVE of a local atom
struct Column {
  const char *name;
  const macro::Quantity *of_result;
  double (FixRve::*of_atom)(int) const;

  bool is_of(int dimension) const { return of_atom || of_result->is_of(dimension); }
  double value(const FixRve &fix, int i) const
  {
    if (of_atom) return (fix.*of_atom)(i);
    return fix.dimension() == 3 ? of_result->of(fix.result<3>(i)) : of_result->of(fix.result<2>(i));
  }
};

constexpr Column OF_ATOMS[] = {
    {"servo_error", nullptr, &FixRve::servo_error}, {"path_stage", nullptr, &FixRve::path_stage},
    {"path_time", nullptr, &FixRve::path_time},     {"path_cycles", nullptr, &FixRve::path_cycles},
    {"path_ended", nullptr, &FixRve::path_ended},   {"inertial", nullptr, &FixRve::inertial_number},
};

const std::vector<Column> &columns()
{
  static const std::vector<Column> all = [] {
    std::vector<Column> list(std::begin(OF_ATOMS), std::end(OF_ATOMS));
    for (const macro::Quantity &quantity : macro::quantities::ALL)
      list.push_back({quantity.name, &quantity, nullptr});
    return list;
  }();
  return all;
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
    const bool has_rve = (atom->mask[i] & groupbit) && impl->fix->slot(i) >= 0;
    for (int k = 0; k < columns; k++)
      row[k] = has_rve ? impl->quantities[k]->value(*impl->fix, i) : 0.0;
  }
}

/* ---------------------------------------------------------------------- */

double ComputeRveAtom::memory_usage()
{
  return static_cast<double>(impl->nmax) * impl->quantities.size() * sizeof(double);
}
