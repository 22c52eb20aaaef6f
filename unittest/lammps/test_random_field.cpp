// SPDX-License-Identifier: GPL-2.0-only
// random_field through LAMMPS scripts: bitwise equal values on any number of ranks, commands that
// use the property, and messages for wrong input. Under mpirun every rank also runs the script
// alone, and both results are compared.

#include "script.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>

using namespace LAMMPS_NS;

namespace {

/// 12 by 8 points in a box of 6 by 4. No point is on a node of a grid of these tests. Ranks divide
/// y, so that the IDs do not depend on the number of ranks.
const std::string points =
    "units si\ndimension 2\nboundary f p p\natom_style atomic\nprocessors 1 * 1\n"
    "region box block 0 6 0 4 -0.1 0.1 units box\ncreate_box 2 box\n"
    "mass * 1.0\nlattice sq 0.5 origin 0.43 0.37 0.0\n"
    "create_atoms 1 box\nfix field all property/atom d_phi\n";
const std::string grid = "lengths 3 1 spacing 0.5 0.25 angle 20 seed 7 ";
const std::string field =
    "random_field all d_phi covariance exponential marginal lognormal 2 0.5 " + grid;

}    // namespace

TEST(RandomField, RanksGiveTheSameBits)
{
  for (const char *keywords :
       {"covariance exponential marginal lognormal 2 0.5",
        "covariance exponential marginal lognormal 2 0.5 interpolation nearest",
        "covariance matern 0.8 marginal lognormal 2 0.5",
        "covariance gaussian marginal lognormal 2 0.5 domain -1 7 -1 5",
        "covariance exponential marginal bounded 0.1 0.3 0 2"}) {
    const std::string command = "random_field all d_phi " + grid + keywords;
    Script together, alone(MPI_COMM_SELF);

    together << points + command;
    alone << points + command;

    const auto values = together.property("phi");
    EXPECT_EQ(values.size(), 96u);
    EXPECT_EQ(values, alone.property("phi")) << keywords;
    double lowest = HUGE_VAL, highest = -HUGE_VAL;
    for (const auto &one : values) {
      lowest = std::fmin(lowest, one.second);
      highest = std::fmax(highest, one.second);
    }
    EXPECT_GT(highest - lowest, 0.05) << "a field varies";
  }
}

TEST(RandomField, OnlyTheGroupGetsValues)
{
  Script script;

  script << points + "set group all d_phi -5\ngroup some id 3 17 96\n" +
          "random_field some d_phi covariance exponential lengths 3 1 spacing 0.5 0.25 marginal "
          "uniform 0 1";

  for (const auto &one : script.property("phi")) {
    if (one.first == 3 || one.first == 17 || one.first == 96)
      EXPECT_TRUE(one.second >= 0.0 && one.second <= 1.0) << one.first;
    else
      EXPECT_EQ(one.second, -5.0) << one.first;
  }
}

TEST(RandomField, VariablesAndDumpsReadTheProperty)
{
  Script script;

  script << points + field +
          "\nvariable which atom floor(10*d_phi)\nvariable top equal max(d_phi)\n"
          "write_dump all custom test_random_field.dump id d_phi v_which modify sort id format "
          "float %.17g";

  MPI_Barrier(MPI_COMM_WORLD);
  std::ifstream dump("test_random_field.dump");
  for (std::string line; std::getline(dump, line) && line.rfind("ITEM: ATOMS", 0) != 0;) {}
  const auto values = script.property("phi");
  tagint id;
  double value, which;
  std::size_t lines = 0;
  for (; dump >> id >> value >> which; ++lines) {
    EXPECT_EQ(value, values.at(id));
    EXPECT_EQ(which, std::floor(10 * values.at(id)));
  }
  EXPECT_EQ(lines, values.size());
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove("test_random_field.dump");
}

TEST(RandomField, ValuesMigrateWithAtomsAndSurviveARestart)
{
  Script script, second;

  script << points + field +
          "\npair_style none\ncomm_modify cutoff 1.0\nvelocity all set 0 2.5 0\nfix move all nve\n"
          "neigh_modify every 1 delay 0 check no\ntimestep 0.01\n";
  const auto before = script.property("phi");
  script << "run 100\nwrite_restart test_random_field.restart";
  second << "read_restart test_random_field.restart\nfix field all property/atom d_phi\n";

  EXPECT_EQ(script.property("phi"), before);
  EXPECT_EQ(second.property("phi"), before);
  // Atoms have crossed the periodic side. The command must wrap them into the box before it
  // evaluates the field.
  EXPECT_NO_THROW(script << field);
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove("test_random_field.restart");
}

