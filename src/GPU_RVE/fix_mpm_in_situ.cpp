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

// The stress in which fix mpm finds ground: asked of all points that are made together, and what is out of balance then.

#include "fix_mpm_impl.h"

#include "collective_error.h"
#include "rve/core/error.h"
#include "rve/core/exact_sum.h"
#include "rve/engine/finite_strain.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "group.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <optional>

using namespace LAMMPS_NS;

namespace {

// Largest error of the stress of RVEs, unless the script says otherwise: nodes between points that all err by it towards them get four
// times as much, in weights of a cell; or, where no weight is known, of the largest stress.
constexpr double ERROR_OF_WEIGHT = 1e-4, ERROR_OF_STRESS = 1e-5;

// Rounds of stress and density: RVEs under more stress are denser, and weigh more.
constexpr int MOST_ROUNDS = 10;
constexpr double DENSITY_CHANGE = 1e-4;

// What may be out of balance at rest [weight of a cell]
constexpr double UNBALANCED_WARN = 1e-3;

// Change of the stress by a law at no strain, over its size, that tells of a stress beyond its strength.
constexpr double BEYOND_STRENGTH = 1e-6;

constexpr double MOST_LEVELS = 1e7;

std::string k0_in_words(const macro::HeightProfile &k0)
{
  double least = k0.value(0), most = least;
  for (int level = 0; level < k0.count(); level++) {
    least = std::min(least, k0.value(level));
    most = std::max(most, k0.value(level));
  }
  return fmt::format("at rest they have k0 from {:.4f} to {:.4f}, in the mean of a level", least,
                     most);
}

}    // namespace

/* ----------------------------------------------------------------------
   means over levels as thick as a point is wide, of one positive value for each new point: sums of integers do not show ranks
------------------------------------------------------------------------- */

template <int D>
macro::HeightProfile FixMpm::ImplOf<D>::profile(const std::vector<int> &made,
                                                const std::vector<double> &values) const
{
  double extremes[3] = {-HUGE_VAL, -HUGE_VAL, 0.0};    // of -height, of height, of the values
  for (std::size_t n = 0; n < made.size(); n++) {
    const double height = atom->x[made[n]][D - 1];
    extremes[0] = std::max(extremes[0], -height);
    extremes[1] = std::max(extremes[1], height);
    extremes[2] = std::max(extremes[2], values[n]);
  }
  MPI_Allreduce(MPI_IN_PLACE, extremes, 3, MPI_DOUBLE, MPI_MAX, world);
  const double width = settings.width_of_point(), lowest = -extremes[0];
  const double levels = std::round((extremes[1] - lowest) / width) + 1.0;
  if (!(levels <= MOST_LEVELS))
    error->all(FLERR,
               "Fix mpm insitu: heights of points are from {} to {} [length], which are more than "
               "{} levels of the width of a point, {}",
               lowest, extremes[1], MOST_LEVELS, width);
  const auto count = (std::size_t) levels;
  std::vector<std::int64_t> sums(2 * count, 0);    // of values, and numbers of points
  bigint points = made.size();
  MPI_Allreduce(MPI_IN_PLACE, &points, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  const rve::FixedScale scale(extremes[2], points);
  for (std::size_t n = 0; n < made.size(); n++) {
    const auto level = (std::size_t) std::round((atom->x[made[n]][D - 1] - lowest) / width);
    sums[level] += scale.integer(values[n]);
    sums[count + level]++;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), (int) sums.size(), MPI_INT64_T, MPI_SUM, world);
  std::vector<double> means(count, 0.0);
  for (std::size_t k = 0; k < count; k++)
    if (sums[count + k] > 0) means[k] = scale.real(sums[k]) / (double) sums[count + k];
  return {lowest - 0.5 * width, width, means};
}

template <int D>
macro::HeightProfile FixMpm::ImplOf<D>::density_profile(const std::vector<int> &made) const
{
  std::vector<double> densities;
  for (const int i : made)
    densities.push_back(settings.density > 0.0 ? settings.density
                                               : grains[model[i]]->bulk_density(i));
  return profile(made, densities);
}

/// Lateral over vertical stress, as the grains of a level have found it without lateral strain.
template <int D>
macro::HeightProfile FixMpm::ImplOf<D>::k0_profile(const std::vector<int> &made) const
{
  std::vector<double> ratios;
  for (const int i : made) {
    const Tensor sigma = stress_of<D>(*grains[model[i]], i);
    const double vertical = sigma(D - 1, D - 1);
    ratios.push_back(std::max(0.0, (trace(sigma) - vertical) / ((D - 1) * vertical)));
  }
  return profile(made, ratios);
}

