// SPDX-License-Identifier: GPL-2.0-only
// A failure on one rank must end all ranks with one message and without hanging. Warnings of ranks
// without a log file must appear in the log. The tests are valid for any number of ranks and are
// run with two.

#include "grains_script.h"
#include "lammps/collective_error.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

using namespace grains_script;

namespace {

int rank()
{
  int me;
  MPI_Comm_rank(MPI_COMM_WORLD, &me);
  return me;
}

int last_rank()
{
  int ranks;
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  return ranks - 1;
}

/// Sets an environment variable on the last rank and removes it in the destructor.
class EnvironmentOfLastRank {
 public:
  EnvironmentOfLastRank(const char *name, const char *value) : name_(name)
  {
    if (rank() == last_rank()) setenv(name, value, 1);
  }
  ~EnvironmentOfLastRank()
  {
    if (rank() == last_rank()) unsetenv(name_);
  }

 private:
  const char *name_;
};

/// Returns the error message of the lines on this rank, or an empty string if they run. All ranks
/// must call it.
std::string message_on_all_ranks(Script &script, const std::string &lines)
{
  try {
    script << lines;
  } catch (const LAMMPS_NS::LAMMPSException &problem) {
    return problem.what();
  }
  return "";
}
std::string message_on_all_ranks(const std::string &lines)
{
  Script script;
  return message_on_all_ranks(script, lines);
}

/// A scene of fix mpm with a point in each of four cells.
const std::string GROUND = R"(units si
dimension 2
boundary f f p
atom_style sphere
lattice sq 1.0
region box block 0 4 0 4 -0.5 0.5
create_box 1 box
create_atoms 1 single 0.5 0.5 0
create_atoms 1 single 3.5 0.5 0
set group all diameter 1.0 density 1000
)";

/// Returns the number of occurrences of `part` in `whole`.
int count_of(const std::string &part, const std::string &whole)
{
  int count = 0;
  for (std::size_t at = whole.find(part); at != std::string::npos; at = whole.find(part, at + 1))
    ++count;
  return count;
}

/// Returns the states of all atoms on every rank.
std::string states_of(Script &script)
{
  std::string all;
  for (int id = 1; id <= 4; ++id) {
    const std::string path = rve_test::temporary_path("one_rank.rve");
    script << "write_rve grains atom " + std::to_string(id) + " file " + path + " format rve";
    MPI_Barrier(MPI_COMM_WORLD);
    all += rve_test::text_of(path);
    MPI_Barrier(MPI_COMM_WORLD);
  }
  return all;
}

}    // namespace

// ---- helpers ----

TEST(Collectively, EndsAllRanksWithTheErrorOfTheFailedRank)
{
  Script script;
  const auto message_of = [&](const auto &fail) -> std::string {
    try {
      LAMMPS_NS::collectively(script.lmp.get(), "fix any", [&] {
        if (rank() == last_rank()) fail();
      });
    } catch (const LAMMPS_NS::LAMMPSAbortException &) {
      return "aborts";
    } catch (const LAMMPS_NS::LAMMPSException &problem) {
      return problem.what();
    }
    return "";
  };
  EXPECT_EQ(message_of([] {}), "");
  EXPECT_IN("fix any: the device is lost",
            message_of([] { throw std::runtime_error("the device is lost"); }));
  EXPECT_IN("fix any: this rank is out of memory", message_of([] { throw std::bad_alloc(); }));
  EXPECT_IN("fix any: an exception without a message",
            message_of([] { throw std::runtime_error(""); }));
}

TEST(Collectively, ReportsTheMessageOfTheLowestRank)
{
  Script script;
  try {
    LAMMPS_NS::collectively(script.lmp.get(), "fix any",
                            [] { throw std::runtime_error("rank " + std::to_string(rank())); });
    FAIL();
  } catch (const LAMMPS_NS::LAMMPSException &problem) {
    EXPECT_IN("fix any: rank 0", problem.what());
  }
}

