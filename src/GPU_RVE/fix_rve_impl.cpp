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

#include "fix_rve_impl.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "group.h"
#include "lammps/rank_resources.h"
#include "modify.h"
#include "rve/core/error.h"
#include "rve/core/exact_sum.h"
#include "rve/core/first_error.h"
#include "rve/core/splitmix64.h"
#include "rve/core/threads.h"
#include "rve/engine/cell_width.h"
#include "rve/engine/finite_strain.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/stability.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <utility>

using namespace LAMMPS_NS;

// of the stability bound: where a given time step is warned of
static constexpr double DT_WARNING = 0.95;

// One of so many checks at the interval looks for steps that are to be warned of, which takes closer bounds of all RVEs
static constexpr int CHECKS_FOR_ONE_WITH_WARNINGS = 10;

// RVEs whose bound is computed exactly, on all ranks together: each takes some milliseconds
static constexpr int MOST_EXACT_BOUNDS = 8;

// Share of the RVEs whose inertial numbers are above the limit of quasi-static deformation, from which on a warning comes. Next to edges
// of rigid bodies a few RVEs exceed the limit in almost any scene, and the response of the whole does not depend on them.
static constexpr double NOTABLE_SHARE = 0.05;

/* ---------------------------------------------------------------------- */

std::unique_ptr<FixRve::Impl> FixRve::Impl::make(FixRve *fix, FixRveSettings settings)
{
  if (settings.dimension == 3) return std::make_unique<ImplOf<3>>(fix, std::move(settings));
  return std::make_unique<ImplOf<2>>(fix, std::move(settings));
}

/* ---------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::read_packings()
{
  packings.read(fix->lmp, settings);
  const std::vector<double> &bounds = packings.bounds();
  if (settings.dt_auto) {
    dt = settings.dt_fraction * *std::min_element(bounds.begin(), bounds.end());
    return;
  }
  for (int k = 0; k < packings.size(); ++k) check_time_step(dt, bounds[k], packings.name(k));
}

/* ---------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::make_engine()
{
  const RankResources share(fix->world);
  settings.options.device_number = share.rank;
  if (!settings.threads_given) settings.options.threads = share.threads();
  settings.options.log = [fix = fix](const std::string &line) {
    // one rank compiles for all of its machine, perhaps one that has no log
    if (fix->comm->me != 0) {
      std::fprintf(stderr, "fix rve %s: %s\n", fix->id, line.c_str());
      return;
    }
    utils::logmesg(fix->lmp, fmt::format("fix rve {}: {}\n", fix->id, line));
    utils::flush_buffers(fix->lmp);
  };
  std::string notice;
  // perhaps on some ranks only: there may be fewer devices than ranks
  collectively(fix->lmp, "fix rve", [&] {
    settings.options.contacts = packings.contacts();
    auto engine = rve::make_engine<D>(settings.options, &notice);
    std::unique_ptr<rve::EngineOf<D>> shadows;
    if (settings.num_shadows > 0) {
      rve::Options precise = settings.options;
      precise.format = rve::Format::Double;
      precise.arithmetic = rve::Arithmetic::Strict;
      shadows = rve::make_engine<D>(precise);
    }
    points = std::make_unique<Points>(std::move(engine), std::move(shadows), settings.macro_step,
                                      threads());
  });
  // what a fix before this one has chosen does not last: beside an engine on the CPU teams of two sizes would alternate
  const bool is_beside_gpu = points->cuda_device() >= 0 && !settings.threads_given;
  rve::most_in_a_team() = is_beside_gpu ? share.threads_beside_gpu() : rve::MOST_THREADS;
  int on_device = points->cuda_device() >= 0 ? 1 : 0, on_all;
  MPI_Allreduce(&on_device, &on_all, 1, MPI_INT, MPI_MIN, fix->world);
  all_on_devices = on_all == 1;

  int has_notice = notice.empty() ? 0 : 1, with_notice;
  MPI_Allreduce(&has_notice, &with_notice, 1, MPI_INT, MPI_SUM, fix->world);
  if (fix->comm->me) return;
  utils::logmesg(fix->lmp, "fix rve {}: {}\n", fix->id, points->description());
  if (share.bound_ranks > 0)
    fix->error->warning(
        FLERR,
        "fix rve: {} of {} MPI ranks on this machine are bound to one core each and use one "
        "thread, "
        "though there are more cores; give them more, with mpirun --bind-to none for example",
        share.bound_ranks, share.ranks);
  if (has_notice)
    utils::logmesg(fix->lmp, "fix rve {}: {}\n", fix->id, notice);
  else if (with_notice)
    fix->error->warning(
        FLERR, "fix rve: {} of {} MPI ranks have no CUDA device; their RVEs are on CPU threads",
        with_notice, fix->comm->nprocs);
}

/* ----------------------------------------------------------------------
   a given time step is the user's business up to the bound; an automatic one follows it
------------------------------------------------------------------------- */

void FixRve::Impl::check_time_step(double used, double bound, const std::string &whose)
{
  if (used > bound)
    fix->error->all(
        FLERR,
        "fix rve: DEM time step {} [time] is above the stability bound {} [time] of {}; "
        "use dt at most {}, or dt auto",
        rve::number(used), rve::number(bound), whose, rve::number(DT_WARNING * bound));
  if (used > DT_WARNING * bound && !warned_dt) {
    warned_dt = true;
    if (fix->comm->me == 0)
      fix->error->warning(FLERR,
                          "fix rve: DEM time step {} [time] is above {} of the stability bound {} "
                          "[time] of {}",
                          rve::number(used), DT_WARNING, rve::number(bound), whose);
  }
}

/* ----------------------------------------------------------------------
   the engine bounds all of them, within 5 % where it matters; the exact one is asked of those with the lowest bounds.
   nothing here depends on the number of ranks, so neither does an automatic step.
------------------------------------------------------------------------- */

