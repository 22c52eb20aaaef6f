// SPDX-License-Identifier: GPL-2.0-only
// Loading paths of fix rve through LAMMPS scripts: one path for each atom, paths from a file and
// from the script, the ends of paths, and restarts. Also runs under mpirun.

#include "grains_script.h"
#include "update.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

using namespace grains_script;
using rve_test::temporary_path;

namespace {

/// Writes a file of this rank and returns its path.
std::string written(const std::string &name, const std::string &text)
{
  const std::string path = file_of_rank(name);
  std::ofstream(path) << text;
  return path;
}

// Four paths. The strain per step is 2.5e-4, or 5e-5 in the path constant_p.
const std::string FOUR_PATHS = R"(# four tests of a laboratory
path oedometer
stage rate yy -0.5 until strain yy < -0.002
path undrained
stage rate yy -0.5 rate volume 0 until ratio > 0.05
stage until time > 0.003
path constant_p
stage rate yy -0.1 stress p v_pressure until strain yy < -0.004
path cyclic
stage rate xy 0.5 stress xx -1e5 stress yy -1e5 reverse strain xy -0.001 0.001 until cycles > 1
)";
const std::string STEP = "timestep 5e-4\nvariable number atom id\nvariable pressure equal 1.0e5\n";
const std::string ATOMS = FOUR_ATOMS + STEP;
const std::string COLUMNS = R"(compute stage all rve/atom path_stage
compute time all rve/atom path_time
compute cycles all rve/atom path_cycles
compute ended all rve/atom path_ended
compute error all rve/atom servo_error
compute p all rve/atom p
compute e all rve/atom void_ratio
compute yy all rve/atom def_yy
compute xy all rve/atom def_xy
)";

std::string fix_with_paths()
{
  return FIX + "dt 5e-5 path " + written("paths", FOUR_PATHS) + " path_variable v_number ";
}

}    // namespace

TEST(PathsOfFixRve, LimitsThatReverseAStageMayBeVariables)
{
  // After two reversals each atom ends at its lower limit. It passes the limit by at most one step.
  const std::string path = FIX +
      "dt 5e-5 path stage rate xy 0.5 stress xx -1e5 stress yy -1e5 "
      "reverse strain xy v_low v_high until cycles > 1\n";
  const std::string limits = "variable high atom 5e-4*id\nvariable low atom -5e-4*id\n";
  GrainsScript script;
  script << ATOMS + COLUMNS + limits + path + "run 100";
  for (int id = 1; id <= 4; ++id) {
    EXPECT_EQ(script.compute("ended").at(id), 1.0) << id;
    EXPECT_LE(script.compute("xy").at(id), -5e-4 * id + 1e-8) << id;
    EXPECT_GT(script.compute("xy").at(id), -5e-4 * id - 2.5e-4 * (1.0 + 1e-5)) << id;
  }
  // The limits grow during the stage: once by variables, once by the keyword ramp of the path.
  const std::string grows = "variable high equal 1e-3+0.2*step*dt\nvariable low equal -v_high\n";
  const std::string ramp = "reverse strain xy ramp -1e-3 -5e-3 0.02 ramp 1e-3 5e-3 0.02";
  std::string with_ramp = path;
  const std::string words = "reverse strain xy v_low v_high";
  with_ramp.replace(with_ramp.find(words), words.size(), ramp);
  GrainsScript by_variable, by_ramp;
  by_variable << ATOMS + COLUMNS + grows + path + "run 100";
  by_ramp << ATOMS + COLUMNS + with_ramp + "run 100";
  EXPECT_LT(by_variable.compute("xy").at(1), -2e-3);
  EXPECT_NEAR(by_ramp.compute("xy").at(1), by_variable.compute("xy").at(1), 1e-12);

  EXPECT_IN(
      "the limits that reverse stage 1 of its path are 0.001 and -0.001; they must be finite "
      "numbers, the first one below the second one",
      message_of(ATOMS + "variable low equal 1e-3\nvariable high equal -1e-3\n" + path + "run 1"));
}

