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
#include "memory.h"
#include "rve/engine/engine.h"
#include "rve_columns.h"
#include "update.h"

#include <cmath>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

// Strain of equations (26) and (27) from F: eps = (F + F^T)/2 - 1, in the sign of F (extension positive).
template <int D> double volumetric_strain(const rve::ResultOf<D> &r)
{
  return rve::trace(r.deformation) - D;
}

// n = 2
double deviatoric_strain(const rve::ResultOf<2> &r)
{
  const double half_difference = 0.5 * (r.deformation(0, 0) - r.deformation(1, 1));
  const double shear = 0.5 * (r.deformation(0, 1) + r.deformation(1, 0));
  return 2.0 * std::sqrt(half_difference * half_difference + shear * shear);
}

// n = 3: sqrt(2/3 e_ij e_ij)
double deviatoric_strain(const rve::ResultOf<3> &r)
{
  const rve::Tensor3 strain = 0.5 * (r.deformation + rve::transpose(r.deformation));
  const double mean = rve::trace(strain) / 3.0;
  double squares = 0.0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const double part = strain(a, b) - (a == b ? mean : 0.0);
      squares += part * part;
    }
  return std::sqrt(squares * 2.0 / 3.0);
}

// of the answer of an RVE, or of the RVE of a local atom
struct Quantity {
  const char *name;
  double (*of_disks)(const rve::ResultOf<2> &);
  double (*of_spheres)(const rve::ResultOf<3> &);
  double (FixRve::*of_atom)(int) const = nullptr;

  bool is_of(int dimension) const { return of_atom || of_disks || dimension == 3; }
  double value(const FixRve &fix, int i) const
  {
    if (of_atom) return (fix.*of_atom)(i);
    return fix.dimension() == 3 ? of_spheres(fix.result<3>(i)) : of_disks(fix.result<2>(i));
  }
};

template <class Of> constexpr Quantity of_both(const char *name, Of of)
{
  return {name, of, of};
}
constexpr Quantity of_spheres(const char *name, double (*of)(const rve::ResultOf<3> &))
{
  return {name, nullptr, of};
}

