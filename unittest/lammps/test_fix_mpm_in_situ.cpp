// SPDX-License-Identifier: GPL-2.0-only
// Initial stress of ground, which fix mpm determines (keyword insitu), through LAMMPS scripts. The
// tests cover equilibrium with the weight from the first step on, bitwise equal results on any
// number of ranks and after a restart, and messages for wrong input. They also run under mpirun.

#include "grains_script.h"
#include "support/tests_of_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

using namespace LAMMPS_NS;
using grains_script::log_of;

namespace {

constexpr double GRAVITY = 9.81, SURCHARGE = 5000.0;

/// Indices of the global vector of the fix.
enum { UNBALANCED = 1, KINETIC = 3, MASS };

class SoilScript : public Script {
 public:
  using Script::Script;

  /// Returns positions, velocities and columns of the fix.
  Rows points()
  {
    const Atom *atom = lmp->atom;
    const Fix *fix = lmp->modify->get_fix_by_id("soil");
    return rows_by_id(6 + fix->size_peratom_cols, [&](int i, std::vector<double> &list) {
      list.insert(list.end(), atom->x[i], atom->x[i] + 3);
      list.insert(list.end(), atom->v[i], atom->v[i] + 3);
      list.insert(list.end(), fix->array_atom[i], fix->array_atom[i] + fix->size_peratom_cols);
    });
  }
};

// Indices of a row of points().
enum { X, Y, Z, COLUMNS = 6 };
enum {
  UY_2D = COLUMNS + 1,
  SXX_2D = COLUMNS + 3,
  SYY_2D,
  SXY_2D,
  RHO_2D = COLUMNS + 10,
  SZZ_2D = COLUMNS + 15
};

int rank()
{
  int me;
  MPI_Comm_rank(MPI_COMM_WORLD, &me);
  return me;
}

/// Returns the file of a library of six packings: two seeds at 5, 20 and 60 kPa. The packings were
/// loaded without lateral strain. All ranks make the library together once.
const std::string &library()
{
  static const std::string path = [] {
    Script()
        << "create_rve test_in_situ.lib grains 60 seeds 1 2 radius uniform 0.0025 0.005 kn 1e6 "
           "friction 0.5 density 2650 damping 0.3 thickness 0.075 pressure 5e3 2e4 6e4 k0 rest "
           "threads 1 device cpu";
    MPI_Barrier(MPI_COMM_WORLD);
    return std::string("test_in_situ.lib");
  }();
  return path;
}

const std::string &spheres()
{
  static const std::string path = [] {
    Script() << "create_rve test_in_situ_spheres.rve shape sphere grains 120 radius uniform 0.0025 "
                "0.005 kn 1e5 friction 0.5 density 2650 damping 0.3 pressure 1e4";
    MPI_Barrier(MPI_COMM_WORLD);
    return std::string("test_in_situ_spheres.rve");
  }();
  return path;
}

struct RemoveFiles : ::testing::Environment {
  void TearDown() override
  {
    if (!rve_test::runs_tests_of(__FILE__)) return;
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank() > 0) return;
    for (const char *file :
         {"test_in_situ.lib", "test_in_situ_spheres.rve", "test_in_situ.restart"})
      std::remove(file);
  }
};
const auto *const remove_files = ::testing::AddGlobalTestEnvironment(new RemoveFiles);

/// Script of a column of 2 by 6 cells of edge 0.5 under a surcharge. It defines no fixes. Ranks
/// divide y.
const std::string GROUND = R"(units si
dimension 2
boundary f f p
atom_style sphere
processors 1 * 1
region box block 0 1 0 4 -0.05 0.05
create_box 1 box
lattice sq 0.5 origin 0.5 0.5 0.0
region ground block 0 1 0 3 -0.05 0.05 units box
region surface block 0 1 2.5 3 -0.05 0.05 units box
create_atoms 1 region ground
group surface region surface
neighbor 0.5 bin
comm_modify cutoff 0.5
timestep 0.001
)";
const std::string WEIGHT = "fix gravity all gravity 9.81 vector 0 -1 0\n";