TEST(OnThisRank, AbortsWithThePositionForEveryKindOfException)
{
  Script script;
  const auto who = [] { return std::string("fix any: RVE of atom 7, step 3"); };
  if (rank() == last_rank()) {
    try {
      LAMMPS_NS::on_this_rank(script.lmp.get(), who,
                              []() -> int { throw std::runtime_error("the device is lost"); });
      FAIL();
    } catch (const LAMMPS_NS::LAMMPSAbortException &problem) {
      EXPECT_IN("fix any: RVE of atom 7, step 3: the device is lost", problem.what());
    }
  }
  EXPECT_EQ(LAMMPS_NS::on_this_rank(script.lmp.get(), who, [] { return 5; }), 5);
}

// ---- failures before a run ----

TEST(OneRankFails, InTheMemoryOfItsRves)
{
  const EnvironmentOfLastRank limit("GPU_RVE_MEMORY_LIMIT", "abc");
  EXPECT_IN("fix rve grains: GPU_RVE_MEMORY_LIMIT in the environment must be a number of bytes",
            message_on_all_ranks(FOUR_ATOMS + SHEAR + "run 1"));
}

TEST(OneRankFails, InTheEngineOfFixRve)
{
  const EnvironmentOfLastRank device("GPU_RVE_REQUIRE_CUDA", "perhaps");
  EXPECT_IN("fix rve grains: GPU_RVE_REQUIRE_CUDA", message_on_all_ranks(FOUR_ATOMS + SHEAR));
}

TEST(OneRankFails, InTheSolverOfFixMpm)
{
  const EnvironmentOfLastRank device("GPU_RVE_REQUIRE_CUDA", "perhaps");
  EXPECT_IN("fix mpm g: GPU_RVE_REQUIRE_CUDA",
            message_on_all_ranks(GROUND + "fix g all mpm 1.0 model all elastic 1e6 0.3"));
}

TEST(OneRankFails, InTheProbesOfATangent)
{
  Script script;
  script << FOUR_ATOMS + SHEAR + "compute c all rve/tangent cxxxx\n";
  const EnvironmentOfLastRank device("GPU_RVE_REQUIRE_CUDA", "perhaps");
  EXPECT_IN("compute rve/tangent c: GPU_RVE_REQUIRE_CUDA", message_on_all_ranks(script, "run 0"));
}

// Atom 4 is on the last of two ranks.
TEST(OneRankFails, InAFileOfTheRankThatHasTheAtom)
{
  EXPECT_IN("fix rve grains: dump:",
            message_on_all_ranks(FOUR_ATOMS + FIX + "dt 1e-4 dump 1 /no/such/folder/rve 4\nrun 1"));
  EXPECT_IN("write_rve: ",
            message_on_all_ranks(FOUR_ATOMS + SHEAR +
                                 "run 0\nwrite_rve grains atom 4 file /no/such/folder/rve"));
}

// ---- warnings of any rank appear once in the log file ----

TEST(WarningsOfAllRanks, OfFrozenRvesAreInTheLog)
{
  const std::string log = log_of(FOUR_ATOMS + "variable crush atom -400*(id!=3)*(step==3)\n" + FIX +
                                 "dt 1e-4 policy freeze overlap_limit 0.1 "
                                 "drive velocity_gradient yy v_crush xy 0.1\nrun 5");
  EXPECT_EQ(count_of("; it is frozen", log), 3) << log;
  EXPECT_EQ(count_of("WARNING: fix rve grains: RVE of atom", log), 1) << log;
  EXPECT_IN("fix rve grains: 3 RVEs were frozen in this run", log);
  for (const int id : {1, 2, 4})
    EXPECT_EQ(count_of("RVE of atom " + std::to_string(id) + " failed at step 3", log), 1) << log;
  EXPECT_LT(log.find("RVE of atom 2 failed"), log.find("RVE of atom 4 failed"));
}

