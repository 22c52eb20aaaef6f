// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/progress.h"

#include "comm.h"
#include "lammps.h"
#include "lammps/script_words.h"
#include "platform.h"
#include "rve/core/error.h"
#include "update.h"
#include "utils.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>
#include <mpi.h>
#include <utility>

using namespace LAMMPS_NS;

namespace {

double sum_over_ranks(LAMMPS *lmp, const Progress::RveSteps &rve_steps)
{
  double steps = rve_steps ? rve_steps() : 0.0;
  MPI_Allreduce(MPI_IN_PLACE, &steps, 1, MPI_DOUBLE, MPI_SUM, lmp->world);
  return steps;
}

}    // namespace

std::string LAMMPS_NS::hours_minutes_seconds(double seconds)
{
  const auto whole = static_cast<bigint>(std::llround(seconds));
  return fmt::format("{}:{:02d}:{:02d}", whole / 3600, whole / 60 % 60, whole % 60);
}

double LAMMPS_NS::read_progress(ScriptWords &words)
{
  const double seconds = words.number();
  if (!(seconds >= 0.0))
    words.refuse(fmt::format("progress is {} [seconds of wall time]; it must be at least 0, which "
                             "means never",
                             rve::number(seconds)));
  return seconds;
}

Progress::Progress(LAMMPS *_lmp, std::string _who, double _interval) :
    lmp(_lmp), who(std::move(_who)), signals(_lmp, who), interval(_interval),
    last_line(platform::walltime())
{
}

void Progress::begin(const RveSteps &rve_steps)
{
  signals.begin();
  utils::flush_buffers(lmp);    // what has been said before the first step
  if (interval == 0.0) return;
  first_step = lmp->update->ntimestep;
  steps_then = sum_over_ranks(lmp, rve_steps);
  start = time_then = platform::walltime();
}

/* ----------------------------------------------------------------------
   rank 0 looks at its clock: the others' may differ.
   what is left takes as long per step as the run has so far; start and stop of the run command say what the run is part of
------------------------------------------------------------------------- */

void Progress::step_done(const RveSteps &rve_steps)
{
  const double now = platform::walltime();
  if (!signals.step_done(interval > 0.0 && now - last_line >= interval)) return;

  const Update &update = *lmp->update;
  const double steps = sum_over_ranks(lmp, rve_steps);
  if (lmp->comm->me == 0) {
    const double share = static_cast<double>(update.ntimestep - update.beginstep) /
        static_cast<double>(std::max(update.endstep - update.beginstep, bigint(1)));
    const double per_step =
        (now - start) / static_cast<double>(std::max(update.ntimestep - first_step, bigint(1)));
    const double left = per_step * static_cast<double>(update.endstep - update.ntimestep);
    std::string line = fmt::format("{}: step {}, {:.1f} % of the run, {} left", who,
                                   update.ntimestep, 100.0 * share, hours_minutes_seconds(left));
    // fewer than before: atoms have been deleted, and their RVEs with them
    if (rve_steps)
      line += fmt::format(", {:.3g} million RVE-steps per second",
                          1e-6 * std::max(steps - steps_then, 0.0) / (now - time_then));
    utils::logmesg(lmp, line + "\n");
    utils::flush_buffers(lmp);    // who follows the log sees it, and a signal cannot lose it
  }
  steps_then = steps;
  last_line = time_then = now;
}