TEST(PathsOfFixRve, EachAtomFollowsItsPathAndTheRunEndsWithTheLast)
{
  GrainsScript script;
  script << ATOMS + COLUMNS + fix_with_paths() + "path_end halt\nrun 0";
  const double before = script.compute("e").at(2);
  script << "run 3";
  EXPECT_EQ(script.compute("stage").at(1), 1.0);
  EXPECT_NEAR(script.compute("time").at(1), 1.5e-3, 1e-15);
  EXPECT_EQ(script.fix_value(15), 0.0);
  EXPECT_GT(script.compute("error").at(3), 0.0);
  EXPECT_GE(script.fix_value(16), script.compute("error").at(3));

  script << "run 1000";

  const double step = 2.5e-4 * (1.0 + 1e-5);
  for (int id = 1; id <= 4; ++id) EXPECT_EQ(script.compute("ended").at(id), 1.0) << id;
  EXPECT_EQ(script.fix_value(15), 4.0);
  EXPECT_NEAR(script.lmp->update->ntimestep, 80, 1);    // the slowest path has 5e-5 per step
  EXPECT_NEAR(std::log(script.compute("yy").at(1)), -0.002, step);
  EXPECT_EQ(script.compute("stage").at(2), 2.0);
  EXPECT_NEAR(script.compute("e").at(2), before, 1e-14);
  EXPECT_NEAR(std::log(script.compute("yy").at(3)), -0.004, step);
  EXPECT_NEAR(script.compute("p").at(3), 1e5, 0.02 * 1e5);
  EXPECT_EQ(script.compute("cycles").at(4), 1.0);
  EXPECT_NEAR(script.compute("xy").at(4), -0.001, step);

  // An RVE does not change after its path has ended. A new path that fix_modify sets starts at its
  // first stage.
  const std::string state = script.state(1);
  script << "fix_modify grains path_end hold\nrun 5";
  EXPECT_EQ(script.state(1), state);
  script << "fix_modify grains path stage rate yy 0.5 until time > 0.0019 path_end halt\nrun 100";
  EXPECT_EQ(script.compute("time").at(1), 4 * 5e-4);
  EXPECT_NEAR(std::log(script.compute("yy").at(1)), -0.001, step);
}

TEST(PathsOfFixRve, ContinueFromARestartFileBitForBit)
{
  const std::string file = temporary_path("restart_of_paths"), fix = fix_with_paths() + "\n";
  const std::string settings = STEP + fix;
  GrainsScript whole, first, second;
  whole << FOUR_ATOMS + settings + COLUMNS + "run 11";
  first << FOUR_ATOMS + settings + "run 5\nwrite_restart " + file + "\nclear";
  second << "read_restart " + file + "\n" + settings + COLUMNS + "run 6";

  for (int id = 1; id <= 4; ++id) {
    SCOPED_TRACE(id);
    EXPECT_EQ(whole.state(id), second.state(id));
    for (const char *column : {"stage", "time", "cycles", "ended", "error"})
      EXPECT_EQ(whole.compute(column).at(id), second.compute(column).at(id)) << column;
  }
}

TEST(PathsOfFixRve, EndedPathsContinueWhenAContinuedRunChangesThem)
{
  const std::string file = temporary_path("restart_of_ended_paths");
  const std::string fix = STEP + FIX + "dt 5e-5 path ",
                    path = "stage rate yy -0.1 until time > 0.001";
  Script first;
  first << FOUR_ATOMS + fix + path + "\nrun 5\nwrite_restart " + file + "\nclear";
  const auto rest = [&](const std::string &words) {
    Script script;
    script << "read_restart " + file + "\n" + fix + words + "\n" + COLUMNS + "run 4";
    return std::map<std::string, double>{{"ended", script.compute("ended").at(1)},
                                         {"stage", script.compute("stage").at(1)},
                                         {"time", script.compute("time").at(1)},
                                         {"yy", std::log(script.compute("yy").at(1))}};
  };

  auto same = rest(path), longer = rest("stage rate yy -0.1 until time > 0.002"),
       second = rest(path + " stage rate yy 0.1 until time > 1");

  EXPECT_EQ(same["ended"], 1.0);
  EXPECT_NEAR(same["yy"], -1e-4, 1e-9);
  EXPECT_EQ(longer["ended"], 1.0);
  EXPECT_EQ(longer["stage"], 1.0);
  EXPECT_NEAR(longer["time"], 0.002, 1e-12);
  EXPECT_NEAR(longer["yy"], -2e-4, 1e-9);
  EXPECT_EQ(second["ended"], 0.0);
  EXPECT_EQ(second["stage"], 2.0);
  EXPECT_NEAR(second["yy"], 1e-4, 1e-9);
}

