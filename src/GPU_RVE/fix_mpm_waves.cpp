// SPDX-License-Identifier: GPL-2.0-only

#include "fix_mpm_jobs.h"

#include "rve/core/error.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

using namespace LAMMPS_NS;

namespace {

// Courant number below which a wave passes at most a hundred cells in a million steps
constexpr double COURANT_SMALL = 1e-4;

// Ratio of the largest coordinate of the grid to its extent above which rounding is checked. Above
// it, a shift of the origin would reduce rounding.
constexpr double FAR_FROM_ORIGIN = 10.0;
// Relative rounding error of the motion in a step above which a warning is printed
constexpr double ROUNDING_WARN = 0.01;

// A warning is printed if the wave speed of an absorbing side and the wave speed of the points next
// to it differ by more than this factor.
constexpr double WRONG_SPEED = 2.0;
// Ratio of the lowest wave speed of RVEs to the upper bound from their contacts [-]. It is the
// square root of a ratio of moduli: for disks that were prepared with a friction of 0.5, the
// modulus is 0.54 times its upper bound.
constexpr double BOUND_OF_GRAINS = 0.73;

}    // namespace

/// Finds the `wave_tests` RVEs with the highest wave-speed bounds on all ranks. Returns the atoms
/// of these RVEs that are on this rank. Atoms with equal bounds are ordered by ID.
template <int D>
std::vector<int> MpmWaves<D>::fastest(const Points &points, const FixRve &source,
                                      const mpm::Constitutive<D> &law) const
{
  using Candidate = std::array<double, 2>;    // squared slowness, ID of the atom
  const int count = setup.settings.wave_tests;
  std::vector<Candidate> mine;
  for (int i = 0; i < atom->nlocal; i++)
    if (points.rigid_body[i] < 0 && setup.grains[points.model[i]] == &source)
      mine.push_back(
          {points.mass[i] / (law.p_wave_modulus(i) * points.volume[i]), (double) atom->tag[i]});
  std::sort(mine.begin(), mine.end());
  mine.resize(count, {std::numeric_limits<double>::infinity(), 0.0});
  std::vector<Candidate> all((std::size_t) comm->nprocs * count);
  MPI_Allgather(mine.data(), 2 * count, MPI_DOUBLE, all.data(), 2 * count, MPI_DOUBLE, world);
  std::sort(all.begin(), all.end());
  std::vector<int> chosen;
  for (int k = 0; k < count; k++) {
    const auto [slowness, id] = all[k];
    if (std::isinf(slowness)) break;
    for (int i = 0; i < atom->nlocal; i++)
      if (atom->tag[i] == (tagint) id) chosen.push_back(i);
  }
  return chosen;
}

template <int D> void MpmWaves<D>::measure(const Points &points)
{
  for (FixRve *source : setup.sources()) {
    source->rves().scale_waves(1.0);
    if (setup.settings.wave_tests == 0) continue;
    mpm::Constitutive<D> *const law = source->template constitutive<D>();
    law->expect_questions();
    const std::vector<int> chosen = fastest(points, *source, *law);
    double share = source->rves().measured_wave_share(chosen), largest;
    MPI_Allreduce(&share, &largest, 1, MPI_DOUBLE, MPI_MAX, world);
    if (largest > 0.0) source->rves().scale_waves(largest);
    if (comm->me != 0) continue;
    if (largest > 0.0)
      utils::logmesg(lmp,
                     "fix mpm {}: step {}: the measured P-wave modulus of RVEs of fix {} is at "
                     "most {:.3g} times the upper bound from their contacts\n",
                     setup.fix->id, update->ntimestep, source->id, largest);
    else if (!std::exchange(warned_tangent, true))
      error->warning(
          FLERR,
          "fix mpm {}: step {}: no tangent of the RVEs of fix {} could be measured; wave "
          "speeds are the upper bound from their contacts",
          setup.fix->id, update->ntimestep, source->id);
  }
}

