// SPDX-License-Identifier: GPL-2.0-only
// fix mpm through LAMMPS scripts: physics in closed form, bitwise equal results on any number of
// ranks and after a restart, and messages for wrong input. Under mpirun every rank also runs the
// scene alone, and both results are compared.

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "exceptions.h"
#include "fix.h"
#include "lammps.h"
#include "lammps/state_readers.h"
#include "modify.h"
#include "output.h"
#include "script.h"
#include "support/files.h"
#include "update.h"

#include <gtest/gtest.h>
#include <mpi.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <set>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

// The global vector has four values, then the entries of the bodies, then TIMES wall times and
// DAMPING components (x and y) of the damping force. Wall times differ from run to run.
constexpr int TIMES = 3;
constexpr int DAMPING = 2;

/// Script with a fix mpm whose ID is soil.
class SoilScript : public Script {
 public:
  using Script::Script;

  Fix *fix() { return lmp->modify->get_fix_by_id("soil"); }

  /// Returns the values of each point by atom ID, on every rank: x, y, vx, vy and the columns of
  /// the fix.
  Rows points()
  {
    const Atom *atom = lmp->atom;
    const int columns = fix()->size_peratom_cols;
    return rows_by_id(4 + columns, [&](int i, std::vector<double> &list) {
      list.insert(list.end(), {atom->x[i][0], atom->x[i][1], atom->v[i][0], atom->v[i][1]});
      list.insert(list.end(), fix()->array_atom[i], fix()->array_atom[i] + columns);
    });
  }

  /// Returns the atom IDs of this rank's points. If they change between two calls, points have
  /// migrated.
  std::set<tagint> mine() const { return {lmp->atom->tag, lmp->atom->tag + lmp->atom->nlocal}; }

  bool has_ranks() const { return lmp->comm->nprocs > 1; }

  /// Returns true if the points of at least one rank differ from its points in `before`.
  bool migrated_since(const std::set<tagint> &before) const
  {
    int changed = mine() != before;
    MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, lmp->world);
    return changed;
  }
};

/// Returns ground of `nx` by `ny` cells of edge 1, with one point in each cell. Above the ground
/// the box has empty space of height `room`.
std::string points_in_box(int nx, int ny, double room = 2)
{
  const std::string width = std::to_string(nx), height = std::to_string(ny);
  return "units si\ndimension 2\nboundary f f p\natom_style sphere\natom_modify map array\n"
         "region box block 0 " +
      width + " 0 " + std::to_string(ny + room) +
      " -0.1 0.1 units box\n"
      "create_box 2 box\nlattice sq 1.0 origin 0.5 0.5 0.0\n"
      "region ground block 0 " +
      width + " 0 " + height +
      " -0.05 0.05 units box\n"
      "create_atoms 1 region ground\nset group all diameter 1.0\n"
      "pair_style none\ncomm_modify cutoff 1.0\nneighbor 0.5 bin\nneigh_modify every 5 delay 0 "
      "check no\n"
      "thermo_modify lost error\n";
}

/// Returns ground of 8 by 6 in cells of edge 1, with points on the given lattice.
std::string block_of_points(const std::string &lattice)
{
  std::string scene = points_in_box(8, 6);
  const std::string usual = "lattice sq 1.0 origin 0.5 0.5 0.0";
  return scene.replace(scene.find(usual), usual.size(), lattice);
}

/// Returns the scene of the tests for bitwise equality: a rough footing that is pressed into
/// elastic ground. Points move by more than one cell.
std::string elastic_footing()
{
  return points_in_box(8, 6) +
      "region plate block 0 2 6 7 -0.05 0.05 units box\ncreate_atoms 2 region plate\nset type 2 "
      "diameter 1.0\n"
      "group ground type 1\ngroup plate type 2\n"
      "region top block 2 8 5 6 -0.05 0.05 units box\ngroup surface region top\n"
      "timestep 0.005\n"
      "fix soil all mpm 1.0 model ground elastic 1.0e6 0.3 density 2000 stress -20000 -20000 0 "
      "boundary xlo roller boundary xhi roller boundary ylo fixed damping 0.05 "
      "rigid plate vx 0 vy -0.5 rough traction surface 0 -20000\n";
}

TEST(FixMpm, UniformStressUnderSurchargeIsInEquilibrium)
{
  // The cases vary the number of points per cell edge, the shape function, and how the loaded
  // points are selected: the uppermost points as a group, or a region.
  for (const auto &edge : {std::string("1"), std::string("2")})
    for (const auto &shape : {std::string("gimp"), std::string("linear")})
      for (const auto &loaded : {std::string("surface"), std::string("top")}) {
        SoilScript script;

        script << block_of_points("lattice sq " + std::to_string(1.0 / std::stod(edge)) +
                                  " origin 0.5 0.5 0.0") +
                "variable low equal 6-1/" + edge +
                "\nregion top block 0 8 ${low} 6 -0.05 0.05 units box\n"
                "group surface region top\ntimestep 0.001\n"
                "fix soil all mpm 1.0 shape " +
                shape + " points_per_cell $(" + edge + "^2) " +
                "model all elastic 1.0e6 0.3 density 2000 stress -20000 -20000 0 "
                "boundary xlo roller boundary xhi roller boundary ylo fixed traction " +
                loaded + " 0 -20000\nrun 0\n";

        // The largest unbalanced nodal force must be below 1e-6 q_s h, with the surcharge q_s and
        // the cell edge h.
        EXPECT_LT(script.fix()->compute_vector(0), 1e-6 * 20000 * 1.0)
            << shape << ", traction " << loaded << ", " << edge << " points per cell edge";
        EXPECT_NEAR(script.fix()->compute_vector(3), 2000 * 48.0, 1e-6);
      }
}

TEST(FixMpm, ShowsFieldsOfPointsAsColumns)
{
  // A row has x, y, vx, vy and then the columns of the fix. Columns 18 to 20, counted from 1, are
  // mass, volume and initial volume.
  constexpr int EPS_V = 12, RHO = 14, MASS = 21;
  std::string scene = elastic_footing();
  scene.insert(scene.size() - 1, " column mass column volume column initial_volume");
  SoilScript script;
  script << scene + "run 40\n";
  double least = 1.0;
  for (const auto &[id, row] : script.points()) {
    const double mass = row[MASS], volume = row[MASS + 1], initial_volume = row[MASS + 2];
    EXPECT_EQ(row[RHO], mass / volume) << id;
    EXPECT_EQ(initial_volume, 1.0) << id;
    EXPECT_NEAR(volume, 1.0 + row[EPS_V], 0.01) << id;
    least = std::min(least, volume);
  }
  EXPECT_LT(least, 0.999) << "the footing compresses the ground";
}

TEST(FixMpm, FreeFallUnderFixGravity)
{
  SoilScript script;

  script << points_in_box(3, 3, 6) +
          "fix soil all mpm 1.0 model all elastic 1.0e5 0.3 density 1000\ntimestep 0.001\n"
          "fix g all gravity 9.81 vector 0 1 0\nvelocity all set 0 0 0\nrun 100\n";

  for (const auto &point : script.points()) EXPECT_NEAR(point.second[3], 9.81 * 0.1, 1e-6);
}

TEST(FixMpm, BarVibratesInItsFirstModeAsInClosedForm)
{
  // First mode of a bar that is fixed at x = 0, with E = 100, L = 25, rho = 1 and the velocity v0 =
  // 0.1 at its free end. The mean velocity is v_cm = v0/(beta L) cos(omega t) with beta = pi/(2 L)
  // and omega = beta sqrt(E/rho).
  const double beta = M_PI / 50.0, omega = beta * 10.0, time = 5.0;
  SoilScript script;

  script << "units si\ndimension 2\nboundary f f p\natom_style sphere\nregion box block 0 27 0 1 "
            "-0.1 0.1 units box\n"
            "create_box 1 box\nlattice sq 1.0 origin 0.5 0.5 0.0\nregion bar block 0 25 0 1 -0.05 "
            "0.05 units box\n"
            "create_atoms 1 region bar\nset group all diameter 1.0\npair_style none\ncomm_modify "
            "cutoff 1.0\n"
            "variable v atom 0.1*sin(PI/50*x)\nvelocity all set v_v 0 0\ntimestep 0.01\n"
            "fix soil all mpm 1.0 model all elastic 100 0 density 1 boundary xlo roller boundary "
            "ylo roller "
            "boundary yhi roller\nvariable p equal vcm(all,x)\nrun 500\n";

  double velocity = 0.0;
  for (const auto &point : script.points()) velocity += point.second[2] / 25;
  EXPECT_NEAR(velocity, 0.1 / (beta * 25) * cos(omega * time),
              0.02 * 0.1);    // grid dispersion at 25 cells
}

class FixMpmScheme : public ::testing::TestWithParam<const char *> {};

TEST_P(FixMpmScheme, PlateReactionIsOedometricModulusTimesStrain)
{
  SoilScript script;

  script << points_in_box(4, 8) +
          "region plate block 0 4 8 9 -0.05 0.05 units box\ncreate_atoms 2 region plate\nset type "
          "2 diameter 1.0\n"
          "group ground type 1\ngroup plate type 2\ntimestep 0.005\n"
          "variable vy equal ramp(0,-0.02)\n"
          "fix soil all mpm 1.0 model ground elastic 1.0e6 0.25 density 2000 damping 0.1 boundary "
          "xlo roller "
          "boundary xhi roller boundary ylo fixed rigid plate vx 0 vy v_vy smooth scheme " +
          GetParam() + "\nrun 1600\n";

  const double strain =
      0.5 * 0.02 * 8.0 / 8.0;    // settlement of a velocity ramp over 8 s, height 8
  const double modulus = 1.0e6 * 0.75 / (1.25 * 0.5);
  EXPECT_NEAR(script.fix()->compute_vector(5), 4.0 * modulus * strain,
              0.04 * 4.0 * modulus * strain);
  EXPECT_NEAR(script.fix()->compute_vector(7), -0.08, 1e-4);
}

INSTANTIATE_TEST_SUITE_P(, FixMpmScheme, ::testing::Values("musl", "usavg"));

TEST(FixMpm, FlipBelowOneFiltersAModeAsInClosedForm)
{
  // The stress is negligible. Each cell of edge h has one point, in its middle. A step replaces the
  // velocity v of a point by
  //   flip v + (1 - flip) (v_left + 2 v + v_right)/4.
  // This multiplies the mode cos(k x) by
  //   flip + (1 - flip) cos^2(k h/2).
  // For a row of length L with free ends, k = pi/L.
  for (const double flip : {1.0, 0.9, 0.0}) {
    SoilScript script;

    script << points_in_box(5, 1) +
            "variable v atom 1e-6*cos(PI/5*x)\nvelocity all set v_v 0 0\ntimestep 1e-6\n"
            "fix soil all mpm 1.0 model all elastic 1.0 0 density 1 flip " +
            std::to_string(flip) + "\nrun 10\n";

    const double factor = pow(flip + (1.0 - flip) * pow(cos(M_PI / 10), 2), 10);
    for (const auto &point : script.points()) {
      const double start = 1e-6 * cos(M_PI / 5 * (point.first - 0.5));
      EXPECT_NEAR(point.second[2], factor * start, 1e-15)
          << "flip " << flip << "; points move by 1e-11, stress adds 1e-16";
    }
  }
}

TEST(FixMpm, UsesMassesPerType)
{
  SoilScript script;

  script << "units si\ndimension 2\nboundary f f p\natom_style atomic\n"
            "region box block 0 3 0 6 -0.1 0.1 units box\ncreate_box 1 box\n"
            "lattice sq 1.0 origin 0.5 0.5 0.0\nregion ground block 0 3 0 3 -0.05 0.05 units box\n"
            "create_atoms 1 region ground\nmass 1 1000\npair_style none\ncomm_modify cutoff 1.0\n"
            "neighbor 0.5 bin\ntimestep 0.001\n"
            "fix soil all mpm 1.0 model all elastic 1.0e5 0.3 density 1000\n"
            "fix g all gravity 9.81 vector 0 1 0\nvelocity all set 0 0 0\nrun 100\n";

  for (const auto &point : script.points()) EXPECT_NEAR(point.second[3], 9.81 * 0.1, 1e-6);
  EXPECT_EQ(script.fix()->compute_vector(3), 9 * 1000.0);
}

TEST(FixMpm, DensityIsThatOfAllPointsOrOfTheModelBeforeIt)
{
  // Returns two sets: the densities of the points of model low and of model high.
  const auto masses = [](const std::string &models) {
    SoilScript script;
    script << points_in_box(4, 4) +
            "region low block 0 4 0 2 -0.05 0.05 units box\ngroup low region low\n"
            "group high subtract all low\ntimestep 0.001\nfix soil all mpm 1.0 " +
            models + "\nrun 0\n";
    std::set<double> rows[2];
    for (const auto &point : script.points())
      rows[point.second[1] > 2.0].insert(point.second[4 + 10]);
    return std::make_pair(rows[0], rows[1]);
  };
  const std::string low = "model low elastic 1e6 0.3 ", high = "model high elastic 1e6 0.2 ";
  const auto pair = [](double a, double b) {
    return std::make_pair(std::set<double>{a}, std::set<double>{b});
  };

  EXPECT_EQ(masses(low + high + "density 1800"), pair(1800, 1800));
  EXPECT_EQ(masses(low + "density 1800 " + high), pair(1800, 1800));
  EXPECT_EQ(masses("density 1800 " + low + high), pair(1800, 1800));
  EXPECT_EQ(masses(low + "density 2000 " + high + "density 1800"), pair(2000, 1800));
  EXPECT_EQ(masses(low + "damping 0.1 density 2000 " + high + "flip 0.9 density 1800"),
            pair(2000, 1800));
  EXPECT_EQ(masses("density 1800 " + low + "density 2000 " + high), pair(2000, 1800));
}

