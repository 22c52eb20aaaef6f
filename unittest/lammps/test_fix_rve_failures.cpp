// SPDX-License-Identifier: GPL-2.0-only
// Failed RVEs through LAMMPS scripts: policies, messages and counts, on any number of ranks.

#include "grains_script.h"

#include <cstdio>
#include <unistd.h>

#include <gtest/gtest.h>

#include <string>

using namespace grains_script;

namespace {

/// Returns a script that stretches the RVEs of atoms 1 and 2 along x at constant area. The RVE of
/// atom 2 stretches a little faster. The other RVEs stay at rest. The DEM time step is 5e-5.
std::string stretched(const std::string &words)
{
  return FOUR_ATOMS + "variable pull atom 5*(id<3)+0.5*(id==2)\nvariable push atom -v_pull\n" +
      "fix grains all rve " + few_grains() +
      " threads 1 dt 5e-5 drive velocity_gradient xx v_pull yy v_push " + words + "\n";
}

}    // namespace

TEST(NarrowCell, ContinuesAsCopiesThatAreCountedAndLogged)
{
  Script script;
  script << stretched("") +
          "compute copies all rve/atom copies\ncompute grains all rve/atom grains\n" +
          "compute p all rve/atom p\nrun 120";

  const Script::Values copies = script.compute("copies"), grains = script.compute("grains"),
                       p = script.compute("p");
  EXPECT_EQ(copies, (Script::Values{{1, 2.0}, {2, 2.0}, {3, 1.0}, {4, 1.0}}));
  EXPECT_EQ(grains, (Script::Values{{1, 32.0}, {2, 32.0}, {3, 16.0}, {4, 16.0}}));
  EXPECT_EQ(script.fix_value("grains", 17), 2.0);
  EXPECT_EQ(script.fix_value("grains", 2), 0.0);
  for (const auto &[id, pressure] : p) EXPECT_GT(pressure, 0.0) << id;

  const std::string log = log_of(stretched("") + "run 120");
  EXPECT_IN("continues as up to 4 copies side by side, and then ends the run", log);
  const std::size_t first = log.find("the cell of the RVE of atom 2 became too narrow at step"),
                    second = log.find("the cell of the RVE of atom 1 became too narrow at step");
  ASSERT_NE(first, std::string::npos) << log;
  ASSERT_NE(second, std::string::npos) << log;
  EXPECT_LT(first, second);
  EXPECT_IN("the RVE continues as 2 copies side by side with 32 grains in total", log);
}

TEST(NarrowCell, IsAnErrorWithoutCopies)
{
  EXPECT_IN("failed at step", message_of(stretched("copies 1") + "run 120"));
  EXPECT_IN("copies is 3; it must be a power of two (1, 2, 4 ...), because cells are doubled",
            message_of(stretched("copies 3")));
}

TEST(NarrowCell, CanBeChangedBetweenRuns)
{
  EXPECT_IN("cell too narrow",
            message_of(stretched("") + "run 20\nfix_modify grains copies 1\nrun 100"));
  EXPECT_EQ(message_of(stretched("copies 1") + "run 20\nfix_modify grains copies 2\nrun 100"), "");
}

// Atom 2 exceeds the overlap limit in the steps 5 and 15. All RVEs are also sheared.
TEST(PolicyFresh, ContinuesWithFreshRvesThatAreCountedAndLogged)
{
  const std::string script = FOUR_ATOMS + "variable crush atom -400*(id==2)*(step%10==5)\n" + FIX +
      "dt 1e-4 policy fresh overlap_limit 0.1 drive velocity_gradient yy v_crush xy 0.1\n"
      "compute renewals all rve/atom renewals\ncompute p all rve/atom p\n";
  Script run;
  run << script + "run 20";

  EXPECT_EQ(run.compute("renewals"), (Script::Values{{1, 0.0}, {2, 2.0}, {3, 0.0}, {4, 0.0}}));
  EXPECT_EQ(run.fix_value("grains", 18), 2.0);
  EXPECT_EQ(run.fix_value("grains", 2), 0.0);
  for (const auto &[id, pressure] : run.compute("p")) EXPECT_GT(pressure, 1e4) << id;

  const std::string log = log_of(script + "run 20");
  EXPECT_IN("its RVE continues as up to 4 copies side by side, and then is replaced by a fresh RVE "
            "(policy fresh)",
            log);
  EXPECT_IN("the RVE of atom 2 failed at step 5: overlap too large; a fresh RVE of packing", log);
  EXPECT_IN("the RVE of atom 2 failed at step 15: overlap too large; a fresh RVE of packing", log);
  EXPECT_IN(" DEM steps: stress xx -", log);
}