TEST(ErrorsOfAllRanks, OfAFailedRveAreInTheLog)
{
  const std::string path = rve_test::temporary_path("failed.log");
  Script script;
  const std::string message = message_on_all_ranks(
      script,
      "log " + path + "\n" + FOUR_ATOMS + "variable crush atom -400*(id==4)\n" + FIX +
          "dt 1e-4 overlap_limit 0.1 drive velocity_gradient yy v_crush xy 0.1\nrun 5");
  EXPECT_IN("RVE of atom 4 failed at step", message);
  EXPECT_IN("with policy freeze the run continues without this RVE", message);
  script << "log none";
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_IN("RVE of atom 4 failed at step", rve_test::text_of(path));
}

TEST(WarningsOfAllRanks, OfATensionAppearsOnce)
{
  const std::string log = log_of(FOUR_ATOMS + "variable pull atom 1e3*(id==4||step>1)\n" + FIX +
                                 "dt 1e-4 policy freeze servo yy v_pull\nrun 3");
  EXPECT_EQ(count_of("grains without cohesion carry no tension", log), 1) << log;
  EXPECT_IN("for atom 4 at step 1", log);
}

TEST(WarningsOfAllRanks, OfAdviceAppearsOnce)
{
  const std::string log = log_of(FOUR_ATOMS + "variable fast atom -20*(id==4)\n" + FIX +
                                 "dt 1e-4 dt_check 1 "
                                 "drive velocity_gradient yy v_fast\nrun 2");
  EXPECT_EQ(count_of("fix rve grains: in the RVE of atom 4", log),
            count_of("fix rve grains: in the RVE of atom", log))
      << log;
  EXPECT_GE(count_of("fix rve grains: in the RVE of atom 4", log), 1) << log;
}

// ---- refused changes ----

TEST(RefusedFixModify, ChangesNoSettingsAndRves)
{
  const std::string begin = FOUR_ATOMS + SHEAR + "run 5\n", end = "run 5\n";
  const std::string restart = rve_test::temporary_path("one_rank.restart");
  const auto result_of = [&](Script &script) {
    script << end + "write_restart " + restart;
    MPI_Barrier(MPI_COMM_WORLD);
    const std::string file = rve_test::text_of(restart);
    MPI_Barrier(MPI_COMM_WORLD);
    return std::make_pair(states_of(script), file);
  };
  Script plain;
  plain << begin;
  const auto expected = result_of(plain);
  for (const std::string words :
       {"dt 5e-4", "friction 0.1 dt 5e-4", "rolling_friction 0.1 dt 5e-4",
        "substeps 3 policy freeze damping 7", "copies 2 friction -1", "substeps match dt 1e-15",
        "drive velocity_gradient yy v_missing", "rolling_friction 0.1 kr 1e3 dt 5e-3", "kn 1e8",
        "mass_scaling 2 kn 1e9"}) {
    SCOPED_TRACE(words);
    Script script;
    script << begin;
    EXPECT_IN("ERROR", message_on_all_ranks(script, "fix_modify grains " + words));
    const auto result = result_of(script);
    EXPECT_TRUE(result.first == expected.first);
    EXPECT_TRUE(result.second == expected.second);
  }
}

TEST(RefusedFixModify, OnOneRankIsRefusedOnAll)
{
  const std::string begin = FOUR_ATOMS + SHEAR + "run 5\n", end = "run 5\n";
  Script plain, script;
  plain << begin + end;
  script << begin;
  {
    // Rolling resistance requires a new engine on each rank. On the last rank the wrong limit makes
    // this fail.
    const EnvironmentOfLastRank limit("GPU_RVE_MEMORY_LIMIT", "abc");
    EXPECT_IN(
        "GPU_RVE_MEMORY_LIMIT",
        message_on_all_ranks(script, "fix_modify grains rolling_friction 0.1 kr 1e3 substeps 3"));
  }
  script << end;
  EXPECT_TRUE(states_of(plain) == states_of(script));
}

// ---- fixes that an error deletes on ranks one by one ----

TEST(DeletedFix, DestructorDoesNotSynchroniseRanks)
{
  Script script;
  script << FOUR_ATOMS + SHEAR + "run 2";
  if (rank() == 0) script.lmp->modify->delete_fix("grains");
  MPI_Barrier(MPI_COMM_WORLD);
  if (rank() != 0) script.lmp->modify->delete_fix("grains");
}