TEST(FixMpm, BodyHasItsOwnDensity)
{
  // Without `density`, the mass of the block is its volume times the density of the ground. With a
  // number it is the volume times this density. With `density rve` it is the mass of the four
  // atoms.
  const auto mass = [](const std::string &words) {
    SoilScript script;
    script << points_in_box(4, 2, 6) +
            "region block block 1 3 4 6 -0.05 0.05 units box\ncreate_atoms 2 region block\n"
            "group ground type 1\ngroup block type 2\nset group all diameter 1.0\n"
            "set group block density 700\ntimestep 0.001\n"
            "fix soil all mpm 1.0 model ground elastic 1e6 0.3 density 2000 "
            "rigid block vx 0 vy free friction 0.5 form box " +
            words + "\nrun 0\n";
    double sum = 0.0, all;
    for (int i = 0; i < script.lmp->atom->nlocal; i++)
      if (script.lmp->atom->type[i] == 2) sum += script.lmp->atom->rmass[i];
    MPI_Allreduce(&sum, &all, 1, MPI_DOUBLE, MPI_SUM, script.lmp->world);
    return all;
  };

  EXPECT_NEAR(mass(""), 4 * 2000.0, 1e-9) << "the only density";
  EXPECT_NEAR(mass("density 2500"), 4 * 2500.0, 1e-9);
  EXPECT_NEAR(mass("density rve"), 4 * 700.0 * M_PI / 6.0, 1e-9) << "of the atoms";
}

TEST(FixMpm, TractionOnARegionIsTractionOnItsPoints)
{
  std::string on_region = elastic_footing();
  const std::string on_group = "traction surface";
  on_region.replace(on_region.find(on_group), on_group.size(), "traction top");
  SoilScript group, region;

  group << elastic_footing() + "run 20\n";
  region << on_region + "run 20\n";

  EXPECT_EQ(group.points(), region.points());
}

TEST(FixMpm, SeparationLetsABodyPushButNotPull)
{
  // Returns the vertical reaction on a plate on stress-free ground after ten steps. Sets `moved` to
  // true if the ground moves.
  const auto reaction = [](const std::string &velocity, const std::string &separation,
                           bool &moved) {
    SoilScript script;
    script << points_in_box(4, 4) +
            "region plate block 0 2 4 5 -0.05 0.05 units box\ncreate_atoms 2 region plate\nset "
            "type 2 diameter 1.0\ngroup ground type 1\ngroup plate type 2\ntimestep 0.005\n"
            "fix soil all mpm 1.0 model ground elastic 1.0e6 0.3 density 2000 boundary ylo fixed "
            "rigid plate vx 0 vy " +
            velocity + " rough separation " + separation + "\nrun 10\n";
    moved = script.fix()->compute_vector(2) > 0.0;    // kinetic energy of the ground
    return script.fix()->compute_vector(5);
  };
  bool moved;

  EXPECT_GT(reaction("-0.1", "no", moved), 0.0);
  EXPECT_TRUE(moved);
  EXPECT_GT(reaction("-0.1", "yes", moved), 0.0);
  EXPECT_TRUE(moved);
  EXPECT_LT(reaction("0.1", "no", moved), 0.0);
  EXPECT_TRUE(moved);
  EXPECT_EQ(reaction("0.1", "yes", moved), 0.0);
  EXPECT_FALSE(moved);
}

TEST(FixMpm, SecondRunAndRunZeroDoNotAdvanceTwice)
{
  SoilScript once, twice;

  once << elastic_footing() + "run 40\n";
  twice << elastic_footing() + "run 0\nrun 15\nrun 0\nrun 25\n";

  EXPECT_EQ(once.points(), twice.points());
  EXPECT_EQ(once.fix()->compute_vector(5), twice.fix()->compute_vector(5));
}

/// Runs the scene on all ranks and on one rank and expects bitwise equal results. With several
/// ranks a point must migrate. Returns the force on the plate.
double plate_force_on_ranks_and_alone(const std::string &scene, int steps)
{
  const std::string run = "run " + std::to_string(steps) + "\n";
  SoilScript together, alone(MPI_COMM_SELF);

  together << "processors 1 * 1\n" + scene + "run 0\n";
  const auto before = together.mine();
  together << run;
  alone << scene + run;

  EXPECT_EQ(together.migrated_since(before), together.has_ranks());
  EXPECT_EQ(together.points(), alone.points());
  EXPECT_EQ(together.fix()->compute_vector(5), alone.fix()->compute_vector(5));
  return alone.fix()->compute_vector(5);
}

/// Returns the scene of elastic_footing() with another ground: Mohr-Coulomb material in the upper
/// half and elastic material below. The ground yields under the footing.
std::string mohr_coulomb_footing()
{
  std::string scene = elastic_footing();
  const std::string law = "model ground elastic 1.0e6 0.3 ";
  return scene
      .replace(scene.find(law), law.size(),
               "model ground elastic 1.0e6 0.3 model upper mohr_coulomb 1.0e6 0.3 1000 30 5 ")
      .insert(scene.find("timestep"),
              "region upper block 0 8 3 6 -0.05 0.05 units box\ngroup upper region upper\n");
}

TEST(FixMpmMohrCoulomb, GroupsHaveTheirOwnLaws)
{
  SoilScript script;
  script << mohr_coulomb_footing() + "run 200\n";

  // The columns of the fix follow x, y, vx, vy.
  constexpr int Y = 1, SXX = 4 + 3, SYY = 4 + 4, SXY = 4 + 5, SZZ = 4 + 15, YIELDED = 4 + 16;
  int yielded = 0;
  for (const auto &point : script.points()) {
    const std::vector<double> &row = point.second;
    const bool plate = row[Y] > 6.0 && row[SXX] == 0.0 && row[SYY] == 0.0;
    if (plate) continue;
    const double sxx = row[SXX], syy = row[SYY], sxy = row[SXY];
    const double mean = 0.5 * (sxx + syy);
    const double radius = std::hypot(0.5 * (sxx - syy), sxy);
    if (row[SZZ] == 0.0) {
      EXPECT_EQ(row[YIELDED], 0.0) << "elastic points do not yield";
      continue;
    }
    // The yield condition for an angle of 30 degrees is 3 σ_1 - σ_3 <= 2 c sqrt(3). The
    // out-of-plane stress σ_zz can also be a principal stress σ_1 or σ_3.
    const double high = std::max(mean + radius, row[SZZ]), low = std::min(mean - radius, row[SZZ]);
    EXPECT_LT(3.0 * high - low, 2000.0 * std::sqrt(3.0) + 1e-6 * 20000) << "atom " << point.first;
    if (row[YIELDED] > 0.0) ++yielded;
  }
  EXPECT_GT(yielded, 3);
}

/// Returns a specimen of cohesive sand, 4 wide and 8 high, between a moving upper plate and a lower
/// plate at rest. In the second half of the run the specimen yields. f_mean[1..3] are vertical
/// forces, averaged over the second half of the run: the force on the upper plate, the force on the
/// lower plate, and the damping force.
std::string specimen_between_platens(double damping)
{
  std::string scene = points_in_box(8, 12, 0);
  const std::string everywhere = "region ground block 0 8 0 12";
  return scene.replace(scene.find(everywhere), everywhere.size(), "region ground block 2 6 2 10") +
      "region lower block 1 7 1 2 -0.05 0.05 units box\ncreate_atoms 2 region lower\n"
      "region upper block 1 7 10 11 -0.05 0.05 units box\ncreate_atoms 2 region upper\n"
      "set type 2 diameter 1.0\ngroup ground type 1\ngroup lower region lower\ngroup upper region "
      "upper\n"
      "timestep 0.005\n"
      "fix soil all mpm 1.0 model ground mohr_coulomb 1.0e7 0.3 10000 30 0 density 2000 "
      "rigid upper vx 0 vy -0.02 rough rigid lower vx 0 vy 0 rough face yhi damping " +
      std::to_string(damping) +
      "\nfix mean all ave/time 1 800 1600 f_soil[6] f_soil[10] f_soil[17]\nrun 1600\n";
}

TEST(FixMpmMohrCoulomb, PlatensDifferByTheForceOfDampingAndAgreeWithoutIt)
{
  for (const double damping : {0.0, 0.05, 0.2}) {
    SoilScript script;
    script << specimen_between_platens(damping);
    const double upper = script.fix_value("mean", 1), lower = script.fix_value("mean", 2);
    const double damped = script.fix_value("mean", 3);

    EXPECT_GT(upper, 1e5);
    // upper + lower - damped is the rate of change of momentum. It is at most that of 64 t which
    // change their velocity by 0.02 m/s in 4 s.
    EXPECT_NEAR(upper + lower, damped, 64000 * 0.02 / 4.0) << "damping " << damping;
    if (damping == 0.0)
      EXPECT_EQ(damped, 0.0);
    else
      EXPECT_GT(damped, 0.5 * damping * upper)
          << "in plastic flow it has the same sign all the time";
  }
}

TEST(FixMpmMohrCoulomb, DampingPartOfReactionsIsInTheLog)
{
  const std::string path = rve_test::temporary_path("log");
  SoilScript script;
  script << "log " + path + "\n" + specimen_between_platens(0.05) + "run 50\nlog none\n";
  MPI_Barrier(MPI_COMM_WORLD);    // rank 0 writes the log
  const std::string log = rve_test::text_of(path);

  EXPECT_NE(log.find("WARNING: fix mpm soil: local damping 0.05 amounts to 3"), std::string::npos)
      << log;
  EXPECT_NE(log.find("f_soil[16] and f_soil[17] are components of the damping force"),
            std::string::npos)
      << log;
  const std::string again = "fix mpm soil: local damping 0.05 amounts to 3";
  EXPECT_NE(log.find("\n" + again), std::string::npos) << "the second run says it, and warns not";
  EXPECT_EQ(log.find("WARNING"), log.rfind("WARNING")) << log;
}

TEST(FixMpmMohrCoulomb, RanksGiveTheSameBits)
{
  plate_force_on_ranks_and_alone(mohr_coulomb_footing(), 400);
}

TEST(FixMpmMohrCoulomb, RestartContinuesBitForBit)
{
  const std::string command = mohr_coulomb_footing();
  SoilScript whole, first, second;

  whole << command + "run 200\n";
  first << command + "run 150\nwrite_restart test_fix_mpm_mc.restart\n";
  second << "read_restart test_fix_mpm_mc.restart\npair_style none\ncomm_modify cutoff "
            "1.0\nneighbor 0.5 bin\nneigh_modify every 5 delay 0 check no\ntimestep 0.005\n" +
          command.substr(command.find("fix soil")) + "run 50\n";

  EXPECT_EQ(whole.points(), second.points());
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove("test_fix_mpm_mc.restart");
}

void make_packing()
{
  SoilScript script;
  script << "units si\ndimension 2\nregion box block 0 1 0 1 -0.1 0.1\ncreate_box 1 box\n"
            "create_rve test_fix_mpm.rve grains 60 seed 1 radius uniform 0.0025 0.005 pressure "
            "20000 kn 1e6 kt 1e6 "
            "friction 0.5 density 2650 damping 0.3 thickness 0.075\n";
}

/// Returns ground of 8 by 3 on which fix deposit drops four points, one every 20 steps from step 1.
std::string ground_under_drops(const std::string &models)
{
  return points_in_box(8, 3, 9) +
      "group ground type 1\ntimestep 0.002\nfix weight all gravity 9.81 vector 0 -1 0\n"
      "region drop block 1 7 9 11 -0.05 0.05 units box\n" +
      models + "fix drops ground deposit 4 1 20 1234 region drop near 1.2 vy -1 -1 units box\n";
}

TEST(FixMpm, PointsThatAFixCreatesInARunFallFreely)
{
  const std::string scene = ground_under_drops(
      "fix soil all mpm 1.0 model ground mohr_coulomb 1e6 0.3 1000 30 0 density 2000 stress -10 "
      "-10 0 boundary xlo roller boundary xhi roller boundary ylo fixed\n");
  SoilScript script, alone(MPI_COMM_SELF);
  script << "processors 1 * 1\n" + scene + "run 21\n";
  alone << scene + "run 21\n";

  const auto points = script.points();
  EXPECT_EQ(points, alone.points());
  ASSERT_EQ(points.size(), 24u + 2u);
  for (const auto &[id, steps] : std::map<tagint, int>{{25, 21}, {26, 1}}) {
    const std::vector<double> &row = points.at(id);
    EXPECT_NEAR(row[3], -1.0 - 9.81 * 0.002 * steps, 2e-4) << "the initial stress adds little";
    EXPECT_NEAR(row[4 + 10], 2000.0, 2.0) << "density";
  }
  EXPECT_NEAR(script.fix()->compute_vector(3), 26 * 2000.0, 1e-6);
  // Both scripts continue with points that have landed: the first in the same session, the second
  // after a restart.
  script << "run 600\nwrite_restart test_fix_mpm_drops.restart\nrun 100\n";
  SoilScript second;
  second << "read_restart test_fix_mpm_drops.restart\npair_style none\ncomm_modify cutoff 1.0\n"
            "neighbor 0.5 bin\nneigh_modify every 5 delay 0 check no\n" +
          scene.substr(scene.find("timestep")) + "run 100\n";
  EXPECT_EQ(script.points().size(), 28u);
  EXPECT_EQ(script.points(), second.points());
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove("test_fix_mpm_drops.restart");
}

