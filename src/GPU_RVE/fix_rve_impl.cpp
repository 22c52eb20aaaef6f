// SPDX-License-Identifier: GPL-2.0-only

#include "fix_rve_impl.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "lammps/rank_resources.h"
#include "rve/core/error.h"
#include "rve/core/threads.h"
#include "rve/engine/cell_width.h"
#include "rve/engine/files.h"
#include "rve/engine/packing_io.h"
#include "timer.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace LAMMPS_NS;

std::unique_ptr<FixRve::Impl> FixRve::Impl::make(FixRve *fix, FixRveSettings settings)
{
  if (settings.dimension == 3) return std::make_unique<ImplOf<3>>(fix, std::move(settings));
  return std::make_unique<ImplOf<2>>(fix, std::move(settings));
}

template <int D> void FixRve::ImplOf<D>::read_packings()
{
  packings.read(lmp, settings);
  if (settings.dt_auto)
    dt = settings.dt_fraction * packings.least_bound();
  else
    for (int k = 0; k < packings.size(); ++k)
      time_step.check(dt, packings.bounds()[k], packings.name(k));
}

template <int D> void FixRve::ImplOf<D>::make_engine()
{
  read_packings();
  const RankResources share(world);
  settings.options.device_number = share.rank;
  if (!settings.threads_given) settings.options.threads = share.threads();
  settings.options.log = [fix = fix](const std::string &line) {
    // all ranks compile the kernels that they need at the same time, and rank 0 has the log file
    if (fix->comm->me != 0) return;
    utils::logmesg(fix->lmp, fmt::format("fix rve {}: {}\n", fix->id, line));
    utils::flush_buffers(fix->lmp);
  };
  std::string notice;
  // some ranks can fail while others succeed, because there can be fewer devices than ranks
  collectively(lmp, settings.name(), [&] {
    settings.options.contacts = packings.contacts();
    auto engine = rve::make_engine<D>(settings.options, &notice);
    std::unique_ptr<rve::EngineOf<D>> shadows;
    if (settings.num_shadows > 0) {
      rve::Options precise = settings.options;
      precise.format = rve::Format::Double;
      precise.arithmetic = rve::Arithmetic::Strict;
      shadows = rve::make_engine<D>(precise);
    }
    points = std::make_unique<macro::RvePointsOf<D>>(std::move(engine), std::move(shadows),
                                                     settings.macro_step, this->threads());
  });
  // The limit is global: this fix overwrites the value of an earlier fix rve. With a limit for each
  // fix, teams of two sizes would alternate, and OpenMP would end and create threads repeatedly.
  const bool is_beside_gpu = points->cuda_device() >= 0 && !settings.threads_given;
  rve::most_in_a_team() = is_beside_gpu ? share.threads_beside_gpu() : rve::MOST_THREADS;
  int on_device = points->cuda_device() >= 0 ? 1 : 0, on_all;
  MPI_Allreduce(&on_device, &on_all, 1, MPI_INT, MPI_MIN, world);
  this->all_on_devices = on_all == 1;

  int has_notice = notice.empty() ? 0 : 1, with_notice;
  MPI_Allreduce(&has_notice, &with_notice, 1, MPI_INT, MPI_SUM, world);
  if (comm->me) return;
  utils::logmesg(lmp, "fix rve {}: {}\n", fix->id, points->description());
  if (share.bound_ranks > 0)
    error->warning(FLERR,
                   "fix rve {}: {} of {} MPI ranks on this machine are bound to one core each and "
                   "use one thread, although the machine has more cores; bind them to more cores, "
                   "for example with mpirun --bind-to none",
                   fix->id, share.bound_ranks, share.ranks);
  if (has_notice)
    utils::logmesg(lmp, "fix rve {}: {}\n", fix->id, notice);
  else if (with_notice)
    error->warning(FLERR,
                   "fix rve {}: {} of {} MPI ranks have no CUDA device; their RVEs use CPU threads",
                   fix->id, with_notice, comm->nprocs);
}