std::string grains()
{
  return "variable sv atom 5000+2200*9.81*(3-y)\nfix grains all rve " + library() +
      " drive mpm packing_stress v_sv packing_random 1 threads 1 device cpu\n";
}

std::string soil(const std::string &model, const std::string &in_situ)
{
  return "fix soil all mpm 0.5 device cpu model all " + model +
      " boundary xlo roller boundary xhi roller boundary ylo fixed traction surface 0 -5000 " +
      in_situ + "\n";
}

const std::string AT_REST = "insitu gravity 9.81 k0 0.5 surcharge 5000";

/// Script of the column in three dimensions: 2 by 1 by 6 cells. Ranks divide z.
const std::string GROUND_IN_SPACE = R"(units si
boundary f f f
atom_style sphere
processors 1 1 *
region box block 0 1 0 0.5 0 4
create_box 1 box
lattice sc 0.5 origin 0.5 0.5 0.5
region ground block 0 1 0 0.5 0 3 units box
create_atoms 1 region ground
)";
const std::string SETTINGS_IN_SPACE = R"(region surface block 0 1 0 0.5 2.5 3 units box
group surface region surface
neighbor 0.5 bin
comm_modify cutoff 0.5
timestep 0.001
fix gravity all gravity 9.81 vector 0 0 -1
)";

std::string soil_in_space(const std::string &model, const std::string &in_situ)
{
  return "fix soil all mpm 0.5 device cpu model all " + model +
      " boundary xlo roller boundary xhi roller boundary ylo roller boundary yhi roller boundary "
      "zlo fixed traction surface 0 0 -5000 " +
      in_situ + "\n";
}
enum { UZ_3D = COLUMNS + 2, SXX_3D = COLUMNS + 4, SYY_3D, SZZ_3D };

}    // namespace

TEST(FixMpmInSitu, WeightSurchargeAndReactionsBalanceForAnyLaw)
{
  for (const char *law :
       {"elastic 1e7 0.3", "mohr_coulomb 1e7 0.3 0 30 0", "drucker_prager 1e7 0.3 1000 30 0"}) {
    SoilScript script;
    script << GROUND + WEIGHT + soil(law, "density 1800 " + AT_REST) + "run 100\n";

    for (const auto &[id, row] : script.points()) {
      const double vertical = SURCHARGE + 1800 * GRAVITY * (3.0 - row[Y]);
      EXPECT_NEAR(row[SYY_2D], -vertical, 1e-9 * vertical) << law;
      EXPECT_NEAR(row[SXX_2D], -0.5 * vertical, 1e-9 * vertical) << law;
      EXPECT_NEAR(row[UY_2D], 0.0, 1e-12) << law;
      // An elastic law does not store the out-of-plane stress.
      const double across = law[0] == 'e' ? 0.0 : -0.5 * vertical;
      EXPECT_NEAR(row[SZZ_2D], across, 1e-9 * vertical) << law;
    }
    // Sums on the grid are rounded, so the unbalanced force is compared with the weight of a cell.
    EXPECT_LT(script.fix_value("soil", UNBALANCED), 1e-9 * 1800 * GRAVITY * 0.25) << law;
  }
}

/// Ground of two layers of 1.5 m, "lower" and "upper".
const std::string LAYERS = GROUND +
    "region lower block 0 1 0 1.5 -0.05 0.05 units box\n"
    "group lower region lower\ngroup upper subtract all lower\n" +
    WEIGHT;

std::string layered_soil(const std::string &models)
{
  return "fix soil all mpm 0.5 device cpu " + models +
      " boundary xlo roller boundary xhi roller boundary ylo fixed traction surface 0 -5000 " +
      AT_REST + "\n";
}

