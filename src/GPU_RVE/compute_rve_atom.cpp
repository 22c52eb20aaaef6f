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
#include "error.h"
#include "fix_rve.h"
#include "memory.h"
#include "rve/engine/engine.h"
#include "rve_columns.h"
#include "update.h"

#include <cmath>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

// Strain of equations (26) and (27) from F, n = 2: eps = (F + F^T)/2 - 1, in the sign of F (extension positive).
double volumetric_strain(const rve::Result &r)
{
  return r.deformation(0, 0) + r.deformation(1, 1) - 2.0;
}

double deviatoric_strain(const rve::Result &r)
{
  const double half_difference = 0.5 * (r.deformation(0, 0) - r.deformation(1, 1));
  const double shear = 0.5 * (r.deformation(0, 1) + r.deformation(1, 0));
  return 2.0 * std::sqrt(half_difference * half_difference + shear * shear);
}

// of the answer of an RVE, or of the RVE of a local atom
struct Quantity {
  const char *name;
  double (*of_result)(const rve::Result &);
  double (FixRve::*of_atom)(int) const = nullptr;

  double value(const FixRve &fix, int i) const
  {
    return of_atom ? (fix.*of_atom)(i) : of_result(fix.result(i));
  }
};

// clang-format off
constexpr Quantity QUANTITIES[] = {
    {"sxx", [](const rve::Result &r) { return r.stress(0, 0); }},
    {"syy", [](const rve::Result &r) { return r.stress(1, 1); }},
    {"sxy", [](const rve::Result &r) { return r.stress(0, 1); }},
    {"syx", [](const rve::Result &r) { return r.stress(1, 0); }},
    {"p", [](const rve::Result &r) { return r.mean_stress(); }},
    {"q", [](const rve::Result &r) { return r.deviatoric_stress(); }},
    {"eps_v", [](const rve::Result &r) { return volumetric_strain(r); }},
    {"eps_q", [](const rve::Result &r) { return deviatoric_strain(r); }},
    {"void_ratio", [](const rve::Result &r) { return r.void_ratio; }},
    {"coordination", [](const rve::Result &r) { return r.coordination_number; }},
    {"coordination_mech", [](const rve::Result &r) { return r.mechanical_coordination_number; }},
    {"fabric_xx", [](const rve::Result &r) { return r.fabric(0, 0); }},
    {"fabric_yy", [](const rve::Result &r) { return r.fabric(1, 1); }},
    {"fabric_xy", [](const rve::Result &r) { return r.fabric(0, 1); }},
    {"def_xx", [](const rve::Result &r) { return r.deformation(0, 0); }},
    {"def_xy", [](const rve::Result &r) { return r.deformation(0, 1); }},
    {"def_yx", [](const rve::Result &r) { return r.deformation(1, 0); }},
    {"def_yy", [](const rve::Result &r) { return r.deformation(1, 1); }},
    {"cell_xx", [](const rve::Result &r) { return r.cell(0, 0); }},
    {"cell_xy", [](const rve::Result &r) { return r.cell(0, 1); }},
    {"cell_yx", [](const rve::Result &r) { return r.cell(1, 0); }},
    {"cell_yy", [](const rve::Result &r) { return r.cell(1, 1); }},
    {"servo_xx", [](const rve::Result &r) { return r.servo_velocity_gradient(0, 0); }},
    {"servo_yy", [](const rve::Result &r) { return r.servo_velocity_gradient(1, 1); }},
    {"servo_xy", [](const rve::Result &r) { return r.servo_velocity_gradient(0, 1); }},
    {"inertial", nullptr, &FixRve::inertial_number},
    {"sliding", [](const rve::Result &r) { return r.sliding_fraction; }},
    {"unbalanced", [](const rve::Result &r) { return r.unbalanced_ratio; }},
    {"kinetic", [](const rve::Result &r) { return r.kinetic_energy; }},
    {"elastic", [](const rve::Result &r) { return r.elastic_energy; }},
    {"work", [](const rve::Result &r) { return r.energy.work; }},
    {"loss_friction", [](const rve::Result &r) { return r.energy.friction; }},
    {"loss_damping", [](const rve::Result &r) { return r.energy.local_damping; }},
    {"loss_viscous", [](const rve::Result &r) { return r.energy.viscous; }},
    {"overlap", [](const rve::Result &r) { return r.largest_overlap; }},
    {"overlap_mean", [](const rve::Result &r) { return r.mean_overlap; }},
    {"force_max", [](const rve::Result &r) { return r.largest_contact_force; }},
    {"grains", [](const rve::Result &r) { return double(r.num_grains); }},
    {"contacts", [](const rve::Result &r) { return double(r.num_contacts); }},
    {"pairs", [](const rve::Result &r) { return double(r.num_pairs); }},
    {"rattlers", [](const rve::Result &r) { return double(r.num_rattlers); }},
    {"substeps", [](const rve::Result &r) { return double(r.counters.steps); }},
    {"rebuilds", [](const rve::Result &r) { return double(r.counters.rebuilds); }},
    {"reductions", [](const rve::Result &r) { return double(r.counters.lattice_reductions); }},
    {"repeats", [](const rve::Result &r) { return double(r.counters.repeats); }},
    {"status", [](const rve::Result &r) { return double(r.status); }},
};
// clang-format on

}    // namespace

struct ComputeRveAtom::Impl {
  std::vector<const Quantity *> quantities;
  std::string fix_id;    // empty: the only fix rve there is
  FixRve *fix = nullptr;
  int nmax = 0;
};

/* ---------------------------------------------------------------------- */

ComputeRveAtom::ComputeRveAtom(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), impl(std::make_unique<Impl>())
{
  impl->quantities =
      read_columns(lmp, "compute rve/atom", id, "quantity", QUANTITIES, 3, narg, arg, impl->fix_id);

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