// Some rows of the tables have times within a step, and the paths continue after the last row.
// Normal strains must agree with the table. The shear strain differs slightly, because the cell
// also stretches during a step. The pressure has an error below one per cent where the slope of the
// table changes.
TEST(PathsOfFixRve, FollowTablesFromFiles)
{
  const std::string strains = written("strains.csv",
                                      "# of a test\ntime, yy, gamma\n0, 0, 0\n0.001, -1e-3, 0\n"
                                      "0.0012, -1e-3, 1e-3\n0.004, 5e-4, 2e-3\n"),
                    stresses = written("stresses.txt", "0 1e5\n0.03 1.1e5\n0.06 1.05e5\n");
  const std::string paths =
      written("paths_of_tables",
              "path strains stage strain yy table " + strains + " yy strain xy table " + strains +
                  " 3 until time > 0.0059\npath pressure stage rate xx-yy 0 stress p table " +
                  stresses + " 2 until time > 0.08\n");
  const std::string fix = ATOMS + COLUMNS + "variable way atom 1+(id>2)\n" + FIX + "dt 5e-5 path ";
  GrainsScript script;
  script << fix + paths + " path_variable v_way path_end halt";
  const auto expect_strains = [&](double yy, double gamma) {
    for (const int id : {1, 2}) {
      EXPECT_NEAR(std::log(script.compute("yy").at(id)), yy, 1e-13);
      EXPECT_NEAR(script.compute("xy").at(id) / script.compute("yy").at(id), gamma, 1e-3 * gamma);
    }
  };

  script << "run 1";
  expect_strains(-5e-4, 0.0);
  script << "run 2";
  expect_strains(-1e-3 + 0.3 / 2.8 * 1.5e-3, 1e-3 + 0.3 / 2.8 * 1e-3);
  script << "run 5";
  expect_strains(5e-4, 2e-3);
  script << "run 52";
  EXPECT_EQ(script.compute("ended").at(1), 1.0);
  expect_strains(5e-4, 2e-3);
  for (const int id : {3, 4}) EXPECT_NEAR(script.compute("p").at(id), 1.1e5, 0.01 * 1.1e5);
  script << "run 1000";
  EXPECT_EQ(script.lmp->update->ntimestep, 160);
  for (const int id : {3, 4}) EXPECT_NEAR(script.compute("p").at(id), 1.05e5, 0.01 * 1.05e5);

  EXPECT_IN("has no column 'zz'; it must be a number from 2 to 3, or one of yy gamma",
            message_of(fix + "stage strain yy table " + strains + " zz"));
  EXPECT_IN("no_such_table", message_of(fix + "stage strain yy table no_such_table 2"));
}

TEST(PathsOfFixRve, AreEquivalentToADriveAndServo)
{
  GrainsScript path, drive, servo, stage;
  path << ATOMS + FIX + "dt 5e-5 path stage rate xy 0.1 rate yy v_rate\nrun 5";
  drive << ATOMS + FIX + "dt 5e-5 drive velocity_gradient xy 0.1 yy v_rate\nrun 5";
  stage << ATOMS + FIX + "dt 5e-5 path stage rate yy -0.1 stress xx -1.1e5\nrun 5";
  servo << ATOMS + FIX + "dt 5e-5 drive velocity_gradient yy -0.1 servo xx -1.1e5\nrun 5";

  EXPECT_EQ(path.state(3), drive.state(3));
  EXPECT_EQ(stage.state(3), servo.state(3));
}

TEST(PathsOfFixRve, ReportInvalidInput)
{
  const std::string begin = ATOMS + FIX;
  EXPECT_IN("path and drive exclude each other",
            message_of(begin + "path stage rate yy 1 drive velocity_gradient xy 1"));
  EXPECT_IN("path and servo exclude each other",
            message_of(begin + "servo xx -1e5 path stage rate yy 1"));
  EXPECT_IN("path_variable requires a path", message_of(begin + "path_variable v_number"));
  EXPECT_IN("the quantities are xx yy xy volume", message_of(begin + "path stage rate zz 1"));
  EXPECT_IN(
      "substeps adaptive and servo exclude each other",
      message_of(begin + "path stage stress p 1e5 stress xx-yy 0 substeps adaptive 1e-5 1e-3"));
  EXPECT_IN("no_such_file", message_of(begin + "path no_such_file"));
  EXPECT_IN("2: the stage has 1 conditions on 2 components (xx yy)",
            message_of(begin + "path " + written("wrong", "# too few\nstage rate volume 1\n")));
  EXPECT_IN("path_variable is 2 for atom 2; it must be a whole number from 1 to 1",
            message_of(begin + "path stage rate yy 1 path_variable v_number\nrun 1"));
  EXPECT_IN("path_variable is 1.0000000001 for atom 1; it must be a whole number from 1 to 1",
            message_of("variable near atom 1.0000000001\n" + begin +
                       "path stage rate yy 1 "
                       "path_variable v_near\nrun 1"));
  EXPECT_IN("variable nowhere does not exist",
            message_of(begin + "path stage rate yy v_nowhere\nrun 1"));
  EXPECT_IN("the value of yy in stage 1 of its path is inf; it must be a finite number",
            message_of(begin + "path stage rate yy v_rate\nvariable rate atom exp(1e9)\nrun 1"));
}