template <int D> void FixRve::ImplOf<D>::init()
{
  this->find_variables();
  attach();
  this->check_clock();
  this->check_dump();
  shadows.choose();
  set_exchange_size();
  advice.advise(true);
}

template <int D> void FixRve::ImplOf<D>::setup()
{
  // the material may have changed since the last run
  if (settings.dt_check_interval) time_step.recheck(Check::Run);
  // a file that cannot be written ends the run before its first step, not at the first dump
  if (settings.dump_interval)
    collectively(lmp, fmt::format("fix rve {}: dump", fix->id), [&] {
      for (const int i : this->dumped_atoms()) rve::require_writable(this->dump_file(i));
    });
  progress.begin([this] { return this->dem_steps(); });
}

/// Advances the RVEs, unless fix mpm does so.
template <int D> void FixRve::ImplOf<D>::final_integrate()
{
  if (settings.driver != RveDriver::Mpm) drives.advance_by_script();
}

template <int D> void FixRve::ImplOf<D>::end_of_step()
{
  if (!checks_postponed) {
    this->finish();
    this->log_notes();
  }
  if (settings.path.halts && drives.all_paths_ended()) {
    is_halted = true;
    timer->force_timeout();
  }
  progress.step_done([this] { return this->dem_steps(); });
  const bigint step = update->ntimestep;
  if (settings.dt_check_interval) {
    const bool due = step % settings.dt_check_interval == 0;
    if (due || !checks_postponed) time_step.recheck(due ? Check::Interval : Check::EveryStep);
    if (due) advice.advise(false);
  }
  if (settings.dump_interval && step % settings.dump_interval == 0)
    for (const int i : this->dumped_atoms())
      this->guarded([&] { rve::write_lammps_data(this->dump_file(i), points->state(slot[i])); }, i);
}

template <int D> void FixRve::ImplOf<D>::post_run()
{
  this->has_run = this->has_run || update->nsteps > 0;
  run_postponed_checks();
  // the run can have further steps after the last check at the interval
  const int interval = settings.dt_check_interval;
  if (interval && update->ntimestep % interval) {
    time_step.recheck(Check::Run);
    advice.advise(false);
  }
  advice.report_fast_strain();
  if (std::exchange(is_halted, false)) {
    timer->reset_timeout();
    if (comm->me == 0)
      utils::logmesg(lmp, "fix rve {}: all paths have ended at step {}\n", fix->id,
                     update->ntimestep);
  }
  if (const int frozen = std::exchange(this->num_frozen, 0); frozen > 1)
    utils::logmesg(lmp, "fix rve {}: {} RVEs were frozen in this run\n", fix->id, frozen);
  shadows.log_report();
  progress.end();
}

template <int D> void FixRve::ImplOf<D>::attach()
{
  const bool is_continued = changes.continues();
  changes.adopt_restart();
  std::vector<int> atoms;
  for (int i = 0; i < atom->nlocal; i++)
    if ((atom->mask[i] & fix->groupbit) && slot[i] < 0) atoms.push_back(i);
  bigint mine = atoms.size(), total;
  MPI_Allreduce(&mine, &total, 1, MPI_LMP_BIGINT, MPI_SUM, world);
  if (total == 0) return;
  if (is_continued && comm->me == 0)
    utils::logmesg(lmp,
                   "fix rve {}: {} atoms of the group had no RVE when the restart file was "
                   "written; their RVEs start from packings\n",
                   fix->id, total);

  const std::vector<const State *> states =
      packings.choose(lmp, fix->igroup, settings.choice, atoms);
  bigint sums[2] = {0, 0}, all_sums[2];
  std::vector<int> grains;
  for (const State *state : states) {
    grains.push_back(state->num_grains());
    sums[0] += state->num_grains();
  }
  rve_memory.check(grains);
  this->guarded([&] {
    const std::vector<int> slots = points->add(states);
    std::vector<int> failed;
    for (std::size_t k = 0; k < slots.size(); ++k) {
      slot[atoms[k]] = slots[k];
      if (points->point(slots[k]).frozen()) failed.push_back(slots[k]);
      sums[1] += static_cast<bigint>(points->bytes(slots[k]));
    }
    this->note_copies(atoms);
    this->report(failed, atoms, this->clock(update->dt).dt, true);
  });
  MPI_Allreduce(sums, all_sums, 2, MPI_LMP_BIGINT, MPI_SUM, world);
  if (comm->me == 0)
    utils::logmesg(lmp,
                   "fix rve {}: {} RVEs with {} grains, {:.1f} MB; DEM time step {} [time], "
                   "stability bound {} [time]\n",
                   fix->id, total, all_sums[0], all_sums[1] / 1048576.0, rve::number(dt),
                   rve::number(packings.least_bound()));
  log_cell_limits(states);
  this->log_notes();
}