/* ---------------------------------------------------------------------- */

template <int D>
std::vector<macro::StressGoal>
FixMpm::ImplOf<D>::stresses_at_rest(const std::vector<int> &made,
                                    const macro::HeightProfile &ground,
                                    const macro::HeightProfile *k0_at_rest)
{
  const MpmInSitu<D> &in_situ = settings.in_situ;
  const bool finds_k0 = in_situ.is_at_rest && !k0_at_rest;
  std::vector<double> k0, surcharge, surface;
  if (!in_situ.is_at_rest) in_situ.k0.evaluate(lmp, fix->igroup, k0);
  in_situ.surcharge.evaluate(lmp, fix->igroup, surcharge);
  double top = -HUGE_VAL;    // of all new points
  if (in_situ.surface) {
    in_situ.surface->evaluate(lmp, fix->igroup, surface);
  } else {
    for (const int i : made) top = std::max(top, atom->x[i][D - 1]);
    MPI_Allreduce(MPI_IN_PLACE, &top, 1, MPI_DOUBLE, MPI_MAX, world);
    top += 0.5 * settings.width_of_point();
  }
  std::vector<macro::StressGoal> goals;
  CollectiveError wrong_k0, tension, without_grains;
  for (const int i : made) {
    if (in_situ.is_at_rest && !grains[model[i]]) without_grains.add(atom->tag[i], {});
    const double height = in_situ.surface ? surface[i] : top;
    const double pressure =
        surcharge[i] + in_situ.gravity * ground.between(atom->x[i][D - 1], height);
    const double ratio = finds_k0 ? 1.0
        : in_situ.is_at_rest      ? k0_at_rest->at(atom->x[i][D - 1])
                                  : k0[i];
    if (!(ratio > 0.0 && std::isfinite(ratio))) wrong_k0.add(atom->tag[i], {ratio, 0.0, 0.0});
    if (!(pressure > 0.0 && std::isfinite(pressure)))
      tension.add(atom->tag[i], {pressure, atom->x[i][D - 1], height});
    goals.push_back(macro::StressGoal::at_rest(D - 1, -pressure, ratio, !finds_k0));
  }
  without_grains.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &) {
    return fmt::format(
        "Fix mpm insitu: k0 rest is what the grains of RVEs find, and atom {} has no "
        "RVE; give k0 as a number (atoms without: {})",
        id, all);
  });
  wrong_k0.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format("Fix mpm insitu: k0 of atom {} is {} [-]; it must be greater than 0 (atoms "
                       "with another one: {})",
                       id, rve::number(at[0]), all);
  });
  tension.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format("Fix mpm insitu: the vertical pressure of atom {} is {} [stress], at the "
                       "height {} under a surface at {} [length]; it must be greater than 0 (atoms "
                       "with another one: {})",
                       id, rve::number(at[0]), rve::number(at[1]), rve::number(at[2]), all);
  });
  return goals;
}

template <int D>
std::vector<macro::StressGoal>
FixMpm::ImplOf<D>::stresses_by_components(const std::vector<int> &made)
{
  std::vector<std::vector<double>> values(settings.in_situ.components.size());
  for (std::size_t c = 0; c < values.size(); c++)
    settings.in_situ.components[c].evaluate(lmp, fix->igroup, values[c]);
  std::vector<macro::StressGoal> goals;
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
  }
  wrong.raise_if_any(lmp, [&](bigint all, tagint id, const CollectiveError::Values &at) {
    return fmt::format("Fix mpm insitu: the stress of atom {} has sxx {}, syy {}, sxy {} [stress]; "
                       "all components must be finite numbers (atoms with others: {})",
                       id, at[0], at[1], at[2], all);
  });
  return goals;
}

/* ----------------------------------------------------------------------
   what the RVEs of each fix need, over all ranks
------------------------------------------------------------------------- */