TEST(FixMpmInSitu, LayersOfDifferentDensityBearTheWeightAboveThem)
{
  const double lower = 2100.0, upper = 1500.0;
  for (const char *models :
       {"model lower elastic 2e7 0.3 density 2100 model upper mohr_coulomb 1e7 0.3 0 30 0 density "
        "1500",
        "density 1500 model lower elastic 2e7 0.3 density 2100 model upper elastic 1e7 0.3"}) {
    SoilScript script;
    script << LAYERS + layered_soil(models) + "run 100\n";

    for (const auto &[id, row] : script.points()) {
      const double depth = 3.0 - row[Y];
      const double vertical =
          SURCHARGE + GRAVITY * (depth < 1.5 ? upper * depth : upper * 1.5 + lower * (depth - 1.5));
      EXPECT_NEAR(row[SYY_2D], -vertical, 1e-9 * vertical) << models;
      EXPECT_NEAR(row[SXX_2D], -0.5 * vertical, 1e-9 * vertical) << models;
      EXPECT_NEAR(row[RHO_2D], depth < 1.5 ? upper : lower, 1e-6) << models;
      EXPECT_NEAR(row[UY_2D], 0.0, 1e-12) << models;
    }
    EXPECT_NEAR(script.fix_value("soil", MASS), 1.5 * (lower + upper), 1e-9) << models;
    EXPECT_LT(script.fix_value("soil", UNBALANCED), 1e-9 * lower * GRAVITY * 0.25) << models;
  }
}

TEST(FixMpmInSitu, LayerOfGrainsHasItsOwnDensityNextToThatOfALaw)
{
  SoilScript script;
  script << LAYERS + grains() +
          layered_soil("model upper rve grains density rve model lower elastic 1e7 0.3 density "
                       "2200") +
          "compute e all rve/atom void_ratio\nrun 0\n";

  std::map<double, double> mean;    // mean density of the two points of a level
  const auto void_ratios = script.compute("e");
  const auto points = script.points();
  for (const auto &[id, row] : points)
    mean[row[Y]] += row[Y] < 1.5 ? 0.5 * 2200.0 : 0.5 * 2650.0 / (1.0 + void_ratios.at(id));
  for (const auto &[id, row] : points)
    EXPECT_NEAR(row[RHO_2D], mean.at(row[Y]), row[Y] < 1.5 ? 1e-6 : 1.01e-4 * mean.at(row[Y]));
  EXPECT_LT(script.fix_value("soil", UNBALANCED), 1e-3 * 2200 * GRAVITY * 0.25);
}

TEST(FixMpmInSituInSpace, WeightSurchargeAndReactionsBalanceForAnyLaw)
{
  for (const char *law :
       {"elastic 1e7 0.3", "mohr_coulomb 1e7 0.3 0 30 0", "drucker_prager 1e7 0.3 1000 30 0"}) {
    SoilScript script;
    script << GROUND_IN_SPACE + SETTINGS_IN_SPACE + soil_in_space(law, "density 1800 " + AT_REST) +
            "run 100\n";

    for (const auto &[id, row] : script.points()) {
      const double vertical = SURCHARGE + 1800 * GRAVITY * (3.0 - row[Z]);
      EXPECT_NEAR(row[SZZ_3D], -vertical, 1e-9 * vertical) << law;
      EXPECT_NEAR(row[SXX_3D], -0.5 * vertical, 1e-9 * vertical) << law;
      EXPECT_NEAR(row[SYY_3D], -0.5 * vertical, 1e-9 * vertical) << law;
      EXPECT_NEAR(row[UZ_3D], 0.0, 1e-12) << law;
    }
    EXPECT_LT(script.fix_value("soil", UNBALANCED), 1e-9 * 1800 * GRAVITY * 0.125) << law;
  }
}

