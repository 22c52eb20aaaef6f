// SPDX-License-Identifier: GPL-2.0-only
#include "fix_rve_jobs.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "rve/core/error.h"
#include "rve/core/first_error.h"
#include "rve/engine/stability.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace LAMMPS_NS;

// Share of the stability bound above which a given time step gets a warning
static constexpr double DT_WARNING = 0.95;

// Of this many checks at the interval, only one tests for warnings too, because warnings need
// sharper bounds of all RVEs.
static constexpr int CHECKS_FOR_ONE_WITH_WARNINGS = 10;

// Largest number of RVEs, over all ranks, whose bound is computed exactly. Each takes milliseconds.
static constexpr int MOST_EXACT_BOUNDS = 8;

template <int D> void RveTimeStep<D>::check(double used, double bound, const std::string &whose)
{
  if (used > bound)
    error->all(FLERR,
               "fix rve {}: DEM time step {} [time] is above the stability bound {} [time] of {}; "
               "use dt at most {}, or dt auto",
               rves.fix->id, rve::number(used), rve::number(bound), whose,
               rve::number(DT_WARNING * bound));
  if (used > DT_WARNING * bound && !has_warned) {
    has_warned = true;
    if (comm->me == 0)
      error->warning(FLERR,
                     "fix rve {}: DEM time step {} [time] is above {} of the stability bound {} "
                     "[time] of {}; use a smaller dt, or dt auto",
                     rves.fix->id, rve::number(used), DT_WARNING, rve::number(bound), whose);
  }
}

/// The engine gives a lower bound of the stable time step of each RVE. Bounds below `enough` are
/// accurate within 5 %. The exact stable time step is computed only for the RVEs with the lowest
/// bounds. The result does not depend on the number of ranks.
template <int D>
typename RveTimeStep<D>::LeastBound RveTimeStep<D>::least(const std::vector<int> &atoms,
                                                          double enough)
{
  const tagint *tag = atom->tag;
  const std::vector<int> some = rves.slots_of(atoms);
  std::vector<double> bounds;
  const std::string who =
      fmt::format("fix rve {}: stability bound at step {}", rves.fix->id, rves.reported_step());
  collectively(lmp, who,
               [&] { bounds = rves.points.as_they_are().bound_time_steps(some, enough); });

  // The exact stable time step is computed for at most MOST_EXACT_BOUNDS candidates. If more RVEs
  // have similar bounds, an RVE that is not a candidate can have a smaller stable time step than
  // all candidates. The difference is at most the inaccuracy of the bounds, and the checks have a
  // margin of this size.
  struct Candidate {
    double bound;
    tagint atom;
    int rank, index;    // rank of the atom, and its index in `atoms` of that rank
  };
  const auto lower = [](const Candidate &a, const Candidate &b) {
    return a.bound < b.bound || (a.bound == b.bound && a.atom < b.atom);
  };
  const int me = comm->me;
  std::vector<Candidate> mine;
  for (std::size_t k = 0; k < atoms.size(); ++k)
    if (bounds[k] < enough) mine.push_back({bounds[k], tag[atoms[k]], me, static_cast<int>(k)});
  std::sort(mine.begin(), mine.end(), lower);
  mine.resize(MOST_EXACT_BOUNDS, {HUGE_VAL, MAXTAGINT, -1, -1});
  constexpr int BYTES = MOST_EXACT_BOUNDS * sizeof(Candidate);
  std::vector<Candidate> candidates(comm->nprocs * MOST_EXACT_BOUNDS);
  MPI_Allgather(mine.data(), BYTES, MPI_BYTE, candidates.data(), BYTES, MPI_BYTE, world);
  std::sort(candidates.begin(), candidates.end(), lower);
  candidates.resize(MOST_EXACT_BOUNDS);
  if (candidates[0].rank < 0) return {HUGE_VAL, MAXTAGINT};

  std::vector<rve::RveStateOf<D>> states;
  std::vector<tagint> whose;
  collectively(lmp, who, [&] {
    for (const Candidate &candidate : candidates) {
      if (candidate.rank != me) continue;
      states.push_back(rves.points.as_they_are().state(some[candidate.index]));
      whose.push_back(candidate.atom);
    }
  });
  const int count = static_cast<int>(states.size());
  std::vector<double> exact(count);
  rve::FirstError failed;
#pragma omp parallel for schedule(dynamic) num_threads(std::max(1, std::min(count, rves.threads())))
  for (int k = 0; k < count; ++k)
    failed.guard(k, [&] { exact[k] = rve::stable_time_step(states[k]); });
  collectively(lmp, who, [&] { failed.rethrow(); });
  double least = HUGE_VAL, least_of_all;
  for (const double dt : exact) least = std::min(least, dt);
  MPI_Allreduce(&least, &least_of_all, 1, MPI_DOUBLE, MPI_MIN, world);
  tagint id = MAXTAGINT, lowest;
  for (int k = 0; k < count; ++k)
    if (exact[k] == least_of_all) id = std::min(id, whose[k]);
  MPI_Allreduce(&id, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, world);
  return {least_of_all, lowest};
}