TEST(FixMpm, PointsDeletedInARunLoseTheirMass)
{
  SoilScript script;
  script << points_in_box(4, 4) +
          "region corner block 3 4 3 4 -0.05 0.05 units box\ntimestep 0.002\n"
          "fix soil all mpm 1.0 model all elastic 1e6 0.3 density 2000 boundary ylo fixed\n"
          "fix out all evaporate 5 1 corner 1234\nrun 20\n";
  EXPECT_EQ(script.points().size(), 15u);
  EXPECT_NEAR(script.fix()->compute_vector(3), 15 * 2000.0, 1e-6);
}

TEST(FixMpmErrors, NamePointsThatCannotBeCreatedInARun)
{
  make_packing();
  MPI_Barrier(MPI_COMM_WORLD);
  const auto message_with = [](const std::string &models) {
    return message_of(ground_under_drops(models) + "run 5\n");
  };
  const std::string of_grains = message_with(
      "fix grains ground rve test_fix_mpm.rve drive mpm dt 1e-4 substeps match device cpu threads "
      "1\nfix soil all mpm 1.0 model ground rve grains\n");
  EXPECT_NE(of_grains.find("step 1: atom 25 was created during the run as a point of the RVEs of "
                           "fix grains; such points can be created between runs only"),
            std::string::npos)
      << of_grains;
  const std::string without = message_with(
      "group first id 1:24\nfix soil all mpm 1.0 model first elastic 1e6 0.3 density 2000\n");
  EXPECT_NE(
      without.find(
          "atom 25 has no constitutive model; give a model for its group with the keyword model"),
      std::string::npos)
      << without;
  const std::string without_setup = message_of(
      points_in_box(4, 2, 4) +
      "timestep 0.002\nfix soil all mpm 1.0 model all elastic 1e6 0.3 density 2000\nrun 1\n"
      "create_atoms 1 single 1.5 4.5 0\nrun 1 pre no\n");
  EXPECT_NE(without_setup.find("has no volume: it was created after the setup of the run"),
            std::string::npos)
      << without_setup;
}

/// Returns a specimen without lateral stress, 4 wide and 8 high, under a smooth plate that moves
/// down. After 300 steps the whole specimen yields.
std::string specimen_under_a_plate(const std::string &law)
{
  std::string scene = points_in_box(8, 8);
  const std::string everywhere = "region ground block 0 8 0 8";
  return scene.replace(scene.find(everywhere), everywhere.size(), "region ground block 0 4 0 8") +
      "region plate block 0 6 8 9 -0.05 0.05 units box\ncreate_atoms 2 region plate\n"
      "set type 2 diameter 1.0\ngroup ground type 1\ngroup plate type 2\ntimestep 0.005\n"
      "fix soil all mpm 1.0 model ground " +
      law +
      " density 2000 boundary xlo roller boundary ylo roller damping 0.2 "
      "rigid plate vx 0 vy -0.02 smooth\n";
}

/// Returns the largest and the smallest yield function of the ground, divided by the uniaxial
/// strength [-]. The yield function and the strength use cohesion and tan(friction angle) divided
/// by `factor`.
std::pair<double, double> yield_of_ground(SoilScript &script, const std::string &law,
                                          double cohesion, double degrees, double factor)
{
  constexpr int SXX = 4 + 3, SYY = 4 + 4, SXY = 4 + 5, SZZ = 4 + 15;
  const double c = cohesion / factor;
  const double phi = std::atan(std::tan(degrees * M_PI / 180.0) / factor), sine = std::sin(phi);
  std::pair<double, double> range(-1e300, 1e300);
  for (const auto &[id, row] : script.points()) {
    if (row[1] > 8.0 - 0.1 || row[SZZ] == 0.0) continue;
    const double sxx = row[SXX], syy = row[SYY], sxy = row[SXY], szz = row[SZZ];
    double f;
    if (law == "mohr_coulomb") {
      const double k = (1.0 + sine) / (1.0 - sine), mean = 0.5 * (sxx + syy);
      const double radius = std::hypot(0.5 * (sxx - syy), sxy);
      f = (k * std::max(mean + radius, szz) - std::min(mean - radius, szz)) /
              (2.0 * c * std::sqrt(k)) -
          1.0;
    } else {
      const double p = (sxx + syy + szz) / 3.0;
      const double j2 =
          0.5 * ((sxx - p) * (sxx - p) + (syy - p) * (syy - p) + (szz - p) * (szz - p)) + sxy * sxy;
      const double scale = std::sqrt(3.0) * (3.0 - sine);
      f = (std::sqrt(j2) + 2.0 * sine / scale * 3.0 * p) / (6.0 * c * std::cos(phi) / scale) - 1.0;
    }
    range = {std::max(range.first, f), std::min(range.second, f)};
  }
  return range;
}

TEST(FixMpmModify, StrengthFallsWithTheFactorAndTheStateIsKept)
{
  for (const std::string law : {"mohr_coulomb", "drucker_prager"}) {
    SoilScript script;
    script << specimen_under_a_plate(law + " 1e7 0.3 1e4 30 10") + "run 600\n";
    const auto expect_yield = [&](double factor) {
      const auto [most, least] = yield_of_ground(script, law, 1e4, 30.0, factor);
      EXPECT_NEAR(most, 0.0, 1e-6) << law << " over " << factor;
      EXPECT_NEAR(least, 0.0, 5e-2) << law << " over " << factor;
    };
    expect_yield(1.0);
    const double reaction = script.fix()->compute_vector(5);
    double plastic = 0.0;
    for (const auto &[id, row] : script.points()) plastic = std::max(plastic, row[4 + 16]);

    script << "fix_modify soil strength_reduction ground 1.5\nrun 800\n";
    expect_yield(1.5);
    EXPECT_LT(script.fix()->compute_vector(5), 0.7 * reaction);
    for (const auto &[id, row] : script.points()) {
      if (row[4 + 16] == 0.0) continue;
      EXPECT_GT(row[4 + 16], 0.5 * plastic) << "it goes on from there";
    }
    // The factor applies to the strength given in the fix command, not to the strength that the
    // previous factor reduced. It also takes effect in a run without setup.
    script << "fix_modify soil strength_reduction ground 2\nrun 800 pre no\n";
    expect_yield(2.0);
    script << "fix_modify soil model ground " + law + " 1e7 0.3 5e3 30 10\nrun 800\n";
    const auto [most, least] = yield_of_ground(script, law, 5e3, 30.0, 1.0);
    EXPECT_NEAR(most, 0.0, 1e-6);
  }
}

TEST(FixMpmModify, FactorOneChangesNothing)
{
  const std::string scene = specimen_under_a_plate("mohr_coulomb 1e7 0.3 1e4 30 10");
  SoilScript plain, modified;
  plain << scene + "run 400\n";
  modified << scene +
          "fix_modify soil strength_reduction ground 3\nfix_modify soil strength_reduction ground "
          "1\nrun 400\n";
  EXPECT_EQ(plain.points(), modified.points());
}

TEST(FixMpmModify, ARestartContinuesBitForBitWithTheReducedStrength)
{
  const std::string scene = specimen_under_a_plate("mohr_coulomb 1e7 0.3 1e4 30 10");
  const std::string fix = scene.substr(scene.find("fix soil"));
  const std::string modify =
      "fix_modify soil model ground mohr_coulomb 1e7 0.3 9e3 30 10 strength_reduction ground 1.5\n";
  const std::string path = "test_fix_mpm_modify.restart";
  const std::string log = rve_test::temporary_path("log.modify");
  SoilScript whole, first;
  whole << scene + "run 400\n" + modify + "run 100\n";
  first << scene + "run 400\n" + modify + "run 40\nwrite_restart " + path + "\n";
  const auto continued = [&](const std::string &with) {
    SoilScript second;
    second << "log " + log + "\nread_restart " + path +
            "\npair_style none\ncomm_modify cutoff 1.0\nneighbor 0.5 bin\n"
            "neigh_modify every 5 delay 0 check no\ntimestep 0.005\n" +
            with + "run 60\nlog none\n";
    MPI_Barrier(MPI_COMM_WORLD);
    return std::make_pair(second.points(), rve_test::text_of(log));
  };

  const auto same = continued(fix);
  EXPECT_EQ(whole.points(), same.first);
  EXPECT_NE(same.second.find(
                "as set by fix_modify before, model ground mohr_coulomb has c 10000 -> 6000"),
            std::string::npos)
      << same.second;
  EXPECT_EQ(same.second.find("with changes"), std::string::npos) << same.second;

  // If the fix command gives the model other parameters than before, the changes in the restart
  // file are not applied.
  std::string other = fix;
  other.replace(other.find("1e4"), 3, "2e4");
  const auto defined = continued(other);
  EXPECT_NE(defined.first, same.first);
  EXPECT_NE(defined.second.find("model ground differs from that of the run before, so that these "
                                "changes by fix_modify are not applied"),
            std::string::npos)
      << defined.second;
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove(path.c_str());
}

TEST(FixMpmModify, RefusedArgumentsChangeNothing)
{
  make_packing();
  MPI_Barrier(MPI_COMM_WORLD);
  const std::string scene = points_in_box(4, 4) +
      "group low id 1 2 3 4\ngroup mid id 5 6 7 8\ngroup top id 9 10 11 12 13 14 15 16\n"
      "timestep 0.001\n"
      "fix grains low rve test_fix_mpm.rve drive mpm dt 1e-4 substeps match device cpu threads 1\n"
      "fix soil all mpm 1.0 model low rve grains model mid elastic 1e6 0.3 model top mohr_coulomb "
      "1e6 0.3 1e3 30 0 density 2000\n";
  const std::string right = "strength_reduction top 1.2 ";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"strength_reduction top 0",
       "fix_modify soil: strength_reduction top is 0 [-]; it must be from 0.01 to 100"},
      {"strength_reduction top 1e5", "strength_reduction top is 100000 [-]"},
      {"strength_reduction top nan", "it must be a number"},
      {right + "strength_reduction mid 1.2",
       "the law of group 'mid' is elastic, which has no strength that could be reduced"},
      {right + "strength_reduction low 1.2",
       "the model of group 'low' uses the RVEs of fix grains; change them with fix_modify grains"},
      {right + "strength_reduction tpo 1.2",
       "the fix has no model of group 'tpo'; did you mean top?"},
      {right + "strength_reduction top 1.3", "strength_reduction top is given twice"},
      {right + "model top elastic 1e6 0.3",
       "the model of group 'top' has the law mohr_coulomb; fix_modify changes parameters of this "
       "law and cannot replace it by 'elastic'"},
      {right + "model top mohr_coulomb 1e6 0.3 1e3 95 0", "friction angle must be in [0, 90)"},
      {right + "model top mohr_coulomb 1e6 0.3 1e3 30", "psi has no value"},
      {right + "damping 0.1", "damping"}};
  SoilScript plain(MPI_COMM_SELF);
  plain << scene + "run 5\n";
  for (const auto &[words, part] : cases) {
    SoilScript script(MPI_COMM_SELF);
    script << scene;
    std::string message;
    try {
      script << "fix_modify soil " + words + "\n";
    } catch (const LAMMPSException &problem) {
      message = problem.what();
    }
    EXPECT_NE(message.find(part), std::string::npos) << message;
    script << "run 5\n";
    EXPECT_EQ(script.points(), plain.points()) << words;
  }
}

TEST(FixMpm, RanksGiveTheSameBits)
{
  plate_force_on_ranks_and_alone(elastic_footing(), 400);
}

TEST(FixMpm, RestartContinuesBitForBit)
{
  const std::string command = elastic_footing();
  const std::string fix = command.substr(command.find("fix soil"));
  SoilScript whole, first, second;

  whole << command + "run 300\n";
  first << command + "run 120\nwrite_restart test_fix_mpm.restart\n";
  second << "read_restart test_fix_mpm.restart\npair_style none\ncomm_modify cutoff 1.0\nneighbor "
            "0.5 bin\n"
            "timestep 0.005\n" +
          fix + "run 180\n";

  EXPECT_EQ(whole.points(), second.points());
  for (int k = 0; k < whole.fix()->size_vector - TIMES - DAMPING; ++k)
    EXPECT_EQ(whole.fix()->compute_vector(k), second.fix()->compute_vector(k))
        << "vector entry " << k;
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove("test_fix_mpm.restart");
}

std::string bytes_of(double value)
{
  return std::string(reinterpret_cast<const char *>(&value), sizeof(value));
}

/// Returns the position at which the data of fix mpm begin in a restart file. They begin with four
/// numbers: negative version, length, checksum and step.
std::size_t place_of_head(const std::string &text, double step)
{
  std::size_t place = text.find(bytes_of(-9.0));
  while (place != std::string::npos &&
         text.compare(place + 3 * sizeof(double), sizeof(double), bytes_of(step)) != 0)
    place = text.find(bytes_of(-9.0), place + 1);
  EXPECT_NE(place, std::string::npos);
  return place;
}