template <int D>
typename FixRve::ImplOf<D>::LeastBound
FixRve::ImplOf<D>::least_time_step(const std::vector<int> &atoms, double enough)
{
  const MPI_Comm world = fix->world;
  const tagint *tag = fix->atom->tag;
  const std::vector<int> some = slots_of(atoms);
  std::vector<double> bounds;
  const std::string who = fmt::format("fix rve {}: time step at step {}", fix->id, reported_step());
  collectively(fix->lmp, who,
               [&] { bounds = points.as_they_are().bound_time_steps(some, enough); });

  // all RVEs may be alike: the others are no further below the least one of these than the bounds are sharp, and a check has that margin
  struct Candidate {
    double bound;
    tagint atom;
    int place;    // among the atoms of this rank, or -1
  };
  const auto lower = [](const Candidate &a, const Candidate &b) {
    return a.bound < b.bound || (a.bound == b.bound && a.atom < b.atom);
  };
  std::vector<Candidate> mine;
  for (std::size_t k = 0; k < atoms.size(); ++k)
    if (bounds[k] < enough) mine.push_back({bounds[k], tag[atoms[k]], static_cast<int>(k)});
  std::sort(mine.begin(), mine.end(), lower);
  mine.resize(MOST_EXACT_BOUNDS, {HUGE_VAL, MAXTAGINT, -1});
  double values[MOST_EXACT_BOUNDS];
  tagint ids[MOST_EXACT_BOUNDS];
  for (int k = 0; k < MOST_EXACT_BOUNDS; ++k) {
    values[k] = mine[k].bound;
    ids[k] = mine[k].atom;
  }
  const int ranks = fix->comm->nprocs, me = fix->comm->me;
  std::vector<double> all_values(ranks * MOST_EXACT_BOUNDS);
  std::vector<tagint> all_ids(all_values.size());
  MPI_Allgather(values, MOST_EXACT_BOUNDS, MPI_DOUBLE, all_values.data(), MOST_EXACT_BOUNDS,
                MPI_DOUBLE, world);
  MPI_Allgather(ids, MOST_EXACT_BOUNDS, MPI_LMP_TAGINT, all_ids.data(), MOST_EXACT_BOUNDS,
                MPI_LMP_TAGINT, world);
  std::vector<Candidate> candidates;
  for (int m = 0; m < ranks * MOST_EXACT_BOUNDS; ++m)
    if (all_values[m] < HUGE_VAL)
      candidates.push_back({all_values[m], all_ids[m],
                            m / MOST_EXACT_BOUNDS == me ? mine[m % MOST_EXACT_BOUNDS].place : -1});
  if (candidates.empty()) return {HUGE_VAL, MAXTAGINT};
  std::sort(candidates.begin(), candidates.end(), lower);
  if (candidates.size() > MOST_EXACT_BOUNDS) candidates.resize(MOST_EXACT_BOUNDS);

  std::vector<State> states;
  std::vector<tagint> whose;
  collectively(fix->lmp, who, [&] {
    for (const Candidate &candidate : candidates) {
      if (candidate.place < 0) continue;
      states.push_back(points.as_they_are().state(some[candidate.place]));
      whose.push_back(candidate.atom);
    }
  });
  const int count = static_cast<int>(states.size());
  std::vector<double> exact(count);
  rve::FirstError failed;
#pragma omp parallel for schedule(dynamic) num_threads(std::max(1, std::min(count, threads())))
  for (int k = 0; k < count; ++k)
    failed.guard(k, [&] { exact[k] = rve::stable_time_step(states[k]); });
  collectively(fix->lmp, who, [&] { failed.rethrow(); });
  double least = HUGE_VAL, least_of_all;
  for (const double dt : exact) least = std::min(least, dt);
  MPI_Allreduce(&least, &least_of_all, 1, MPI_DOUBLE, MPI_MIN, world);
  tagint id = MAXTAGINT, lowest;
  for (int k = 0; k < count; ++k)
    if (exact[k] == least_of_all) id = std::min(id, whose[k]);
  MPI_Allreduce(&id, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, world);
  return {least_of_all, lowest};
}

/* ----------------------------------------------------------------------
   RVEs that a check of this kind covers. RVEs that have stiffened are checked after every step.
   An automatic step is not checked where runs begin and end: a divided run must have the bits of
   the whole run. Frozen RVEs do not advance.
------------------------------------------------------------------------- */

template <int D> std::vector<int> FixRve::ImplOf<D>::atoms_to_check(Check check)
{
  if (check == Check::Interval || check == Check::InSitu) return advancing_atoms();
  if (check == Check::Run) return settings.dt_auto ? std::vector<int>() : advancing_atoms();
  finish();
  std::vector<int> atoms;
  if (points.as_they_are().any_has_stiffened())
    for (int i = 0; i < fix->atom->nlocal; i++)
      if (slot[i] >= 0 && points.as_they_are().has_stiffened(slot[i])) atoms.push_back(i);
  return atoms;
}

/* ---------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::recheck_time_step(Check check)
{
  const std::vector<int> atoms = atoms_to_check(check);
  int mine = atoms.empty() ? 0 : 1, any = mine;
  if (fix->comm->nprocs > 1) MPI_Allreduce(&mine, &any, 1, MPI_INT, MPI_MAX, fix->world);
  if (!any) return;
  // a divided run must have the bits of the whole run: checks at its parts' ends leave no trace
  if (check != Check::Run) points.as_they_are().note_check(slots_of(atoms));
  const double used = settings.dt_auto ? dt : clock(fix->update->dt).dt;
  // only an error can follow: RVEs near the bound need not be found
  const bool between_warnings = check == Check::Interval &&
      fix->update->ntimestep % (CHECKS_FOR_ONE_WITH_WARNINGS * settings.dt_check_interval) != 0;
  const bool silent = check == Check::Run || (!settings.dt_auto && (warned_dt || between_warnings));
  const double margin = silent ? 1.0 : DT_WARNING;
  const LeastBound least = least_time_step(atoms, used / margin);
  if (!(used > margin * least.dt)) return;

  if (!settings.dt_auto) {
    check_time_step(used, least.dt,
                    fmt::format("the RVE of atom {} at step {}", least.atom, reported_step()));
    return;
  }
  dt = settings.dt_fraction * least.dt;
  if (fix->comm->me) return;
  utils::logmesg(fix->lmp, "fix rve {}: DEM time step is now {} (step {}, RVE of atom {})\n",
                 fix->id, rve::number(dt), reported_step(), least.atom);
  const bool has_used_it = check != Check::InSitu;
  if (has_used_it && used > least.dt && !std::exchange(warned_dt, true))
    fix->error->warning(
        FLERR,
        "fix rve: in step {} the DEM time step {} [time] was above the stability bound {} [time] "
        "of the RVE of atom {}, which stiffened within one step; use a smaller timestep, or "
        "dt auto with less than {}",
        reported_step(), rve::number(used), rve::number(least.dt), least.atom,
        rve::number(settings.dt_fraction));
}

/* ----------------------------------------------------------------------
   said before the first RVE is made: a run that ends there would have cost the time that its set-up takes.
   ranks of a node that use the same device, or the memory of the host, are judged together.
------------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::check_memory(const std::vector<int> &grains)
{
  constexpr double MB = 1048576.0;
  const int mine = static_cast<int>(grains.size());
  rve::Memory memory;
  collectively(fix->lmp, "fix rve", [&] { memory = points->memory(); });
  MPI_Comm node, sharers;
  MPI_Comm_split_type(fix->world, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node);
  const std::size_t color = std::hash<std::string>()(memory.name) % MAXSMALLINT;
  MPI_Comm_split(node, static_cast<int>(color), 0, &sharers);
  MPI_Comm_free(&node);
  int rank, ranks;
  MPI_Comm_rank(sharers, &rank);
  MPI_Comm_size(sharers, &ranks);

  int sharing = !memory.is_host && ranks > 1 ? 1 : 0;
  MPI_Allreduce(MPI_IN_PLACE, &sharing, 1, MPI_INT, MPI_SUM, fix->world);
  if (sharing && !warned_sharing && fix->comm->me == 0)
    fix->error->warning(FLERR,
                        "fix rve: {} of {} MPI ranks share a CUDA device with another one, and "
                        "wait for each other; use as many ranks per node as there are devices",
                        sharing, fix->comm->nprocs);
  warned_sharing = true;

  const auto sum = [sharers](auto value, MPI_Datatype type) {
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, type, MPI_SUM, sharers);
    return value;
  };
  const bigint total = sum(bigint(mine), MPI_LMP_BIGINT);
  double free = memory.is_known ? static_cast<double>(memory.free) : HUGE_VAL;
  MPI_Allreduce(MPI_IN_PLACE, &free, 1, MPI_DOUBLE, MPI_MIN, sharers);
  // of the first RVEs of each rank, as many as its share of `number`
  const auto bytes_for = [&](bigint number) {
    const int some = total ? static_cast<int>((number * mine + total - 1) / total) : 0;
    return sum(points->bytes_for(grains, some, settings.num_shadows), MPI_DOUBLE);
  };

  std::string message;
  const double needed = bytes_for(total);
  if (needed > free) {
    bigint fit = 0, too_many = total;
    while (too_many - fit > 1) {
      const bigint middle = (fit + too_many) / 2;
      (bytes_for(middle) <= free ? fit : too_many) = middle;
    }
    message = fmt::format(
        "fix rve: {} RVEs{} need {:.1f} MB of {}, where {:.1f} MB are free; {} RVEs would fit. "
        "Smaller packings, another number format, or more nodes or devices help",
        total, ranks > 1 ? fmt::format(" of {} MPI ranks", ranks) : "", needed / MB, memory.name,
        free / MB, fit);
  }
  MPI_Comm_free(&sharers);

  error_if_any(fix->lmp, message);
}

/* ---------------------------------------------------------------------- */

