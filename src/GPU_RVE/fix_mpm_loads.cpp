// SPDX-License-Identifier: GPL-2.0-only

#include "fix_mpm_jobs.h"

#include "lammps/state_readers.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "group.h"
#include "modify.h"
#include "region.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

template <int D>
mpm::TractionLoad<D> MpmLoads<D>::load_of(const MpmTraction<D> &traction,
                                          const Points &points) const
{
  mpm::TractionLoad<D> load;
  load.face = traction.face;
  load.follows = traction.is_pressure;
  const auto as_vector = [&load](const Vec &given) {
    if (!load.follows) return given;
    Vec of_pressure = Vec::zero();
    of_pressure[mpm::axis_of(load.face)] = -mpm::outward(load.face) * given[0];
    return of_pressure;
  };
  const bool varies = std::any_of(traction.traction, traction.traction + D,
                                  [](const ScriptValue &value) { return value.per_atom; });
  std::vector<double> of_atoms[D];
  Vec given = Vec::zero();
  // per-atom variables are evaluated only for the atoms of the group of the load
  const int igroup = traction.groupbit ? group->find(traction.id) : setup.fix->igroup;
  for (int a = 0; a < D; a++)
    if (varies)
      traction.traction[a].evaluate(lmp, igroup, of_atoms[a]);
    else
      given[a] = traction.traction[a].evaluate(lmp);
  load.traction = as_vector(given);
  Region *region = traction.groupbit ? nullptr : domain->get_region_by_id(traction.id);
  if (region) region->prematch();
  for (int i = 0; i < atom->nlocal; i++) {
    const double *x = atom->x[i];
    if (region ? points.rigid_body[i] < 0 && region->match(x[0], x[1], x[2])
               : atom->mask[i] & traction.groupbit)
      load.point_index.push_back(i);
  }
  for (const int i : load.point_index) {
    if (!varies) break;
    for (int a = 0; a < D; a++) given[a] = of_atoms[a][i];
    load.of_point.push_back(as_vector(given));
  }
  return load;
}

template <int D> void MpmLoads<D>::warn_of_empty_regions() const
{
  for (std::size_t k = 0; k < loads.size(); k++) {
    const MpmTraction<D> &traction = setup.settings.tractions[k];
    if (traction.groupbit) continue;
    bigint loaded = loads[k].point_index.size();
    MPI_Allreduce(MPI_IN_PLACE, &loaded, 1, MPI_LMP_BIGINT, MPI_SUM, world);
    if (loaded == 0 && comm->me == 0)
      error->warning(FLERR,
                     "fix mpm {}: region {} of a {} contains no deformable points at step {}, so "
                     "that the {} has no effect",
                     setup.fix->id, traction.id, traction.keyword(), update->ntimestep,
                     traction.keyword());
  }
}

template <int D> void MpmLoads<D>::move_bodies(bool advance)
{
  mpm::MpmSolver<D> &solver = *setup.solver;
  for (std::size_t b = 0; b < displacement.size(); b++) {
    const MpmRigidBody<D> &body = setup.settings.bodies[b];
    double rates[mpm::FREEDOMS<D>];
    for (int k = 0; k < mpm::FREEDOMS<D>; k++) rates[k] = body.rates[k].evaluate(lmp);
    for (int a = 0; a < D; a++) speed = std::max(speed, std::fabs(rates[a]));
    if (!body.friction.variable.empty())
      solver.set_body_friction((int) b, body.friction.evaluate(lmp));
    if (solver.rigid_bodies().can_turn((int) b)) {
      solver.rigid_bodies().set_rates((int) b, rates);
      continue;
    }
    Vec velocity;
    std::copy_n(rates, D, velocity.component);
    solver.set_body_velocity((int) b, velocity);
    if (advance) displacement[b] = displacement[b] + update->dt * velocity;
  }
}

template <int D> void MpmLoads<D>::solve(const Points &points, bool advance)
{
  modify->clearstep_compute();
  speed = 0.0;
  loads.clear();
  for (const MpmTraction<D> &traction : setup.settings.tractions)
    loads.push_back(load_of(traction, points));
  if (!advance) warn_of_empty_regions();
  setup.guarded([&] {
    move_bodies(advance);
    modify->addstep_compute(update->ntimestep + 1);
    if (!advance) {
      setup.solver->evaluate(points, loads, update->dt);
      return;
    }
    setup.solver->step(points, loads, update->dt);
    for (const int b : setup.turning)
      for (int a = 0; a < D; a++)
        displacement[b][a] += update->dt * setup.solver->rigid_bodies().rates(b)[a];
  });
}

template <int D> bool MpmLoads<D>::reads_results() const
{
  const auto reads = [&](const ScriptValue &value) {
    return !value.variable.empty() && may_read_results(lmp, value.variable);
  };
  for (const MpmRigidBody<D> &body : setup.settings.bodies)
    if (reads(body.friction) || std::any_of(std::begin(body.rates), std::end(body.rates), reads))
      return true;
  for (const MpmTraction<D> &load : setup.settings.tractions) {
    if (std::any_of(load.traction, load.traction + D, reads)) return true;
    // a region moves or changes its shape by variables
    const Region *region = load.groupbit ? nullptr : domain->get_region_by_id(load.id);
    if (region && (region->dynamic || region->varshape)) return true;
  }
  return false;
}

template class LAMMPS_NS::MpmLoads<2>;
template class LAMMPS_NS::MpmLoads<3>;