// clang-format off
constexpr Quantity QUANTITIES[] = {
    of_both("sxx", [](const auto &r) { return r.stress(0, 0); }),
    of_both("syy", [](const auto &r) { return r.stress(1, 1); }),
    of_both("sxy", [](const auto &r) { return r.stress(0, 1); }),
    of_both("syx", [](const auto &r) { return r.stress(1, 0); }),
    of_spheres("szz", [](const rve::ResultOf<3> &r) { return r.stress(2, 2); }),
    of_spheres("sxz", [](const rve::ResultOf<3> &r) { return r.stress(0, 2); }),
    of_spheres("szx", [](const rve::ResultOf<3> &r) { return r.stress(2, 0); }),
    of_spheres("syz", [](const rve::ResultOf<3> &r) { return r.stress(1, 2); }),
    of_spheres("szy", [](const rve::ResultOf<3> &r) { return r.stress(2, 1); }),
    of_both("p", [](const auto &r) { return r.mean_stress(); }),
    of_both("q", [](const auto &r) { return r.deviatoric_stress(); }),
    of_both("eps_v", [](const auto &r) { return volumetric_strain(r); }),
    of_both("eps_q", [](const auto &r) { return deviatoric_strain(r); }),
    of_both("void_ratio", [](const auto &r) { return r.void_ratio; }),
    of_both("coordination", [](const auto &r) { return r.coordination_number; }),
    of_both("coordination_mech", [](const auto &r) { return r.mechanical_coordination_number; }),
    of_both("fabric_xx", [](const auto &r) { return r.fabric(0, 0); }),
    of_both("fabric_yy", [](const auto &r) { return r.fabric(1, 1); }),
    of_both("fabric_xy", [](const auto &r) { return r.fabric(0, 1); }),
    of_spheres("fabric_zz", [](const rve::ResultOf<3> &r) { return r.fabric(2, 2); }),
    of_spheres("fabric_xz", [](const rve::ResultOf<3> &r) { return r.fabric(0, 2); }),
    of_spheres("fabric_yz", [](const rve::ResultOf<3> &r) { return r.fabric(1, 2); }),
    of_both("def_xx", [](const auto &r) { return r.deformation(0, 0); }),
    of_both("def_xy", [](const auto &r) { return r.deformation(0, 1); }),
    of_both("def_yx", [](const auto &r) { return r.deformation(1, 0); }),
    of_both("def_yy", [](const auto &r) { return r.deformation(1, 1); }),
    of_spheres("def_xz", [](const rve::ResultOf<3> &r) { return r.deformation(0, 2); }),
    of_spheres("def_yz", [](const rve::ResultOf<3> &r) { return r.deformation(1, 2); }),
    of_spheres("def_zx", [](const rve::ResultOf<3> &r) { return r.deformation(2, 0); }),
    of_spheres("def_zy", [](const rve::ResultOf<3> &r) { return r.deformation(2, 1); }),
    of_spheres("def_zz", [](const rve::ResultOf<3> &r) { return r.deformation(2, 2); }),
    of_both("cell_xx", [](const auto &r) { return r.cell(0, 0); }),
    of_both("cell_xy", [](const auto &r) { return r.cell(0, 1); }),
    of_both("cell_yx", [](const auto &r) { return r.cell(1, 0); }),
    of_both("cell_yy", [](const auto &r) { return r.cell(1, 1); }),
    of_spheres("cell_xz", [](const rve::ResultOf<3> &r) { return r.cell(0, 2); }),
    of_spheres("cell_yz", [](const rve::ResultOf<3> &r) { return r.cell(1, 2); }),
    of_spheres("cell_zx", [](const rve::ResultOf<3> &r) { return r.cell(2, 0); }),
    of_spheres("cell_zy", [](const rve::ResultOf<3> &r) { return r.cell(2, 1); }),
    of_spheres("cell_zz", [](const rve::ResultOf<3> &r) { return r.cell(2, 2); }),
    of_both("servo_xx", [](const auto &r) { return r.servo_velocity_gradient(0, 0); }),
    of_both("servo_yy", [](const auto &r) { return r.servo_velocity_gradient(1, 1); }),
    of_both("servo_xy", [](const auto &r) { return r.servo_velocity_gradient(0, 1); }),
    of_spheres("servo_zz", [](const rve::ResultOf<3> &r) { return r.servo_velocity_gradient(2, 2); }),
    of_spheres("servo_xz", [](const rve::ResultOf<3> &r) { return r.servo_velocity_gradient(0, 2); }),
    of_spheres("servo_yz", [](const rve::ResultOf<3> &r) { return r.servo_velocity_gradient(1, 2); }),
    {"servo_error", nullptr, nullptr, &FixRve::servo_error},
    {"path_stage", nullptr, nullptr, &FixRve::path_stage},
    {"path_time", nullptr, nullptr, &FixRve::path_time},
    {"path_cycles", nullptr, nullptr, &FixRve::path_cycles},
    {"path_ended", nullptr, nullptr, &FixRve::path_ended},
    {"inertial", nullptr, nullptr, &FixRve::inertial_number},
    of_both("sliding", [](const auto &r) { return r.sliding_fraction; }),
    of_both("unbalanced", [](const auto &r) { return r.unbalanced_ratio; }),
    of_both("kinetic", [](const auto &r) { return r.kinetic_energy; }),
    of_both("elastic", [](const auto &r) { return r.elastic_energy; }),
    of_both("work", [](const auto &r) { return r.energy.work; }),
    of_both("loss_friction", [](const auto &r) { return r.energy.friction; }),
    of_both("loss_damping", [](const auto &r) { return r.energy.local_damping; }),
    of_both("loss_viscous", [](const auto &r) { return r.energy.viscous; }),
    of_both("overlap", [](const auto &r) { return r.largest_overlap; }),
    of_both("overlap_mean", [](const auto &r) { return r.mean_overlap; }),
    of_both("force_max", [](const auto &r) { return r.largest_contact_force; }),
    of_both("grains", [](const auto &r) { return double(r.num_grains); }),
    of_both("contacts", [](const auto &r) { return double(r.num_contacts); }),
    of_both("pairs", [](const auto &r) { return double(r.num_pairs); }),
    of_both("rattlers", [](const auto &r) { return double(r.num_rattlers); }),
    of_both("substeps", [](const auto &r) { return double(r.counters.steps); }),
    of_both("rebuilds", [](const auto &r) { return double(r.counters.rebuilds); }),
    of_both("reductions", [](const auto &r) { return double(r.counters.lattice_reductions); }),
    of_both("repeats", [](const auto &r) { return double(r.counters.repeats); }),
    of_both("status", [](const auto &r) { return double(r.status); }),
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