/// The density of a point is that of the packing of its RVE. All RVEs have the same packing here,
/// so the initial stress balances the weight.
TEST(FixMpmInSituInSpace, GrainsStayAtRestToTheSameBitsOnRanksAndAfterARestart)
{
  const std::string grains =
      "fix grains all rve " + spheres() + " drive mpm threads 1 device cpu\n";
  const std::string fixes = SETTINGS_IN_SPACE + grains +
      soil_in_space("rve grains", "insitu gravity 9.81 k0 0.6 surcharge 5000");
  SoilScript together, alone(MPI_COMM_SELF), first, second;
  together << GROUND_IN_SPACE + fixes + "run 30\n";
  alone << GROUND_IN_SPACE + fixes + "run 30\n";
  first << GROUND_IN_SPACE + fixes + "run 10\nwrite_restart test_in_situ.restart\n";
  second << "processors 1 1 *\nread_restart test_in_situ.restart\npair_style none\n" + fixes +
          "run 20\n";

  EXPECT_EQ(together.points(), alone.points());
  EXPECT_EQ(second.points(), alone.points());
  EXPECT_LT(alone.fix_value("soil", UNBALANCED), 1e-3 * 1500 * GRAVITY * 0.125);
  double farthest = 0.0;
  for (const auto &[id, row] : alone.points()) {
    farthest = std::max(farthest, std::abs(row[UZ_3D]));
    EXPECT_NEAR(row[SXX_3D], 0.6 * row[SZZ_3D], 5e-3 * std::abs(row[SZZ_3D])) << id;
  }
  // Without the initial stress the ground would fall by 4.4 mm in this time.
  EXPECT_LT(farthest, 1e-3 * 0.5 * GRAVITY * 0.03 * 0.03);
}

/// Absorbing sides exert no static force. Therefore pressures on the sides balance the initial
/// stress. On the lateral sides the pressures increase with depth.
TEST(FixMpmInSitu, GroundBetweenAbsorbingSidesRestsUnderTheReactionOfItsStress)
{
  const std::string groups =
      "region left block 0 0.5 0 3 -0.05 0.05 units box\ngroup left region left\n"
      "region right block 0.5 1 0 3 -0.05 0.05 units box\ngroup right region right\n"
      "region foot block 0 1 0 0.5 -0.05 0.05 units box\ngroup foot region foot\n"
      "variable across atom 0.5*(5000+1800*9.81*(3-y))\nvariable below equal 5000+1800*9.81*3\n";
  const std::string sides =
      "fix soil all mpm 0.5 device cpu model all elastic 1e7 0.3 density 1800 "
      "boundary xlo absorbing 86 46 boundary xhi absorbing 86 46 "
      "boundary ylo absorbing 86 46 traction surface 0 -5000 " +
      AT_REST;
  const std::string reactions = " pressure left v_across face xlo pressure right v_across face xhi "
                                "pressure foot v_below face ylo";
  for (const bool held : {true, false}) {
    SoilScript script;
    script << GROUND + WEIGHT + groups + sides + (held ? reactions : "") + "\nrun 100\n";

    double farthest = 0.0;
    for (const auto &[id, row] : script.points())
      farthest = std::max(farthest, std::abs(row[UY_2D]));
    if (held) {
      EXPECT_LT(farthest, 1e-12);
      EXPECT_LT(script.fix_value("soil", UNBALANCED), 1e-9 * 1800 * GRAVITY * 0.25);
    } else {
      // Without these pressures the ground sinks for 0.1 s. Its velocity approaches the value at
      // which the dashpots of the lower side bear the weight. The settlement must exceed a tenth of
      // this velocity times 0.1 s.
      const double velocity = (SURCHARGE + 1800 * GRAVITY * 3.0) / (1800 * 86.0);
      EXPECT_GT(farthest, 0.1 * velocity * 0.1);
    }
  }
}