template <int D> void MpmWaves<D>::check_courant(const Points &points, double body_speed)
{
  setup.guarded([&] { number = setup.solver->cfl_number(points, update->dt); });
  const double limit = setup.settings.courant_error;
  if (number > limit)
    error->all(FLERR,
               "fix mpm {}: step {}: the Courant number is {:.4g} with the present stiffness; it "
               "must be at most {}: the time step {} must be below {:.4g} [time]",
               setup.fix->id, update->ntimestep, number, limit, update->dt,
               update->dt * limit / number);
  check_flow(points);
  if (number > setup.settings.courant_warn && !warned) {
    if (comm->me == 0)
      error->warning(FLERR,
                     "fix mpm {}: step {}: the Courant number is {:.4g} with the present "
                     "stiffness, above the limit {} of warnings; above {} the run ends",
                     setup.fix->id, update->ntimestep, number, setup.settings.courant_warn, limit);
    warned = true;
  }
  check_rounding(points, body_speed);
}

/// Water that flows has the limit (Courant number)² + flow number <= 1.
template <int D> void MpmWaves<D>::check_flow(const Points &points) const
{
  double flow = 0.0;
  setup.guarded([&] { flow = setup.solver->flow_number(points, update->dt); });
  const double limit = setup.settings.courant_error, sum = number * number + flow;
  if (flow == 0.0 || !(sum > limit * limit)) return;
  // largest factor x of the time step: (number x)² + flow x = limit²
  const double factor =
      2.0 * limit * limit / (flow + std::sqrt(flow * flow + 4.0 * limit * limit * number * number));
  error->all(FLERR,
             "fix mpm {}: step {}: the flow number of the water, 2 D dt k (kw/n)/(density gravity "
             "h^2), is {:.4g}; with the square of the Courant number, {:.4g}, it must be at most "
             "{:.4g}: the time step {} must be below {:.4g} [time], or use a lower kw or "
             "conductivity k",
             setup.fix->id, update->ntimestep, flow, number * number, limit * limit, update->dt,
             update->dt * factor);
}

/// Coordinates are doubles, and the distance between neighboring doubles grows with their distance
/// from the origin.
template <int D> void MpmWaves<D>::check_rounding(const Points &points, double body_speed)
{
  if (warned_rounding) return;
  double quantum = 0.0, coordinate = 0.0;
  for (int a = 0; a < D; a++) {
    const double lo = setup.settings.options.lo[a], hi = setup.settings.options.hi[a];
    const double largest = std::max(std::fabs(lo), std::fabs(hi));
    if (largest <= FAR_FROM_ORIGIN * (hi - lo) || largest <= coordinate) continue;
    coordinate = largest;
    quantum = std::nextafter(largest, HUGE_VAL) - largest;
  }
  if (quantum == 0.0) return;
  setup.solver->fetch(points);
  double speed = body_speed;
  for (int i = 0; i < atom->nlocal; i++)
    for (int a = 0; a < D; a++) speed = std::max(speed, std::fabs(atom->v[i][a]));
  MPI_Allreduce(MPI_IN_PLACE, &speed, 1, MPI_DOUBLE, MPI_MAX, world);
  const double motion = speed * update->dt;
  if (motion == 0.0 || 0.5 * quantum <= ROUNDING_WARN * motion) return;
  warned_rounding = true;
  if (comm->me != 0) return;
  error->warning(
      FLERR,
      "fix mpm {}: step {}: near the coordinate {} [distance] positions are multiples of {:.3g}, "
      "and the largest motion in a step is {:.3g}: rounding changes it by up to {:.0f} %, and "
      "motions below {:.3g} are lost. Subtract a constant from the coordinates, so that they are "
      "near zero, or use a time step or a velocity with motions of at least {:.3g}",
      setup.fix->id, update->ntimestep, rve::number(coordinate), quantum, motion,
      std::min(100.0, 50.0 * quantum / motion), 0.5 * quantum, 0.5 * quantum / ROUNDING_WARN);
}