template <int D>
macro::InSituReport FixMpm::ImplOf<D>::bring_grains(const std::vector<int> &made,
                                                    const std::vector<macro::StressGoal> &goals,
                                                    double tolerance)
{
  macro::InSituReport all;
  all.fewest_steps = MAXBIGINT;
  for (std::size_t k = 0; k < grains.size(); k++) {
    // groups may share a fix
    if (!grains[k] ||
        std::find(grains.begin(), grains.begin() + k, grains[k]) != grains.begin() + k)
      continue;
    std::vector<int> atoms;
    std::vector<macro::StressGoal> of_atoms;
    for (std::size_t n = 0; n < made.size(); n++)
      if (grains[model[made[n]]] == grains[k]) {
        atoms.push_back(made[n]);
        of_atoms.push_back(goals[n]);
      }
    if (atoms.empty()) continue;
    const macro::InSituReport report = grains[k]->bring_to_stress(atoms, of_atoms, tolerance);
    all.fewest_steps = std::min(all.fewest_steps, report.fewest_steps);
    all.most_steps = std::max(all.most_steps, report.most_steps);
    all.largest_error = std::max(all.largest_error, report.largest_error);
  }
  MPI_Allreduce(MPI_IN_PLACE, &all.fewest_steps, 1, MPI_INT64_T, MPI_MIN, world);
  MPI_Allreduce(MPI_IN_PLACE, &all.most_steps, 1, MPI_INT64_T, MPI_MAX, world);
  MPI_Allreduce(MPI_IN_PLACE, &all.largest_error, 1, MPI_DOUBLE, MPI_MAX, world);
  return all;
}

/* ----------------------------------------------------------------------
   stress, mass and memory of new points; collective
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::begin_in_situ(const std::vector<int> &made)
{
  bigint total = made.size();
  MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  if (total == 0) return;
  const MpmInSitu<D> &in_situ = settings.in_situ;
  const double h = solver->grid().cell_size();
  const double cell = settings.options.thickness * (D == 2 ? h * h : h * h * h);
  macro::HeightProfile ground = density_profile(made);
  double tolerance =
      in_situ.tolerance.value_or(ERROR_OF_WEIGHT * ground.value(0) * in_situ.gravity * h);
  std::vector<macro::StressGoal> goals;
  macro::InSituReport report;
  std::optional<macro::HeightProfile> k0_at_rest;
  bool has_settled = false;
  double change = 0.0;
  bigint most_steps = 0;
  int rounds = 0;
  while (rounds < MOST_ROUNDS && !has_settled) {
    rounds++;
    goals = in_situ.is_by_components()
        ? stresses_by_components(made)
        : stresses_at_rest(made, ground, k0_at_rest ? &*k0_at_rest : nullptr);
    if (in_situ.is_by_components() && !in_situ.tolerance) {
      double largest = 0.0;
      for (const macro::StressGoal &goal : goals)
        for (const double x : goal.stress.component) largest = std::max(largest, std::fabs(x));
      MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, world);
      tolerance = ERROR_OF_STRESS * largest;
    }
    has_settled = true;
    if (!has_grains()) break;
    report = bring_grains(made, goals, tolerance);
    most_steps += report.most_steps;
    // the first round is without lateral strain; packings differ, and level ground has one lateral stress in a level
    const bool found_k0 = in_situ.is_at_rest && !k0_at_rest;
    if (found_k0) k0_at_rest = k0_profile(made);
    if (found_k0) has_settled = false;
    if (in_situ.is_by_components() || (settings.density > 0.0 && has_settled)) break;
    const macro::HeightProfile denser = density_profile(made);
    change = ground.change_to(denser);
    has_settled = has_settled && change <= DENSITY_CHANGE;
    // at the end the density is the one that the stress balances
    if (!has_settled) ground = denser;
  }
  if (!has_settled)
    error->all(FLERR,
               "Fix mpm insitu: density and stress of the RVEs do not settle: after {} rounds the "
               "density of a level still changes by {:.2g}",
               MOST_ROUNDS, change);

  for (std::size_t n = 0; n < made.size(); n++) {
    const int i = made[n];
    const FixRve *source = grains[model[i]];
    const macro::StressGoal &goal = goals[n];
    stress[i] = source ? stress_of<D>(*source, i) : rve::leading_components<D>(goal.stress);
    if (!(settings.density > 0.0)) {
      const double height = atom->x[i][D - 1];
      mass[i] = (in_situ.is_by_components() ? source->bulk_density(i) : ground.at(height)) *
          settings.initial_volume;
    }
    begin_memory(i);
    // the stress across the plane is a lateral one too
    const int place = D == 2 && !in_situ.is_by_components() && !source
        ? layout.place((int) remembering[i], "out_of_plane_stress")
        : -1;
    if (place >= 0) memory_of(i)[place] = goal.stress(2, 2);
  }
  check_strength(made);
  is_in_situ = true;
  weight_of_cell = in_situ.gravity * ground.value(0) * cell;
  if (comm->me != 0) return;
  std::string of_grains;
  if (has_grains())
    of_grains =
        fmt::format("; RVEs took up to {} DEM steps to their stress, in {} rounds of weight and "
                    "density; the largest error of a component is {:.3g} [stress]",
                    most_steps, rounds, report.largest_error);
  if (k0_at_rest) of_grains += "; " + k0_in_words(*k0_at_rest);
  utils::logmesg(lmp, "fix mpm {}: {} points in situ{}\n", fix->id, total, of_grains);
}

/* ----------------------------------------------------------------------
   a law that changes a stress at no strain does not bear it
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::check_strength(const std::vector<int> &made)
{
  std::vector<Tensor> after = stress;
  std::vector<double> remembered = rows;
  const std::vector<Tensor> none(stress.size(), Tensor::identity());
  bigint beyond = 0;
  tagint lowest = MAXTAGINT;
  for (std::size_t k = 0; k < settings.models.size(); k++) {
    if (!settings.models[k].law) continue;
    std::vector<int> some;
    for (const int i : made)
      if (model[i] == (int) k) some.push_back(i);
    if (some.empty()) continue;
    std::sort(some.begin(), some.end());
    settings.models[k].law->update((int) some.size(), some.data(), none.data(), update->dt,
                                   after.data(), {remembered.data(), layout.width()});
    for (const int i : some)
      if (rve::norm(after[i] - stress[i]) > BEYOND_STRENGTH * rve::norm(stress[i])) {
        beyond++;
        lowest = std::min(lowest, atom->tag[i]);
      }
  }
  MPI_Allreduce(MPI_IN_PLACE, &beyond, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, world);
  if (beyond > 0 && comm->me == 0)
    error->warning(FLERR,
                   "Fix mpm {}: the stress in situ of {} points is beyond the strength of their "
                   "law, that of atom {} for one; they will yield at once. Take a k0 between the "
                   "active and the passive limit, or more strength",
                   fix->id, beyond, lowest);
}

/* ----------------------------------------------------------------------
   forces are complete: what is out of balance before the first step
------------------------------------------------------------------------- */