TEST(FixMpm, RestartFileOfAnotherVersionIsRefused)
{
  const std::string command = elastic_footing();
  const std::string path =
      "test_fix_mpm_version." + std::to_string(SoilScript().lmp->comm->me) + ".restart";
  SoilScript(MPI_COMM_SELF) << command + "run 1\nwrite_restart " + path + "\n";
  const std::string read = "read_restart " + path + "\npair_style none\ncomm_modify cutoff 1.0\n" +
      command.substr(command.find("fix soil"));
  ASSERT_EQ(message_of(read), "");

  // The data of the fix begin with the negative version.
  const std::string text = rve_test::text_of(path);
  const std::size_t place = place_of_head(text, 1.0);
  const auto message_with = [&](double version) {
    std::string other = text;
    std::ofstream(path, std::ios::binary)
        << other.replace(place, sizeof(double), bytes_of(version));
    return message_of(read);
  };
  const std::string newer = message_with(-10.0), none = message_with(1.0),
                    torn = message_with(-9.5);
  std::remove(path.c_str());

  EXPECT_NE(
      newer.find(
          "the restart file has version 10 of the data of this fix; this program reads version 9"),
      std::string::npos)
      << newer;
  EXPECT_NE(none.find("has version 1 or 2 of the data of this fix; this program reads version 9"),
            std::string::npos)
      << none;
  EXPECT_NE(torn.find("is damaged: it begins with -9.5 instead of the version -9"),
            std::string::npos)
      << torn;
}

TEST(FixMpm, FlippedBitsOfRestartFilesAreRefused)
{
  const std::string command = elastic_footing();
  const std::string path =
      "test_fix_mpm_flips." + std::to_string(SoilScript().lmp->comm->me) + ".restart";
  SoilScript(MPI_COMM_SELF) << command + "run 3\nwrite_restart " + path + "\n";
  const std::string read = "read_restart " + path + "\npair_style none\ncomm_modify cutoff 1.0\n" +
      command.substr(command.find("fix soil"));
  const std::string text = rve_test::text_of(path);
  const std::size_t head = place_of_head(text, 3.0);
  double length;
  std::memcpy(&length, &text[head + sizeof(double)], sizeof(length));
  // The record of an atom begins with its number of values, 29, and the step.
  const auto record = text.find(bytes_of(29.0) + bytes_of(3.0));
  ASSERT_NE(record, std::string::npos);

  // The loop covers every bit of the versions, lengths and sizes, and every seventh bit of the
  // rest.
  const auto count_silent = [&](std::size_t begin, std::size_t end) {
    int silent = 0;
    for (std::size_t bit = 8 * begin; bit < 8 * end; bit += bit < 8 * (begin + 16) ? 1 : 7) {
      std::string other = text;
      other[bit / 8] = static_cast<char>(other[bit / 8] ^ 1 << bit % 8);
      std::ofstream(path, std::ios::binary) << other;
      const std::string message = message_of(read);
      const bool is_named = message.find("fix mpm soil: the ") != std::string::npos;
      EXPECT_TRUE(is_named) << "bit " << bit - 8 * begin << ": " << message;
      silent += !is_named;
    }
    return silent;
  };
  EXPECT_EQ(count_silent(head, head + (std::size_t) length * sizeof(double)), 0);
  EXPECT_EQ(count_silent(record, record + 29 * sizeof(double)), 0);
  std::remove(path.c_str());
}

TEST(FixMpm, ContinuedRunListsChangedSettings)
{
  const std::string command = elastic_footing();
  const std::string path =
      "test_fix_mpm_other." + std::to_string(SoilScript().lmp->comm->me) + ".restart";
  const std::string log = path + ".log";
  SoilScript first(MPI_COMM_SELF);
  first << command + "run 20\nwrite_restart " + path + "\n";
  const std::string read =
      "read_restart " + path + "\npair_style none\ncomm_modify cutoff 1.0\nneighbor 0.5 bin\n";
  const auto said = [&](std::string fix, const std::string &before = "") {
    Script script(MPI_COMM_SELF);
    script << "log " + log + "\n" + read + before + fix + "log none\n";
    return std::make_pair(rve_test::text_of(log), script.fix_value("soil", 8));
  };
  std::string fix = command.substr(command.find("fix soil"));
  const auto same = said(fix);
  std::string spelled = fix;
  spelled.replace(spelled.find("damping 0.05"), 12, "damping 5e-2");
  const auto as_number = said(spelled);
  std::string other = fix;
  other.replace(other.find("damping 0.05"), 12, "flip 0.99");
  other.replace(other.find("elastic 1.0e6 0.3 density 2000"), 30, "elastic 2.0e6 0.3 density 2100");
  const auto changed = said(other);
  // In the continued run, another body precedes the plate. The plate must keep its displacement.
  const auto two = said(fix.substr(0, fix.find("rigid")) + "rigid lid vx 0 vy 0 rough " +
                            fix.substr(fix.find("rigid")),
                        "group lid id 1\n");
  std::remove(path.c_str());
  std::remove(log.c_str());

  EXPECT_EQ(same.first.find("with changes"), std::string::npos) << same.first;
  EXPECT_EQ(as_number.first.find("with changes"), std::string::npos) << as_number.first;
  EXPECT_EQ(same.second, first.fix_value("soil", 8));
  EXPECT_NE(changed.first.find("fix mpm soil: continues the run that wrote the restart file with "
                               "changes: model ground elastic 1.0e6 0.3 -> elastic 2.0e6 0.3, "
                               "damping 0.05 -> not given, flip not given -> 0.99"),
            std::string::npos)
      << changed.first;
  EXPECT_NE(changed.first.find(
                "keep their values; these changes apply to new points only: density 2000 -> 2100"),
            std::string::npos)
      << changed.first;
  EXPECT_NE(two.first.find("start with displacement 0: lid"), std::string::npos) << two.first;
  EXPECT_EQ(two.second, 0.0);
}

TEST(FixMpm, RestartFilesOfDifferentStepsAreRefused)
{
  // If a restart has several files, LAMMPS writes the file with the header first. If the run is
  // killed then, the other files still have the atoms of the previous restart.
  const std::string command = elastic_footing();
  const std::string path = "test_fix_mpm_steps." + std::to_string(SoilScript().lmp->comm->me) + ".";
  SoilScript(MPI_COMM_SELF) << command + "run 5\nwrite_restart " + path +
          "early.%\nrun 5\nwrite_restart " + path + "late.%\n";
  const std::string read = "read_restart " + path +
      "late.%\npair_style none\ncomm_modify cutoff 1.0\n" +
      command.substr(command.find("fix soil"));
  ASSERT_EQ(message_of(read), "");
  std::remove((path + "late.0").c_str());
  std::rename((path + "early.0").c_str(), (path + "late.0").c_str());

  const std::string message = message_of(read);

  for (const char *file : {"late.0", "late.base", "early.base"}) std::remove((path + file).c_str());
  EXPECT_NE(message.find("is of step 5, but the header of the restart files is of step 10"),
            std::string::npos)
      << message;
}

TEST(FixMpm, RecordsFollowTheirAtomsWhenOthersAreDeletedBeforeTheFix)
{
  const std::string command = elastic_footing(), path = "test_fix_mpm_deleted.restart";
  const std::string fix = command.substr(command.find("fix soil"));
  SoilScript first;
  first << command + "run 120\nwrite_restart " + path + "\n";
  const std::string read = "read_restart " + path +
      "\npair_style none\ncomm_modify cutoff 1.0\nneighbor 0.5 bin\ngroup pit id 3 12 20\n";
  Script::Rows expected = first.points();
  for (const tagint id : {3, 12, 20}) expected.erase(id);

  SoilScript rest;
  rest << read + "delete_atoms group pit compress no\n" + fix + "run 0\n";
  const Script::Rows points = rest.points();

  ASSERT_EQ(points.size(), expected.size());
  // The first eight values are x, y, vx and vy, three values of the displacement (x, y and
  // magnitude), and stress xx.
  for (const auto &[id, row] : points)
    for (int k = 0; k < 8; ++k) EXPECT_EQ(row[k], expected[id][k]) << "atom " << id << ", " << k;
  EXPECT_NE(message_of(read + "delete_atoms group pit\n" + fix).find("their IDs were changed"),
            std::string::npos);
  MPI_Barrier(MPI_COMM_WORLD);
  if (!rest.lmp->comm->me) std::remove(path.c_str());
}

/// Returns a heavy ball with friction that falls on elastic ground next to an inclined wall. The
/// wall rotates about its foot.
std::string ball_and_wall()
{
  return points_in_box(10, 5, 5) +
      "region ball sphere 5.5 7.3 0 1.3\nregion wall block 1 2 3 9 -0.05 0.05 units box\n"
      "create_atoms 2 region ball\ncreate_atoms 2 region wall\nset group all diameter 1.0\n"
      "group ground type 1\ngroup ball region ball\ngroup wall region wall\n"
      "displace_atoms wall rotate 1 3 0 0 0 1 10\ntimestep 0.005\n"
      "variable tip equal 0.1*(step>20)\nfix weight all gravity 9.81 vector 0 -1 0\n"
      "fix soil all mpm 1.0 model ground elastic 1.0e6 0.3 density 2000 "
      "boundary xlo roller boundary xhi roller boundary ylo fixed damping 0.02 "
      "rigid ball vx free vy free friction 0.5 form ball spin free "
      "rigid wall vx 0 vy 0 rough form box separation yes spin v_tip pivot 1 3 turned 10\n";
}

// Index of the first of the five values of the ball in the global vector: vx, vy, spin, angle and
// torque. These values follow the damping force.
constexpr int BALL = 4 + 2 * 4 + TIMES + DAMPING;

/// Returns the scene of ball_and_wall() with a body of convex form, a wedge, that has the points of
/// the ball.
std::string wedge_and_wall()
{
  std::string scene = ball_and_wall();
  const std::string ball = "form ball";
  return scene.replace(scene.find(ball), ball.size(), "form convex 3 4 8.5 7 8.5 5.7 5.6");
}

void expect_same_bits_on_ranks_and_after_a_restart(const std::string &bodies)
{
  SoilScript together, alone(MPI_COMM_SELF);
  together << "processors 1 * 1\n" + bodies + "run 120\n";
  alone << bodies + "run 120\n";
  const auto vector_of = [](SoilScript &script) {
    std::vector<double> all;
    for (int k = 0; k < script.fix()->size_vector; k++)
      if (k < 12 || k >= 12 + TIMES) all.push_back(script.fix()->compute_vector(k));
    return all;
  };
  EXPECT_EQ(together.points(), alone.points());
  EXPECT_EQ(vector_of(together), vector_of(alone));
  EXPECT_GT(std::fabs(alone.fix()->compute_vector(BALL + 2)), 1e-4) << "the wall makes it spin";
  EXPECT_NEAR(alone.fix()->compute_vector(BALL + 5 + 3), 0.1 * 100 * 0.005, 1e-12)
      << "angle of the wall, whose numbers follow the five of the ball; it turns from step 21 on";

  const std::string path = "test_fix_mpm_bodies.restart";
  SoilScript first;
  first << "processors 1 * 1\n" + bodies + "run 70\nwrite_restart " + path + "\n";
  SoilScript second;
  second << "read_restart " + path +
          "\npair_style none\ncomm_modify cutoff 1.0\nneighbor 0.5 bin\n"
          "neigh_modify every 5 delay 0 check no\nthermo_modify lost error\n" +
          bodies.substr(bodies.find("timestep")) + "run 50\n";
  EXPECT_EQ(second.points(), alone.points());
  EXPECT_EQ(vector_of(second), vector_of(alone));
  if (second.lmp->comm->me == 0) std::remove(path.c_str());
}

TEST(FixMpmBodies, FreeBallAndTurningWallHaveTheSameBitsOnRanksAndAfterARestart)
{
  expect_same_bits_on_ranks_and_after_a_restart(ball_and_wall());
}

TEST(FixMpmBodies, FreeWedgeAndTurningWallHaveTheSameBitsOnRanksAndAfterARestart)
{
  expect_same_bits_on_ranks_and_after_a_restart(wedge_and_wall());
}

TEST(FixMpmBodies, FrictionFollowsItsVariable)
{
  const std::string bodies = ball_and_wall();
  const std::string constant = "friction 0.5";
  std::string varies = bodies, wrong = bodies;
  varies.replace(bodies.find(constant), constant.size(), "friction v_mu");
  wrong.replace(bodies.find(constant), constant.size(), "friction v_late");
  SoilScript script, reference;
  reference << bodies + "run 60\n";
  script << "variable mu equal 0.5\n" + varies + "run 60\n";
  EXPECT_EQ(script.points(), reference.points());
  script << "variable mu equal 0.1\nrun 60\n";
  reference << "run 60\n";
  EXPECT_NE(script.points(), reference.points());

  EXPECT_NE(message_of("variable late equal 0.5-0.1*step\n" + wrong + "run 10\n")
                .find("friction of rigid body ball must be above 0"),
            std::string::npos);
}

