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

#include "compute_rve_contact_local.h"

#include "atom.h"
#include "error.h"
#include "group.h"
#include "lammps/rve_columns.h"
#include "rve/engine/contact_network.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

/// A contact in the RVE of an atom.
template <int D> struct Row {
  tagint atom;
  const rve::SpringContactOf<D> &contact;
};

using Quantity = ColumnOf<Row>;

template <class Of> Quantity of_both(const char *name, Of of)
{
  return {name, of, of};
}
Quantity of_spheres(const char *name, double (*of)(const Row<3> &))
{
  return {name, nullptr, of};
}

double size(double force)
{
  return force;
}
double size(const rve::Vec<double, 3> &force)
{
  return std::sqrt(rve::dot(force, force));
}

// clang-format off
const Quantity QUANTITIES[] = {
    of_both("atom", [](const auto &r) { return double(r.atom); }),
    of_both("id1", [](const auto &r) { return double(r.contact.geometry.first + 1); }),
    of_both("id2", [](const auto &r) { return double(r.contact.geometry.second + 1); }),
    of_both("image_x", [](const auto &r) { return double(r.contact.image[0]); }),
    of_both("image_y", [](const auto &r) { return double(r.contact.image[1]); }),
    of_spheres("image_z", [](const Row<3> &r) { return double(r.contact.image[2]); }),
    of_both("branch_x", [](const auto &r) { return r.contact.geometry.branch[0]; }),
    of_both("branch_y", [](const auto &r) { return r.contact.geometry.branch[1]; }),
    of_spheres("branch_z", [](const Row<3> &r) { return r.contact.geometry.branch[2]; }),
    of_both("normal_x", [](const auto &r) { return r.contact.geometry.normal[0]; }),
    of_both("normal_y", [](const auto &r) { return r.contact.geometry.normal[1]; }),
    of_spheres("normal_z", [](const Row<3> &r) { return r.contact.geometry.normal[2]; }),
    of_both("overlap", [](const auto &r) { return r.contact.geometry.overlap; }),
    of_both("fn", [](const auto &r) { return r.contact.normal_force; }),
    of_both("ft", [](const auto &r) { return size(r.contact.springs.tangential); }),
    of_spheres("ft_x", [](const Row<3> &r) { return r.contact.springs.tangential[0]; }),
    of_spheres("ft_y", [](const Row<3> &r) { return r.contact.springs.tangential[1]; }),
    of_spheres("ft_z", [](const Row<3> &r) { return r.contact.springs.tangential[2]; }),
    of_both("fr", [](const auto &r) { return size(r.contact.springs.rolling); }),
    of_spheres("fr_x", [](const Row<3> &r) { return r.contact.springs.rolling[0]; }),
    of_spheres("fr_y", [](const Row<3> &r) { return r.contact.springs.rolling[1]; }),
    of_spheres("fr_z", [](const Row<3> &r) { return r.contact.springs.rolling[2]; }),
    of_spheres("mt", [](const Row<3> &r) { return r.contact.springs.twisting; }),
    of_both("force_x", [](const auto &r) { return r.contact.force_on_first[0]; }),
    of_both("force_y", [](const auto &r) { return r.contact.force_on_first[1]; }),
    of_spheres("force_z", [](const Row<3> &r) { return r.contact.force_on_first[2]; }),
    of_both("mobilized", [](const auto &r) { return r.contact.mobilized_friction; }),
    of_both("sliding",
            [](const auto &r) { return double(r.contact.mobilized_friction >= rve::SLIDING); }),
};
// clang-format on

template <int D>
void add_rows(const rve::RveStateOf<D> &state, tagint atom,
              const std::vector<const Quantity *> &quantities, std::vector<double> &rows)
{
  for (const rve::SpringContactOf<D> &contact : rve::find_spring_contacts(state))
    for (const Quantity *quantity : quantities) rows.push_back(quantity->of(Row<D>{atom, contact}));
}

constexpr const char *STYLE = "compute rve/contact/local";

}    // namespace

struct ComputeRveContactLocal::Impl {
  std::vector<const Quantity *> quantities;
  std::string fix_id;    // empty for the only fix rve
  FixRve *fix = nullptr;
  ColumnValues values;
};

ComputeRveContactLocal::ComputeRveContactLocal(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), impl(std::make_unique<Impl>())
{
  impl->quantities =
      read_columns(lmp, STYLE, id, "quantity", QUANTITIES, 3, narg, arg, impl->fix_id);
  impl->values = ColumnValues(impl->quantities.size());
  local_flag = 1;
  size_local_rows = 0;
  size_local_cols = impl->values.num_columns();
}

ComputeRveContactLocal::~ComputeRveContactLocal() = default;

void ComputeRveContactLocal::init()
{
  impl->fix = fix_of_columns(lmp, STYLE, id, impl->fix_id, impl->quantities);
}

/// Rows are sorted by local atom, then by the first and the second grain of the contact.
void ComputeRveContactLocal::compute_local()
{
  invoked_local = update->ntimestep;
  std::vector<double> rows;
  int mine = 0, found;
  with_rves(*impl->fix, [&](const auto &rves) {
    for (int i = 0; i < atom->nlocal; i++) {
      if (!(atom->mask[i] & groupbit) || rves.slot[i] < 0) continue;
      mine = 1;
      add_rows(rves.state(i), atom->tag[i], impl->quantities, rows);
    }
  });
  MPI_Allreduce(&mine, &found, 1, MPI_INT, MPI_MAX, world);
  if (!found)
    error->all(FLERR,
               "compute rve/contact/local {}: no atom of group {} has an RVE of fix {}; use a "
               "group of atoms of that fix, for example: group look id 17",
               id, group->names[igroup], impl->fix->id);
  size_local_rows = static_cast<int>(rows.size() / impl->quantities.size());
  impl->values.resize(size_local_rows, vector_local, array_local);
  std::copy(rows.begin(), rows.end(), impl->values.row(0));
}

double ComputeRveContactLocal::memory_usage()
{
  return impl->values.bytes();
}