template <int D> void FixMpm::ImplOf<D>::report_in_situ()
{
  is_in_situ = false;
  // of the forces that act on points, where the script says no gravity
  const double h = solver->grid().cell_size();
  double by_forces = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    double squares = 0.0;
    for (int a = 0; a < D; a++) squares += atom->f[i][a] * atom->f[i][a];
    if (body[i] < 0) by_forces = std::max(by_forces, std::sqrt(squares) / volume[i]);
  }
  MPI_Allreduce(MPI_IN_PLACE, &by_forces, 1, MPI_DOUBLE, MPI_MAX, world);
  by_forces *= settings.options.thickness * (D == 2 ? h * h : h * h * h);
  const double weight = weight_of_cell > 0.0 ? weight_of_cell : by_forces;
  const double unbalanced = solver->max_unbalanced_force();
  if (comm->me != 0) return;
  if (!(weight > 0.0)) {
    utils::logmesg(lmp, "fix mpm {}: in situ the largest unbalanced nodal force is {:.3g}\n",
                   fix->id, unbalanced);
    return;
  }
  const double share = unbalanced / weight;
  const std::string text = fmt::format(
      "in situ the largest unbalanced nodal force is {:.3g} of the weight of a cell", share);
  if (share <= UNBALANCED_WARN) {
    utils::logmesg(lmp, "fix mpm {}: {}\n", fix->id, text);
    return;
  }
  error->warning(FLERR, "Fix mpm {}: {}, above {:g}: the ground will move. {}", fix->id, text,
                 UNBALANCED_WARN,
                 by_forces == 0.0
                     ? "No force acts on the points: define fix gravity before this fix"
                     : "Gravity, surcharge, tractions, boundaries and the surface must be those of "
                       "insitu; under a surface that is not level the ground has to find its "
                       "balance, in a run with damping");
}

#define IN_SITU(D)                                                          \
  template void FixMpm::ImplOf<D>::begin_in_situ(const std::vector<int> &); \
  template void FixMpm::ImplOf<D>::report_in_situ();
IN_SITU(2)
IN_SITU(3)
#undef IN_SITU