std::string FixRve::Impl::place_of_failure(int atom) const
{
  return fmt::format("fix rve {}: {}step {}", fix->id,
                     atom >= 0 ? fmt::format("RVE of atom {}, ", fix->atom->tag[atom]) : "",
                     reported_step());
}

/* ---------------------------------------------------------------------- */

void FixRve::Impl::find_variables()
{
  for (auto *list : {&settings.velocity_gradient, &settings.stress_goal})
    for (auto &component : *list) component.value.find(fix->lmp, "fix rve");
  for (ScriptValue &value : settings.path.values) value.find(fix->lmp, "fix rve path");
  settings.path.number.find(fix->lmp, "fix rve path_variable");
}

/* ---------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::attach()
{
  const bool is_continued = continues;
  adopt_restart();
  const Atom *atom = fix->atom;
  std::vector<int> atoms;
  for (int i = 0; i < atom->nlocal; i++)
    if ((atom->mask[i] & fix->groupbit) && slot[i] < 0) atoms.push_back(i);
  bigint mine = atoms.size(), total;
  MPI_Allreduce(&mine, &total, 1, MPI_LMP_BIGINT, MPI_SUM, fix->world);
  if (total == 0) return;
  if (is_continued && fix->comm->me == 0)
    utils::logmesg(
        fix->lmp,
        "fix rve {}: {} atoms of the group had no RVE when the restart file was written; "
        "their RVEs begin from packings\n",
        fix->id, total);

  const std::vector<const State *> states = packings.choose(fix->lmp, fix->igroup, settings, atoms);
  bigint sums[2] = {0, 0}, all_sums[2];
  std::vector<int> grains;
  for (const State *state : states) {
    grains.push_back(state->num_grains());
    sums[0] += state->num_grains();
  }
  check_memory(grains);
  guarded([&] {
    const std::vector<int> slots = points->add(states);
    std::vector<int> failed;
    for (std::size_t k = 0; k < slots.size(); ++k) {
      slot[atoms[k]] = slots[k];
      if (points->point(slots[k]).frozen()) failed.push_back(slots[k]);
      sums[1] += static_cast<bigint>(points->bytes(slots[k]));
    }
    note_copies(atoms);
    report(failed, atoms, clock(fix->update->dt).dt, true);
  });
  MPI_Allreduce(sums, all_sums, 2, MPI_LMP_BIGINT, MPI_SUM, fix->world);
  if (fix->comm->me == 0)
    utils::logmesg(
        fix->lmp,
        "fix rve {}: {} RVEs with {} grains, {:.1f} MB; DEM time step {}, stability "
        "bound {}\n",
        fix->id, total, all_sums[0], all_sums[1] / 1048576.0, rve::number(dt),
        rve::number(*std::min_element(packings.bounds().begin(), packings.bounds().end())));
  say_how_far_cells_go(states);
  say_notes();
}

/* ---------------------------------------------------------------------- */

template <int D>
void FixRve::ImplOf<D>::say_how_far_cells_go(const std::vector<const State *> &states) const
{
  double worst[D + 1] = {}, of_all[D + 1];    // least shares, and -grains
  worst[D] = -HUGE_VAL;
  for (const State *state : states) {
    const auto share = rve::least_share_of_widths(*state, settings.options.skin);
    for (int a = 0; a < D; ++a) worst[a] = std::max(worst[a], share[a]);
    worst[D] = std::max(worst[D], -rve::grains_across(*state));
  }
  MPI_Allreduce(worst, of_all, D + 1, MPI_DOUBLE, MPI_MAX, fix->world);
  if (fix->comm->me == 0)
    utils::logmesg(
        fix->lmp,
        "fix rve {}: cells are at least {:.1f} grains wide; a cell compressed to less "
        "than {:.3f} of its width {}or {:.3f} of its height is too narrow for its "
        "grains, {}{}\n",
        fix->id, -of_all[D], of_all[0],
        D == 3 ? fmt::format("along x, {:.3f} of that along y ", of_all[1]) : "", of_all[D - 1],
        settings.macro_step.most_copies > 1
            ? fmt::format("is continued by up to {} copies of it side by side, and then ",
                          settings.macro_step.most_copies)
            : "and ",
        settings.policy == RvePolicy::Stop         ? "ends the run (policy stop)"
            : settings.policy == RvePolicy::Freeze ? "its RVE is frozen"
                                                   : "a fresh RVE takes its place");
}