/// An automatic step is not checked at the beginning and the end of a run, because a divided run
/// must give the same bits as the whole run. Frozen RVEs are not checked.
template <int D> std::vector<int> RveTimeStep<D>::atoms_to_check(Check check)
{
  if (check == Check::Interval || check == Check::InSitu) return rves.advancing_atoms();
  if (check == Check::Run)
    return rves.settings.dt_auto ? std::vector<int>() : rves.advancing_atoms();
  rves.finish();
  std::vector<int> atoms;
  if (rves.points.as_they_are().any_has_stiffened())
    for (int i = 0; i < atom->nlocal; i++)
      if (rves.slot[i] >= 0 && rves.points.as_they_are().has_stiffened(rves.slot[i]))
        atoms.push_back(i);
  return atoms;
}

template <int D> void RveTimeStep<D>::recheck(Check check)
{
  const std::vector<int> atoms = atoms_to_check(check);
  int mine = atoms.empty() ? 0 : 1, any = mine;
  if (comm->nprocs > 1) MPI_Allreduce(&mine, &any, 1, MPI_INT, MPI_MAX, world);
  if (!any) return;
  // A check at the start or the end of a run must not change later checks: a divided run must give
  // the same bits as the whole run.
  if (check != Check::Run) rves.points.as_they_are().note_check(rves.slots_of(atoms));
  const double used = rves.settings.dt_auto ? rves.dt : rves.clock(update->dt).dt;
  // most checks at the interval test for errors only and need no sharp bounds near the time step
  const bool between_warnings = check == Check::Interval &&
      update->ntimestep % (CHECKS_FOR_ONE_WITH_WARNINGS * rves.settings.dt_check_interval) != 0;
  const bool silent = check == Check::Run ||
      (!rves.settings.dt_auto && (has_warned || between_warnings));
  const double margin = silent ? 1.0 : DT_WARNING;
  const LeastBound lowest = least(atoms, used / margin);
  if (!(used > margin * lowest.dt)) return;

  if (!rves.settings.dt_auto) {
    this->check(used, lowest.dt,
                fmt::format("the RVE of atom {} at step {}", lowest.atom, rves.reported_step()));
    return;
  }
  rves.dt = rves.settings.dt_fraction * lowest.dt;
  if (comm->me) return;
  utils::logmesg(lmp, "fix rve {}: DEM time step is now {} [time] (step {}, RVE of atom {})\n",
                 rves.fix->id, rve::number(rves.dt), rves.reported_step(), lowest.atom);
  const bool has_used_it = check != Check::InSitu;
  if (has_used_it && used > lowest.dt && !std::exchange(has_warned, true))
    error->warning(FLERR,
                   "fix rve {}: in step {} the DEM time step {} [time] was above the stability "
                   "bound {} [time] of the RVE of atom {}, which stiffened within one step; use a "
                   "smaller timestep, or dt auto with a fraction below {}",
                   rves.fix->id, rves.reported_step(), rve::number(used), rve::number(lowest.dt),
                   lowest.atom, rve::number(rves.settings.dt_fraction));
}

template <int D> void RveTimeStep<D>::choose()
{
  is_old = false;
  const double of_packings = rves.packings.least_bound();
  const std::vector<int> advancing = rves.advancing_atoms();
  // the bound of an RVE that has lost all contacts is a few times the bound of its packing
  const LeastBound lowest = least(advancing, 100.0 * of_packings);
  if (rves.settings.dt_auto) {
    const double bound = lowest.atom == MAXTAGINT ? of_packings : lowest.dt;
    rves.dt = rves.settings.dt_fraction * bound;
    if (comm->me == 0)
      utils::logmesg(
          lmp, "fix rve {}: DEM time step is now {} [time] (step {}, stability bound {} [time])\n",
          rves.fix->id, rve::number(rves.dt), update->ntimestep, rve::number(bound));
    rves.points->note_check(rves.slots_of(advancing));
    return;
  }
  rves.dt = rves.settings.dt;
  const double used = rves.clock(update->dt).dt;
  if (lowest.atom == MAXTAGINT)
    check(used, of_packings, "its packings");
  else
    check(used, lowest.dt,
          fmt::format("the RVE of atom {} at step {}", lowest.atom, update->ntimestep));
  // this comes last, because a time step that ends with an error must not count as checked
  rves.points->note_check(rves.slots_of(advancing));
}

template class LAMMPS_NS::RveTimeStep<2>;
template class LAMMPS_NS::RveTimeStep<3>;