TEST(FixMpmBodies, AnAngleAsFrictionAndTheOnlyDensityOfABodyAreNoted)
{
  const std::string path = rve_test::temporary_path("noted.log");
  std::string bodies = ball_and_wall();
  const auto replace = [&](const std::string &words, const std::string &by) {
    bodies.replace(bodies.find(words), words.size(), by);
  };
  replace("friction 0.5", "friction 35");
  replace("density 2000 ", "");
  replace("form ball", "form ball density 2000");
  SoilScript() << "log " + path + "\n" + bodies + "run 0\nlog none\n";
  const std::string log = rve_test::text_of(path);
  EXPECT_NE(log.find("friction of rigid ball is 35 [-], above 2; if this is an angle"),
            std::string::npos)
      << log;
  EXPECT_NE(log.find("the density of rigid ball is the only one and applies to all points"),
            std::string::npos)
      << log;
}

TEST(FixMpmBodies, BlockRestsOnTheGroundWithItsWeight)
{
  SoilScript script;
  script << points_in_box(8, 4, 4) +
          "region block block 2.5 5.5 4 6 -0.05 0.05 units box\n"
          "lattice sq 1.0 origin 0.0 0.5 0.0\ncreate_atoms 2 region block\nset group all diameter "
          "1.0\n"
          "group ground type 1\ngroup block type 2\ntimestep 0.01\n"
          "fix weight block gravity 9.81 vector 0 -1 0\n"
          "fix soil all mpm 1.0 model ground elastic 1.0e6 0.0 density 2000 "
          "boundary xlo roller boundary xhi roller boundary ylo fixed damping 0.7 "
          "rigid block vx free vy free friction 0.3 form box spin free\nrun 3000\n";

  const double weight = 6 * 2000 * 9.81;
  EXPECT_NEAR(script.fix()->compute_vector(5), weight, 1e-3 * weight);
  EXPECT_NEAR(script.fix()->compute_vector(4), 0.0, 1e-6 * weight) << "symmetric";
  // The footing settles less than on a column of its own width, since the ground next to the
  // footing also bears load.
  const double settlement = -script.fix()->compute_vector(7);
  const double column = weight / 3.0 * 4.0 / 1.0e6;
  EXPECT_LT(settlement, column);
  EXPECT_GT(settlement, 0.5 * column);
}

/// Returns a plate that is pressed into 16 points with RVEs of 60 grains. The row of points below
/// the plate starts at y = 3.5, just above the border y = 3.49 between two ranks. Within a few
/// steps, these points migrate to the lower rank.
std::string footing_on_grains()
{
  return points_in_box(4, 4, 2.98) +
      "region plate block 0 2 4 5 -0.05 0.05 units box\ncreate_atoms 2 region plate\nset type 2 "
      "diameter 1.0\n"
      "group ground type 1\ngroup plate type 2\n"
      "region top block 2 4 3 4 -0.05 0.05 units box\ngroup surface region top\n"
      "timestep 0.005\n"
      "fix grains ground rve test_fix_mpm.rve drive mpm dt 1e-4 substeps match device cpu threads "
      "1\n"
      "fix soil all mpm 1.0 domain 0 4 0 6 model ground rve grains boundary xlo roller boundary "
      "xhi roller "
      "boundary ylo fixed "
      "damping 0.05 rigid plate vx 0 vy -0.3 rough traction surface 0 -20000\n";
}

// The wave speed of RVEs is only known within limits. The upper limit is the bound c from the
// contact stiffnesses. The lower limit is c sqrt(0.54) = 0.73 c. A warning must appear if the given
// speed is below half of the lower limit or above twice the upper limit.
TEST(FixMpmWithGrains, SpeedsOfAbsorbingSidesAreComparedWithTheBoundOfTheContacts)
{
  make_packing();
  const std::string path = file_of_rank("log");
  const std::string scene = points_in_box(4, 4) + "timestep 0.005\nlog " + path +
      "\nfix grains all rve test_fix_mpm.rve drive mpm dt 1e-4 substeps match device cpu threads "
      "1\nfix soil all mpm 1.0 model all rve grains boundary xhi roller boundary ylo fixed ";
  SoilScript script(MPI_COMM_SELF);
  script << scene + "\nrun 0\n";
  // The Courant number of points at rest is c dt/h, with the wave speed c, dt = 0.005 and h = 1.
  const double bound = script.lmp->modify->get_fix_by_id("soil")->compute_scalar() / 0.005;
  ASSERT_GT(bound, 10.0);
  ASSERT_LT(bound, 1000.0);
  for (const double share : {0.3, 0.45, 1.0, 1.9, 2.1}) {
    const std::string cp = std::to_string(share * bound);
    SoilScript(MPI_COMM_SELF) << scene + "boundary xlo absorbing " + cp + " 1\nrun 0\nlog none\n";
    const bool warns =
        rve_test::text_of(path).find("boundary xlo absorbing cp is") != std::string::npos;
    EXPECT_EQ(warns, share < 0.73 / 2.0 || share > 2.0) << share;
    EXPECT_EQ(rve_test::text_of(path).find("absorbing cs is"), std::string::npos)
        << "RVEs do not tell it";
  }
}

TEST(FixMpmWithGrains, InitialStressIsThatOfTheRvesAndBalancesTheSurcharge)
{
  make_packing();
  SoilScript script;

  script << points_in_box(4, 4) +
          "region top block 0 4 3 4 -0.05 0.05 units box\ngroup surface region top\ntimestep "
          "0.005\n"
          "fix grains all rve test_fix_mpm.rve drive mpm dt 1e-4 substeps match device cpu threads "
          "1\n"
          "fix soil all mpm 1.0 model all rve grains boundary xlo roller boundary xhi roller "
          "boundary ylo fixed "
          "traction surface 0 -20000\nrun 0\n";

  // A small packing keeps some shear stress, which no boundary balances. This shear stress causes
  // the whole unbalanced force.
  double shear = 0.0;
  for (const auto &point : script.points()) {
    EXPECT_NEAR(point.second[4 + 6], 20000, 20);    // mean stress p; tolerance of the packing
    shear = std::max(shear, std::fabs(point.second[4 + 5]));
  }
  EXPECT_LT(shear, 0.2 * 20000);
  EXPECT_LT(script.fix()->compute_vector(0),
            shear * 1.0 + 2e-3 * 20000);    // force / (h thickness)
  EXPECT_GT(script.fix()->compute_vector(3),
            16 * 2650 / 1.25);    // mass: grain density / (1 + e), e < 0.25
  EXPECT_LT(script.fix()->compute_vector(3), 16 * 2650 / 1.10);
}

TEST(FixMpmWithGrains, WaveSpeedIsThatOfTheTangentsOnRequest)
{
  make_packing();
  const auto modulus_of = [](const std::string &words, double &largest_stiffness) {
    SoilScript script;
    // Contacts are softer in the tangential direction (kt) than in the normal one. The bound of the
    // wave speed assumes the normal stiffness in both directions.
    script << points_in_box(4, 4) +
            "timestep 0.005\nfix grains all rve test_fix_mpm.rve kt 1e5 drive mpm dt 1e-4 substeps "
            "match device cpu threads 1\n"
            "fix soil all mpm 1.0 model all rve grains " +
            words + "\ncompute c all rve/tangent cxxxx cyyyy\nrun 0\n";
    LAMMPS_NS::Compute *tangent = script.lmp->modify->get_compute_by_id("c");
    tangent->compute_peratom();
    if (script.lmp->atom->nlocal > 0)
      largest_stiffness = std::max(tangent->array_atom[0][0], tangent->array_atom[0][1]);
    // The points are at rest, so the Courant number is c dt/h with the wave speed c.
    const double speed = script.fix()->compute_scalar() / 0.005;
    return speed * speed * script.fix()->compute_vector(3) / 16.0;
  };
  double stiffness = 0.0;

  const double bound = modulus_of("", stiffness);
  const double measured = modulus_of("wave_speed tangent 3", stiffness);

  EXPECT_LT(measured, 0.9 * bound);
  // `measured` belongs to the fastest wave in any direction, and `stiffness` to the faster one of
  // the waves along x and y. The packing is nearly isotropic, so they differ by less than 20 %.
  if (stiffness > 0.0) {
    EXPECT_GT(measured, 0.99 * stiffness);
    EXPECT_LT(measured, 1.2 * stiffness);
  }
  // `wave_speed tangent N` measures the N RVEs with the highest bounds; among equal bounds, the IDs
  // decide. If N exceeds the number of RVEs, all of them are measured.
  EXPECT_EQ(modulus_of("wave_speed tangent 100", stiffness), measured);
  EXPECT_EQ(modulus_of("wave_speed bound", stiffness), bound);
}

// The surcharge is twice the pressure at which the packings were prepared. Under this load the
// packings gain contacts, which changes the wave speeds.
TEST(FixMpmWithGrains, WaveSpeedFollowsTheGrainsInARunOnRequest)
{
  make_packing();
  const auto courant_after = [](const std::string &words, const std::string &runs,
                                std::vector<double> &stresses) {
    SoilScript script;
    script << points_in_box(2, 2) +
            "timestep 0.005\nfix grains all rve test_fix_mpm.rve kt 1e5 drive mpm dt 1e-4 substeps "
            "match device cpu threads 1\n"
            "region top block 0 2 1 2 -0.05 0.05 units box\ngroup surface region top\n"
            "fix soil all mpm 1.0 model all rve grains boundary xlo roller boundary xhi roller "
            "boundary ylo fixed traction surface 0 -40000 wave_speed " +
            words + "\n" + runs;
    for (const auto &point : script.points())
      stresses.insert(stresses.end(), point.second.begin(), point.second.end());
    return script.fix()->compute_scalar();
  };
  std::vector<double> once, followed, stopped;

  const double at_the_start = courant_after("tangent 4", "run 40", once);
  const double in_the_run = courant_after("tangent 4 every 20", "run 40", followed);
  // The update in step 40 measures the grains after 39 steps. `run 0` after `run 39` measures the
  // same state.
  const double at_a_start = courant_after("tangent 4", "run 39\nrun 0", stopped);

  EXPECT_EQ(in_the_run, at_a_start);
  EXPECT_NE(in_the_run, at_the_start);
  EXPECT_EQ(followed, once);    // the update of the wave speed changes no other result
}

TEST(FixMpmWithGrains, OtherGroupsHaveAnAnalyticLaw)
{
  // The two upper rows of points have RVEs, the two lower rows a Mohr-Coulomb material. Both
  // materials bear the surcharge.
  make_packing();
  SoilScript script;

  script << points_in_box(4, 4) +
          "region low block 0 4 0 2 -0.05 0.05 units box\ngroup low region low\ngroup high "
          "subtract "
          "all low\n"
          "region top block 0 4 3 4 -0.05 0.05 units box\ngroup surface region top\ntimestep "
          "0.002\n"
          "fix grains high rve test_fix_mpm.rve drive mpm dt 1e-4 substeps match device cpu "
          "threads "
          "1\n"
          "fix soil all mpm 1.0 model high rve grains model low mohr_coulomb 1e7 0.2 0 30 0 "
          "density "
          "2200 stress -20000 -20000 0 boundary xlo roller boundary xhi roller boundary ylo fixed "
          "damping 0.2 traction surface 0 -20000\nrun 100\n";

  int analytic = 0;
  for (const auto &point : script.points()) {
    const double szz = point.second[4 + 15];
    EXPECT_NEAR(point.second[4 + 4], -20000, 0.15 * 20000) << "shear stress of the packing";
    if (szz == 0.0) continue;
    ++analytic;
    EXPECT_NEAR(szz, -20000, 0.15 * 20000);
  }
  EXPECT_EQ(analytic, 8);
}

TEST(FixMpmWithGrains, RanksGiveTheSameBits)
{
  make_packing();
  // The plate exerts a larger force than the surcharge would on the width of the plate, 2.
  EXPECT_GT(plate_force_on_ranks_and_alone(footing_on_grains(), 80), 2.0 * 20000);
}

TEST(FixMpmWithGrains, RestartContinuesBitForBit)
{
  make_packing();
  const std::string command = footing_on_grains();
  SoilScript whole, first, second;

  whole << "processors 1 * 1\n" + command + "run 80\n";
  first << "processors 1 * 1\n" + command + "run 50\nwrite_restart test_fix_mpm_grains.restart\n";
  second << "read_restart test_fix_mpm_grains.restart\npair_style none\ncomm_modify cutoff "
            "1.0\nneighbor 0.5 bin\n"
            "timestep 0.005\n" +
          command.substr(command.find("fix grains")) + "run 30\n";

  EXPECT_EQ(whole.points(), second.points());
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove("test_fix_mpm_grains.restart");
}

TEST(FixMpm, DeviceGivesTheSameBits)
{
  // During the run atoms migrate and are sorted, another fix exerts forces, and thermo output reads
  // results from the device.
  const auto scene = [](const std::string &device) {
    const std::string scene = elastic_footing();
    return "processors 1 * 1\n" + scene.substr(0, scene.size() - 1) + " device " + device +
        "\nfix g all gravity 1.0 vector 0 -1 0\natom_modify sort 20 1.0\nthermo 70\n"
        "thermo_style custom step f_soil[1] f_soil[6]\nrun 150\n"
        "region corner block 7 8 4 6 -0.05 0.05 units box\ndelete_atoms region corner\n"
        "run 100\nvelocity ground set 0 NULL NULL\nrun 150\n";
  };
  SoilScript cpu, device;

  cpu << scene("cpu");
  device << scene("auto");

  EXPECT_EQ(cpu.points(), device.points());
  for (int k = 0; k < cpu.fix()->size_vector - TIMES - DAMPING; ++k)
    EXPECT_EQ(cpu.fix()->compute_vector(k), device.fix()->compute_vector(k)) << "entry " << k;
}

