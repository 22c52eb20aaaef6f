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
#include "comm.h"
#include "error.h"
#include "fix_rve.h"
#include "group.h"
#include "memory.h"
#include "rve/engine/contact_network.h"
#include "rve_columns.h"
#include "update.h"

#include <cstring>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

/// A contact in the RVE of an atom.
struct Row {
  tagint atom;
  const rve::SpringContact &contact;
};

struct Quantity {
  const char *name;
  double (*of)(const Row &);
};

// clang-format off
constexpr Quantity QUANTITIES[] = {
    {"atom", [](const Row &r) { return double(r.atom); }},
    {"id1", [](const Row &r) { return double(r.contact.geometry.first + 1); }},
    {"id2", [](const Row &r) { return double(r.contact.geometry.second + 1); }},
    {"image_x", [](const Row &r) { return double(r.contact.image[0]); }},
    {"image_y", [](const Row &r) { return double(r.contact.image[1]); }},
    {"branch_x", [](const Row &r) { return r.contact.geometry.branch[0]; }},
    {"branch_y", [](const Row &r) { return r.contact.geometry.branch[1]; }},
    {"normal_x", [](const Row &r) { return r.contact.geometry.normal[0]; }},
    {"normal_y", [](const Row &r) { return r.contact.geometry.normal[1]; }},
    {"overlap", [](const Row &r) { return r.contact.geometry.overlap; }},
    {"fn", [](const Row &r) { return r.contact.normal_force; }},
    {"ft", [](const Row &r) { return r.contact.springs.tangential; }},
    {"fr", [](const Row &r) { return r.contact.springs.rolling; }},
    {"force_x", [](const Row &r) { return r.contact.force_on_first[0]; }},
    {"force_y", [](const Row &r) { return r.contact.force_on_first[1]; }},
    {"mobilized", [](const Row &r) { return r.contact.mobilized_friction; }},
    {"sliding", [](const Row &r) { return r.contact.mobilized_friction >= rve::SLIDING ? 1.0 : 0.0; }},
};
// clang-format on

}    // namespace

struct ComputeRveContactLocal::Impl {
  std::vector<const Quantity *> quantities;
  std::string fix_id;    // empty: the only fix rve there is
  FixRve *fix = nullptr;
  int nmax = 0;
};

/* ---------------------------------------------------------------------- */

ComputeRveContactLocal::ComputeRveContactLocal(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), impl(std::make_unique<Impl>())
{
  impl->quantities = read_columns(lmp, "compute rve/contact/local", id, "quantity", QUANTITIES, 3,
                                  narg, arg, impl->fix_id);

  local_flag = 1;
  size_local_rows = 0;
  size_local_cols = impl->quantities.size() == 1 ? 0 : static_cast<int>(impl->quantities.size());
}

/* ---------------------------------------------------------------------- */

ComputeRveContactLocal::~ComputeRveContactLocal()
{
  memory->destroy(vector_local);
  memory->destroy(array_local);
}

/* ---------------------------------------------------------------------- */

void ComputeRveContactLocal::init()
{
  impl->fix = FixRve::find(lmp, impl->fix_id, std::string("compute rve/contact/local ") + id);
}

/* ----------------------------------------------------------------------
   rows in the order of the local atoms, and of their grains
------------------------------------------------------------------------- */

void ComputeRveContactLocal::compute_local()
{
  invoked_local = update->ntimestep;
  const int columns = static_cast<int>(impl->quantities.size());
  std::vector<double> rows;
  int mine = 0, found;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit) || impl->fix->slot(i) < 0) continue;
    mine = 1;
    for (const rve::SpringContact &contact : rve::find_spring_contacts(impl->fix->state<2>(i)))
      for (const Quantity *quantity : impl->quantities)
        rows.push_back(quantity->of({atom->tag[i], contact}));
  }
  MPI_Allreduce(&mine, &found, 1, MPI_INT, MPI_MAX, world);
  if (!found)
    error->all(
        FLERR,
        "compute rve/contact/local {}: no atom of group {} has an RVE of fix {}; choose atoms "
        "of its group, as in: group look id 17",
        id, group->names[igroup], impl->fix->id);

  size_local_rows = static_cast<int>(rows.size()) / columns;
  if (size_local_rows > impl->nmax) {
    impl->nmax = size_local_rows;
    memory->destroy(vector_local);
    memory->destroy(array_local);
    if (columns == 1)
      memory->create(vector_local, impl->nmax, "rve/contact/local:vector");
    else
      memory->create(array_local, impl->nmax, columns, "rve/contact/local:array");
  }
  if (size_local_rows)
    memcpy(columns == 1 ? vector_local : array_local[0], rows.data(), rows.size() * sizeof(double));
}

/* ---------------------------------------------------------------------- */

double ComputeRveContactLocal::memory_usage()
{
  return static_cast<double>(impl->nmax) * impl->quantities.size() * sizeof(double);
}