template <int D> void MpmWaves<D>::check_time_step() const
{
  if (comm->me != 0 || update->nsteps == 0 || number >= COURANT_SMALL) return;
  error->warning(
      FLERR,
      "fix mpm {}: the Courant number is {:.2g}, so that the fastest wave travels through {:.2g} "
      "cells in the {} steps of this run. The time step is {} [time]{}; the Courant number is 0.5 "
      "with the time step {:.2g}",
      setup.fix->id, number, number * update->nsteps, update->nsteps, update->dt,
      update->dt_default ? ", the default of LAMMPS: set it with the timestep command" : "",
      number > 0.0 ? 0.5 * update->dt / number : 0.0);
}

/// Dashpots with n times the impedance of the points reflect |n - 1|/(n + 1) of the stress of a
/// wave: a third for n = 2 or 1/2. Smaller reflections cause no warning, because a side can
/// represent another material than that of the points.
template <int D> void MpmWaves<D>::check_absorbing_sides(const Points &points)
{
  const mpm::SolverOptions<D> &options = setup.settings.options;
  // each side has a speed of compression waves and one of shear waves
  constexpr int KINDS = 2, SPEEDS = KINDS * mpm::FACES<D>;
  if (warned_sides ||
      std::none_of(options.dashpots.begin(), options.dashpots.end(),
                   [](const mpm::Dashpots &some) { return some.exist(); }))
    return;
  setup.solver->fetch(points);
  for (mpm::Constitutive<D> *law : setup.laws) law->expect_questions();
  // largest speed, and negative of the least speed, of the points within a cell size of the side
  double most[2 * SPEEDS], *const least = most + SPEEDS;
  std::fill_n(most, SPEEDS, 0.0);
  std::fill_n(least, SPEEDS, -std::numeric_limits<double>::infinity());
  for (int i = 0; i < atom->nlocal; i++) {
    if (points.rigid_body[i] >= 0) continue;
    const mpm::Constitutive<D> &law = *setup.laws[points.model[i]];
    for (int side = 0; side < mpm::FACES<D>; side++) {
      if (!options.dashpots[side].exist()) continue;
      const int axis = side / 2;
      const double away = side % 2 ? options.hi[axis] - atom->x[i][axis]
                                   : atom->x[i][axis] - options.lo[axis];
      if (away > options.cell_size) continue;
      const double of_water = setup.solver->modulus_of_water(points, i);
      const double moduli[KINDS] = {law.p_wave_modulus(i) + of_water, law.shear_modulus(i)};
      for (int kind = 0; kind < KINDS; kind++) {
        if (!(moduli[kind] > 0.0)) continue;    // RVE without contacts, or unknown modulus
        const double speed = std::sqrt(moduli[kind] * points.volume[i] / points.mass[i]);
        double &largest = most[KINDS * side + kind], &smallest = least[KINDS * side + kind];
        largest = std::max(largest, speed);
        smallest =
            std::max(smallest, -(setup.grains[points.model[i]] ? BOUND_OF_GRAINS * speed : speed));
      }
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, most, 2 * SPEEDS, MPI_DOUBLE, MPI_MAX, world);
  for (int k = 0; k < SPEEDS; k++) {
    const mpm::Dashpots &dashpots = options.dashpots[k / KINDS];
    const double given = k % KINDS == 0 ? dashpots.normal : dashpots.tangential;
    if (given == 0.0 || most[k] == 0.0) continue;
    const double low = -least[k] / WRONG_SPEED, high = WRONG_SPEED * most[k];
    if (given >= low && given <= high) continue;
    warned_sides = true;
    if (comm->me == 0)
      error->warning(
          FLERR,
          "fix mpm {}: boundary {} absorbing {} is {} [length/time]; it should be between {:.4g} "
          "and {:.4g}, because {} waves of the points within a cell of this side have speeds from "
          "{:.4g} to {:.4g}. More than a third of their stress is reflected",
          setup.fix->id, MpmSettings<D>::name_of_side(k / KINDS), k % KINDS == 0 ? "cp" : "cs",
          rve::number(given), low, high, k % KINDS == 0 ? "compression" : "shear",
          WRONG_SPEED * low, most[k]);
  }
}

template class LAMMPS_NS::MpmWaves<2>;
template class LAMMPS_NS::MpmWaves<3>;
