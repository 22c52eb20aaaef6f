// SPDX-License-Identifier: GPL-2.0-only
// SIGTERM and SIGINT during a run. The run must end after the present step and write the restart
// file of the script. Under mpirun only the last rank gets the signal.

#include "fix_external.h"
#include "library.h"
#include "script.h"
#include "support/files.h"
#include "update.h"

#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <fstream>

using namespace LAMMPS_NS;
using rve_test::text_of;

namespace {

const std::string FOUR_ATOMS = R"(units si
dimension 2
boundary p p p
atom_style atomic
processors 1 * 1
region box block 0 4 0 4 -0.5 0.5
create_box 1 box
mass 1 1.0
timestep 1e-3
pair_style none
comm_modify cutoff 1.0
create_atoms 1 single 0.5 0.5 0
create_atoms 1 single 2.5 0.5 0
create_atoms 1 single 0.5 2.5 0
create_atoms 1 single 2.5 2.5 0
)";

const std::string GRAINS = "fix grains all rve " EXAMPLE_PACKINGS
                           "/A_h0075.rve threads 1 device cpu dt 1e-4 drive "
                           "velocity_gradient yy -0.05 xy 0.1\n";

const std::string SOIL = R"(units si
dimension 2
boundary f f p
atom_style atomic
region box block 0 3 0 6 -0.1 0.1 units box
create_box 1 box
mass 1 1000
lattice sq 1.0 origin 0.5 0.5 0.0
region ground block 0 3 0 3 -0.05 0.05 units box
create_atoms 1 region ground
pair_style none
comm_modify cutoff 1.0
neighbor 0.5 bin
timestep 0.001
fix soil all mpm 1.0 model all elastic 1.0e5 0.3 density 1000
)";

int rank()
{
  int me;
  MPI_Comm_rank(MPI_COMM_WORLD, &me);
  return me;
}

bool on_last_rank()
{
  int size;
  MPI_Comm_size(MPI_COMM_WORLD, &size);
  return rank() == size - 1;
}

/// A script that sends itself a signal in the middle of a given step.
class SignalledScript : public Script {
 public:
  void raise_in_step(bigint step, int signal)
  {
    *this << "fix external all external pf/callback 1 1";
    when = step;
    what = signal;
    lammps_set_fix_external_callback(lmp.get(), "external", &SignalledScript::in_step, this);
  }

 private:
  bigint when = 0;
  int what = 0;

  static void in_step(void *self, bigint step, int, tagint *, double **, double **)
  {
    auto *script = static_cast<SignalledScript *>(self);
    if (step != script->when) return;
    script->when = -1;    // only once, because the setup of the next run has the same step
    if (on_last_rank()) std::raise(script->what);
  }
};

/// Runs the lines on all ranks together. Returns the error message, or an empty string without an
/// error.
std::string message_of(Script &script, const std::string &lines)
{
  try {
    script << lines;
  } catch (const LAMMPSException &problem) {
    return problem.what();
  }
  return "";
}

auto handler_of(int signal)
{
  struct sigaction action;
  sigaction(signal, nullptr, &action);
  return action.sa_handler;
}

#define EXPECT_IN(part, whole) EXPECT_PRED_FORMAT2(::testing::IsSubstring, part, whole)

/// Returns the step N of the message "`who` ended the run after step N...". On one rank a signal in
/// `step` must end the run after this step. Several ranks synchronise at least in steps 1, 2, 4, 8
/// and so on. There the run must end at the latest in the first of these steps that is not before
/// `step`.
bigint end_of_run(const std::string &who, const std::string &message, bigint step)
{
  const std::string words = who + " ended the run after step ";
  EXPECT_IN(words, message);
  const std::size_t at = message.find(words);
  if (at == std::string::npos) return -1;
  const bigint end = std::stoll(message.substr(at + words.size()));
  EXPECT_GE(end, step);
  int ranks;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  bigint latest = step;
  if (ranks > 1)
    for (latest = 1; latest < step;) latest *= 2;
  EXPECT_LE(end, latest);
  return end;
}

}    // namespace

