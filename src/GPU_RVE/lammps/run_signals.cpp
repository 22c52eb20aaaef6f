// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/run_signals.h"

#include "comm.h"
#include "error.h"
#include "lammps.h"
#include "output.h"
#include "platform.h"
#include "timer.h"
#include "update.h"

#include <algorithm>
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

}    // namespace

RunSignals::RunSignals(LAMMPS *_lmp, std::string _who) : lmp(_lmp), who(std::move(_who)) {}

/* ----------------------------------------------------------------------
   the run may have ended in an error
------------------------------------------------------------------------- */

RunSignals::~RunSignals()
{
  stop_watching();
}

void RunSignals::begin()
{
  interval = steps_left = 1;
  watch();
}

bool RunSignals::step_done(bool rank_zero_says)
{
  watch();    // runs with `pre no` have no setup
  const bool alone = lmp->comm->nprocs == 1;
  if (!alone && --steps_left > 0) return false;
  const double now = platform::walltime();
  const auto waited = static_cast<int>(std::min(1e6 * (now - asked), 1e9));    // microseconds
  asked = now;
  int said[] = {lmp->comm->me == 0 && rank_zero_says ? 1 : 0, noted, waited};
  if (!alone) MPI_Allreduce(MPI_IN_PLACE, said, 3, MPI_INT, MPI_MAX, lmp->world);
  const double steps_in_time = interval * (1e6 * LONGEST_WAIT) / std::max(said[2], 1);
  interval = std::clamp(static_cast<int>(std::min(steps_in_time, 2.0 * interval)), 1, MOST_STEPS);
  steps_left = interval;
  // noted on all ranks, for the end: this one may have got none
  noted = said[1];
  if (said[1]) lmp->timer->force_timeout();
  return said[0] != 0;
}

/* ----------------------------------------------------------------------
   a signal that came after the last step, or where there was none, counts as well: nobody else has seen it
------------------------------------------------------------------------- */

void RunSignals::end()
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