TEST(PolicyFresh, IsContinuedFromARestartFileToTheSameBits)
{
  const std::string file = rve_test::temporary_path("restart");
  const std::string settings = "variable crush atom -400*(id==2)*(step==8||step==15)\n" + FIX +
      "dt 1e-4 policy fresh overlap_limit 0.1 drive velocity_gradient yy v_crush xy 0.1\n";
  const auto states = [](Script &script) {
    // Returns the states of all four atoms as text.
    std::string all;
    for (int id = 1; id <= 4; ++id) {
      const std::string path = rve_test::temporary_path("state.rve");
      script << "write_rve grains atom " + std::to_string(id) + " file " + path + " format rve";
      MPI_Barrier(MPI_COMM_WORLD);
      all += rve_test::text_of(path);
      MPI_Barrier(MPI_COMM_WORLD);
    }
    return all;
  };
  Script whole, first, second;
  whole << FOUR_ATOMS + settings + "run 20";
  first << FOUR_ATOMS + settings + "run 12\nwrite_restart " + file + "\nclear";
  second << "read_restart " + file + "\ntimestep 1e-3\n" + settings + "run 8";

  EXPECT_EQ(whole.fix_value("grains", 18), 2.0);
  EXPECT_EQ(second.fix_value("grains", 18), 2.0);
  EXPECT_EQ(states(whole), states(second));
}

TEST(FailureAtTheStart, NamesThePropertyOfThePacking)
{
  const std::string message =
      message_of(FOUR_ATOMS + FIX + "dt 1e-4 overlap_limit 1e-9 drive none\nrun 1");

  EXPECT_IN("failed at step 0: overlap too large (state of its packing: largest overlap 0.0236",
            message);
  EXPECT_IN("of the sum of radii, overlap_limit 1e-09 [radius], void ratio 0.161", message);
}

TEST(PackingFiles, LoopOfLinksIsNamed)
{
  const std::string link = file_of_rank("loop");
  std::remove(link.c_str());
  ASSERT_EQ(symlink(link.c_str(), link.c_str()), 0);

  EXPECT_IN("cannot open packing file " + link + ": Too many levels of symbolic links",
            message_of(FOUR_ATOMS + "fix grains all rve " + link + " dt 1e-4 drive none"));
  std::remove(link.c_str());
}

// If LAMMPS deletes atoms after read_restart, it does not move the records of the restart file.
TEST(RestartRecords, FollowTheirAtomsWhenOthersAreDeletedBeforeTheFix)
{
  const std::string file = rve_test::temporary_path("restart");
  const std::string columns = "compute c all rve/atom syy\n";
  Script first, rest;
  first << FOUR_ATOMS + SHEAR + columns + "run 5\nwrite_restart " + file;
  Script::Values expected = first.compute("c");
  expected.erase(2);
  const std::string read =
      "read_restart " + file + "\nvariable rate atom -0.05*id\ngroup pit id 2\n";

  rest << read + "delete_atoms group pit compress no\n" + SHEAR + columns + "run 0";

  EXPECT_EQ(rest.compute("c"), expected);
  EXPECT_IN("delete_atoms renumbers unless it has compress no",
            message_of(read + "delete_atoms group pit\n" + SHEAR));
}

TEST(RestartRecords, RecordsThatLammpsDroppedAreReported)
{
  const std::string file = rve_test::temporary_path("restart");
  Script first;
  first << FOUR_ATOMS + SHEAR + "run 5\nwrite_restart " + file;
  const std::string read = "read_restart " + file + "\nvariable rate atom -0.05*id\n";

  EXPECT_IN("records of the restart file are lost", log_of(read + "run 0\n" + SHEAR));
  EXPECT_EQ(log_of(read + SHEAR + "run 0").find("records of the restart file are lost"),
            std::string::npos);
}

TEST(RestartRecords, AtomsWithoutAnRveAreReported)
{
  const std::string file = rve_test::temporary_path("restart");
  Script first;
  std::string some = SHEAR;
  some.replace(some.find("all"), 3, "some");
  first << FOUR_ATOMS + "group some id 1 2\n" + some + "run 5\nwrite_restart " + file;

  EXPECT_IN("2 atoms of the group had no RVE when the restart file was written",
            log_of("read_restart " + file + "\nvariable rate atom -0.05*id\n" + SHEAR + "run 0"));
}
