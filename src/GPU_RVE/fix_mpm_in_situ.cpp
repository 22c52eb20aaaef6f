// SPDX-License-Identifier: GPL-2.0-only

#include "fix_mpm_water.h"

#include "lammps/mpm_communication.h"
#include "rve/core/error.h"
#include "rve/core/pi.h"
#include "rve/engine/finite_strain.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace LAMMPS_NS;

namespace {

// Default tolerances of the stress of RVEs [-]. ERROR_OF_WEIGHT is relative to the weight of a cell
// per area. ERROR_OF_STRESS is relative to the largest stress and applies if no weight is known.
// Stress errors within ERROR_OF_WEIGHT give a node an unbalanced force: each component is at most
// 2 D ERROR_OF_WEIGHT weights of a cell, even if all errors have the worst signs.
constexpr double ERROR_OF_WEIGHT = 1e-4, ERROR_OF_STRESS = 1e-5;

// Unbalanced force at rest above which a warning is printed [weight of a cell]
constexpr double UNBALANCED_WARN = 1e-3;

// A stress counts as beyond the strength of its law if the law changes it at zero strain by more
// than this ratio: norm of the change divided by norm of the stress [-].
constexpr double BEYOND_STRENGTH = 1e-6;

}    // namespace

/// Makes the profile of ground at rest from the values of the script at each new point. Ends with
/// an error if a value is out of range.
template <int D>
macro::GroundAtRest MpmGround<D>::at_rest(const Points &points, const Atoms &made) const
{
  const MpmInSitu<D> &in_situ = setup.settings.in_situ;
  const double width = setup.settings.width_of_point();
  std::vector<double> k0, surcharge, surface;
  if (!in_situ.is_at_rest) in_situ.k0.evaluate(lmp, setup.fix->igroup, k0);
  in_situ.surcharge.evaluate(lmp, setup.fix->igroup, surcharge);
  if (in_situ.surface) in_situ.surface->evaluate(lmp, setup.fix->igroup, surface);
  double top = -HUGE_VAL;
  for (const int i : made) top = std::max(top, atom->x[i][D - 1] + 0.5 * width);
  MPI_Allreduce(MPI_IN_PLACE, &top, 1, MPI_DOUBLE, MPI_MAX, world);

  const std::vector<double> density = densities(points, made);    // finds the water, too
  macro::GroundAtRest::Points given;
  given.finds_k0 = in_situ.is_at_rest;
  CollectiveError wrong_k0, without_grains;
  for (const int i : made) {
    given.height.push_back(atom->x[i][D - 1]);
    given.surface.push_back(in_situ.surface ? surface[i] : top);
    given.surcharge.push_back(surcharge[i]);
    if (water.exists()) given.pore_pressure.push_back(water.pressure_at_start(i));
    if (in_situ.is_at_rest) {
      if (!setup.grains[points.model[i]]) without_grains.add(atom->tag[i], {});
      continue;
    }
    given.k0.push_back(k0[i]);
    if (!(k0[i] > 0.0 && std::isfinite(k0[i]))) wrong_k0.add(atom->tag[i], {k0[i], 0.0, 0.0});
  }
  without_grains.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &) {
    return fmt::format("fix mpm {}: insitu: k0 rest takes k0 from RVEs, but atom {} has no RVE; "
                       "give k0 as a number (atoms without an RVE: {})",
                       setup.fix->id, id, all);
  });
  wrong_k0.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format("fix mpm {}: insitu: k0 of atom {} is {} [-]; it must be greater than 0 "
                       "(atoms with an invalid value: {})",
                       setup.fix->id, id, rve::number(at[0]), all);
  });
  macro::GroundAtRest ground(in_situ.gravity, width, D - 1, given, density,
                             mpm_communication(lmp, setup.settings.name()));
  CollectiveError tension;
  for (std::size_t n = 0; n < made.size(); n++) {
    const double pressure = ground.vertical_pressure(n);
    if (!(pressure > 0.0 && std::isfinite(pressure)))
      tension.add(atom->tag[made[n]], {pressure, given.height[n], given.surface[n]});
  }
  const char *const kind = water.exists() ? "effective vertical pressure" : "vertical pressure";
  tension.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format("fix mpm {}: insitu: the {} of atom {} is {} [stress] at the "
                       "height {} [length], under a surface at {} [length]; it must be greater "
                       "than 0 (atoms with an invalid value: {})",
                       setup.fix->id, kind, id, rve::number(at[0]), rve::number(at[1]),
                       rve::number(at[2]), all);
  });
  return ground;
}