/* ----------------------------------------------------------------------
   a random choice that is the same on any number of ranks: the atoms whose IDs hash lowest
------------------------------------------------------------------------- */

static std::vector<std::uint64_t> lowest_of_all(std::vector<std::uint64_t> mine, int number,
                                                MPI_Comm world)
{
  const auto shorten = [number](std::vector<std::uint64_t> &list) {
    std::sort(list.begin(), list.end());
    list.resize(std::min(list.size(), static_cast<std::size_t>(number)));
  };
  shorten(mine);
  int ranks;
  MPI_Comm_size(world, &ranks);
  const int count = static_cast<int>(mine.size());
  std::vector<int> counts(ranks), begins(ranks, 0);
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (int rank = 1; rank < ranks; ++rank) begins[rank] = begins[rank - 1] + counts[rank - 1];
  std::vector<std::uint64_t> all(begins.back() + counts.back());
  MPI_Allgatherv(mine.data(), count, MPI_UINT64_T, all.data(), counts.data(), begins.data(),
                 MPI_UINT64_T, world);
  shorten(all);
  return all;
}

template <int D> void FixRve::ImplOf<D>::remove_shadows(int number)
{
  std::vector<std::uint64_t> mine;
  const auto hash = [this](int i) { return rve::splitmix64(fix->atom->tag[i]); };
  for (const int i : atoms_with_rve())
    if (point(i).shadow >= 0) mine.push_back(hash(i));
  const std::vector<std::uint64_t> kept = lowest_of_all(mine, number, fix->world);
  for (const int i : atoms_with_rve())
    if (point(i).shadow >= 0 && !std::binary_search(kept.begin(), kept.end(), hash(i)))
      points->remove_shadow(slot[i]);
}

template <int D> void FixRve::ImplOf<D>::choose_shadows()
{
  if (settings.num_shadows == 0) return;
  const Atom *atom = fix->atom;
  std::vector<std::uint64_t> mine;
  int shadows[2] = {0, 0}, all_shadows[2];
  for (const int i : atoms_with_rve()) {
    ++shadows[1];
    if (point(i).shadow >= 0)
      ++shadows[0];
    else if (!point(i).frozen())
      mine.push_back(rve::splitmix64(atom->tag[i]));
  }
  MPI_Allreduce(shadows, all_shadows, 2, MPI_INT, MPI_SUM, fix->world);
  const int wanted = settings.num_shadows - all_shadows[0];
  if (wanted == 0) return;
  if (wanted < 0) remove_shadows(settings.num_shadows);    // a restart file had more

  const std::vector<std::uint64_t> candidates =
      lowest_of_all(mine, std::max(wanted, 0), fix->world);
  for (const int i : atoms_with_rve())
    if (point(i).shadow < 0 &&
        std::binary_search(candidates.begin(), candidates.end(), rve::splitmix64(atom->tag[i])))
      guarded([&] { points->add_shadow(slot[i]); }, i);

  const int total =
      std::min(all_shadows[0], settings.num_shadows) + static_cast<int>(candidates.size());
  if (fix->comm->me == 0)
    utils::logmesg(fix->lmp,
                   "fix rve {}: {} of {} RVEs have shadows in double with {} DEM steps for one: "
                   "{:.3g} DEM steps of shadows for each of the RVEs\n",
                   fix->id, total, all_shadows[1], settings.macro_step.shadow_refinement,
                   static_cast<double>(total) * settings.macro_step.shadow_refinement /
                       std::max(all_shadows[1], 1));
}

template <int D> FixRve::Impl::ShadowReport FixRve::ImplOf<D>::shadow_report() const
{
  double most = -1.0, most_of_all;
  std::int64_t sums[2] = {0, 0}, all_sums[2];    // number of shadows, sum of deviations
  for (const int i : atoms_with_rve()) {
    if (point(i).shadow < 0) continue;
    ++sums[0];
    most = std::max(most, point(i).shadow_deviation());
  }
  MPI_Allreduce(&most, &most_of_all, 1, MPI_DOUBLE, MPI_MAX, fix->world);
  MPI_Allreduce(sums, all_sums, 1, MPI_INT64_T, MPI_SUM, fix->world);
  if (all_sums[0] == 0) return {0.0, 0.0, 0};
  // a sum of integers has no order, so ranks do not show
  const rve::FixedScale scale(std::max(most_of_all, 1e-300), all_sums[0]);
  for (const int i : atoms_with_rve())
    if (point(i).shadow >= 0) sums[1] += scale.integer(point(i).shadow_deviation());
  MPI_Allreduce(&sums[1], &all_sums[1], 1, MPI_INT64_T, MPI_SUM, fix->world);
  tagint id = MAXTAGINT, lowest;
  for (const int i : atoms_with_rve())
    if (point(i).shadow >= 0 && point(i).shadow_deviation() == most_of_all)
      id = std::min(id, fix->atom->tag[i]);
  MPI_Allreduce(&id, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, fix->world);
  return {scale.real(all_sums[1]) / static_cast<double>(all_sums[0]), most_of_all, lowest};
}