TEST(FixMpm, ColumnsBelongToTheStepForEveryReader)
{
  // Thermo output occurs only in the first and the last step. fix vector also reads the columns in
  // steps between them.
  constexpr int STEPS = 6;
  SoilScript script, step_by_step;
  script << elastic_footing() +
          "thermo 1000\ncompute settled all reduce sum f_soil[3]\nfix history all vector 2 "
          "c_settled\nrun " +
          std::to_string(STEPS) + "\n";

  step_by_step << elastic_footing() + "run 0\n";
  for (int step = 2; step <= STEPS; step += 2) {
    step_by_step << "run 2\n";
    double sum = 0.0;
    for (const auto &point : step_by_step.points()) sum += point.second[4 + 2];
    EXPECT_GT(sum, 0.0);
    // The first value of fix vector belongs to step 0.
    EXPECT_NEAR(script.fix_value("history", 1 + step / 2), sum, 1e-12 * sum);
  }
}

/// Returns the points of a scene after 40 steps. The steps are run in three ways: in one run, in
/// three runs of which the last has no setup, and with `run every`. Output occurs every `interval`
/// steps.
std::vector<Script::Rows> ends_with_output(const std::string &scene, int interval)
{
  std::vector<Script::Rows> ends;
  for (const char *run : {"run 40\n", "run 10\nrun 0\nrun 30 pre no\n",
                          "run 40 every 7 \"variable n equal step\"\n"}) {
    SoilScript script;
    script << scene + "thermo " + std::to_string(interval) + "\n" + run;
    ends.push_back(script.points());
  }
  return ends;
}

/// Returns elastic_footing() with `words` replaced by `others`, with the commands `before` inserted
/// before the time step and the commands `after` at the end.
std::string footing_with(const std::string &words, const std::string &others,
                         const std::string &before, const std::string &after = "")
{
  std::string scene = elastic_footing();
  scene.replace(scene.find(words), words.size(), others);
  return scene.insert(scene.find("timestep"), before) + after;
}

TEST(FixMpm, VariablesDoNotDependOnTheOutput)
{
  // In each scene, a velocity, a traction, a moving region or gravity depends on the displacement
  // or the stress of points.
  const std::vector<std::string> scenes = {
      footing_with("vy -0.5", "vy v_v",
                   "variable depth equal -F_soil[41][2]\nvariable v equal -0.5*(1-20*v_depth)\n"),
      footing_with("0 -20000\n", "0 v_q\n", "variable q equal -20000-1e-1*c_largest\n",
                   "compute largest all reduce max f_soil[7]\n"),
      footing_with("surface 0 -20000\n", "lid 0 -20000\n",
                   "variable shift equal 50*F_soil[41][3]\n"
                   "region lid block 2 8 5 6 -0.05 0.05 units box move v_shift NULL NULL\n"),
      footing_with("timestep", "timestep", "",
                   "variable g equal 9.81*(1+1e2*abs(F_soil[41][3]))\n"
                   "fix g all gravity v_g vector 0 -1 0\n")};
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const std::vector<Script::Rows> often = ends_with_output(scenes[k], 1),
                                    seldom = ends_with_output(scenes[k], 40);
    for (std::size_t way = 0; way < often.size(); ++way) {
      EXPECT_TRUE(often[way] == seldom[way]) << "scene " << k << ", way " << way;
      EXPECT_TRUE(often[way] == often[0]) << "scene " << k << ", way " << way;
    }
  }
}

TEST(FixMpmWithGrains, DriveVariablesDoNotDependOnTheOutput)
{
  // The RVE of point 41 does not act on the continuum. Its shear rate is the component xy of the
  // deformation gradient of point 41.
  make_packing();
  MPI_Barrier(MPI_COMM_WORLD);
  const std::string scene = footing_with(
      "timestep", "timestep", "",
      "variable rate equal F_soil[41][13]\ngroup probe id 41\n"
      "fix grains probe rve test_fix_mpm.rve dt 1e-4 drive velocity_gradient xy v_rate "
      "device cpu threads 1\ncompute stress probe rve/atom sxy\n");
  std::vector<Script::Values> shear;
  for (const char *interval : {"1", "40"}) {
    SoilScript script;
    script << scene + "thermo " + interval + "\nrun 40\n";
    shear.push_back(script.compute("stress"));
  }
  EXPECT_NE(shear[0].at(41), 0.0);
  EXPECT_EQ(shear[0], shear[1]);
}

TEST(FixMpm, FillsColumnsOnlyForFormulasThatMayReadThem)
{
  // Runs the footing with this velocity of the plate. Then returns state_may_be_read() of a step
  // without output: true if something can read the columns of the fix in this step.
  const auto looks = [](const std::string &velocity, const std::string &before = "") {
    const std::string scene = elastic_footing();
    SoilScript script;
    std::string own = scene;
    own.replace(own.find("vy -0.5"), 7, "vy v_v");
    script << before + "variable v equal " + velocity + "\n" + own + "thermo 100\nrun 3\n";
    script.lmp->update->laststep = script.lmp->output->next = 1000;
    return state_may_be_read(script.lmp.get());
  };

  EXPECT_FALSE(looks("-0.5"));
  EXPECT_FALSE(looks("-0.1*(v_t>0)*((v_t<1)*v_t+(v_t>=1))", "variable t equal (step-0.5)*dt\n"))
      << "as in the example of the footing";
  EXPECT_FALSE(looks("-1.5e-1*sin(2*PI*time/0.3)+2.E+0*0"));
  EXPECT_FALSE(looks("-0.5+0*y[3]+0*vx[7]")) << "positions and velocities are those of the step";
  EXPECT_TRUE(looks("-0.5+0*f_soil[1]"));
  EXPECT_TRUE(looks("-0.5+0*F_soil[1][2]"));
  EXPECT_TRUE(looks("-0.5+0*v_t", "variable t equal v_s*2\nvariable s equal 1+0*F_soil[1][2]\n"));
  EXPECT_TRUE(looks("-0.5+0*mass(all,ground)")) << "a region may follow from a variable";
  EXPECT_TRUE(looks("-0.5+0*ke")) << "thermo keywords are computes";
}

TEST(FixMpm, VectorEndsWithTheWallTimeOfTheRun)
{
  SoilScript script;
  script << elastic_footing() + "run 20\n";

  EXPECT_EQ(script.fix()->size_vector, 4 + 4 + TIMES + DAMPING);
  EXPECT_EQ(script.fix_value("soil", 9), 0.0) << "no RVEs";
  EXPECT_GT(script.fix_value("soil", 10), 0.0);
  EXPECT_GT(script.fix_value("soil", 11), 0.0) << "columns are filled in the last step";
}

TEST(FixMpmWithGrains, VectorHasTheTimeOfTheRves)
{
  make_packing();
  MPI_Barrier(MPI_COMM_WORLD);
  SoilScript script;
  script << footing_on_grains() + "run 5\n";

  for (int n = 9; n <= 11; ++n) EXPECT_GT(script.fix_value("soil", n), 0.0);
}

/// Returns the log of two steps of a scene whose last fix gets the keyword *progress*.
std::string log_with_progress(const std::string &scene)
{
  const std::string path = rve_test::temporary_path("log");
  SoilScript script;
  script << "log " + path + "\n" + scene.substr(0, scene.size() - 1) +
          " progress 1e-9\nrun 2\nlog none\n";
  MPI_Barrier(MPI_COMM_WORLD);    // rank 0 writes the log
  return rve_test::text_of(path);
}

TEST(FixMpm, LogsItsProgressWithoutGrains)
{
  const std::string log = log_with_progress(elastic_footing());

  EXPECT_NE(log.find("fix mpm soil: step 1, 50.0 % of the run, 0:00:0"), std::string::npos) << log;
  EXPECT_NE(log.find("fix mpm soil: step 2, 100.0 % of the run, 0:00:00 left\n"), std::string::npos)
      << log;
}

TEST(FixMpmWithGrains, ProgressIsLoggedByTheGrains)
{
  make_packing();
  MPI_Barrier(MPI_COMM_WORLD);

  const std::string log = log_with_progress(footing_on_grains());

  EXPECT_EQ(log.find("of the run"), std::string::npos);
}

TEST(FixMpmErrors, OnlyCoincidentPointsGiveAWarning)
{
  const std::string more = "region more block 0 2 0 4 -0.05 0.05 units box\nregion above block 0 2 "
                           "2 4 -0.05 0.05 units box\n";
  const std::vector<std::pair<std::string, bool>> cases = {{"more", true}, {"above", false}};
  for (const auto &[region, is_on_top] : cases) {
    const std::string path = rve_test::temporary_path(region);
    SoilScript script;
    script << "log " + path + "\n" + points_in_box(2, 2, 4) + more +
            "timestep 0.001\nfix soil all mpm 1.0 model all elastic 1.0e6 0.3 density 2000\nrun 1\n"
            "create_atoms 1 region " +
            region + "\nset type 1 diameter 1.0\nrun 1\nlog none\n";
    MPI_Barrier(MPI_COMM_WORLD);    // rank 0 writes the log
    const std::string log = rve_test::text_of(path);

    const auto at = log.find("4 of 8 cells with new points, 1 by 1 [distance] each, contain more "
                             "than 1.3 times their area, the fullest 2 times");
    EXPECT_EQ(at != std::string::npos, is_on_top) << log;
  }
}