TEST(FixMpmInSitu, GrainsBearTheirDepthAndTheColumnStaysAtRest)
{
  SoilScript script;
  script << GROUND + WEIGHT + grains() + soil("rve grains", AT_REST) + "run 0\n";
  const double unbalanced = script.fix_value("soil", UNBALANCED);
  const auto begin = script.points();

  script << "run 200\n";

  // All points of a level have the same density. The vertical stress is the weight per area of the
  // levels above plus half the weight per area of the level itself.
  std::map<double, double> density, cover;
  for (const auto &[id, row] : begin) density[row[Y]] = row[RHO_2D];
  double above = SURCHARGE;
  for (auto level = density.rbegin(); level != density.rend(); ++level) {
    cover[level->first] = above + 0.25 * GRAVITY * level->second;
    above += 0.5 * GRAVITY * level->second;
  }
  const double weight = density.begin()->second * GRAVITY * 0.25;
  EXPECT_LT(unbalanced, 1e-3 * weight);
  const double tolerance = 1e-4 * density.begin()->second * GRAVITY * 0.5;
  for (const auto &[id, row] : begin) {
    EXPECT_EQ(row[RHO_2D], density.at(row[Y]));
    EXPECT_NEAR(row[SYY_2D], -cover.at(row[Y]), 1.01 * tolerance);
    EXPECT_NEAR(row[SXX_2D], -0.5 * cover.at(row[Y]), 1.01 * tolerance);
    EXPECT_NEAR(row[SXY_2D], 0.0, 1.01 * tolerance);
  }
  // The ground stays at rest: displacements are at most 1e-7 of the height, and the stress does not
  // change.
  for (const auto &[id, row] : script.points()) {
    EXPECT_LT(std::fabs(row[UY_2D]), 3e-7);
    EXPECT_NEAR(row[SYY_2D], begin.at(id)[SYY_2D], 1e-3 * cover.at(begin.at(id)[Y]));
  }
  EXPECT_GT(density.begin()->second, density.rbegin()->second) << "deeper ground is denser";
}

TEST(FixMpmInSitu, MassDensityIsTheMeanDensityOfTheGrainsOfALevel)
{
  SoilScript script;
  script << GROUND + WEIGHT + grains() + soil("rve grains", AT_REST) +
          "compute e all rve/atom void_ratio\nrun 0\n";

  std::map<double, double> sum, mass_density;
  const auto void_ratios = script.compute("e");
  for (const auto &[id, row] : script.points()) {
    sum[row[Y]] += 0.5 * 2650.0 / (1.0 + void_ratios.at(id));    // each level has two points
    mass_density[row[Y]] = row[RHO_2D];
  }
  // The iteration of weight and density ends when the change is below 1e-4.
  for (const auto &[height, mean] : sum) EXPECT_NEAR(mass_density.at(height), mean, 1.01e-4 * mean);
}

// K0 is the ratio of lateral to vertical stress at rest. Each packing has its own K0. In level
// ground, the two points of a level must nevertheless have the same K0.
TEST(FixMpmInSitu, LevelAtRestHasTheLateralStressOfItsGrains)
{
  SoilScript script;
  script << GROUND + WEIGHT + grains() +
          soil("rve grains", "insitu gravity 9.81 k0 rest surcharge 5000") + "run 0\n";

  std::map<double, std::vector<double>> ratios;
  double weight = 0.0;
  for (const auto &[id, row] : script.points()) {
    ratios[row[Y]].push_back(row[SXX_2D] / row[SYY_2D]);
    weight = std::max(weight, row[RHO_2D] * GRAVITY * 0.25);
  }
  for (const auto &[height, of_level] : ratios) {
    EXPECT_NEAR(of_level[0], of_level[1], 1e-3);
    EXPECT_GT(of_level[0], 0.3);
    EXPECT_LT(of_level[0], 0.8);
  }
  EXPECT_LT(script.fix_value("soil", UNBALANCED), 1e-3 * weight);
}