/* ----------------------------------------------------------------------
   the time step has a check of its own, which knows the bound
------------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::advise(bool at_start)
{
  constexpr int KINDS = rve::NUM_ADVICE_KINDS;
  struct Judgement {
    double worst[KINDS] = {};
    int beyond[KINDS] = {};
    tagint id[KINDS];
    std::string message[KINDS];

    Judgement() { std::fill_n(id, KINDS, MAXTAGINT); }
    /// The worst of a kind; of equal ones that with the lowest id.
    void take(int kind, double severity, tagint tag, const std::string &words)
    {
      if (severity < worst[kind] || (severity == worst[kind] && tag > id[kind])) return;
      worst[kind] = severity;
      id[kind] = tag;
      message[kind] = words;
    }
  };
  complete();
  const std::vector<int> atoms = atoms_with_rve();
  const int count = static_cast<int>(atoms.size());
  Judgement mine;
  rve::FirstError failed;
  {
    const rve::LightWork work(count, threads());
#pragma omp parallel num_threads(work.team)
    {
      Judgement some;
#pragma omp for
      for (int k = 0; k < count; ++k) {
        const tagint tag = fix->atom->tag[atoms[k]];
        failed.guard(k, [&] {
          for (const rve::Advice &advice : advice_on(atoms[k], at_start)) {
            const int kind = static_cast<int>(advice.kind);
            ++some.beyond[kind];
            some.take(kind, advice.severity(), tag, advice.message);
          }
        });
      }
#pragma omp critical(advice_on_rves)
      for (int kind = 0; kind < KINDS; ++kind) {
        mine.beyond[kind] += some.beyond[kind];
        if (some.beyond[kind] > 0)
          mine.take(kind, some.worst[kind], some.id[kind], some.message[kind]);
      }
    }
  }
  guarded([&] { failed.rethrow(); });
  double worst_of_all[KINDS];
  int all_beyond[KINDS];
  tagint lowest[KINDS];
  auto &[worst, beyond, id, message] = mine;
  MPI_Allreduce(worst, worst_of_all, KINDS, MPI_DOUBLE, MPI_MAX, fix->world);
  MPI_Allreduce(beyond, all_beyond, KINDS, MPI_INT, MPI_SUM, fix->world);
  for (int kind = 0; kind < KINDS; ++kind)
    if (worst[kind] < worst_of_all[kind]) id[kind] = MAXTAGINT;
  MPI_Allreduce(id, lowest, KINDS, MPI_LMP_TAGINT, MPI_MIN, fix->world);
  int all_rves;
  MPI_Allreduce(&count, &all_rves, 1, MPI_INT, MPI_SUM, fix->world);
  constexpr int FAST = static_cast<int>(rve::AdviceKind::FastStrain);
  for (int kind = 0; kind < KINDS; ++kind) {
    if (all_beyond[kind] == 0) continue;
    const double share = static_cast<double>(all_beyond[kind]) / all_rves;
    if (kind == FAST) {
      if (!note_fast_strain(share, worst_of_all[kind], lowest[kind])) continue;
    } else if (std::exchange(advised[kind], true)) {
      continue;
    }
    const std::string text = first_message(
        fix->lmp,
        id[kind] != lowest[kind]
            ? ""
            : fmt::format("fix rve: in the RVE of atom {}{} at step {}, {}", lowest[kind],
                          all_beyond[kind] > 1
                              ? fmt::format(" (and {} other{}, {:.3g} % of the RVEs)",
                                            all_beyond[kind] - 1, all_beyond[kind] > 2 ? "s" : "",
                                            100.0 * share)
                              : "",
                          fix->update->ntimestep, message[kind]));
    // the log file belongs to rank 0
    if (fix->comm->me == 0) fix->error->warning(FLERR, text);
  }
}

/* ---------------------------------------------------------------------- */

/// Records a check in which a share of the RVEs strained too fast. Returns true if a warning is due, which is once in a run.
template <int D> bool FixRve::ImplOf<D>::note_fast_strain(double share, double worst, tagint id)
{
  const Update *update = fix->update;
  if (update->ntimestep <= update->firststep) return false;    // of the run before
  fast_strain.share = std::max(fast_strain.share, share);
  if (worst > fast_strain.worst) {
    fast_strain.worst = worst;
    fast_strain.id = id;
    fast_strain.step = update->ntimestep;
  }
  return share >= NOTABLE_SHARE && !std::exchange(fast_strain.is_told, true);
}

/// Logs at the end of a run the share that was too small for a warning.
template <int D> void FixRve::ImplOf<D>::report_fast_strain()
{
  const FastStrain run = std::exchange(fast_strain, {});
  if (fix->comm->me != 0 || run.share == 0.0 || run.is_told) return;
  constexpr double LIMIT = rve::QUASI_STATIC_INERTIAL_NUMBER;
  utils::logmesg(fix->lmp,
                 "fix rve {}: up to {:.3g} % of the RVEs had inertial numbers above the {:g} of "
                 "quasi-static deformation at a check, the largest {:.2g} in the RVE of atom {} at "
                 "step {}\n",
                 fix->id, 100.0 * run.share, LIMIT, run.worst * LIMIT, run.id, run.step);
}

/* ---------------------------------------------------------------------- */

template <int D> std::vector<rve::Advice> FixRve::ImplOf<D>::advice_on(int atom, bool at_start)
{
  const typename Points::Point &point = this->point(atom);
  if (point.frozen()) return {};
  rve::DriveRates motion;
  motion.strain_rate = point.strain_rate();
  motion.dt = point.drive.dt;
  motion.applied_strain = rve::strain_size(point.result.deformation);
  std::vector<rve::Advice> list =
      rve::advice(settings.options.format, point.last_steps(), point.material, motion);
  if (at_start) {
    for (rve::Advice &friction : rve::advice_on_friction(point.material))
      list.push_back(std::move(friction));
  } else if (point.drive.has_servo() || point.out_of_reach > 0.0) {
    for (rve::Advice &servo : points->advice_on_servo(slot[atom])) list.push_back(std::move(servo));
  }
  if (settings.options.track_energy)
    for (rve::Advice &energy : points->advice_on_energy(slot[atom], at_start))
      list.push_back(std::move(energy));
  return list;
}

/* ---------------------------------------------------------------------- */

template <int D> std::vector<int> FixRve::ImplOf<D>::slots_of(const std::vector<int> &atoms) const
{
  std::vector<int> some(atoms.size());
  for (std::size_t k = 0; k < atoms.size(); ++k) some[k] = slot[atoms[k]];
  return some;
}

/* ---------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::take_in(int atom, const double *record, int size)
{
  slot[atom] = -1;
  if (size == 0) return;
  guarded([&] { slot[atom] = points->add_record(record, size); }, atom);
}

/* ----------------------------------------------------------------------
   a LAMMPS of units si that is told nothing makes steps of 1e-8 seconds
------------------------------------------------------------------------- */

void FixRve::Impl::check_clock() const
{
  const Update *update = fix->update;
  clock(update->dt);
  const bool own_time = settings.substeps > 0 && settings.driver != RveDriver::Mpm;
  const bool no_step = update->nsteps == 0;
  if (own_time || no_step || !update->dt_default || update->dt > dt || fix->comm->me) return;
  fix->error->warning(FLERR,
                      "fix rve {}: the timestep is {} [time], the default of units {}, and no "
                      "longer than one DEM step of {} [time]; set it with the command timestep",
                      fix->id, rve::number(update->dt), update->unit_style, rve::number(dt));
}

/* ---------------------------------------------------------------------- */

void FixRve::Impl::check_dump() const
{
  if (settings.dump_interval == 0) return;
  std::vector<int> found(settings.dump_atoms.size(), 0);
  for (const int i : atoms_with_rve())
    for (std::size_t k = 0; k < found.size(); ++k)
      if (fix->atom->tag[i] == settings.dump_atoms[k]) found[k] = 1;
  MPI_Allreduce(MPI_IN_PLACE, found.data(), static_cast<int>(found.size()), MPI_INT, MPI_MAX,
                fix->world);
  for (std::size_t k = 0; k < found.size(); ++k)
    if (!found[k])
      fix->error->all(FLERR,
                      "fix rve {}: dump names atom {}, which has no RVE of this fix; name atoms of "
                      "group {}",
                      fix->id, settings.dump_atoms[k], fix->group->names[fix->igroup]);
}

/* ---------------------------------------------------------------------- */

