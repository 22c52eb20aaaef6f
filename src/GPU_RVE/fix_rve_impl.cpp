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
#include "rve/engine/packing_io.h"
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
  this->packings.read(this->lmp, this->settings);
  const std::vector<double> &bounds = this->packings.bounds();
  if (this->settings.dt_auto) {
    this->dt = this->settings.dt_fraction * *std::min_element(bounds.begin(), bounds.end());
    return;
  }
  for (int k = 0; k < this->packings.size(); ++k)
    time_step.check(this->dt, bounds[k], this->packings.name(k));
}

template <int D> void FixRve::ImplOf<D>::make_engine()
{
  const RankResources share(this->world);
  this->settings.options.device_number = share.rank;
  if (!this->settings.threads_given) this->settings.options.threads = share.threads();
  this->settings.options.log = [fix = this->fix](const std::string &line) {
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
  collectively(this->lmp, "fix rve", [&] {
    this->settings.options.contacts = this->packings.contacts();
    auto engine = rve::make_engine<D>(this->settings.options, &notice);
    std::unique_ptr<rve::EngineOf<D>> shadows;
    if (this->settings.num_shadows > 0) {
      rve::Options precise = this->settings.options;
      precise.format = rve::Format::Double;
      precise.arithmetic = rve::Arithmetic::Strict;
      shadows = rve::make_engine<D>(precise);
    }
    this->points = std::make_unique<macro::RvePointsOf<D>>(
        std::move(engine), std::move(shadows), this->settings.macro_step, this->threads());
  });
  // what a fix before this one has chosen does not last: beside an engine on the CPU teams of two sizes would alternate
  const bool is_beside_gpu = this->points->cuda_device() >= 0 && !this->settings.threads_given;
  rve::most_in_a_team() = is_beside_gpu ? share.threads_beside_gpu() : rve::MOST_THREADS;
  int on_device = this->points->cuda_device() >= 0 ? 1 : 0, on_all;
  MPI_Allreduce(&on_device, &on_all, 1, MPI_INT, MPI_MIN, this->world);
  this->all_on_devices = on_all == 1;

  int has_notice = notice.empty() ? 0 : 1, with_notice;
  MPI_Allreduce(&has_notice, &with_notice, 1, MPI_INT, MPI_SUM, this->world);
  if (this->comm->me) return;
  utils::logmesg(this->lmp, "fix rve {}: {}\n", this->fix->id, this->points->description());
  if (share.bound_ranks > 0)
    this->error->warning(
        FLERR,
        "fix rve: {} of {} MPI ranks on this machine are bound to one core each and use one "
        "thread, "
        "though there are more cores; give them more, with mpirun --bind-to none for example",
        share.bound_ranks, share.ranks);
  if (has_notice)
    utils::logmesg(this->lmp, "fix rve {}: {}\n", this->fix->id, notice);
  else if (with_notice)
    this->error->warning(
        FLERR, "fix rve: {} of {} MPI ranks have no CUDA device; their RVEs are on CPU threads",
        with_notice, this->comm->nprocs);
}

template <int D> void FixRve::ImplOf<D>::attach()
{
  const bool is_continued = changes.continues();
  changes.adopt_restart();
  const Atom *atom = this->atom;
  std::vector<int> atoms;
  for (int i = 0; i < atom->nlocal; i++)
    if ((atom->mask[i] & this->fix->groupbit) && this->slot[i] < 0) atoms.push_back(i);
  bigint mine = atoms.size(), total;
  MPI_Allreduce(&mine, &total, 1, MPI_LMP_BIGINT, MPI_SUM, this->world);
  if (total == 0) return;
  if (is_continued && this->comm->me == 0)
    utils::logmesg(
        this->lmp,
        "fix rve {}: {} atoms of the group had no RVE when the restart file was written; "
        "their RVEs begin from packings\n",
        this->fix->id, total);

  const std::vector<const State *> states =
      this->packings.choose(this->lmp, this->fix->igroup, this->settings.choice, atoms);
  bigint sums[2] = {0, 0}, all_sums[2];
  std::vector<int> grains;
  for (const State *state : states) {
    grains.push_back(state->num_grains());
    sums[0] += state->num_grains();
  }
  rve_memory.check(grains);
  this->guarded([&] {
    const std::vector<int> slots = this->points->add(states);
    std::vector<int> failed;
    for (std::size_t k = 0; k < slots.size(); ++k) {
      this->slot[atoms[k]] = slots[k];
      if (this->points->point(slots[k]).frozen()) failed.push_back(slots[k]);
      sums[1] += static_cast<bigint>(this->points->bytes(slots[k]));
    }
    this->note_copies(atoms);
    this->report(failed, atoms, this->clock(this->update->dt).dt, true);
  });
  MPI_Allreduce(sums, all_sums, 2, MPI_LMP_BIGINT, MPI_SUM, this->world);
  if (this->comm->me == 0)
    utils::logmesg(this->lmp,
                   "fix rve {}: {} RVEs with {} grains, {:.1f} MB; DEM time step {}, stability "
                   "bound {}\n",
                   this->fix->id, total, all_sums[0], all_sums[1] / 1048576.0,
                   rve::number(this->dt),
                   rve::number(*std::min_element(this->packings.bounds().begin(),
                                                 this->packings.bounds().end())));
  say_how_far_cells_go(states);
  this->say_notes();
}

template <int D>
void FixRve::ImplOf<D>::say_how_far_cells_go(const std::vector<const State *> &states) const
{
  double worst[D + 1] = {}, of_all[D + 1];    // least shares, and -grains
  worst[D] = -HUGE_VAL;
  for (const State *state : states) {
    const auto share = rve::least_share_of_widths(*state, this->settings.options.skin);
    for (int a = 0; a < D; ++a) worst[a] = std::max(worst[a], share[a]);
    worst[D] = std::max(worst[D], -rve::grains_across(*state));
  }
  MPI_Allreduce(worst, of_all, D + 1, MPI_DOUBLE, MPI_MAX, this->world);
  if (this->comm->me == 0)
    utils::logmesg(
        this->lmp,
        "fix rve {}: cells are at least {:.1f} grains wide; a cell compressed to less "
        "than {:.3f} of its width {}or {:.3f} of its height is too narrow for its "
        "grains, {}{}\n",
        this->fix->id, -of_all[D], of_all[0],
        D == 3 ? fmt::format("along x, {:.3f} of that along y ", of_all[1]) : "", of_all[D - 1],
        this->settings.macro_step.most_copies > 1
            ? fmt::format("is continued by up to {} copies of it side by side, and then ",
                          this->settings.macro_step.most_copies)
            : "and ",
        this->settings.policy == RvePolicy::Stop         ? "ends the run (policy stop)"
            : this->settings.policy == RvePolicy::Freeze ? "its RVE is frozen"
                                                         : "a fresh RVE takes its place");
}

/// Sets the size for the whole run, on all ranks: with maxexchange_dynamic the buffers of
/// comm_style tiled would become too small (LAMMPS of 2025 and before, whose exchange() gives
/// bufextra the smaller of two values).
template <int D> void FixRve::ImplOf<D>::set_exchange_size()
{
  int mine = RestartRecords::HEADER, most;
  for (const int i : this->atoms_with_rve()) {
    const int bound = RestartRecords::HEADER + this->points->record_bound(this->slot[i]);
    mine = std::max(mine, bound);
    if (this->settings.policy != RvePolicy::Fresh) continue;
    // another packing may take its place, and it may have more grains
    const double grains =
        static_cast<double>(this->point(i).result.num_grains) / this->points->copies(this->slot[i]);
    const double times = std::max(1.0, this->packings.most_grains() / std::max(grains, 1.0));
    mine = std::max(mine, static_cast<int>(std::ceil(times * bound)));
  }
  MPI_Allreduce(&mine, &most, 1, MPI_INT, MPI_MAX, this->world);
  this->fix->maxexchange = std::max(this->fix->maxexchange, most);
}

/// The scheme USAVG calls this in the middle of a step, too: postponed checks wait for its end.
template <int D> void FixRve::ImplOf<D>::synchronise_ranks()
{
  this->finish();
  if (this->update->ntimestep != this->step_of_advance) run_postponed_checks();
}

template <int D> void FixRve::ImplOf<D>::run_postponed_checks()
{
  this->finish();
  if (!std::exchange(this->checks_postponed, false)) return;
  this->reports_last_advance = true;
  this->say_notes();
  if (this->settings.dt_check_interval) time_step.recheck(Impl::Check::EveryStep);
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
      report =
          macro::bring_to_stress(*this->points, this->slots_of(atoms), goals, tolerance, this->dt);
    } catch (const macro::InSituError &problem) {
      message = this->place_of_failure(atoms[problem.place()]) + ": " + problem.what();
    }
  });
  error_if_any(this->lmp, message);
  if (this->settings.dt_check_interval) time_step.recheck(Impl::Check::InSitu);
  return report;
}