TEST(FixMpmInSitu, SpheresBearTheirDepthInSpaceAndInThePlane)
{
  const std::string rve = "fix grains all rve " + spheres() + " drive mpm threads 1 device cpu\n";
  SoilScript plane, space;

  plane << GROUND + WEIGHT + rve + soil("rve grains", AT_REST) +
          "compute s all rve/atom szz\nrun 0\n";
  space << "units si\nboundary f f f\natom_style sphere\nregion box block 0 0.5 0 0.5 0 2\n"
           "create_box 1 box\nlattice sc 0.5 origin 0.5 0.5 0.5\n"
           "region ground block 0 0.5 0 0.5 0 1.5 units box\ncreate_atoms 1 region ground\n"
           "neighbor 0.5 bin\ncomm_modify cutoff 0.5\ntimestep 0.001\n"
           "fix gravity all gravity 9.81 vector 0 0 -1\n" +
          rve +
          "fix soil all mpm 0.5 device cpu model all rve grains boundary xlo roller boundary xhi "
          "roller boundary ylo roller boundary yhi roller boundary zlo fixed insitu gravity 9.81 "
          "k0 0.6\nrun 0\n";

  const auto across = plane.compute("s");
  for (const auto &[id, row] : plane.points())
    EXPECT_NEAR(across.at(id), 0.5 * row[SYY_2D], 3.0) << "the stress across the plane is lateral";
  EXPECT_LT(plane.fix_value("soil", UNBALANCED), 1e-3 * 1500 * GRAVITY * 0.25);
  EXPECT_LT(space.fix_value("soil", UNBALANCED), 1e-3 * 1500 * GRAVITY * 0.125);
}

TEST(FixMpmInSitu, ComponentsMayBeVariablesOfAnAtom)
{
  SoilScript script;
  script << GROUND + WEIGHT + grains() +
          "variable syy atom -20000-1000*y\nvariable sxx atom 0.6*v_syy\nvariable sxy atom "
          "500*x\n" +
          soil("rve grains", "insitu stress v_sxx v_syy v_sxy tolerance 2") + "run 0\n";

  for (const auto &[id, row] : script.points()) {
    EXPECT_NEAR(row[SYY_2D], -20000 - 1000 * row[Y], 2.0);
    EXPECT_NEAR(row[SXX_2D], 0.6 * (-20000 - 1000 * row[Y]), 2.0);
    EXPECT_NEAR(row[SXY_2D], 500 * row[X], 2.0);
  }
}

// The Hertz contacts are prepared at 20 kPa. At the in-situ stress of 400 or 900 kPa they are
// stiffer, so the automatic time step must be shorter.
TEST(FixMpmInSitu, HertzContactsStayAtRestAtALargerStressWithAnAutomaticTimeStep)
{
  const std::string packing = "test_in_situ_hertz.rve";
  Script() << "create_rve " + packing +
          " grains 100 seed 3 radius uniform 0.0025 0.005 density 2650 damping 0.3 pressure 2e4 "
          "thickness 0.075 contact hertz 5e9 0.0 tangential mindlin/force 4e9 0.5 0.5 damping "
          "velocity";
  MPI_Barrier(MPI_COMM_WORLD);
  for (const std::string pressure : {"4e5", "9e5"}) {
    SCOPED_TRACE(pressure);
    SoilScript script;
    script << "units si\ndimension 2\nboundary f f p\natom_style sphere\nprocessors 1 * 1\n"
              "region box block 0 2 0 2 -0.05 0.05\ncreate_box 1 box\n"
              "lattice sq 0.5 origin 0.5 0.5 0\ncreate_atoms 1 box\nneighbor 0.5 bin\n"
              "comm_modify cutoff 0.5\ntimestep 5e-4\n"
              "fix grains all rve " +
            packing +
            " drive mpm threads 1\n"
            "fix soil all mpm 0.5 boundary xlo roller boundary xhi roller boundary ylo roller "
            "boundary yhi roller model all rve grains insitu stress -" +
            pressure + " -" + pressure +
            " 0\n"
            "compute energy all rve/atom kinetic elastic\ncompute sum all reduce sum c_energy[*]\n"
            "thermo_style custom step c_sum[*]\nthermo 20\nrun 40\n";

    const Compute *const energies = script.lmp->modify->get_compute_by_id("sum");
    EXPECT_LT(energies->vector[0], 1e-6 * energies->vector[1]) << "of grains at rest";
    for (const auto &[id, row] : script.points())
      EXPECT_NEAR(row[SYY_2D], -std::stod(pressure), 1e-4 * std::stod(pressure));
  }
  MPI_Barrier(MPI_COMM_WORLD);
  if (rank() == 0) std::remove(packing.c_str());
}