std::vector<int> FixRve::Impl::atoms_with_rve() const
{
  std::vector<int> atoms;
  for (int i = 0; i < fix->atom->nlocal; i++)
    if (slot[i] >= 0) atoms.push_back(i);
  return atoms;
}

template <int D> std::vector<int> FixRve::ImplOf<D>::advancing_atoms() const
{
  std::vector<int> atoms = atoms_with_rve();
  atoms.erase(
      std::remove_if(atoms.begin(), atoms.end(), [this](int i) { return points->frozen(slot[i]); }),
      atoms.end());
  return atoms;
}

template <int D> double FixRve::ImplOf<D>::dem_steps() const
{
  double steps = 0.0;
  for (const int i : atoms_with_rve()) steps += static_cast<double>(point(i).result.counters.steps);
  return steps;
}

/* ----------------------------------------------------------------------
   for the whole run, on all ranks: with maxexchange_dynamic the buffers of comm_style tiled would become too small (LAMMPS of 2025
   and before; exchange() there gives bufextra the smaller of two values)
------------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::set_exchange_size()
{
  int mine = RestartRecords::HEADER, most;
  for (const int i : atoms_with_rve()) {
    const int bound = RestartRecords::HEADER + points->record_bound(slot[i]);
    mine = std::max(mine, bound);
    if (settings.policy != RvePolicy::Fresh) continue;
    // another packing may take its place, and it may have more grains
    const double grains = static_cast<double>(point(i).result.num_grains) / points->copies(slot[i]);
    const double times = std::max(1.0, packings.most_grains() / std::max(grains, 1.0));
    mine = std::max(mine, static_cast<int>(std::ceil(times * bound)));
  }
  MPI_Allreduce(&mine, &most, 1, MPI_INT, MPI_MAX, fix->world);
  fix->maxexchange = std::max(fix->maxexchange, most);
}

/* ---------------------------------------------------------------------- */

template <int D>
void FixRve::ImplOf<D>::check(const Matrix &tensor, const char *what, const char *unit,
                              int atom) const
{
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
      if (!std::isfinite(tensor(a, b)))
        fix->error->one(FLERR,
                        "fix rve: {} component {} of atom {} is {} {} at step {}; it must "
                        "be a finite number",
                        what, rve_component_name(a, b), fix->atom->tag[atom], tensor(a, b), unit,
                        fix->update->ntimestep);
}

/* ---------------------------------------------------------------------- */

/// True if this step needs complete results. Other readers request them on demand.
template <int D> bool FixRve::ImplOf<D>::wants_details() const
{
  const int interval = settings.dt_check_interval;
  const auto &paths = settings.path.of<D>();
  return (paths && paths->needs_details()) || (interval && fix->update->ntimestep % interval == 0);
}

template <int D>
void FixRve::ImplOf<D>::advance(const std::vector<int> &atoms, const std::vector<Drive> &drives)
{
  finish();
  const int count = static_cast<int>(atoms.size());
  int first_bad = count;
  slots = slots_of(atoms);
  {
    const rve::LightWork work(count, threads());
#pragma omp parallel for num_threads(work.team) reduction(min : first_bad)
    for (int k = 0; k < count; ++k) {
      const Drive &drive = drives[k];
      if (!rve::finite(drive.velocity_gradient) || !rve::finite(drive.stress_goal) ||
          !rve::finite(drive.deformation))
        first_bad = std::min(first_bad, k);
    }
  }
  if (first_bad < count) {
    check(drives[first_bad].velocity_gradient, "velocity gradient", "[1/time]", atoms[first_bad]);
    check(drives[first_bad].stress_goal, "stress goal", "[stress]", atoms[first_bad]);
    check(drives[first_bad].deformation, "deformation increment", "[-]", atoms[first_bad]);
  }
  const bool with_details = wants_details();
  guarded([&] {
    std::vector<int> failed = points->advance(slots, drives, with_details);
    ++num_advances;
    note_copies(atoms);
    if (settings.policy == RvePolicy::Fresh) failed = renew(failed, atoms);
    report(failed, atoms, drives.empty() ? 0.0 : drives.front().dt, false);
  });
}

/* ----------------------------------------------------------------------
   an advance by increments: a device runs it while LAMMPS ends this step and begins the next, unless the RVEs are accessed before.
   all ranks decide alike
------------------------------------------------------------------------- */

/// Notes whether the checks of an advance that begins in this step are postponed.
template <int D> void FixRve::ImplOf<D>::note_begin()
{
  checks_postponed = all_on_devices && !wants_details();
  step_of_advance = fix->update->ntimestep;
}

template <int D>
rve::Request *FixRve::ImplOf<D>::begin(const std::vector<int> &atoms,
                                       macro::MacroIncrementsOf<D> &increments)
{
  finish();
  note_begin();
  slots = slots_of(atoms);
  rve::Request *const request =
      guarded([&] { return points.as_they_are().begin(slots, increments); });
  if (!request) {
    advance_by_drives(atoms, increments);
    return nullptr;
  }
  under_way = {&atoms, &increments};
  if (checks_postponed) return request;
  finish();
  if (wants_details()) complete();
  return nullptr;
}

template <int D>
void FixRve::ImplOf<D>::advance_by_drives(const std::vector<int> &atoms,
                                          macro::MacroIncrementsOf<D> &increments)
{
  const int count = static_cast<int>(atoms.size());
  std::vector<Drive> wanted(count);
  for (int k = 0; k < count; ++k) {
    wanted[k].dt = increments.dt;
    wanted[k].substeps = increments.substeps;
    wanted[k].deformation = increments.increment(k);
  }
  advance(atoms, wanted);
  for (int k = 0; k < count; ++k) increments.take_stress(k, stress(atoms[k]));
}

template <int D>
rve::Request *FixRve::ImplOf<D>::plan(const std::vector<int> &atoms, bool is_as_before,
                                      const rve::PointsOnDevice &there,
                                      macro::MacroIncrementsOf<D> &increments)
{
  finish();
  note_begin();
  if (!is_as_before) slots = slots_of(atoms);
  under_way = {&atoms, &increments};
  return guarded(
      [&] { return points.as_they_are().plan(slots, atoms, is_as_before, there, increments); });
}

template <int D> bool FixRve::ImplOf<D>::is_as_before(const std::vector<int> &atoms)
{
  const int count = static_cast<int>(atoms.size());
  bool same = count == static_cast<int>(slots.size());
  for (int k = 0; same && k < count; ++k) same = slots[k] == slot[atoms[k]];
  return same && points.as_they_are().is_as_before(slots, atoms);
}