template <int D>
void FixRve::ImplOf<D>::log_cell_limits(const std::vector<const State *> &states) const
{
  // Maxima over RVEs. worst[a]: a cell that is compressed below this share of its present width
  // along axis a is too narrow. worst[D]: negative of the number of grains across the cell.
  double worst[D + 1] = {}, of_all[D + 1];
  worst[D] = -HUGE_VAL;
  for (const State *state : states) {
    const auto share = rve::least_share_of_widths(*state, settings.options.skin);
    for (int a = 0; a < D; ++a) worst[a] = std::max(worst[a], share[a]);
    worst[D] = std::max(worst[D], -rve::grains_across(*state));
  }
  MPI_Allreduce(worst, of_all, D + 1, MPI_DOUBLE, MPI_MAX, world);
  if (comm->me == 0)
    utils::logmesg(
        lmp,
        "fix rve {}: cells are at least {:.1f} grains wide; a cell that is compressed below {:.3f} "
        "of its width {}or {:.3f} of its height is too narrow for its grains, and its RVE {}{}\n",
        fix->id, -of_all[D], of_all[0],
        D == 3 ? fmt::format("along x, {:.3f} of its width along y ", of_all[1]) : "",
        of_all[D - 1],
        settings.macro_step.most_copies > 1
            ? fmt::format("continues as up to {} copies side by side, and then ",
                          settings.macro_step.most_copies)
            : "",
        settings.policy == RvePolicy::Stop         ? "ends the run (policy stop)"
            : settings.policy == RvePolicy::Freeze ? "is frozen (policy freeze)"
                                                   : "is replaced by a fresh RVE (policy fresh)");
}

/// Sets one size for the whole run on all ranks and does not use maxexchange_dynamic. With that
/// flag, exchange() of comm_style tiled sets bufextra to the smaller of two values in LAMMPS 2025
/// and older, and the buffers become too small.
template <int D> void FixRve::ImplOf<D>::set_exchange_size()
{
  int mine = RestartRecords::HEADER, most;
  for (const int i : this->atoms_with_rve()) {
    const int bound = RestartRecords::HEADER + points->record_bound(slot[i]);
    mine = std::max(mine, bound);
    if (settings.policy != RvePolicy::Fresh) continue;
    // a fresh RVE can have more grains than the RVE that it replaces
    const double grains =
        static_cast<double>(this->point(i).result.num_grains) / points->copies(slot[i]);
    const double times = std::max(1.0, packings.most_grains() / std::max(grains, 1.0));
    mine = std::max(mine, static_cast<int>(std::ceil(times * bound)));
  }
  MPI_Allreduce(&mine, &most, 1, MPI_INT, MPI_MAX, world);
  fix->maxexchange = std::max(fix->maxexchange, most);
}

/// If the last advance was in the present step, its checks remain postponed. The scheme USAVG calls
/// this function in the middle of a step.
template <int D> void FixRve::ImplOf<D>::synchronise_ranks()
{
  this->finish();
  if (update->ntimestep != this->step_of_advance) run_postponed_checks();
}

