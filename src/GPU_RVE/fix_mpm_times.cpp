// SPDX-License-Identifier: GPL-2.0-only

#include "fix_mpm_jobs.h"

#include "comm.h"
#include "timer.h"
#include "update.h"

using namespace LAMMPS_NS;

// wall time of a run above which its parts are logged [seconds]
static constexpr double LONG_RUN = 1.0;

template <int D> typename MpmTimes<D>::Moment MpmTimes<D>::now() const
{
  Moment moment;
  for (std::size_t k = 0; k < setup.grains.size(); k++)
    if (setup.grains[k]) moment.models += setup.solver->model_time((int) k);
  for (const FixRve *source : setup.sources()) {
    moment.engine += source->rves().engine_time();
    moment.bounds += source->rves().bounding_time();
  }
  moment.copies = setup.solver->transfer_time();
  moment.clock = platform::walltime();
  return moment;
}

template <int D> void MpmTimes<D>::end_step()
{
  const Moment ended = now();
  const double engine = ended.engine - begun.engine;
  const double in_rves = engine + ended.bounds - begun.bounds;
  // time for filling the output columns, without the RVE updates that it waits for
  const double columns = ended.clock - solved.clock - (ended.models - solved.models);
  // transfers: output columns, copies from and to a device, and the work of RVE models outside the
  // engine
  const double transfers =
      columns + solved.copies - begun.copies + ended.models - begun.models - engine;
  seconds[RVE] += in_rves;
  seconds[TRANSFERS] += transfers;
  seconds[MPM] += ended.clock - begun.clock - transfers - in_rves;
}

template <int D> void MpmTimes<D>::report() const
{
  double all[] = {seconds[RVE], seconds[MPM], seconds[TRANSFERS], timer->get_wall(Timer::OUTPUT),
                  timer->get_wall(Timer::TOTAL)};
  MPI_Allreduce(MPI_IN_PLACE, all, 5, MPI_DOUBLE, MPI_SUM, world);
  for (double &time : all) time /= comm->nprocs;
  const double total = all[4];
  if (comm->me != 0 || total < LONG_RUN || update->nsteps == 0) return;
  const double per_step = 1e3 / update->nsteps;
  utils::logmesg(lmp,
                 "fix mpm {}: wall time {:.2f} s; per step [ms]: RVE {:.3f}, MPM {:.3f}, transfers "
                 "{:.3f}, LAMMPS {:.3f}, output {:.3f}\n",
                 setup.fix->id, total, per_step * all[0], per_step * all[1], per_step * all[2],
                 per_step * (total - all[0] - all[1] - all[2] - all[3]), per_step * all[3]);
}

template <int D> double MpmTimes<D>::longest(int part) const
{
  double time = seconds[part];
  MPI_Allreduce(MPI_IN_PLACE, &time, 1, MPI_DOUBLE, MPI_MAX, world);
  return time;
}

template class LAMMPS_NS::MpmTimes<2>;
template class LAMMPS_NS::MpmTimes<3>;