template <int D> void FixRve::ImplOf<D>::finish()
{
  if (!under_way.increments || !points.as_they_are().is_under_way()) return;
  const UnderWay advance = std::exchange(under_way, {});
  const bool reported_last_advance = std::exchange(reports_last_advance, true);
  guarded([&] {
    const std::vector<int> places = points.as_they_are().finish();
    ++num_advances;
    note_copies(*advance.atoms);
    std::vector<int> failed;
    for (const int place : places) failed.push_back(slots[place]);
    if (settings.policy == RvePolicy::Fresh) failed = renew(failed, *advance.atoms);
    report(failed, *advance.atoms, advance.increments->dt, false);
    for (const int place : places)
      advance.increments->take_stress(place, stress((*advance.atoms)[place]));
  });
  reports_last_advance = reported_last_advance;
}

/// The scheme USAVG calls this in the middle of a step, too: postponed checks wait for its end.
template <int D> void FixRve::ImplOf<D>::synchronise_ranks()
{
  finish();
  if (fix->update->ntimestep != step_of_advance) run_postponed_checks();
}

template <int D> void FixRve::ImplOf<D>::run_postponed_checks()
{
  finish();
  if (!std::exchange(checks_postponed, false)) return;
  reports_last_advance = true;
  say_notes();
  if (settings.dt_check_interval) recheck_time_step(Check::EveryStep);
  reports_last_advance = false;
}

/* ---------------------------------------------------------------------- */

template <int D>
macro::InSituReport FixRve::ImplOf<D>::bring_to_stress(const std::vector<int> &atoms,
                                                       const std::vector<macro::StressGoal> &goals,
                                                       double tolerance)
{
  std::string message;
  macro::InSituReport report;
  guarded([&] {
    try {
      report = macro::bring_to_stress(*points, slots_of(atoms), goals, tolerance, dt);
    } catch (const macro::InSituError &problem) {
      message = place_of_failure(atoms[problem.place()]) + ": " + problem.what();
    }
  });
  error_if_any(fix->lmp, message);
  if (settings.dt_check_interval) recheck_time_step(Check::InSitu);
  return report;
}

/* ---------------------------------------------------------------------- */

template <int D> void FixRve::ImplOf<D>::advance_by_script()
{
  if (const auto &paths = settings.path.of<D>()) {
    advance_on_paths(*paths);
    return;
  }
  fix->modify->clearstep_compute();
  const std::vector<int> atoms = atoms_with_rve();
  const std::vector<Drive> wanted = drives(atoms);
  fix->modify->addstep_compute(fix->update->ntimestep + 1);
  advance(atoms, wanted);
}

/* ---------------------------------------------------------------------- */

template <int D>
macro::PathStep FixRve::ImplOf<D>::path_step(int atom, const macro::RveClock &clock) const
{
  return {clock.dt, clock.substeps, settings.servo_gain.value_or(points->servo_gain(slot[atom])),
          settings.servo_max_rate.value_or(macro::SERVO_STRAIN_PER_STEP / clock.dt)};
}

template <int D> void FixRve::ImplOf<D>::begin_paths(const macro::LoadPathsOf<D> &paths)
{
  std::vector<double> numbers;
  for (const int i : atoms_with_rve()) {
    macro::PathState<D> &state = points->path(slot[i]);
    if (state.path >= 0) continue;
    double number = 1.0;
    if (settings.path.number_given) {
      if (numbers.empty()) settings.path.number.evaluate(fix->lmp, fix->igroup, numbers);
      number = numbers[i];
    }
    if (!(number >= 1.0 && number <= paths.size()) || number != std::floor(number))
      fix->error->one(FLERR,
                      "fix rve {}: path_variable is {} for atom {}; it must be a whole number from "
                      "1 to {}, the number of paths",
                      fix->id, number, fix->atom->tag[i], paths.size());
    paths.begin(state, static_cast<int>(number) - 1, point(i).result.deformation);
  }
}

template <int D> void FixRve::ImplOf<D>::advance_on_paths(const macro::LoadPathsOf<D> &paths)
{
  fix->modify->clearstep_compute();
  begin_paths(paths);
  std::vector<int> atoms = atoms_with_rve();
  atoms.erase(std::remove_if(atoms.begin(), atoms.end(),
                             [this](int i) { return points->path(slot[i]).ended != 0; }),
              atoms.end());
  const int num_values = static_cast<int>(settings.path.values.size());
  std::vector<std::vector<double>> values(num_values);
  for (int n = 0; n < num_values; ++n)
    settings.path.values[n].evaluate(fix->lmp, fix->igroup, values[n]);
  fix->modify->addstep_compute(fix->update->ntimestep + 1);

  const macro::RveClock clock = this->clock(fix->update->dt);
  std::vector<Drive> wanted;
  std::vector<double> own(num_values);
  const auto of_atom = [&](int i) {
    for (int n = 0; n < num_values; ++n) own[n] = values[n][i];
    return own.data();
  };
  for (const int i : atoms) {
    guarded(
        [&] {
          wanted.push_back(points->path_drive(slot[i], paths, path_step(i, clock), of_atom(i)));
        },
        i);
  }
  advance(atoms, wanted);
  for (const int i : atoms) points->follow_path(slot[i], paths, path_step(i, clock), of_atom(i));
}

template <int D> FixRve::Impl::PathReport FixRve::ImplOf<D>::path_report(int atom) const
{
  const macro::PathState<D> &state = points->path(slot[atom]);
  if (!settings.path.any() || state.path < 0) return {};
  return {state.stage + 1.0, state.time, state.cycles(), static_cast<double>(state.ended)};
}

template <int D> bool FixRve::ImplOf<D>::all_paths_ended() const
{
  int going = 0, any;
  for (const int i : advancing_atoms()) going = going || points->path(slot[i]).ended == 0;
  MPI_Allreduce(&going, &any, 1, MPI_INT, MPI_MAX, fix->world);
  return any == 0;
}

/* ---------------------------------------------------------------------- */