template <int D> void FixRve::ImplOf<D>::run_postponed_checks()
{
  this->finish();
  if (!std::exchange(checks_postponed, false)) return;
  this->reports_last_advance = true;
  this->log_notes();
  if (settings.dt_check_interval) time_step.recheck(Check::EveryStep);
  this->reports_last_advance = false;
}

template <int D>
macro::InSituReport FixRve::ImplOf<D>::bring_to_stress(const std::vector<int> &atoms,
                                                       const std::vector<macro::StressGoal> &goals,
                                                       double tolerance)
{
  std::string message;
  macro::InSituReport report;
  this->guarded([&] {
    try {
      report = macro::bring_to_stress(*points, this->slots_of(atoms), goals, tolerance, dt);
    } catch (const macro::InSituError &problem) {
      message = this->failure_context(atoms[problem.index()]) + ": " + problem.what();
    }
  });
  error_if_any(lmp, message);
  if (settings.dt_check_interval) time_step.recheck(Check::InSitu);
  return report;
}

/// Returns component n of the vector. The components are the numbers of RVEs and of frozen RVEs (0,
/// 1), DEM steps, list rebuilds, lattice reductions and repeated steps (2 to 5), the status bits of
/// all RVEs (6), the DEM time step (7), DEM steps per LAMMPS step (8), wall time per advance (9),
/// mean and largest deviation from shadows and the atom ID of the largest (10 to 12), the numbers
/// of quiescent RVEs and of RVEs whose path has ended (13, 14), the largest error of a steered
/// stress (15), the number of RVEs that are several copies side by side (16), and how often a fresh
/// RVE has replaced a failed one (17).
template <int D> double FixRve::ImplOf<D>::vector_component(int n) const
{
  const auto now = this->clock(update->dt);
  if (n == 7) return now.dt;
  if (n == 8 && !settings.macro_step.adaptive) return now.substeps;
  if (n >= 10 && n <= 12) {
    const auto report = shadows.report();
    return n == 10 ? report.mean : n == 11 ? report.largest : report.atom;
  }

  double mine = 0.0, all = 0.0;
  int status = 0, any_status = 0;
  for (const int i : this->atoms_with_rve()) {
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
    if (n == 13) mine += point.is_quiescent() ? 1.0 : 0.0;
    if (n == 14) mine += settings.path.any() && point.path.ended ? 1.0 : 0.0;
    if (n == 15) mine = MAX(mine, point.servo_error);
    if (n == 16) mine += point.copies > 1 ? 1.0 : 0.0;
    if (n == 17) mine += point.renewals;
    status |= static_cast<int>(point.result.status);
  }
  if (n == 6) {
    MPI_Allreduce(&status, &any_status, 1, MPI_INT, MPI_BOR, world);
    return any_status;
  }
  if (n == 9)
    mine = this->num_advances
        ? points.as_they_are().total_time() / static_cast<double>(this->num_advances)
        : 0.0;
  const bool is_largest = n == 8 || n == 9 || n == 15;
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, is_largest ? MPI_MAX : MPI_SUM, world);
  return all;
}

template <int D> double FixRve::ImplOf<D>::bytes() const
{
  double bytes = 0.0;
  for (const int i : this->atoms_with_rve()) bytes += points->bytes(slot[i]);
  return bytes;
}

template <int D> double FixRve::ImplOf<D>::measured_wave_share(const std::vector<int> &atoms) const
{
  if (atoms.empty()) return 0.0;
  return this->guarded([&] {
    const rve::Format format = settings.options.format;
    macro::TangentProbesOf<D> probes(
        this->empty_engine(format), macro::TangentOptions::of(format, macro::TangentKind::Elastic));
    const auto state_of = [&](int atom) { return points->state(slot[atom]); };
    if constexpr (D == 3)
      if (lmp->domain->dimension == 3)
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

template struct FixRve::ImplOf<2>;
template struct FixRve::ImplOf<3>;
