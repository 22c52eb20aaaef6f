// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/progress.h"

#include "comm.h"
#include "error.h"
#include "lammps.h"
#include "lammps/script_arguments.h"
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

// Limits of the interval between two communications of ranks: its wall time, estimated from the
// last interval, and its number of steps.
constexpr double LONGEST_WAIT = 0.05;    // seconds
constexpr int MOST_STEPS = 16;

constexpr int SIGNALS[] = {SIGTERM, SIGINT};
constexpr int COUNT = 2;

// The handlers of signals are global to the program, and so is their state.
volatile std::sig_atomic_t recorded = 0;    // the last signal, or 0
bool watching = false;
bool taken[COUNT];                 // true for signals that have our handler while watching
struct sigaction before[COUNT];    // actions before watch()

extern "C" void record(int signal)
{
  recorded = signal;
}

void watch()
{
  if (watching) return;
  watching = true;
  recorded = 0;
  struct sigaction action = {};
  action.sa_handler = record;
  // SA_RESETHAND: the same signal has its default action the second time. SA_RESTART: interrupted
  // system calls continue.
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  sigemptyset(&action.sa_mask);
  for (int k = 0; k < COUNT; ++k) {
    sigaction(SIGNALS[k], nullptr, &before[k]);
    // the signal stays ignored if nohup, or a shell that starts a process in the background, has
    // set it to be ignored
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

/// Writes restart files of the present step unless they have been written already. Returns their
/// names with " and " between them.
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
  // the toggle gives the file of the next restart
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

/// Returns a time in seconds as hours, minutes and seconds, for example "2:03:04".
std::string hours_minutes_seconds(double seconds)
{
  const auto whole = static_cast<bigint>(std::llround(seconds));
  return fmt::format("{}:{:02d}:{:02d}", whole / 3600, whole / 60 % 60, whole % 60);
}

}    // namespace

double LAMMPS_NS::read_progress(ScriptArguments &words)
{
  const double seconds = words.number();
  if (!(seconds >= 0.0))
    words.refuse(fmt::format("progress is {} [seconds of wall time]; it must be at least 0, and 0 "
                             "means no progress lines",
                             rve::number(seconds)));
  return seconds;
}

Progress::Progress(LAMMPS *_lmp, std::string _who, double _interval) :
    lmp(_lmp), who(std::move(_who)), interval(_interval), last_line(platform::walltime())
{
}

// If the run ended in an error, end() was not called.
Progress::~Progress()
{
  stop_watching();
}

void Progress::begin(const RveSteps &rve_steps)
{
  steps_between = steps_left = 1;
  watch();
  utils::flush_buffers(lmp);    // lines before the first step appear in the log
  if (interval == 0.0) return;
  first_step = lmp->update->ntimestep;
  steps_then = sum_over_ranks(lmp, rve_steps);
  start = time_then = platform::walltime();
}

// Sends the last recorded signal to all ranks. Returns `line_is_due` of rank 0, which is part of
// the same communication, or false in steps without communication.
bool Progress::exchange_signals(bool line_is_due)
{
  watch();    // runs with `pre no` do not call begin()
  const bool alone = lmp->comm->nprocs == 1;
  if (!alone && --steps_left > 0) return false;
  const double now = platform::walltime();
  const auto waited = static_cast<int>(std::min(1e6 * (now - last_exchange), 1e9));
  last_exchange = now;
  // 1 if a line is due on rank 0, signal, time since the last communication [microseconds]
  int values[] = {lmp->comm->me == 0 && line_is_due ? 1 : 0, recorded, waited};
  if (!alone) MPI_Allreduce(MPI_IN_PLACE, values, 3, MPI_INT, MPI_MAX, lmp->world);
  const double steps_in_time = steps_between * (1e6 * LONGEST_WAIT) / std::max(values[2], 1);
  const double most = std::min(steps_in_time, 2.0 * steps_between);
  steps_left = steps_between = std::clamp(static_cast<int>(most), 1, MOST_STEPS);
  // end() needs the signal on all ranks, and this rank may have received none
  recorded = values[1];
  if (values[1]) lmp->timer->force_timeout();
  return values[0] != 0;
}

// Rank 0 decides by its clock if a line is due, because the clocks of the ranks can differ.
void Progress::step_done(const RveSteps &rve_steps)
{
  const double now = platform::walltime();
  if (!exchange_signals(interval > 0.0 && now - last_line >= interval)) return;
  const double steps = sum_over_ranks(lmp, rve_steps);
  if (lmp->comm->me == 0) print(now, steps, rve_steps != nullptr);
  steps_then = steps;
  last_line = time_then = now;
}

// The estimate assumes that the remaining steps take as long as those of this run so far. The share
// refers to the steps between start and stop of the run command.
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
  // the number of steps decreases if atoms and their RVEs have been deleted
  if (has_rves)
    line += fmt::format(", {:.3g} million RVE-steps per second",
                        1e-6 * std::max(steps - steps_then, 0.0) / (now - time_then));
  utils::logmesg(lmp, line + "\n");
  utils::flush_buffers(lmp);    // the line appears at once and survives a signal
}

// A signal that arrives after the last step, or in a run without steps, also ends the script.
void Progress::end()
{
  if (!watching) return;
  stop_watching();
  int signal = recorded;
  recorded = 0;
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