TEST(FixMpmInSitu, InitialStressBeyondTheStrengthGivesAWarning)
{
  const std::string path = file_of_rank("strength.log");
  for (const char *law : {"drucker_prager 1e7 0.3 0 30 10", "mohr_coulomb 1e7 0.3 0 30 10"}) {
    Script(MPI_COMM_SELF) << "log " + path + "\n" + GROUND +
            soil(law, "density 2000 stress -1e3 -1e5 0") + "run 0\nlog none\n";
    const std::string text = rve_test::text_of(path);
    EXPECT_NE(text.find("the initial stress of 12 points exceeds the strength of their law"),
              std::string::npos)
        << text;
  }
  std::remove(path.c_str());
}

TEST(FixMpmInSitu, ASurfaceMayBeAVariableOfAnAtom)
{
  SoilScript script;
  script << GROUND + WEIGHT + "variable top atom 3+x\nvariable k atom 0.4+0.1*x\n" +
          soil("elastic 1e7 0.3", "density 1800 insitu gravity 9.81 k0 v_k surface v_top") +
          "run 0\n";

  for (const auto &[id, row] : script.points()) {
    const double vertical = 1800 * GRAVITY * (3.0 + row[X] - row[Y]);
    EXPECT_NEAR(row[SYY_2D], -vertical, 1e-9 * vertical);
    EXPECT_NEAR(row[SXX_2D], -(0.4 + 0.1 * row[X]) * vertical, 1e-9 * vertical);
  }
}

TEST(FixMpmInSitu, RanksGiveTheSameBits)
{
  const std::string command = GROUND + WEIGHT + grains() + soil("rve grains", AT_REST) + "run 20\n";
  SoilScript together, alone(MPI_COMM_SELF);

  together << command;
  alone << command;

  EXPECT_EQ(together.points(), alone.points());
}

TEST(FixMpmInSitu, RestartContinuesBitForBit)
{
  const std::string fixes = WEIGHT + grains() + soil("rve grains", AT_REST);
  SoilScript whole, first, second;

  whole << GROUND + fixes + "run 30\n";
  first << GROUND + fixes + "run 10\nwrite_restart test_in_situ.restart\n";
  second << "processors 1 * 1\nread_restart test_in_situ.restart\npair_style none\nneighbor 0.5 "
            "bin\ncomm_modify cutoff 0.5\n"
            "timestep 0.001\nregion surface block 0 1 2.5 3 -0.05 0.05 units box\n" +
          fixes + "run 20\n";

  EXPECT_EQ(whole.points(), second.points());
}

TEST(FixMpmInSitu, ReportsUnbalancedForces)
{
  const std::string law = "elastic 1e7 0.3";
  EXPECT_IN("the largest unbalanced nodal force of the in-situ state is",
            log_of(GROUND + WEIGHT + soil(law, "density 1800 " + AT_REST) + "run 0"));
  EXPECT_IN("No force acts on the points: define fix gravity before this fix",
            log_of(GROUND + soil(law, "density 1800 " + AT_REST) + WEIGHT + "run 0"));
  // Without the keyword surcharge nothing balances the traction of 5000 Pa on the surface. The
  // weight of a cell is 4414 N per metre of thickness.
  EXPECT_IN(
      "of the weight of a cell, above 0.001, so that the ground will move",
      log_of(GROUND + WEIGHT + soil(law, "density 1800 insitu gravity 9.81 k0 0.5") + "run 0"));
  EXPECT_IN(
      "the in-situ stress of 12 points exceeds the strength of their law (atom 1, for example)",
      log_of(GROUND + WEIGHT +
             soil("mohr_coulomb 1e7 0.3 0 30 0",
                  "density 1800 insitu gravity 9.81 k0 0.2 surcharge 5000") +
             "run 0"));
}