TEST(RunSignals, RunEndsAfterItsStepAndContinuesFromTheRestartFile)
{
  const std::string write = "write_rve grains atom 3 file ";
  {
    Script whole;
    whole << FOUR_ATOMS + GRAINS + "run 20\n" + write + "test_signals.whole.rve format rve";
  }
  SignalledScript script;
  script << FOUR_ATOMS + GRAINS + "restart 1000 test_signals.one test_signals.two";
  script.raise_in_step(7, SIGTERM);

  const std::string message = message_of(script, "run 20");

  const bigint end = end_of_run("fix rve grains: SIGTERM", message, 7);
  EXPECT_IN("; continue from restart file test_signals.one", message);
  EXPECT_EQ(script.lmp->update->ntimestep, end);
  EXPECT_EQ(handler_of(SIGTERM), SIG_DFL);
  Script continued;
  continued << "read_restart test_signals.one\npair_style none\ncomm_modify cutoff 1.0\n" + GRAINS +
          "run 20 upto\n" + write + "test_signals.continued.rve format rve";
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_EQ(continued.lmp->update->ntimestep, 20);
  EXPECT_EQ(text_of("test_signals.continued.rve"), text_of("test_signals.whole.rve"));
  MPI_Barrier(MPI_COMM_WORLD);
  if (rank() == 0)
    for (const char *name : {"one", "two", "whole.rve", "continued.rve"})
      std::remove((std::string("test_signals.") + name).c_str());
}

TEST(RunSignals, AFileWithTheStepInItsNameIsNamed)
{
  SignalledScript script;
  script << FOUR_ATOMS + GRAINS + "restart 1000 test_signals.*.restart";
  script.raise_in_step(3, SIGINT);

  const std::string message = message_of(script, "run 20");

  const std::string name =
      "test_signals." + std::to_string(end_of_run("SIGINT", message, 3)) + ".restart";
  EXPECT_IN("; continue from restart file " + name, message);
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_TRUE(std::ifstream(name).is_open());
  MPI_Barrier(MPI_COMM_WORLD);
  if (rank() == 0) std::remove(name.c_str());
}

TEST(RunSignals, WithoutARestartCommandTheMessageSaysSo)
{
  SignalledScript script;
  script << FOUR_ATOMS + GRAINS;
  script.raise_in_step(5, SIGTERM);

  const std::string message = message_of(script, "run 20");

  const bigint end = end_of_run("SIGTERM", message, 5);
  EXPECT_IN("; there is no restart file, since the script has no restart command", message);
  // A program that catches the error is allowed to run on. The signal ends only one run.
  EXPECT_EQ(message_of(script, "run 3"), "");
  EXPECT_EQ(script.lmp->update->ntimestep, end + 3);
}

TEST(RunSignals, ASignalInTheLastStepOrInTheSetupIsNotLost)
{
  SignalledScript last, setup;
  last << FOUR_ATOMS + GRAINS;
  last.raise_in_step(4, SIGTERM);
  EXPECT_IN("SIGTERM ended the run after step 4", message_of(last, "run 4"));

  // The signal comes while LAMMPS sets up fix external. Fix rve is older and is already set up.
  setup << FOUR_ATOMS + GRAINS + "run 2";
  setup.raise_in_step(2, SIGTERM);
  EXPECT_IN("SIGTERM ended the run after step 2", message_of(setup, "run 0"));
}

TEST(RunSignals, ARunOfMaterialPointsWithoutGrainsEndsToo)
{
  SignalledScript script;
  script << SOIL;
  script.raise_in_step(6, SIGTERM);

  end_of_run("fix mpm soil: SIGTERM", message_of(script, "run 20"), 6);
}

TEST(RunSignals, RunsWithoutSetupReactToo)
{
  SignalledScript script;
  script << FOUR_ATOMS + GRAINS;
  script.raise_in_step(7, SIGTERM);

  end_of_run("SIGTERM", message_of(script, "run 20 every 5 NULL"), 7);
  EXPECT_EQ(message_of(script, "run 2"), "");
}

// A caller can start LAMMPS with an ignored signal: nohup ignores SIGHUP, and shells ignore SIGINT
// for background jobs. A run must not react to an ignored signal.
TEST(RunSignals, IgnoredSignalsStayIgnored)
{
  const auto before = std::signal(SIGINT, SIG_IGN);
  SignalledScript script;
  script << FOUR_ATOMS + GRAINS;
  script.raise_in_step(5, SIGINT);

  EXPECT_EQ(message_of(script, "run 10"), "");

  EXPECT_EQ(handler_of(SIGINT), SIG_IGN);
  std::signal(SIGINT, before);
}