TEST(FixMpmErrors, AreReported)
{
  make_packing();
  MPI_Barrier(MPI_COMM_WORLD);
  const std::string scene = points_in_box(2, 2) + "timestep 0.001\n";
  const std::string law = "model all elastic 1.0e6 0.3 density 2000";
  const std::string rank = std::to_string(SoilScript().lmp->comm->me);
  const std::string dump = "test_fix_mpm_rerun." + rank + ".dump";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {scene + "fix soil all mpm 1.0 " + law + " cfl 1 1e300",
       "fix mpm soil: cfl error is 1e300; it must be from -1e+30 to 1e+30"},
      {scene + "fix soil all mpm 1.0 " + law + " wave_speed tangent 0", "wave_speed tangent is 0"},
      {scene + "fix soil all mpm 1.0 " + law + " wave_speed tangent 1 every 0",
       "wave_speed tangent every is 0"},
      {scene + "fix soil all mpm 1.0 " + law + " wave_speed 3", "wave_speed"},
      {scene + "fix soil all mpm 1.0 " + law + " cfl 1 100",
       "cfl is 1 100; it must be 0 < warn <= error <= 10"},
      {scene + "fix soil all mpm 1.0 model all elastic 1e6 0.3 density 1e300",
       "fix mpm soil: density is 1e300; it must be from -1e+30 to 1e+30"},
      {scene + "fix soil all mpm 1.0 " + law + " damping -0.1",
       "local damping must be in [0, 1), got -0.1"},
      {scene + "fix soil all mpm 1.0 " + law + "\ndump d all custom 1 " + dump +
           " id x y\nrun 1\nrerun " + dump + " dump x y",
       "fix mpm soil: rerun cannot be used"},
      {scene + "fix soil all mpm 1.0 " + law + "\nfix d all deform 1 x scale 1.1\nrun 1",
       "fix d (style deform) changes the box and moves atoms with it"},
      {scene + "fix soil all mpm 1.0 " + law + "\nrun 1\nchange_box all x scale 1.1 remap\nrun 1",
       "points and simulation box have changed since the last run"},
      {scene + "group g id 1\nfix soil all mpm 1.0 " + law +
           " traction g 0 -1\nrun 1\ngroup g delete\nrun 1",
       "fix mpm soil: traction: group g has been deleted since the fix was defined"},
      {scene + "group first id 1\ngroup g id 2\nfix soil all mpm 1.0 " + law +
           " traction g 0 -1\nrun 1\ngroup first delete\ngroup g delete\ngroup g id 3\nrun 1",
       "fix mpm soil: traction: group g has been deleted and redefined"},
      {scene + "group g id 1\nfix soil all mpm 1.0 model g elastic 1.0e6 0.3 " + law +
           "\nrun 1\ngroup g delete\nrun 1",
       "fix mpm soil: model: group g has been deleted since the fix was defined"},
      {scene + "group nobody empty\nfix soil all mpm 1.0 " + law + " traction nobody 0 -1\nrun 1",
       "fix mpm soil: traction: group nobody has no atoms"},
      {block_of_points("lattice sq 0.5 origin 0.5 0.5 0.0") +
           "timestep 0.001\nfix soil all mpm 1.0 " + law + "\nrun 1",
       "contain more than 1.3 times their area, the fullest 4 times"},
      {scene + "fix soil all mpm 0 " + law, "cell size is 0 [length]; it must be greater than 0"},
      {scene + "fix soil all mpm 1.0 " + law + " wings yes", "unknown keyword 'wings'"},
      {scene + "fix soil all mpm 1.0 " + law + " boundry xlo roller",
       "fix mpm soil: unknown keyword 'boundry'; did you mean boundary?"},
      {scene + "fix soil all mpm 1.0 " + law + " damping 0.1 0.2",
       "fix mpm soil: found '0.2' after 'damping 0.1', where a keyword or the end was expected"},
      {scene + "fix soil all mpm 1.0 " + law + " damping low",
       "fix mpm soil: damping is 'low'; it must be a number"},
      {scene + "group plate id 4\nvariable down equal -1\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy down rough",
       "fix mpm soil: rigid vy is 'down'; it must be a number or v_name of a variable; did you "
       "mean "
       "v_down?"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy -1 rough\nrun 0\ngroup plate clear\nrun 0",
       "rigid body plate has no points"},
      {scene + "fix soil all mpm 1.0 " + law + " flip 1.5", "in [0, 1]"},
      {scene + "fix soil all mpm 1.0 " + law + " boundary top roller",
       "boundary is 'top'; it must be xlo, xhi, ylo or yhi"},
      {scene + "fix soil all mpm 1.0 " + law + " boundary xlo sticky",
       "boundary xlo is 'sticky'; it must be free, roller, fixed or absorbing"},
      {scene + "fix soil all mpm 1.0 " + law + " boundary xlo absorbing 0 20",
       "boundary xlo absorbing cp is 0 [length/time]; it must be greater than 0"},
      {scene + "fix soil all mpm 1.0 " + law + " boundary xlo absorbing 30 -1",
       "boundary xlo absorbing cs is -1 [length/time]; it must be at least 0 and below cp, 30"},
      {scene + "fix soil all mpm 1.0 " + law + " boundary xlo absorbing 20 30",
       "boundary xlo absorbing cs is 30 [length/time]; it must be at least 0 and below cp, 20"},
      {scene + "fix soil all mpm 1.0 " + law + " boundary ylo absorbing roller 0",
       "boundary ylo absorbing cs is 0 [length/time]; it must be greater than 0"},
      {scene + "fix soil all mpm 1.0 " + law + " boundary xlo absorbing 30",
       "boundary xlo absorbing cs has no value; the command ends there"},
      {scene + "fix soil all mpm 1.0 " + law + " shape cubic",
       "shape is 'cubic'; it must be linear, gimp or cpgimp"},
      {scene + "fix soil all mpm 1.0 " + law + " scheme usl",
       "scheme is 'usl'; it must be musl or usavg"},
      {scene + "fix soil all mpm 1.0 " + law + " device tpu",
       "device is 'tpu'; it must be auto, cpu or cuda"},
      {scene + "fix soil all mpm 1.0 " + law + " scheme",
       "fix mpm soil: scheme has no value; the command ends there; it must read: scheme musl | "
       "usavg"},
      {scene + "fix soil all mpm 1.0 " + law + " damping 1",
       "local damping must be in [0, 1), got 1"},
      {scene + "fix soil all mpm 1.0 " + law + " progress -1",
       "progress is -1 [seconds of wall time]; it must be at least 0, and 0 means no progress "
       "lines"},
      {scene + "fix soil all mpm 1.0 " + law + " points_per_cell 0",
       "points_per_cell is 0 [-]; it must be from 1 to 10000"},
      {scene + "fix soil all mpm 1.0 " + law + " points_per_cell 1e30",
       "points_per_cell is 1e+30 [-]; it must be from 1 to 10000"},
      {scene + "fix soil all mpm 1.0 " + law + " volume 1e-300",
       "volume is 1e-300 [length^2]; it must be from 0.0001 to 1 (the volume of a cell), because a "
       "cell has at most 10000 points"},
      {scene + "fix soil all mpm 1.0 " + law + " volume 1.5",
       "volume is 1.5 [length^2]; it must be from 0.0001 to 1 (the volume of a cell)"},
      {scene + "fix soil all mpm 1.0 " + law + " cfl 1.0 0.5",
       "cfl is 1 0.5; it must be 0 < warn <= error <= 10"},
      {scene + "fix soil all mpm 1.0 " + law + " domain 0 2.5 0 4",
       "whole number of cells, got 2.5 / 1 = 2.5"},
      {scene + "fix soil all mpm 1.0 " + law + " flip 0.9 flip 0.99",
       "fix mpm soil: flip is given twice, as 'flip 0.9' and as 'flip 0.99'; give it once"},
      {scene + "fix soil all mpm 1.0 " + law + " boundary xlo roller boundary xlo fixed",
       "fix mpm soil: boundary xlo is given twice"},
      {scene + "fix soil all mpm 1.0 " + law + " model all elastic 1.0e6 0.2",
       "fix mpm soil: model all is given twice"},
      {scene + "fix soil all mpm 1.0 " + law + " points_per_cell 1 volume 0.9",
       "fix mpm soil: volume is given twice, as 'points_per_cell 1' and as 'volume 0.9'"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 0 rough rigid plate vx 0 vy 1 rough",
       "fix mpm soil: rigid plate is given twice"},
      {scene + "fix soil all mpm 1.0 " + law +
           " traction all 0 -1 face xhi traction all 0 -1 face xlo face yhi",
       "fix mpm soil: traction all number 2 face is given twice"},
      {scene + "fix soil all mpm 1.0 " + law + " separation yes", "must follow a rigid body"},
      {scene + "fix soil all mpm 1.0 " + law + " face yhi",
       "must follow a traction, a pressure or a rigid body"},
      {scene + "fix soil all mpm 1.0 " + law + " traction lid 0 -1",
       "traction group 'lid' does not exist"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law + " rigid plat vx 0 vy 0 rough",
       "fix mpm soil: rigid group 'plat' does not exist; did you mean plate?"},
      {scene + "fix soil all mpm 1.0 " + law + " traction all 0 v_q\nrun 0",
       "fix mpm soil: variable q does not exist"},
      {scene + "variable q string 1\nfix soil all mpm 1.0 " + law + " traction all 0 v_q\nrun 0",
       "fix mpm soil: variable q must be of equal or atom style"},
      {scene + "variable q atom 1\ngroup plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy v_q rough\nrun 0",
       "fix mpm soil: variable q must be of equal style"},
      {scene + "fix soil all mpm 1.0 " + law + " traction ground 0 -1\nregion ground delete\nrun 0",
       "fix mpm soil: traction: region ground does not exist"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 0 rough rough rough",
       "rigid has '0' instead of vy; it must read: rigid group-ID vx value vy value rough | "
       "smooth"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law + " rigid plate vx 0 vy 0 glued",
       "rigid contact is 'glued'; it must be smooth, rough or friction"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law + " rigid plate vx 0 vy free rough",
       "fix mpm soil: rigid plate: free is for a body of form box, ball or convex"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 0 rough form box face yhi",
       "fix mpm soil: rigid plate: face is for a body of form face"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 0 rough form convex 2 0 0 1 0",
       "form convex is 2; it must be at least 3"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 0 rough form convex 3 0 0 1 0 0 nan",
       "form convex y3 is 'nan'; it must be a number"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 0 rough form convex 3 0 0 2 0 1",
       "form convex y3 has no value; the command ends there; it must read: form face | box | ball "
       "| convex N x1 y1 ... xN yN"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 0 rough form convex 3 0 0 1 1 2 2\nrun 0",
       "rigid body plate has vertices in one line"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 0 friction 0 form ball",
       "friction"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 0 rough form box turned 1e30",
       "fix mpm soil: rigid plate turned is 1e+30 [degrees]; it must be from -360 to 360"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 10 rough\nrun 1000",
       "rigid body plate has lost 1 of its 1 points, which left the simulation box, x from 0 to 2"},
      {scene + "fix soil all mpm 1.0 " + law + " spin 0.1", "spin must follow a rigid body"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 0 rough separation maybe",
       "separation is 'maybe'; it must be yes, no, on, off, true or false"},
      {scene + "group plate id 4\nfix soil all mpm 1.0 " + law +
           " rigid plate vx 0 vy 0 rough traction plate 0 -1\nrun 0",
       "is rigid and cannot carry a traction"},
      {scene + "fix soil all mpm 1.0 model all elastic 1.0e6 0.5 density 2000",
       "Poisson's ratio must be in (-1, 0.5), got 0.5"},
      {scene + "fix soil all mpm 1.0 model all plastic 1.0e6 0.3 density 2000",
       "model law is 'plastic'; it must be rve, elastic, mohr_coulomb or drucker_prager"},
      {scene + "fix soil all mpm 1.0 model all mohr_coulomb 1.0e6 0.3 0 95 0 density 2000",
       "friction angle must be in [0, 90), got 95 [degrees]"},
      {scene + "fix soil all mpm 1.0 model all mohr_coulomb 1.0e6 0.3 0 30",
       "model mohr_coulomb psi has no value; the command ends there; it must read: model group-ID "
       "rve fix-ID"},
      {scene + "fix soil all mpm 1.0 " + law + "\nvelocity all set 0 500 0\nrun 10",
       "is outside of the grid, x from 0 to 2, y from 0 to 4"},
      {scene + "fix soil all mpm 1.0 model all elastic 1.0e6 0.3 density -2000",
       "model all density is -2000 [mass/length^3]; it must be greater than 0, or rve"},
      {scene + "fix soil all mpm 1.0 model all elastic 1.0e6 0.3\nrun 0",
       "give the model of group all a density > 0 with the keyword density"},
      {scene +
           "group low id 1\nfix soil all mpm 1.0 model all elastic 1e6 0.3 density 1800 "
           "model low elastic 1e6 0.3 density rve\nrun 0",
       "atom 1 has no RVE that gives a density; give the model of group low a density > 0"},
      {scene + "fix soil all mpm 1.0 " + law + " flip 1 density 1800",
       "fix mpm soil: model all density is given twice, as 'density 2000' and as 'density 1800'; "
       "give "
       "it once"},
      {scene + "fix soil all mpm 1.0 density 2000 density 1800 model all elastic 1e6 0.3",
       "fix mpm soil: density is given twice"},
      {scene + "fix soil all mpm 1.0 " + law + "\nrun_style respa 1\nrun 0", "respa"},
      {scene + "fix soil all mpm 1.0 model nobody elastic 1.0e6 0.3 density 2000",
       "group 'nobody' does not exist"},
      {scene + "fix soil all mpm 1.0 model all elastic -1.0e6 0.3 density 2000",
       "must be positive, got -1000000"},
      {scene + "fix soil all mpm 1.0 model all rve grains density rve\nrun 0",
       "model all: fix grains does not exist"},
      {scene + "fix soil all mpm 1.0 density 2000\nrun 0", "no constitutive model"},
      {scene +
           "fix grains all gravity 9.81 vector 0 -1 0\nfix soil all mpm 1.0 model all rve "
           "grains\nrun 0",
       "model all: fix grains has style gravity; it must be rve"},
      {scene +
           "fix grains all rve test_fix_mpm.rve dt 1e-4 drive velocity_gradient xy 0.1\n"
           "fix soil all mpm 1.0 model all rve grains\nrun 0",
       "the drive must be mpm"},
      {scene +
           "group some id 1 2\nfix grains some rve test_fix_mpm.rve dt 1e-4 drive mpm\n"
           "fix soil all mpm 1.0 model all rve grains\nrun 0",
       "atom 3 has no RVE of fix grains; the group of that fix must contain the atom"},
      {scene + "group none empty\nfix soil none mpm 1.0 " + law + "\nrun 0", "no atoms"},
      {scene + "fix soil all mpm 1.0 " + law + "\nfix hold all setforce 0 0 0\nrun 0",
       "keyword rigid or boundary"},
      {scene + "fix soil all mpm 1.0 " + law + "\nfix move all nve\nrun 0", "integrates"},
      {scene + "fix soil all mpm 1.0 " + law + "\nminimize 0 0 1 1", "minimize"},
      {scene + "fix soil all mpm 1.0 " + law + "\ntimestep 1.0\nrun 1", "Courant number"},
      {"units real\ndimension 2\nregion b block 0 1 0 1 -0.1 0.1\ncreate_box 1 b\nfix soil all mpm "
       "1.0 " +
           law,
       "units"},
      {"units si\nregion b block 0 1 0 1 0 1\ncreate_box 1 b\nfix soil all mpm 1.0 " + law,
       "in x, y and z"},
      {"units si\ndimension 2\nregion b block 0 1 0 1 -0.1 0.1\ncreate_box 1 b\nfix soil all mpm "
       "1.0 " +
           law,
       "fix mpm soil: the grid is not periodic; use boundary f, s or m in x and y"},
      {"units si\ndimension 2\nboundary f f p\nregion b block 0 1 0 1 -0.1 0.1\ncreate_box 1 b\n"
       "mass 1 1900\ncreate_atoms 1 single 0.5 0.5 0\npair_style none\ncomm_modify cutoff 1\n"
       "fix soil all mpm 1.0 " +
           law + "\nrun 0",
       "has the mass 2000 (density * volume), but atom type 1 has the mass 1900"},
  };

  for (const auto &one : cases) {
    const std::string message = message_of(one.first);
    EXPECT_NE(message.find(one.second), std::string::npos)
        << "expected '" << one.second << "' in '" << message << "'";
  }
  std::remove(dump.c_str());
}