template <int D> double MpmGround<D>::density_of_weight(const Points &points, int i) const
{
  return setup.density_of(points, i) + water.density_at_start(i) - water.buoyancy_at_start(i);
}

template <int D>
std::vector<double> MpmGround<D>::densities(const Points &points, const Atoms &made) const
{
  water.find_porosities(points, made);    // RVEs may have another porosity now
  std::vector<double> values;
  for (const int i : made) values.push_back(density_of_weight(points, i));
  return values;
}

/// Returns the profile of the density over height. At each level it has the mean density of the
/// points there whose density comes from their RVEs.
template <int D>
macro::HeightProfile MpmGround<D>::density_of_grains(const Points &points, const Atoms &made,
                                                     const macro::GroundAtRest &ground) const
{
  const auto &models = setup.settings.models;
  const auto is_given = [&](const auto &some) { return setup.settings.density_of(some) > 0.0; };
  if (std::none_of(models.begin(), models.end(), is_given)) return ground.density();
  std::vector<double> height, value;
  for (const int i : made) {
    if (setup.given_density(points, i) > 0.0) continue;
    height.push_back(atom->x[i][D - 1]);
    value.push_back(density_of_weight(points, i));
  }
  bigint total = height.size();
  MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  if (total == 0) return ground.density();
  return macro::level_means(height, value, setup.settings.width_of_point(),
                            mpm_communication(lmp, setup.settings.name()));
}

/// Returns the ratio of lateral to vertical stress of the points `made` [-]. All of them must have
/// RVEs.
template <int D>
std::vector<double> MpmGround<D>::stress_ratios(const Points &points, const Atoms &made) const
{
  std::vector<double> values;
  for (const int i : made) {
    const Tensor sigma = stress_of<D>(*setup.grains[points.model[i]], i);
    const double vertical = sigma(D - 1, D - 1);
    values.push_back(std::max(0.0, (trace(sigma) - vertical) / ((D - 1) * vertical)));
  }
  return values;
}

template <int D> auto MpmGround<D>::goals_by_components(const Atoms &made) const -> Goals
{
  const std::vector<ScriptValue> &components = setup.settings.in_situ.components;
  std::vector<std::vector<double>> values(components.size());
  for (std::size_t c = 0; c < values.size(); c++)
    components[c].evaluate(lmp, setup.fix->igroup, values[c]);
  Goals goals;
  CollectiveError wrong;
  for (const int i : made) {
    Tensor sigma = Tensor::zero();
    int c = D;
    for (int a = 0; a < D; a++) {
      sigma(a, a) = values[a][i];
      for (int b = a + 1; b < D; b++) sigma(a, b) = sigma(b, a) = values[c++][i];
    }
    if (!rve::finite(sigma)) wrong.add(atom->tag[i], {sigma(0, 0), sigma(1, 1), sigma(0, 1)});
    goals.push_back(macro::StressGoal::of<D>(sigma));
    if (!setup.settings.options.axisymmetric) continue;
    goals.back().stress(2, 2) = sigma(0, 0);    // lateral stresses are equal
    goals.back().steered[2][2] = true;
  }
  wrong.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format(
        "fix mpm {}: insitu: the stress of atom {} has sxx {}, syy {}, sxy {} [stress]; all "
        "components must be finite numbers (atoms with an invalid value: {})",
        setup.fix->id, id, at[0], at[1], at[2], all);
  });
  return goals;
}

/// Brings the RVEs of the points `made` to the stresses `goals`. Returns the largest number of DEM
/// steps and the largest error of all RVEs on all ranks.
template <int D>
macro::InSituReport MpmGround<D>::bring_grains(const Points &points, const Atoms &made,
                                               const Goals &goals, double tolerance) const
{
  macro::InSituReport all;
  for (FixRve *source : setup.sources()) {
    std::vector<int> atoms;
    Goals of_atoms;
    for (std::size_t n = 0; n < made.size(); n++)
      if (setup.grains[points.model[made[n]]] == source) {
        atoms.push_back(made[n]);
        of_atoms.push_back(goals[n]);
      }
    const macro::InSituReport some = source->rves().bring_to_stress(atoms, of_atoms, tolerance);
    all.most_steps = std::max(all.most_steps, some.most_steps);
    all.largest_error = std::max(all.largest_error, some.largest_error);
  }
  MPI_Allreduce(MPI_IN_PLACE, &all.most_steps, 1, MPI_INT64_T, MPI_MAX, world);
  MPI_Allreduce(MPI_IN_PLACE, &all.largest_error, 1, MPI_DOUBLE, MPI_MAX, world);
  return all;
}