/// Returns component n: RVEs, frozen ones, DEM steps, rebuilds, lattice reductions, repeats, worst
/// status, DEM time step, DEM steps per LAMMPS step, wall time per advance, mean and largest
/// deviation from shadows, atom ID of the largest, RVEs that were skipped, RVEs whose path has
/// ended, largest error of a steered stress, RVEs that are copies side by side, fresh RVEs in place
/// of others.
template <int D> double FixRve::ImplOf<D>::vector_component(int n) const
{
  const auto now = this->clock(this->update->dt);
  if (n == 7) return now.dt;
  if (n == 8 && !this->settings.macro_step.adaptive) return now.substeps;
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
    if (n == 13) mine += point.asleep() ? 1.0 : 0.0;
    if (n == 14) mine += this->settings.path.any() && point.path.ended ? 1.0 : 0.0;
    if (n == 15) mine = MAX(mine, point.servo_error);
    if (n == 16) mine += point.copies > 1 ? 1.0 : 0.0;
    if (n == 17) mine += point.renewals;
    status |= static_cast<int>(point.result.status);
  }
  if (n == 6) {
    MPI_Allreduce(&status, &any_status, 1, MPI_INT, MPI_BOR, this->world);
    return any_status;
  }
  if (n == 9)
    mine = this->num_advances
        ? this->points.as_they_are().total_time() / static_cast<double>(this->num_advances)
        : 0.0;
  const bool is_largest = n == 8 || n == 9 || n == 15;
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, is_largest ? MPI_MAX : MPI_SUM, this->world);
  return all;
}

template <int D> double FixRve::ImplOf<D>::bytes() const
{
  double bytes = 0.0;
  for (const int i : this->atoms_with_rve()) bytes += this->points->bytes(this->slot[i]);
  return bytes;
}

template <int D> double FixRve::ImplOf<D>::measured_wave_share(const std::vector<int> &atoms) const
{
  if (atoms.empty()) return 0.0;
  return this->guarded([&] {
    const rve::Format format = this->settings.options.format;
    macro::TangentProbesOf<D> probes(
        this->empty_engine(format), macro::TangentOptions::of(format, macro::TangentKind::Elastic));
    const auto state_of = [&](int atom) { return this->points->state(this->slot[atom]); };
    if constexpr (D == 3)
      if (this->lmp->domain->dimension == 3)
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

template <int D> void FixRve::ImplOf<D>::write_dump(int atom) const
{
  this->guarded(
      [&] { rve::write_lammps_data(this->dump_file(atom), this->points->state(this->slot[atom])); },
      atom);
}

template struct FixRve::ImplOf<2>;
template struct FixRve::ImplOf<3>;
