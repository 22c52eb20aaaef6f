// SPDX-License-Identifier: GPL-2.0-only
#include "fix_rve_jobs.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "rve/core/first_error.h"
#include "rve/core/threads.h"
#include "rve/engine/finite_strain.h"
#include "update.h"

#include <algorithm>
#include <utility>

using namespace LAMMPS_NS;

// Share of RVEs with inertial numbers above the limit of quasi-static deformation that causes a
// warning. A few RVEs near edges of rigid bodies exceed the limit in almost every model, and the
// global response does not depend on them.
static constexpr double NOTABLE_SHARE = 0.05;

template <int D> void RveAdvice<D>::advise(bool at_start)
{
  constexpr int KINDS = rve::NUM_ADVICE_KINDS;
  rves.complete();
  const std::vector<int> atoms = rves.atoms_with_rve();
  const int count = static_cast<int>(atoms.size());
  std::vector<std::vector<rve::Advice>> lists(count);
  rve::FirstError failed;
  {
    const rve::LightWork work(count, rves.threads());
#pragma omp parallel for num_threads(work.team)
    for (int k = 0; k < count; ++k)
      failed.guard(k, [&] { lists[k] = advice_on(atoms[k], at_start); });
  }
  rves.guarded([&] { failed.rethrow(); });
  // find the worst RVE for each kind of advice; among equally bad RVEs, the one with the lowest
  // atom ID
  double worst[KINDS] = {}, worst_of_all[KINDS];
  int beyond[KINDS] = {}, all_beyond[KINDS];
  tagint id[KINDS], lowest[KINDS];
  std::string message[KINDS];
  std::fill_n(id, KINDS, MAXTAGINT);
  for (int k = 0; k < count; ++k)
    for (const rve::Advice &advice : lists[k]) {
      const int kind = static_cast<int>(advice.kind);
      const double severity = advice.severity();
      const tagint tag = atom->tag[atoms[k]];
      ++beyond[kind];
      if (severity < worst[kind] || (severity == worst[kind] && tag > id[kind])) continue;
      worst[kind] = severity;
      id[kind] = tag;
      message[kind] = advice.message;
    }
  MPI_Allreduce(worst, worst_of_all, KINDS, MPI_DOUBLE, MPI_MAX, world);
  MPI_Allreduce(beyond, all_beyond, KINDS, MPI_INT, MPI_SUM, world);
  for (int kind = 0; kind < KINDS; ++kind)
    if (worst[kind] < worst_of_all[kind]) id[kind] = MAXTAGINT;
  MPI_Allreduce(id, lowest, KINDS, MPI_LMP_TAGINT, MPI_MIN, world);
  int all_rves;
  MPI_Allreduce(&count, &all_rves, 1, MPI_INT, MPI_SUM, world);
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
        lmp,
        id[kind] != lowest[kind]
            ? ""
            : fmt::format(
                  "fix rve {}: in the RVE of atom {}{} at step {}, {}", rves.fix->id, lowest[kind],
                  all_beyond[kind] > 1
                      ? fmt::format(" (and {} other{}, {:.3g} % of the RVEs)", all_beyond[kind] - 1,
                                    all_beyond[kind] > 2 ? "s" : "", 100.0 * share)
                      : "",
                  update->ntimestep, message[kind]));
    // only rank 0 has the log file
    if (comm->me == 0) error->warning(FLERR, text);
  }
}

template <int D> bool RveAdvice<D>::note_fast_strain(double share, double worst, tagint id)
{
  // the previous run has noted this step
  if (update->ntimestep <= update->firststep) return false;
  fast_strain.share = std::max(fast_strain.share, share);
  if (worst > fast_strain.worst) {
    fast_strain.worst = worst;
    fast_strain.id = id;
    fast_strain.step = update->ntimestep;
  }
  return share >= NOTABLE_SHARE && !std::exchange(fast_strain.has_warned, true);
}

template <int D> void RveAdvice<D>::report_fast_strain()
{
  const FastStrain run = std::exchange(fast_strain, {});
  if (comm->me != 0 || run.share == 0.0 || run.has_warned) return;
  constexpr double LIMIT = rve::QUASI_STATIC_INERTIAL_NUMBER;
  utils::logmesg(
      lmp,
      "fix rve {}: up to {:.3g} % of the RVEs had inertial numbers above {:g}, the limit of "
      "quasi-static deformation; the largest was {:.2g} in the RVE of atom {} at step {}\n",
      rves.fix->id, 100.0 * run.share, LIMIT, run.worst * LIMIT, run.id, run.step);
}

template <int D> std::vector<rve::Advice> RveAdvice<D>::advice_on(int atom, bool at_start)
{
  const auto &point = rves.point(atom);
  if (point.frozen()) return {};
  rve::DriveRates motion;
  motion.strain_rate = point.strain_rate();
  motion.dt = point.drive.dt;
  motion.applied_strain = rve::strain_size(point.result.deformation);
  std::vector<rve::Advice> list =
      rve::advice(rves.settings.options.format, point.last_steps(), point.material, motion);
  if (at_start) {
    for (rve::Advice &friction : rve::advice_on_friction(point.material))
      list.push_back(std::move(friction));
  } else if (point.drive.has_servo() || point.out_of_reach > 0.0) {
    for (rve::Advice &servo : rves.points->advice_on_servo(rves.slot[atom]))
      list.push_back(std::move(servo));
  }
  if (rves.settings.options.track_energy)
    for (rve::Advice &energy : rves.points->advice_on_energy(rves.slot[atom], at_start))
      list.push_back(std::move(energy));
  return list;
}

template class LAMMPS_NS::RveAdvice<2>;
template class LAMMPS_NS::RveAdvice<3>;