template <int D> auto MpmGround<D>::find(const Points &points, const Atoms &made) -> Starts
{
  bigint total = made.size();
  MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  if (total == 0) return {};
  const Starts starts = setup.settings.in_situ.is_by_components() ? find_by_components(points, made)
                                                                  : find_at_rest(points, made);
  is_new = true;
  // only at the start of a run: otherwise each step in which a fix creates points would log a line
  if (comm->me == 0 && update->ntimestep == update->firststep)
    utils::logmesg(lmp, "fix mpm {}: {} points start with their in-situ stress\n", setup.fix->id,
                   total);
  return starts;
}

/// Returns the stress of the RVE of a point, or the stress of `goal` if the point has no RVE.
template <int D>
mpm::Tensor<D> MpmGround<D>::stress_at(const Points &points, int i,
                                       const macro::StressGoal &goal) const
{
  const FixRve *source = setup.grains[points.model[i]];
  return source ? stress_of<D>(*source, i) : rve::leading_components<D>(goal.stress);
}

template <int D>
auto MpmGround<D>::find_by_components(const Points &points, const Atoms &made) -> Starts
{
  const Goals goals = goals_by_components(made);
  double largest = 0.0;
  for (const macro::StressGoal &goal : goals)
    for (const double x : goal.stress.component) largest = std::max(largest, std::fabs(x));
  MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, world);
  const double tolerance = setup.settings.in_situ.tolerance.value_or(ERROR_OF_STRESS * largest);
  const macro::InSituReport report = bring_grains(points, made, goals, tolerance);
  const std::vector<double> density = densities(points, made);
  Starts starts;
  for (std::size_t n = 0; n < made.size(); n++)
    starts.push_back(
        {stress_at(points, made[n], goals[n]), density[n] + water.buoyancy_at_start(made[n]), {}});
  weight_of_cell = 0.0;
  report_grains(report, 1);
  return starts;
}

template <int D> auto MpmGround<D>::find_at_rest(const Points &points, const Atoms &made) -> Starts
{
  const MpmInSitu<D> &in_situ = setup.settings.in_situ;
  const double h = setup.solver->grid().cell_size();
  macro::GroundAtRest ground = at_rest(points, made);
  const double tolerance =
      in_situ.tolerance.value_or(ERROR_OF_WEIGHT * ground.density().value(0) * in_situ.gravity * h);
  macro::InSituReport report;
  if (setup.has_grains()) {
    setup.guarded([&] {
      do report.take(bring_grains(points, made, ground.goals(), tolerance));
      while (!ground.settles(densities(points, made),
                             in_situ.is_at_rest ? stress_ratios(points, made)
                                                : std::vector<double>()));
    });
  }
  const macro::HeightProfile of_grains = density_of_grains(points, made, ground);
  Starts starts;
  for (std::size_t n = 0; n < made.size(); n++) {
    const int i = made[n];
    const macro::StressGoal goal = ground.goal(n);
    // without a density of the script, the point gets the density whose weight the stress balances
    const double given = setup.given_density(points, i);
    const double density = given > 0.0
        ? given + water.density_at_start(i)
        : of_grains.at(atom->x[i][D - 1]) + water.buoyancy_at_start(i);
    starts.push_back({stress_at(points, i, goal), density, {}});
    // the stress out of the plane is a lateral stress
    if (D == 2 && !setup.grains[points.model[i]]) starts.back().across_plane = goal.stress(2, 2);
  }
  weight_of_cell = in_situ.gravity * ground.density().value(0) * cell_volume();
  report_grains(report, ground.rounds());
  if (const auto &k0 = ground.found_k0(); k0 && comm->me == 0)
    utils::logmesg(lmp,
                   "fix mpm {}: k0 of the RVEs at rest is {:.4f} to {:.4f}, as mean over a level\n",
                   setup.fix->id, k0->least(), k0->most());
  return starts;
}

template <int D>
void MpmGround<D>::report_grains(const macro::InSituReport &report, int rounds) const
{
  // only at the start of a run: otherwise each step in which a fix creates points would log a line
  if (!setup.has_grains() || comm->me != 0 || update->ntimestep != update->firststep) return;
  utils::logmesg(
      lmp,
      "fix mpm {}: RVEs needed at most {} DEM steps to their in-situ stress, in {} iterations of "
      "weight and density; the largest error of a component is {:.3g} [stress]\n",
      setup.fix->id, report.most_steps, rounds, report.largest_error);
}

