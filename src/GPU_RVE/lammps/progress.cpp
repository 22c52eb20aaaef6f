// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/progress.h"

#include "comm.h"
#include "error.h"
#include "lammps.h"
#include "lammps/script_words.h"
#include "output.h"
#include "platform.h"
#include "rve/core/error.h"
#include "timer.h"
#include "update.h"
#include "utils.h"

#include "fmt/format.h"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <mpi.h>
#include <utility>

using namespace LAMMPS_NS;

namespace {

// between two questions of several ranks, if steps take as long as those before
constexpr double LONGEST_WAIT = 0.05;    // seconds
constexpr int MOST_STEPS = 16;

constexpr int SIGNALS[] = {SIGTERM, SIGINT};
constexpr int COUNT = 2;

// signals belong to the program, and so does this
volatile std::sig_atomic_t noted = 0;    // the last one, or 0
bool watching = false;
bool taken[COUNT];
struct sigaction before[COUNT];

extern "C" void note(int signal)
{
  noted = signal;
}

void watch()
{
  if (watching) return;
  watching = true;
  noted = 0;
  struct sigaction action = {};
  action.sa_handler = note;
  // the same signal again does what it does without a handler; calls of the system go on
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  sigemptyset(&action.sa_mask);
  for (int k = 0; k < COUNT; ++k) {
    sigaction(SIGNALS[k], nullptr, &before[k]);
    // ignored by nohup, or by a shell for what it runs in the background
    taken[k] = (before[k].sa_flags & SA_SIGINFO) || before[k].sa_handler != SIG_IGN;
    if (taken[k]) sigaction(SIGNALS[k], &action, nullptr);
  }
}

void stop_watching()
{
  if (!watching) return;
  watching = false;
  for (int k = 0; k < COUNT; ++k)
    if (taken[k]) sigaction(SIGNALS[k], &before[k], nullptr);
}

/// Names of the files that hold the present step, " and " between them.
std::string write_restart_files(LAMMPS *lmp)
{
  Output *output = lmp->output;
  const bigint step = lmp->update->ntimestep;
  if (output->last_restart != step) output->write_restart(step);
  std::string names;
  if (output->restart_flag_single) {
    names = output->restart1;
    const std::size_t star = names.find('*');
    if (star != std::string::npos) names.replace(star, 1, std::to_string(step));
  }
  // the toggle names the next one
  if (output->restart_flag_double)
    names += (names.empty() ? "" : " and ") +
        std::string(output->restart_toggle ? output->restart2a : output->restart2b);
  return names;
}

double sum_over_ranks(LAMMPS *lmp, const Progress::RveSteps &rve_steps)
{
  double steps = rve_steps ? rve_steps() : 0.0;
  MPI_Allreduce(MPI_IN_PLACE, &steps, 1, MPI_DOUBLE, MPI_SUM, lmp->world);
  return steps;
}

/// "2:03:04" of seconds: hours, minutes, seconds.
std::string hours_minutes_seconds(double seconds)
{
  const auto whole = static_cast<bigint>(std::llround(seconds));
  return fmt::format("{}:{:02d}:{:02d}", whole / 3600, whole / 60 % 60, whole % 60);
}

}    // namespace

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
    lmp(_lmp), who(std::move(_who)), interval(_interval), last_line(platform::walltime())
{
}

/// The run may have ended in an error.
Progress::~Progress()
{
  stop_watching();
}

void Progress::begin(const RveSteps &rve_steps)
{
  steps_between = steps_left = 1;
  watch();
  utils::flush_buffers(lmp);    // what has been said before the first step
  if (interval == 0.0) return;
  first_step = lmp->update->ntimestep;
  steps_then = sum_over_ranks(lmp, rve_steps);
  start = time_then = platform::walltime();
}

/// Returns what rank 0 says, so that its question costs no communication of its own.
bool Progress::ask_ranks(bool rank_zero_says)
{
  watch();    // runs with `pre no` have no setup
  const bool alone = lmp->comm->nprocs == 1;
  if (!alone && --steps_left > 0) return false;
  const double now = platform::walltime();
  const auto waited = static_cast<int>(std::min(1e6 * (now - asked), 1e9));    // microseconds
  asked = now;
  int said[] = {lmp->comm->me == 0 && rank_zero_says ? 1 : 0, noted, waited};
  if (!alone) MPI_Allreduce(MPI_IN_PLACE, said, 3, MPI_INT, MPI_MAX, lmp->world);
  const double steps_in_time = steps_between * (1e6 * LONGEST_WAIT) / std::max(said[2], 1);
  const double most = std::min(steps_in_time, 2.0 * steps_between);
  steps_left = steps_between = std::clamp(static_cast<int>(most), 1, MOST_STEPS);
  // noted on all ranks, for the end: this one may have got none
  noted = said[1];
  if (said[1]) lmp->timer->force_timeout();
  return said[0] != 0;
}

/// Rank 0 looks at its clock: those of other ranks may differ.
void Progress::step_done(const RveSteps &rve_steps)
{
  const double now = platform::walltime();
  if (!ask_ranks(interval > 0.0 && now - last_line >= interval)) return;
  const double steps = sum_over_ranks(lmp, rve_steps);
  if (lmp->comm->me == 0) print(now, steps, rve_steps != nullptr);
  steps_then = steps;
  last_line = time_then = now;
}

/// What is left takes as long per step as the run has so far. Start and stop of the run command say
/// what the run is part of.
void Progress::print(double now, double steps, bool has_rves) const
{
  const Update &update = *lmp->update;
  const double share = static_cast<double>(update.ntimestep - update.beginstep) /
      static_cast<double>(std::max(update.endstep - update.beginstep, bigint(1)));
  const double per_step =
      (now - start) / static_cast<double>(std::max(update.ntimestep - first_step, bigint(1)));
  const double left = per_step * static_cast<double>(update.endstep - update.ntimestep);
  std::string line = fmt::format("{}: step {}, {:.1f} % of the run, {} left", who, update.ntimestep,
                                 100.0 * share, hours_minutes_seconds(left));
  // fewer than before: atoms have been deleted, and their RVEs with them
  if (has_rves)
    line += fmt::format(", {:.3g} million RVE-steps per second",
                        1e-6 * std::max(steps - steps_then, 0.0) / (now - time_then));
  utils::logmesg(lmp, line + "\n");
  utils::flush_buffers(lmp);    // who follows the log sees it, and a signal cannot lose it
}

/// A signal that came after the last step, or where there was none, counts as well: nobody else has
/// seen it.
void Progress::end()
{
  if (!watching) return;
  stop_watching();
  int signal = noted;
  noted = 0;
  MPI_Allreduce(MPI_IN_PLACE, &signal, 1, MPI_INT, MPI_MAX, lmp->world);
  if (!signal) return;
  lmp->timer->reset_timeout();
  const std::string files = lmp->output->restart_flag ? write_restart_files(lmp) : "";
  lmp->error->all(FLERR, "{}: {} ended the run after step {}; {}", who,
                  signal == SIGTERM ? "SIGTERM" : "SIGINT", lmp->update->ntimestep,
                  files.empty()
                      ? "there is no restart file, since the script has no restart command"
                      : "continue from restart file " + files);
}