TEST(RandomField, PaddingIsReportedInTheLog)
{
  {
    Script script(MPI_COMM_WORLD, "test_random_field.log");
    script << points +
            "random_field all d_phi covariance gaussian lengths 5 4 spacing 0.5 0.5 seed 3";
  }    // the log is complete when LAMMPS has ended
  MPI_Barrier(MPI_COMM_WORLD);
  std::ifstream stream("test_random_field.log");
  const std::string log((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());

  for (const char *part : {"random_field d_phi: gaussian covariance on 13 x 9 nodes, torus of ",
                           "a torus of 24 x 16 points has ", " negative eigenvalues, smallest -",
                           "; padding by ", " points removes them", "96 atoms: mean "})
    EXPECT_NE(log.find(part), std::string::npos) << part << "\n" << log;
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove("test_random_field.log");
}

TEST(RandomFieldErrors, AreReported)
{
  const std::string scene = points + "random_field all d_phi ";
  const std::string law = "covariance exponential lengths 3 1 ", grid = "spacing 0.5 0.25 ";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"random_field all d_phi", "the simulation box must be defined before"},
      {"region b block 0 1 0 1 0 1\ncreate_box 1 b\nrandom_field all d_phi",
       "dimension is 3; it must be 2"},
      {points + "random_field all", "random_field: property has no value; the command ends there"},
      {points + "random_field soil d_phi " + law + grid, "group 'soil' does not exist"},
      {points + "random_field all phi " + law + grid,
       "property is 'phi'; it must be d_name of a fix property/atom"},
      {points + "random_field all d_psi " + law + grid,
       "there is no per-atom vector d_psi; define it first: fix ID all property/atom d_psi"},
      {points + "fix two all property/atom i_psi\nrandom_field all d_psi " + law + grid,
       "there is no per-atom vector d_psi"},
      {scene + law + grid + "angle 1e300", "angle must be from -360 to 360 [degrees], got 1e+300"},
      {scene + law + grid + "wings 2", "unknown keyword 'wings'; the keywords are"},
      {scene + law + grid + "margnal normal 0 1",
       "random_field: unknown keyword 'margnal'; did you mean marginal?"},
      {scene + law + "spacing 0.5 0.25 0.1",
       "found '0.1' after 'spacing 0.5 0.25', where a keyword or the end was expected"},
      {scene + law + "spacing 0.5 small", "spacing dy is 'small'; it must be a number"},
      {scene + grid + "covariance spherical",
       "covariance is 'spherical'; it must be exponential, gaussian or matern nu"},
      {scene + grid + "covariance matern",
       "covariance matern nu has no value; the command ends there; it must read: covariance "
       "exponential | gaussian | matern nu"},
      {scene + "lengths 3 1 " + grid + "covariance matern -2",
       "smoothness nu of the Matern covariance must be in (0, 25], got -2"},
      {scene + grid + "lengths 3 1", "the keyword covariance must be given"},
      {scene + grid + "covariance gaussian", "the keyword lengths must be given"},
      {scene + law, "the keyword spacing must be given"},
      {scene + law + "spacing 0.5 -1", "grid spacing in y must be positive, got -1"},
      {scene + grid + "covariance gaussian lengths 0.4 1",
       "horizontal correlation length 0.4 is below the grid spacing, 0.5"},
      {scene + law + grid + "seed 1 seed 1",
       "random_field: seed is given twice, as 'seed 1' and as 'seed 1'; give it once"},
      {scene + law + grid + "marginal normal 0 1 marginal lognormal 1 1",
       "random_field: marginal is given twice, as 'marginal normal 0 1' and as 'marginal lognormal "
       "1 1'"},
      {scene + law + grid + "marginal lognormal 1 1e200",
       "standard deviation of a lognormal field must be at most 1e15 times its mean, got 1e+200"},
      {scene + grid + "covariance gaussian lengths 3 5",
       "vertical correlation length 5 is above the extent of the domain, 4"},
      {scene + law + grid + "marginal gamma 1 2",
       "marginal is 'gamma'; it must be normal, lognormal, uniform or bounded"},
      {scene + law + grid + "marginal lognormal -1 2",
       "mean of a lognormal field must be positive, got -1"},
      {scene + law + grid + "marginal bounded 3 2 0 1",
       "lower bound must be below the upper one, got 3 and 2"},
      {scene + law + grid + "interpolation cubic",
       "interpolation is 'cubic'; it must be linear or nearest"},
      {scene + law + grid + "seed -1", "seed is -1; it must be at least 0"},
      {scene + law + grid + "max_points 3", "max_points is 3; it must be at least 4"},
      {scene + law + grid + "max_points 100",
       "the covariance needs a torus of 24 x 32 points, above the limit of 100"},
      {scene + "covariance gaussian lengths 6 4 " + grid + "max_points 1000",
       " negative eigenvalues, down to -"},
      {scene + law + grid + "domain 0 6 2 4",
       "atom 1 at (0.215, 0.185) is outside the domain, x from 0 to 6 and y from 2 to 4 (atoms "
       "outside: 48)"},
      {scene + law + grid + "marginal normal 0.5 0.2 bounds 0.49 0.51",
       "is outside the bounds [0.49, 0.51] ("},
      {scene + law + grid + "bounds 1 0", "lower bound must be below the upper one, got 1 and 0"},
  };

  for (const auto &one : cases) {
    const std::string message = message_of(one.first);
    EXPECT_NE(message.find(one.second), std::string::npos)
        << "expected '" << one.second << "' in '" << message << "'";
  }
}

TEST(RandomFieldErrors, ErrorsKeepTheOldValues)
{
  Script script;
  script << points + "set group all d_phi -5";

  EXPECT_THROW(script << field + "bounds 1.99 2.01", LAMMPSException);

  for (const auto &one : script.property("phi")) EXPECT_EQ(one.second, -5.0);
}

TEST(RandomField, LargeValuesHaveTheirMeanAndDeviationInTheLog)
{
  {
    Script script(MPI_COMM_WORLD, "test_random_field_large.log");
    script << points + "random_field all d_phi covariance exponential marginal normal 0 1e200 " +
            grid;
  }
  MPI_Barrier(MPI_COMM_WORLD);
  std::ifstream stream("test_random_field_large.log");
  const std::string log((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());

  const auto place = log.find("96 atoms: mean ");
  ASSERT_NE(place, std::string::npos) << log;
  double mean, deviation;
  ASSERT_EQ(std::sscanf(log.c_str() + place, "96 atoms: mean %lf, standard deviation %lf", &mean,
                        &deviation),
            2);
  EXPECT_LT(std::fabs(mean), 2e200);
  EXPECT_GT(deviation, 1e199);
  EXPECT_LT(deviation, 4e200);
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove("test_random_field_large.log");
}