template <int D> double MpmGround<D>::cell_volume() const
{
  const mpm::SolverOptions<D> &options = setup.settings.options;
  const double h = options.cell_size;
  if (options.axisymmetric) return 2.0 * rve::kPi * options.hi[0] * h * h;
  return options.thickness * (D == 2 ? h * h : h * h * h);
}

template <int D> void MpmGround<D>::check_strength(const Points &points, const Atoms &made)
{
  const MpmSettings<D> &settings = setup.settings;
  std::vector<Tensor> after(points.stress, points.stress + points.count);
  std::vector<double> remembered(points.memory,
                                 points.memory + (std::size_t) points.count * points.memory_width);
  const std::vector<Tensor> none(points.count, Tensor::identity());
  const std::vector<double> no_hoop(points.count, 1.0);
  std::vector<double> hoop_after;
  if constexpr (D == 2) hoop_after.assign(points.hoop_stress, points.hoop_stress + points.count);
  bigint beyond = 0;
  tagint lowest = MAXTAGINT;
  for (std::size_t k = 0; k < settings.models.size(); k++) {
    if (!settings.models[k].law) continue;
    std::vector<int> some;
    for (const int i : made)
      if (points.model[i] == (int) k) some.push_back(i);
    if (some.empty()) continue;
    std::sort(some.begin(), some.end());
    settings.models[k].law->set_hoop({no_hoop.data(), hoop_after.data()});
    settings.models[k].law->update((int) some.size(), some.data(), none.data(), update->dt,
                                   after.data(), {remembered.data(), points.memory_width});
    for (const int i : some) {
      const Tensor &before = points.stress[i];
      if (!(rve::norm(after[i] - before) > BEYOND_STRENGTH * rve::norm(before))) continue;
      beyond++;
      lowest = std::min(lowest, atom->tag[i]);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &beyond, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, world);
  if (update->ntimestep == update->firststep) warned_strength = false;
  if (beyond > 0 && !std::exchange(warned_strength, true) && comm->me == 0)
    error->warning(FLERR,
                   "fix mpm {}: the {} of {} points exceeds the strength of their law (atom {}, "
                   "for example), so that they yield in the first step; use {}, or more strength",
                   setup.fix->id, settings.in_situ.given ? "in-situ stress" : "initial stress",
                   beyond, lowest,
                   settings.in_situ.given ? "a k0 between the active and the passive limit"
                                          : "normal stresses with a smaller difference");
}

template <int D> void MpmGround<D>::report(const Points &points)
{
  if (!is_new) return;
  is_new = false;
  // if the script gives no gravity, the weight follows from the forces on points
  double by_forces = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    double squares = 0.0;
    for (int a = 0; a < D; a++) squares += atom->f[i][a] * atom->f[i][a];
    if (points.rigid_body[i] < 0)
      by_forces = std::max(by_forces, std::sqrt(squares) / points.volume[i]);
  }
  MPI_Allreduce(MPI_IN_PLACE, &by_forces, 1, MPI_DOUBLE, MPI_MAX, world);
  by_forces *= cell_volume();
  const double weight = weight_of_cell > 0.0 ? weight_of_cell : by_forces;
  const double unbalanced = setup.solver->max_unbalanced_force();
  if (comm->me != 0) return;
  if (!(weight > 0.0)) {
    utils::logmesg(
        lmp,
        "fix mpm {}: the largest unbalanced nodal force of the in-situ state is {:.3g} [force]\n",
        setup.fix->id, unbalanced);
    return;
  }
  const double share = unbalanced / weight;
  const std::string text = fmt::format(
      "the largest unbalanced nodal force of the in-situ state is {:.3g} of the weight of a cell",
      share);
  if (share <= UNBALANCED_WARN) {
    utils::logmesg(lmp, "fix mpm {}: {}\n", setup.fix->id, text);
    return;
  }
  error->warning(FLERR, "fix mpm {}: {}, above {:g}, so that the ground will move. {}",
                 setup.fix->id, text, UNBALANCED_WARN,
                 by_forces == 0.0
                     ? "No force acts on the points: define fix gravity before this fix"
                     : "Gravity, surcharge, tractions, boundaries and the surface must be those of "
                       "insitu. Under a surface that is not level, run with damping until the "
                       "ground is in equilibrium");
}

template class LAMMPS_NS::MpmGround<2>;
template class LAMMPS_NS::MpmGround<3>;