/// Returns the log of 20 steps in which a plate moves down by `motion` per step. The lower side of
/// the box is at `ylo`. Sets `moved` to the ratio of two displacements: that of the points of the
/// plate to the prescribed one.
std::string log_of_plate(double ylo, double motion, double &moved)
{
  char box[400];
  std::snprintf(box, sizeof box,
                "region box block 0 4 %.17g %.17g -0.1 0.1 units box\ncreate_box 1 box\n"
                "lattice sq 1.0 origin 0.5 0.5 0.0\n"
                "region plate block 0 2 %.17g %.17g -0.05 0.05 units box\n",
                ylo, ylo + 8, ylo + 4, ylo + 5);
  char rate[40];
  std::snprintf(rate, sizeof rate, "%.17g", -motion / 0.001);
  const std::string path = file_of_rank("log");
  {
    SoilScript script(MPI_COMM_SELF);
    script << "log " + path +
            "\nunits si\ndimension 2\nboundary f f p\natom_style sphere\natom_modify map array\n" +
            box +
            "create_atoms 1 region plate\nset group all diameter 1.0\npair_style none\n"
            "comm_modify cutoff 1.0\ntimestep 0.001\ngroup plate region plate\n"
            "fix soil all mpm 1.0 model all elastic 1e6 0.3 density 2000 rigid plate vx 0 vy " +
            rate + " rough\nrun 20\nlog none\n";
    moved = script.fix()->array_atom[0][1] / (-20 * motion);
  }
  const std::string log = rve_test::text_of(path);
  std::remove(path.c_str());
  return log;
}

// The coordinates are about 5600 km, as on maps. LAMMPS stores positions as doubles. At 5600 km,
// doubles are multiples of 2^-30 m.
TEST(FixMpmWarnings, NameCoordinatesThatRoundTheMotionOfAStep)
{
  const double quantum = std::ldexp(1.0, -30), far = 5621000;
  const std::string warning =
      "fix mpm soil: step 0: near the coordinate 5621008 [distance] positions are multiples of "
      "9.31e-10, and the largest motion in a step is 1e-09: rounding changes it by up to 47 %, and "
      "motions below 4.66e-10 are lost";
  double moved;
  std::string log = log_of_plate(far, 1e-9, moved);
  EXPECT_NEAR(moved, 0.931, 1e-3);
  EXPECT_NE(log.find(warning), std::string::npos) << log;
  EXPECT_EQ(log.find("are lost"), log.rfind("are lost")) << "more than once:" << log;
  log = log_of_plate(far, 4e-10, moved);
  EXPECT_EQ(moved, 0.0);
  EXPECT_NE(log.find("rounding changes it by up to 100 %"), std::string::npos) << log;

  // The warning appears if half a quantum, the largest rounding error, exceeds one per cent of the
  // motion in a step. This is the case for motions below 50 quanta.
  log = log_of_plate(far, 49.4 * quantum, moved);
  EXPECT_NE(log.find("multiples of 9.31e-10"), std::string::npos) << log;
  log = log_of_plate(far, 50.5 * quantum, moved);
  EXPECT_EQ(log.find("multiples of"), std::string::npos) << log;
  EXPECT_NEAR(moved, 1.0, 0.01);

  // Near the origin there is no warning, even if the motion is tiny or zero.
  for (const double motion : {1e-9, 1e-15, 0.0}) {
    log = log_of_plate(0.0, motion, moved);
    EXPECT_EQ(log.find("multiples of"), std::string::npos) << motion << log;
  }
  log = log_of_plate(far, 0.0, moved);
  EXPECT_EQ(log.find("multiples of"), std::string::npos) << log;
}

TEST(FixMpmWarnings, NameProbableMistakes)
{
  const std::string scene = points_in_box(4, 4) + "timestep 0.001\n";
  const std::string fix = "fix soil all mpm 1.0 model all elastic 1.0e6 0.3 density 2000";
  const std::string run = "\nrun 2\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {points_in_box(4, 4) + fix + run,
       "The time step is 1e-08 [time], the default of LAMMPS: set it with the timestep command; "
       "the Courant number is 0.5 with the time step 0.019"},
      {scene + "timestep 1e-9\n" + fix + run,
       "The time step is 1e-09 [time]; the Courant number is 0.5 with the time step 0.019"},
      {points_in_box(4, 4) + fix + "\nrun 0\n", ""},
      {scene + "group some id 1 2 3\n" + fix + " model some elastic 1e6 0.2" + run,
       "3 points are in the groups of more than one model"},
      {scene + "region air block 0 4 5 6 INF INF units box\n" + fix + " traction air 0 -1" + run,
       "region air of a traction contains no deformable points at step 0"},
      {scene + fix + run + "displace_atoms all move 0.1 0 0 units box" + run,
       "points have been moved since the last run"},
      {scene + "create_atoms 1 single 1.5 1.5 0\n" + fix + run,
       "1 of 16 cells with points, 1 by 1 [distance] each, contain more than 1.3 times"},
      {scene +
           "fix soil all mpm 1.0 model all mohr_coulomb 1e6 0.3 1e4 30 0 density 2000 stress 100 "
           "200 0" +
           run,
       "the initial stress 100 200 is a tension"},
      {scene +
           "fix soil all mpm 1.0 model all mohr_coulomb 1e6 0.3 1e4 30 0 density 2000 stress "
           "-100 -200 0" +
           run,
       ""},
      {scene + fix + run + "change_box all y final 0 7" + run, ""},
      {scene + "group block id 16\n" + fix + " rigid block vx 0 vy 0 rough form box" + run, ""},
      {scene + "group block id 1 11\n" + fix + " rigid block vx 0 vy 0 rough form box" + run,
       "fix mpm soil: 7 points that do not belong to the rigid body block are inside its form"},
      // The wave speeds are c_p = sqrt(1.346 E/rho) = 25.9 and c_s = sqrt(E/2.6/rho) = 13.9. If an
      // absorbing side has twice or half the speed of a wave, it reflects a third of the stress of
      // the wave.
      {scene + fix + " boundary xlo absorbing 26 14 boundary xhi absorbing 51 7" + run, ""},
      {scene + fix + " boundary xlo absorbing 53 14" + run,
       "fix mpm soil: boundary xlo absorbing cp is 53 [length/time]; it should be between 12.97 "
       "and 51.89, because compression waves of the points within a cell of this side have speeds "
       "from 25.94 to 25.94. More than a third of their stress is reflected"},
      {scene + fix + " boundary xhi absorbing 12 7" + run,
       "boundary xhi absorbing cp is 12 [length/time]; it should be between 12.97 and 51.89"},
      {scene + fix + " boundary ylo absorbing roller 6" + run,
       "boundary ylo absorbing cs is 6 [length/time]; it should be between 6.934 and 27.74, "
       "because shear waves"},
      {scene + fix + " boundary ylo absorbing 26 0" + run, ""},
      // The stiff layer is the lower one and has four times the wave speed of the soft one. Both
      // layers touch xlo; only the stiff one touches ylo.
      {scene +
           "group stiff id 1 2 3 4 5 6 7 8\ngroup soft subtract all stiff\n"
           "fix soil all mpm 1.0 model stiff elastic 1.6e7 0.3 model soft elastic 1.0e6 0.3 "
           "density 2000 boundary xlo absorbing 60 30 boundary ylo absorbing 200 100" +
           run,
       ""},
      {scene +
           "group stiff id 1 2 3 4\ngroup soft subtract all stiff\n"
           "fix soil all mpm 1.0 model stiff elastic 1.6e7 0.3 model soft elastic 1.0e6 0.3 "
           "density 2000 boundary ylo absorbing 30 14" +
           run,
       "boundary ylo absorbing cp is 30 [length/time]; it should be between 51.89 and 207.5"},
      {scene + fix + run + "velocity all set 0.1 0 0" + run, ""}};
  const std::string path = file_of_rank("log");
  for (const auto &one : cases) {
    Script(MPI_COMM_SELF) << "log " + path + "\n" + one.first + "log none\n";
    const std::string log = rve_test::text_of(path);
    if (one.second.empty())
      EXPECT_EQ(log.find("WARNING: fix mpm"), std::string::npos) << log;
    else
      EXPECT_NE(log.find(one.second), std::string::npos) << log;
  }
}

}    // namespace

// ---- groups that change in a run ----

namespace {

/// Returns a block of 4 by 4 points that rises with the given speed. The uppermost points start at
/// y = 3.5. `groups` and `fixes` define the model.
std::string rising_block(const std::string &speed, const std::string &groups,
                         const std::string &fixes)
{
  return "units si\ndimension 2\nboundary f f p\natom_style sphere\natom_modify map array sort 0 "
         "0.0\n"
         "region box block 0 8 0 8 -0.5 0.5\ncreate_box 1 box\nlattice sq 1.0 origin 0.5 0.5 0\n"
         "region g block 2 6 0 4 -0.5 0.5\ncreate_atoms 1 region g\nset group all diameter 1.0\n"
         "pair_style none\ncomm_modify cutoff 1.0\ntimestep 1e-3\n" +
      groups + "velocity all set 0 " + speed + " 0\n" + fixes + "run 200\n";
}

}    // namespace

// The error occurs in the step in which the point leaves, even if this step does not check the
// Courant number.
TEST(FixMpm, APointThatLeavesTheGroupsOfAllModelsIsNamed)
{
  const std::string groups = "region r block 0 8 0 4.2 -0.5 0.5\n"
                             "group soil dynamic all region r every 1\nrun 0\n";
  const std::string fix = "fix m all mpm 1.0 domain 0 8 0 8 boundary xlo roller model soil "
                          "elastic 1e6 0.3 density 2000\n";
  // With speed 5.07 or 5.3 the point leaves in different steps. The fix checks the Courant number
  // in one of these steps and not in the other.
  for (const std::string speed : {"5.07", "5.3"}) {
    const std::string message = message_of(rising_block(speed, groups, fix));
    EXPECT_NE(message.find("fix mpm m: step 1"), std::string::npos) << message;
    EXPECT_NE(message.find("atom 13 has left the groups of all models during the run"),
              std::string::npos)
        << message;
  }
}

TEST(FixMpm, APointThatJoinsTheGroupOfAModelWithoutAnRveIsNamed)
{
  const std::string groups = "region low block 0 8 0 4.2 -0.5 0.5\n"
                             "region high block 0 8 4.2 8 -0.5 0.5\n"
                             "group low dynamic all region low every 1\n"
                             "group high dynamic all region high every 1\n"
                             "group grains id 1\nrun 0\n";
  for (const std::string waves : {"", "wave_speed tangent 1 every 1 "}) {
    const std::string fix = "fix r grains rve " EXAMPLE_PACKINGS
                            "/A_h0075.rve drive mpm threads 1\n"
                            "fix m all mpm 1.0 domain 0 8 0 8 boundary xlo roller " +
        waves + "model low elastic 1e6 0.3 model high rve r density 2000\n";
    const std::string message = message_of(rising_block("5.07", groups, fix));
    EXPECT_NE(message.find(
                  "atom 13 has joined group high of the model rve r during the run and has no RVE"),
              std::string::npos)
        << message;
  }
}

// The RVE of atom 13 cannot follow: it did not deform while the elastic law computed the stress of
// the point.
TEST(FixMpm, APointThatJoinsTheGroupOfItsRveInARunIsNamed)
{
  const std::string groups = "region low block 0 8 0 4.2 -0.5 0.5\n"
                             "region high block 0 8 4.2 8 -0.5 0.5\n"
                             "group low dynamic all region low every 1\n"
                             "group high dynamic all region high every 1\nrun 0\n";
  const std::string fix = "fix r all rve " EXAMPLE_PACKINGS "/A_h0075.rve drive mpm threads 1\n"
                          "fix m all mpm 1.0 domain 0 8 0 8 boundary xlo roller "
                          "model low elastic 1e6 0.3 model high rve r density 2000\n";
  const std::string message = message_of(rising_block("5.07", groups, fix));
  EXPECT_NE(message.find("atom 13 has joined group high of the model rve r during the run, but its "
                         "RVE does not have its earlier deformation"),
            std::string::npos)
      << message;
}

TEST(FixMpm, DeletedFixOfRvesIsNamedInARunWithoutSetUp)
{
  const std::string rves = "fix r all rve " EXAMPLE_PACKINGS "/A_h0075.rve drive mpm threads 1\n";
  const std::string fix = rves +
      "fix m all mpm 1.0 domain 0 8 0 8 boundary ylo fixed model all rve r\nrun 1\nunfix r\n";
  for (const std::string &anew : {std::string(), rves}) {
    const std::string message = message_of(rising_block("0", "", fix + anew + "run 1 pre no\n"));
    EXPECT_NE(message.find("model all: fix r has been deleted or redefined since the last run"),
              std::string::npos)
        << message;
  }
}

// LAMMPS assigns the bit of a deleted group to the next new group, and a run with `pre no` does not
// check groups.
TEST(FixMpm, GroupsAndRegionsDeletedBeforeARunWithoutSetUpAreNamed)
{
  const std::string fix =
      "region top block 2 6 3 4 -0.5 0.5\ngroup top region top\n"
      "fix m all mpm 1.0 domain 0 8 0 8 boundary ylo fixed model all elastic 1e6 "
      "0.3 density 2000 traction top 0 -1000\nrun 1\n";
  const std::string message = message_of(
      rising_block("0", "", fix + "group top delete\ngroup bottom id 1\nrun 1 pre no\n"));
  EXPECT_NE(message.find("group top has been deleted since the fix was defined"), std::string::npos)
      << message;
}