template <int D>
std::vector<rve::DriveOf<D>> FixRve::ImplOf<D>::drives(const std::vector<int> &atoms)
{
  const macro::RveClock clock = this->clock(fix->update->dt);
  std::vector<Drive> drives(atoms.size());
  std::vector<double> values;
  for (const auto &rate : settings.velocity_gradient) {
    rate.value.evaluate(fix->lmp, fix->igroup, values);
    for (std::size_t k = 0; k < atoms.size(); ++k)
      drives[k].velocity_gradient(rate.row, rate.column) = values[atoms[k]];
  }
  for (std::size_t k = 0; k < atoms.size(); ++k)
    check(drives[k].velocity_gradient, "velocity gradient", "[1/time]", atoms[k]);
  if (settings.stress_goal.empty()) {
    // with adaptive substeps RVEs have a time of their own, but the strain is that of the LAMMPS step
    const double dt_of_path = settings.macro_step.adaptive ? fix->update->dt / clock.substeps
                                                           : clock.dt;
    for (std::size_t k = 0; k < drives.size(); ++k) {
      guarded(
          [&] {
            drives[k] = Drive::constant_velocity_gradient(drives[k].velocity_gradient, dt_of_path,
                                                          clock.substeps);
          },
          atoms[k]);
      drives[k].dt = clock.dt;
    }
    return drives;
  }
  for (const auto &goal : settings.stress_goal) {
    goal.value.evaluate(fix->lmp, fix->igroup, values);
    for (std::size_t k = 0; k < atoms.size(); ++k) {
      const double stress = values[atoms[k]];
      drives[k].controlled[goal.row][goal.column] = true;
      drives[k].stress_goal(goal.row, goal.column) = stress;
      if (!(goal.row == goal.column && stress > 0.0) || warned_tension) continue;
      warned_tension = true;
      notes.push_back(
          {fix->atom->tag[atoms[k]], NoteKind::Tension,
           fmt::format("the goal of servo {} is {} [stress] for atom {} at step {}, a tension, and "
                       "grains without cohesion carry none: the cell opens without end; it should "
                       "be at most 0, because stresses are negative in compression",
                       rve_component_name(goal.row, goal.column), rve::number(stress),
                       fix->atom->tag[atoms[k]], fix->update->ntimestep)});
    }
  }
  for (std::size_t k = 0; k < atoms.size(); ++k) {
    Drive &drive = drives[k];
    drive.dt = clock.dt;
    drive.substeps = clock.substeps;
    drive.servo_gain = settings.servo_gain.value_or(points->servo_gain(slot[atoms[k]]));
    drive.servo_max_rate =
        settings.servo_max_rate.value_or(macro::SERVO_STRAIN_PER_STEP / clock.dt);
  }
  return drives;
}

/* ----------------------------------------------------------------------
   RVEs, frozen ones, DEM steps, rebuilds, lattice reductions, repeats, worst status,
   DEM time step, DEM steps per LAMMPS step, wall time per advance,
   mean and largest deviation from shadows, atom ID of the largest, RVEs that were skipped,
   RVEs whose path has ended, largest error of a steered stress, RVEs that are copies side by side,
   fresh RVEs in place of others
------------------------------------------------------------------------- */

template <int D> double FixRve::ImplOf<D>::vector_component(int n) const
{
  const auto now = Impl::clock(fix->update->dt);
  if (n == 7) return now.dt;
  if (n == 8 && !settings.macro_step.adaptive) return now.substeps;
  if (n >= 10 && n <= 12) {
    const auto report = shadow_report();
    return n == 10 ? report.mean : n == 11 ? report.largest : report.atom;
  }

  double mine = 0.0, all = 0.0;
  int status = 0, any_status = 0;
  for (const int i : atoms_with_rve()) {
    const auto &point = this->point(i);
    const auto &counters = point.result.counters;
    const double values[] = {1.0,
                             point.frozen() ? 1.0 : 0.0,
                             (double) counters.steps,
                             (double) counters.rebuilds,
                             (double) counters.lattice_reductions,
                             (double) counters.repeats};
    if (n < 6) mine += values[n];
    if (n == 8) mine = MAX(mine, point.drive.substeps);
    if (n == 13) mine += point.asleep() ? 1.0 : 0.0;
    if (n == 14) mine += settings.path.any() && point.path.ended ? 1.0 : 0.0;
    if (n == 15) mine = MAX(mine, point.servo_error);
    if (n == 16) mine += point.copies > 1 ? 1.0 : 0.0;
    if (n == 17) mine += point.renewals;
    status |= static_cast<int>(point.result.status);
  }
  if (n == 6) {
    MPI_Allreduce(&status, &any_status, 1, MPI_INT, MPI_BOR, fix->world);
    return any_status;
  }
  if (n == 9)
    mine = num_advances ? points.as_they_are().total_time() / static_cast<double>(num_advances)
                        : 0.0;
  const bool is_largest = n == 8 || n == 9 || n == 15;
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, is_largest ? MPI_MAX : MPI_SUM, fix->world);
  return all;
}

/* ---------------------------------------------------------------------- */

template <int D> double FixRve::ImplOf<D>::bytes() const
{
  double bytes = 0.0;
  for (const int i : atoms_with_rve()) bytes += points->bytes(slot[i]);
  return bytes;
}

template <int D> double FixRve::ImplOf<D>::measured_wave_share(const std::vector<int> &atoms) const
{
  if (atoms.empty()) return 0.0;
  return guarded([&] {
    const rve::Format format = settings.options.format;
    macro::TangentProbesOf<D> probes(
        fix->template empty_engine<D>(format),
        macro::TangentOptions::of(format, macro::TangentKind::Elastic));
    const auto state_of = [&](int atom) { return points->state(slot[atom]); };
    if constexpr (D == 3)
      if (fix->lmp->domain->dimension == 3)
        return of_space->measured_wave_share(atoms, probes, state_of);
    return of_plane.measured_wave_share(atoms, probes, state_of);
  });
}

template <int D> double FixRve::ImplOf<D>::bulk_density(int atom) const
{
  const auto &point = this->point(atom);
  return point.material.density / (1.0 + point.result.void_ratio);
}

template <int D> double FixRve::ImplOf<D>::inertial_number(int atom) const
{
  const auto &point = this->point(atom);
  return rve::inertial_number(point.last_steps(), point.material, point.strain_rate());
}

template <int D> void FixRve::ImplOf<D>::write_dump(int atom, const std::string &path) const
{
  guarded([&] { rve::write_lammps_data(path, points->state(slot[atom])); }, atom);
}

/* ---------------------------------------------------------------------- */

macro::RveClock FixRve::Impl::clock(double lammps_dt) const
{
  if (settings.substeps > 0) return {dt, settings.substeps};
  // a ratio that is whole but for rounding shall not cost a step more
  const double steps = std::max(1.0, std::ceil(lammps_dt / dt * (1.0 - 1e-12)));
  const int of_shadows = settings.steps_per_step();
  if (!(steps * of_shadows <= MAXSMALLINT))
    fix->error->all(FLERR,
                    "fix rve {}: a timestep of {} [time] takes {} DEM steps of dt {} [time]{}; "
                    "there can be {} at most: use a longer dt or a shorter timestep",
                    fix->id, rve::number(lammps_dt), rve::number(steps), rve::number(dt),
                    of_shadows > 1 ? fmt::format(", {} times as many of a shadow", of_shadows) : "",
                    MAXSMALLINT);
  const int substeps = static_cast<int>(steps);
  if (settings.macro_step.adaptive) return {dt, substeps};    // the number is chosen for each RVE
  return {lammps_dt / substeps, substeps};
}

template struct FixRve::ImplOf<2>;
template struct FixRve::ImplOf<3>;