TEST(FixMpmInSitu, InvalidArgumentsAreNamed)
{
  const auto with = [](const std::string &in_situ) {
    return GROUND + WEIGHT + soil("elastic 1e7 0.3", "density 1800 " + in_situ) + "run 0\n";
  };
  const std::vector<std::pair<std::string, std::string>> cases = {
      {with("insitu gravity 9.81"), "insitu needs gravity and k0, or stress alone"},
      {with("insitu k0 0.5"), "insitu needs gravity and k0, or stress alone"},
      {with("insitu stress -1 -1 0 gravity 9.81"), "insitu needs gravity and k0, or stress alone"},
      {with("insitu weight 9.81"), "insitu has 'weight'; it must read: insitu gravity g k0"},
      {with("insitu gravity -9.81 k0 0.5"),
       "insitu gravity is -9.81 [length/time^2]; it must be greater than 0"},
      {with("insitu gravity 9.81 k0 0.5 tolerance 0"),
       "insitu tolerance is 0 [stress]; it must be greater than 0"},
      {with("insitu gravity 9.81 k0 0.7 k0 0.5"), "insitu has k0 twice; give it once"},
      {with("insitu gravity 9.81 k0 0.7 gravity 9.81"), "insitu has gravity twice; give it once"},
      {with("insitu gravity 9.81 k0 v_none"), "variable none does not exist"},
      {with("insitu gravity 9.81 k0 -0.5"),
       "fix mpm soil: insitu: k0 of atom 1 is -0.5 [-]; it must be greater than 0 (atoms with an "
       "invalid value: 12)"},
      {with("insitu gravity 9.81 k0 0.5 surface 2.5"),
       "fix mpm soil: insitu: the vertical pressure of atom 11 is -4414.5 [stress] at the height "
       "2.75 [length], under a surface at 2.5 [length]; it must be greater than 0 (atoms with an "
       "invalid value: 2)"},
      {with("insitu gravity 9.81 k0 rest"),
       "k0 rest takes k0 from RVEs, but atom 1 has no RVE; give k0 as a number (atoms without an "
       "RVE: 12)"},
      {with("stress -1 -1 0 insitu gravity 9.81 k0 0.5"), "stress and insitu exclude each other"},
      {GROUND + WEIGHT + grains() +
           soil("rve grains", "insitu gravity 9.81 k0 0.05 surcharge 5000") + "run 0\n",
       "cannot be brought to the stress"},
  };
  for (const auto &[lines, part] : cases) EXPECT_IN(part, message_of(lines));
}

// ---- choice of packings by depth ----

TEST(PackingStress, IsThatOfTheNearestLevel)
{
  Script script;
  script << GROUND + "variable sv atom 3000*exp(y)\nfix grains all rve " + library() +
          " packing_stress v_sv packing_random 1 threads 1 device cpu\ncompute s all rve/atom syy\n"
          "compute y all property/atom yu\nrun 0\n";

  const auto stress = script.compute("s"), height = script.compute("y");
  std::map<double, int> times;
  for (const auto &[id, sigma] : stress) {
    const double wanted = 3000.0 * std::exp(height.at(id));
    double nearest = 0.0;
    for (const double level : {5e3, 2e4, 6e4})
      if (nearest == 0.0 ||
          std::fabs(std::log(level / wanted)) < std::fabs(std::log(nearest / wanted)))
        nearest = level;
    EXPECT_NEAR(-sigma, nearest, 2e-3 * nearest);
    times[nearest]++;
  }
  EXPECT_EQ(times.size(), 3u);
}

TEST(PackingStress, ReportsInvalidInput)
{
  const auto with = [](const std::string &keywords) {
    return GROUND + "variable sv atom 3000*(1-y)\nfix grains all rve " + library() + " " +
        keywords + " threads 1 device cpu\nrun 0\n";
  };
  EXPECT_IN("packing_stress selects 2 packings of 5000.", message_of(with("packing_stress 1000")));
  EXPECT_IN("packing_stress of atom 5 is -750 [stress]; it is positive in compression",
            message_of(with("packing_stress v_sv packing_random 1")));
  EXPECT_IN("packing_variable and packing_stress exclude each other",
            message_of(with("packing_variable v_sv packing_stress 1000")));
  EXPECT_IN("void ratios of the packings with its packing_stress are from",
            message_of(with("packing_stress 1000 packing_void_ratio 0.9 0.01")));
}
