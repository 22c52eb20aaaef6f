// SPDX-License-Identifier: GPL-2.0-only
// Pore water of fix mpm, through LAMMPS scripts: ground with a water table that stays at rest,
// effective stresses and pore pressures in the output, RVEs at constant volume, the same bits on
// any number of ranks and after a restart, and messages for wrong input. The tests also run under
// mpirun.

#include "grains_script.h"
#include "support/tests_of_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

using namespace LAMMPS_NS;
using grains_script::log_of;

namespace {

constexpr double GRAVITY = 9.81, WATER = 1000.0, DRY = 1600.0, POROSITY = 0.4;

/// Indices of the global vector of the fix.
enum { UNBALANCED = 1, MASS = 4 };

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

// Indices of a row of points(). The three columns of water are the last ones.
enum { X, Y, Z, COLUMNS = 6 };
enum { UY_2D = COLUMNS + 1, SXX_2D = COLUMNS + 3, SYY_2D, RHO_2D = COLUMNS + 10 };
enum { P_2D = COLUMNS + 17, N_2D, RU_2D };
enum { UZ_3D = COLUMNS + 2, SXX_3D = COLUMNS + 4, SYY_3D, SZZ_3D };
enum { P_3D = COLUMNS + 25, N_3D, RU_3D };
const std::string WET_COLUMNS = " column pore_pressure column porosity column r_u";

const std::string &spheres()
{
  static const std::string path = [] {
    Script() << "create_rve test_water_spheres.rve shape sphere grains 120 radius uniform 0.0025 "
                "0.005 kn 1e5 friction 0.5 density 2650 damping 0.3 pressure 1e4";
    MPI_Barrier(MPI_COMM_WORLD);
    return std::string("test_water_spheres.rve");
  }();
  return path;
}

struct RemoveFiles : ::testing::Environment {
  void TearDown() override
  {
    if (!rve_test::runs_tests_of(__FILE__)) return;
    MPI_Barrier(MPI_COMM_WORLD);
    int me;
    MPI_Comm_rank(MPI_COMM_WORLD, &me);
    for (const char *file : {"test_water_spheres.rve", "test_water.restart"})
      if (me == 0) std::remove(file);
  }
};
const auto *const remove_files = ::testing::AddGlobalTestEnvironment(new RemoveFiles);

/// Script of a column of 2 by 6 cells of edge 0.5 with the surface at 3. Ranks divide y.
const std::string GROUND = R"(units si
dimension 2
boundary f f p
atom_style sphere
processors 1 * 1
region box block 0 1 0 4 -0.05 0.05
create_box 1 box
lattice sq 0.5 origin 0.5 0.5 0.0
region ground block 0 1 0 3 -0.05 0.05 units box
create_atoms 1 region ground
)";
const std::string SETTINGS = R"(neighbor 0.5 bin
comm_modify cutoff 0.5
timestep 0.0002
fix gravity all gravity 9.81 vector 0 -1 0
)";

std::string soil(const std::string &arguments)
{
  return "fix soil all mpm 0.5 device cpu boundary xlo roller boundary xhi roller boundary ylo "
         "fixed " +
      arguments + "\n";
}
const std::string SAND = "model all elastic 1e7 0.3 density 1600 ";
const std::string SATURATED = "water all undrained kw 1e8 density 1000 porosity 0.4 ";

/// The same column of RVEs of spheres in three dimensions: 1 by 1 by 6 cells. Ranks divide z.
const std::string GROUND_IN_SPACE = R"(units si
boundary f f f
atom_style sphere
processors 1 1 *
region box block 0 0.5 0 0.5 0 4
create_box 1 box
lattice sc 0.5 origin 0.5 0.5 0.5
region ground block 0 0.5 0 0.5 0 3 units box
create_atoms 1 region ground
)";
std::string soil_in_space()
{
  return "neighbor 0.5 bin\ncomm_modify cutoff 0.5\ntimestep 0.0002\n"
         "region surface block 0 0.5 0 0.5 2.5 3 units box\ngroup surface region surface\n"
         "fix gravity all gravity 9.81 vector 0 0 -1\n"
         "fix grains all rve " +
      spheres() +
      " drive mpm threads 1 device cpu\n"
      "fix soil all mpm 0.5 device cpu model all rve grains boundary xlo roller boundary xhi "
      "roller boundary ylo roller boundary yhi roller boundary zlo fixed insitu gravity 9.81 k0 "
      "0.6 surcharge 5000 water_table 2.5 traction surface 0 0 -5000 water all undrained kw 2e8 "
      "density 1000 porosity rve" +
      WET_COLUMNS + "\n";
}

}    // namespace

TEST(FixMpmWater, ColumnWithAWaterTableStaysAtRest)
{
  const double table = 2.0;
  SoilScript script;
  script << GROUND + SETTINGS +
          soil(SAND + SATURATED + "insitu gravity 9.81 k0 0.5 water_table 2.0" + WET_COLUMNS) +
          "run 100\n";

  for (const auto &[id, row] : script.points()) {
    const bool wet = row[Y] < table;
    const double saturated = DRY + POROSITY * WATER;
    const double total =
        GRAVITY * (wet ? DRY * (3.0 - table) + saturated * (table - row[Y]) : DRY * (3.0 - row[Y]));
    const double pressure = wet ? WATER * GRAVITY * (table - row[Y]) : 0.0;
    EXPECT_NEAR(row[P_2D], pressure, 1e-9 * total);
    EXPECT_NEAR(row[SYY_2D], pressure - total, 1e-9 * total) << "effective";
    EXPECT_NEAR(row[SXX_2D], 0.5 * (pressure - total), 1e-9 * total) << "k0 of effective stresses";
    EXPECT_NEAR(row[N_2D], POROSITY, 1e-12) << "dry points have pores, too";
    EXPECT_NEAR(row[RU_2D], 0.0, 1e-9);
    EXPECT_NEAR(row[RHO_2D], wet ? saturated : DRY, 1e-6);
    EXPECT_NEAR(row[UY_2D], 0.0, 1e-12);
  }
  EXPECT_NEAR(script.fix_value("soil", MASS), 3.0 * DRY + 2.0 * POROSITY * WATER, 1e-9);
  // a pressure is rounded to 1e-16 of K_w/n
  EXPECT_LT(script.fix_value("soil", UNBALANCED), 1e-9 * 2000 * GRAVITY * 0.25);
}

TEST(FixMpmWater, SuddenLoadGoesToTheWaterAndRaisesTheRatioOfPorePressure)
{
  // Without lateral strain the water carries (K_w/n)/(M' + K_w/n) of a load. It vibrates about this
  // state without damping; with damping it comes to rest.
  const double ground = 1e7 * 0.7 / (1.3 * 0.4), share = 1e8 / POROSITY / (ground + 1e8 / POROSITY);
  SoilScript script;
  script << GROUND + SETTINGS +
          "region surface block 0 1 2.5 3 -0.05 0.05 units box\ngroup surface region surface\n" +
          soil(SAND + SATURATED +
               "damping 0.3 traction surface 0 -2000 insitu gravity 9.81 k0 0.5 surcharge 1000" +
               WET_COLUMNS) +
          "run 3000\n";

  for (const auto &[id, row] : script.points()) {
    const double initial = 1000.0 + 2000.0 * GRAVITY * (3.0 - (row[Y] - row[UY_2D]));
    EXPECT_NEAR(row[P_2D], share * 1000.0, 1e-3 * 1000.0) << "strains are 4e-6";
    EXPECT_NEAR(row[P_2D] - row[SYY_2D], initial + 1000.0, 1e-4 * initial) << "total stress";
    EXPECT_NEAR(row[RU_2D], row[P_2D] / initial, 1e-9);
  }
}

/// Still water reduces the weight of ground by that of the water that it displaces. The effective
/// stress balances the submerged unit weight of each layer.
TEST(FixMpmWater, SubmergedLayersRestUnderTheirBuoyantWeight)
{
  const double grains = DRY / (1.0 - POROSITY);    // density of the grains in both layers
  const auto n_at = [](double y) { return y < 1.5 ? 0.3 : 0.4; };
  const auto density_at = [&](double y) { return (1.0 - n_at(y)) * grains; };
  const auto weight_at = [&](double y) {
    return GRAVITY * (density_at(y) - (1.0 - n_at(y)) * WATER);
  };
  SoilScript script;
  script << GROUND + SETTINGS +
          "variable n atom 0.3+0.1*(y>1.5)\nregion low block 0 1 0 1.5 -0.05 0.05 units box\n"
          "group low region low\n" +
          soil(fmt::format("model all elastic 1e7 0.3 density {:.17g} model low elastic 1e7 0.3 "
                           "density {:.17g} water all submerged density 1000 porosity v_n insitu "
                           "gravity 9.81 k0 0.5" +
                               WET_COLUMNS,
                           density_at(2.0), density_at(1.0))) +
          "run 200\n";

  for (const auto &[id, row] : script.points()) {
    const double y = row[Y];
    const double expected = y < 1.5 ? 1.5 * weight_at(2.0) + (1.5 - y) * weight_at(1.0)
                                    : (3.0 - y) * weight_at(2.0);
    EXPECT_NEAR(row[SYY_2D], -expected, 1e-9 * expected);
    EXPECT_NEAR(row[RHO_2D], density_at(y) + n_at(y) * WATER, 1e-6)
        << "with the water in the pores";
    EXPECT_NEAR(row[UY_2D], 0.0, 1e-12);
    EXPECT_EQ(row[P_2D], 0.0) << "the excess over still water";
    EXPECT_NEAR(row[N_2D], n_at(y), 1e-12);
  }
  EXPECT_LT(script.fix_value("soil", UNBALANCED), 1e-12 * 2000 * GRAVITY * 0.25);
}

/// A column without initial stress settles by γ' H²/(2 M'). It begins to fall with the buoyant
/// share of gravity.
TEST(FixMpmWater, SubmergedColumnSettlesUnderItsBuoyantWeight)
{
  const double modulus = 1e9 * 0.7 / (1.3 * 0.4), mass = DRY + POROSITY * WATER;
  const double weight = GRAVITY * (mass - WATER);
  const std::string fixes = SETTINGS + "timestep 2e-4\n" +
      soil("damping 0.3 model all elastic 1e9 0.3 density 1600 water all submerged density 1000 "
           "porosity 0.4");
  SoilScript first, last;
  first << GROUND + fixes + "run 1\n";
  last << GROUND + fixes + "run 3000\n";

  for (const auto &[id, row] : first.points())
    if (row[Y] > 2.0) { EXPECT_NEAR(row[4], -weight / mass * 2e-4, 1e-9 * GRAVITY * 2e-4) << "vy"; }
  for (const auto &[id, row] : last.points()) {
    const double y = row[Y] - row[UY_2D];
    // strains are 1.4e-5; the points of a GIMP column carry the mean stress of their boxes
    EXPECT_NEAR(row[SYY_2D], -weight * (3.0 - y), 1e-4 * weight * 3.0);
    EXPECT_NEAR(row[UY_2D], -weight / modulus * (3.0 * y - 0.5 * y * y),
                0.01 * weight / modulus * 4.5);
  }
}

/// Terzaghi's consolidation of a column that is drained at its surface. Its pressures are those of
/// the undrained load at the beginning.
TEST(FixMpmWater, LoadedColumnConsolidates)
{
  // 2 by 6 cells of 0.5, one point per cell; M' = E with a Poisson's ratio of 0, K_w/n = 25 M'
  const double ratio = 25.0, load = 1000.0, diffusivity = 1e-3 / (WATER * GRAVITY) * 1e7 / 1.04;
  const double time = 0.3 * 9.0 / diffusivity;    // T = 0.3
  SoilScript script;
  script << GROUND + SETTINGS +
          "unfix gravity\ntimestep 4e-4\n"
          "region surface block 0 1 2.5 3 -0.05 0.05 units box\ngroup surface region surface\n" +
          soil(fmt::format(
                   "damping 0.1 model all elastic 1e7 0 density 1600 water all flows kw 1e8 "
                   "conductivity 1e-3 gravity 9.81 density 1000 porosity 0.4 "
                   "traction surface 0 -1000") +
               WET_COLUMNS) +
          fmt::format("run {}\n", (int) std::lround(time / 4e-4));

  const double p0 = load * ratio / (1.0 + ratio);
  for (const auto &[id, row] : script.points()) {
    double expected = 0.0;
    for (int m = 0; m < 20; m++) {
      const double M = 0.5 * 3.14159265358979323846 * (2 * m + 1);
      const double depth = 3.0 - (row[Y] - row[UY_2D]);
      expected += 2.0 / M * std::sin(M * depth / 3.0) * std::exp(-M * M * 0.3);
    }
    EXPECT_NEAR(row[P_2D], p0 * expected, 0.02 * p0) << "six cells";
    EXPECT_NEAR(row[P_2D] - row[SYY_2D], load, 0.02 * load) << "total stress";
  }
}

namespace {

/// Expects points with the same bits after 300 steps on all ranks, on one rank, and with a restart
/// on another grid of ranks, and returns them.
Script::Rows expect_same_bits(const std::string &fixes)
{
  SoilScript whole, alone(MPI_COMM_SELF), first, second;
  whole << GROUND + fixes + "run 300\n";
  alone << GROUND + fixes + "run 300\n";
  first << GROUND + fixes + "run 100\nwrite_restart test_water.restart\n";
  second << "processors 1 * 1\nread_restart test_water.restart\npair_style none\n" + fixes +
          "run 200\n";

  EXPECT_EQ(whole.points(), alone.points());
  EXPECT_EQ(whole.points(), second.points());
  return alone.points();
}

}    // namespace

TEST(FixMpmWater, FlowHasTheSameBitsOnRanksAndAfterARestart)
{
  const std::string fixes = SETTINGS +
      soil("model all mohr_coulomb 1e7 0.3 0 30 0 density 1600 water all flows kw 1e8 conductivity "
           "1e-3 gravity 9.81 density 1000 porosity 0.4 cavitation 1e3 drained ylo insitu gravity "
           "9.81 k0 0.5 surcharge 3000 water_table 2.0" +
           WET_COLUMNS + " column water_volume");
  const Script::Rows points = expect_same_bits(fixes);
  double lost = 0.0;
  for (const auto &[id, row] : points)
    if (row[Y] < 2.0) lost += 0.25 * POROSITY - row.back();
  EXPECT_GT(lost, 1e-5) << "the base is drained";
}

TEST(FixMpmWater, PorosityMayBeAVariableAndTheGroupOfWaterAPart)
{
  SoilScript script;
  script << GROUND + SETTINGS +
          "variable n atom 0.3+0.02*y\nregion low block 0 1 0 1 -0.05 0.05 units box\n"
          "group low region low\n" +
          soil(SAND + "water low undrained kw 1e8 density 1000 porosity v_n" + WET_COLUMNS) +
          "run 0\n";

  for (const auto &[id, row] : script.points()) {
    const double n = row[Y] < 1.0 ? 0.3 + 0.02 * row[Y] : 0.0;
    EXPECT_NEAR(row[N_2D], n, 1e-12);
    EXPECT_NEAR(row[RHO_2D], DRY + n * WATER, 1e-6);
  }
}

TEST(FixMpmWater, RanksGiveTheSameBitsAndARestartContinuesThem)
{
  const std::string fixes = SETTINGS +
      soil("model all mohr_coulomb 1e7 0.3 0 30 0 density 1600 " + SATURATED +
           "cavitation 1e3 insitu gravity 9.81 k0 0.5 surcharge 3000 water_table 2.0" +
           WET_COLUMNS);
  expect_same_bits(fixes);
}

TEST(FixMpmWater, SpheresGiveThePorosityAndStayAtRestToTheSameBits)
{
  const std::string fixes = soil_in_space();
  SoilScript together, alone(MPI_COMM_SELF), first, second;
  together << GROUND_IN_SPACE + fixes + "run 30\n";
  alone << GROUND_IN_SPACE + fixes + "compute e all rve/atom void_ratio\nrun 30\n";
  first << GROUND_IN_SPACE + fixes + "run 10\nwrite_restart test_water.restart\n";
  second << "processors 1 1 *\nread_restart test_water.restart\npair_style none\n" + fixes +
          "run 20\n";

  EXPECT_EQ(together.points(), alone.points());
  EXPECT_EQ(second.points(), alone.points());
  EXPECT_LT(alone.fix_value("soil", UNBALANCED), 1e-3 * 1500 * GRAVITY * 0.125);
  const auto void_ratios = alone.compute("e");
  for (const auto &[id, row] : alone.points()) {
    const double e = void_ratios.at(id);
    EXPECT_NEAR(row[N_3D], e / (1.0 + e), 1e-9) << "porosity follows the volume as the RVE does";
    EXPECT_NEAR(row[P_3D], row[Z] < 2.5 ? WATER * GRAVITY * (2.5 - row[Z]) : 0.0, 30.0)
        << "K_w/n times strains of the ground that finds its rest, 1e-7";
    EXPECT_NEAR(row[SXX_3D], 0.6 * row[SZZ_3D], 5e-3 * std::abs(row[SZZ_3D])) << id;
    EXPECT_LT(std::abs(row[UZ_3D]), 1e-6);
  }
}

namespace {

/// A cell with eight points, each with an RVE. Three sides of the cell are smooth walls and three
/// are smooth plates, so that the motion of all nodes is prescribed. The stretches of a step are
/// exp(2 r), exp(-r) and exp(-r): the volume is constant to round-off.
std::string cell_at_constant_volume(const std::string &water)
{
  return "units si\ndimension 3\nboundary f f f\natom_style sphere\natom_modify map array\n"
         "region box block 0 2 0 2 0 2 units box\ncreate_box 2 box\nlattice sc 0.5 origin 0.5 0.5 "
         "0.5\nregion ground block 0 1 0 1 0 1 units box\ncreate_atoms 1 region ground\n"
         "create_atoms 2 single 1.25 0.25 0.25 units box\ncreate_atoms 2 single 1.75 0.75 0.75 "
         "units box\ngroup px id 9 10\n"
         "create_atoms 2 single 0.25 1.25 0.25 units box\ncreate_atoms 2 single 0.75 1.75 0.75 "
         "units box\ngroup py id 11 12\n"
         "create_atoms 2 single 0.25 0.25 1.25 units box\ncreate_atoms 2 single 0.75 0.75 1.75 "
         "units box\ngroup pz id 13 14\ngroup ground type 1\nset group all diameter 0.5\n"
         "neighbor 1.0 bin\ncomm_modify cutoff 2.0\ntimestep $(2^(-15))\n"
         "fix grains ground rve " +
      spheres() +
      " dt $(2^(-19)) substeps 16 device cpu threads 1 format double drive mpm\n"
      "variable w equal (exp(4*dt)-1)/dt\nvariable vz equal (exp(-8*dt)-1)/dt\n"
      "fix soil all mpm 1.0 shape linear points_per_cell 8 model ground rve grains density 2000 "
      "boundary xlo roller boundary ylo roller boundary zlo roller "
      "rigid px vx v_w vy 0 vz 0 smooth face xlo rigid py vx 0 vy v_w vz 0 smooth face ylo "
      "rigid pz vx 0 vy 0 vz v_vz smooth face zlo cfl 1 10 " +
      water +
      "\ncompute sxx all rve/atom sxx\ncompute syy all rve/atom syy\ncompute szz all "
      "rve/atom szz\n";
}

}    // namespace

/// Pore water does not change the grains of a cell whose motion is prescribed. At constant volume
/// their stress is that of the undrained path of fix rve.
TEST(FixMpmWater, CellAtConstantVolumeIsTheUndrainedPathOfFixRve)
{
  // so light a water does not change masses
  SoilScript wet, dry;
  wet << cell_at_constant_volume("water ground undrained kw 2e8 density 1e-20 porosity rve" +
                                 WET_COLUMNS) +
          "run 40\n";
  dry << cell_at_constant_volume("") + "run 40\n";
  grains_script::GrainsScript driven;
  driven << "units si\ndimension 3\nboundary p p p\natom_style atomic\natom_modify map array\n"
            "region box block 0 4 0 4 0 4\ncreate_box 1 box\nmass 1 1.0\n"
            "create_atoms 1 single 1 1 1\ntimestep $(2^(-15))\nfix grains all rve " +
          spheres() +
          " dt $(2^(-19)) substeps 16 device cpu threads 1 format double "
          "path stage rate zz -8 rate volume 0 rate xx-yy 0 until time > 1 path_end halt\n"
          "compute sxx all rve/atom sxx\ncompute syy all rve/atom syy\ncompute szz all "
          "rve/atom szz\nrun 40\n";

  for (const char *id : {"sxx", "syy", "szz"}) {
    const auto found = wet.compute(id);
    const auto without_water = dry.compute(id);
    const double expected = driven.compute(id).at(1);
    EXPECT_GT(std::abs(expected), 1e3);
    for (int atom = 1; atom <= 8; ++atom) {
      EXPECT_NEAR(found.at(atom), expected, 1e-9 * std::abs(expected)) << id;
      EXPECT_NEAR(found.at(atom), without_water.at(atom), 1e-12 * std::abs(expected))
          << "the forces of the water change the scale to which momenta of nodes are rounded";
    }
  }
  const auto points = wet.points();
  for (int atom = 1; atom <= 8; ++atom)
    EXPECT_NEAR(points.at(atom)[P_3D], 0.0, 1e-4) << "1e-14 of volume in 40 steps, times K_w/n";
}

TEST(FixMpmWater, LogHasItsRangesAndWarnsOfSoftWaterAndCavitation)
{
  const std::string still = "insitu gravity 9.81 k0 0.5 water_table 2.0";
  EXPECT_IN(
      "fix mpm soil: 8 points have water: porosity 0.4 to 0.4, pore pressure 2452 to 1.717e+04 "
      "[stress]",
      log_of(GROUND + SETTINGS + soil(SAND + SATURATED + still) + "run 0"));
  EXPECT_IN(
      "is 2.79 times the P-wave modulus of the ground, below 10, so that the grains carry 26 % "
      "of an undrained load; use a higher kw",
      log_of(GROUND + SETTINGS +
             soil(SAND + "water all undrained kw 1.5e7 density 1000 porosity 0.4 " + still) +
             "run 0"));
  EXPECT_IN("no point has water, because none of the group is below the water table",
            log_of(GROUND + SETTINGS +
                   soil(SAND + SATURATED + "insitu gravity 9.81 k0 0.5 water_table -1") + "run 0"));
  EXPECT_IN("points is at the limit of cavitation, 0 [stress]",
            log_of(GROUND + SETTINGS + "velocity all ramp vy 0 0.01 y 0 3\n" +
                   soil(SAND + SATURATED + "cavitation 0") + "run 5"));
}

TEST(FixMpmWaterErrors, AreReported)
{
  const auto of = [](const std::string &arguments) {
    return message_of(GROUND + SETTINGS + soil(arguments) + "run 0\n");
  };
  const std::string begin = SAND + "water all undrained ";
  EXPECT_IN(
      "water has 'drained' instead of undrained; it must read: water group-ID undrained kw "
      "value density value porosity value | rve [cavitation value], or group-ID flows kw value "
      "conductivity value",
      of(SAND + "water all drained kw 1e8"));
  EXPECT_IN("water has '1e8' instead of kw", of(begin + "1e8"));
  EXPECT_IN("kw is 0 [stress]; it must be greater than 0", of(begin + "kw 0"));
  EXPECT_IN("density is -1 [mass/length^3]; it must be greater than 0",
            of(begin + "kw 1e8 density -1"));
  EXPECT_IN("porosity", of(begin + "kw 1e8 density 1000 porosity 1.5"));
  EXPECT_IN("the porosity of atom 1 is 0.005 [-]; it must be at least 0.01 and below 1 (atoms with "
            "an invalid value: 12)",
            of(begin + "kw 1e8 density 1000 porosity 0.005"));
  EXPECT_IN("porosity rve needs RVEs of spheres, but atom 1 has no RVE; give the porosity as a "
            "number (atoms without an RVE of spheres: 12)",
            of(begin + "kw 1e8 density 1000 porosity rve"));
  EXPECT_IN("water cavitation is -5 [stress]; it must be at least 0",
            of(begin + "kw 1e8 density 1000 porosity 0.4 cavitation -5"));
  EXPECT_IN("group", of(SAND + "water nobody undrained kw 1e8 density 1000 porosity 0.4"));
  EXPECT_IN("insitu water_table needs the keyword water",
            of(SAND + "insitu gravity 9.81 k0 0.5 water_table 2"));
  EXPECT_IN("column pore_pressure needs the keyword water", of(SAND + "column pore_pressure"));
  EXPECT_IN("the effective vertical pressure of atom",
            of(SAND + SATURATED + "insitu gravity 9.81 k0 0.5 water_table 30"));
  EXPECT_IN("insitu needs gravity and k0",
            of(SAND + SATURATED + "insitu stress -1 -1 0 water_table 2"));
  const std::string flows = SAND + "water all flows ";
  EXPECT_IN("water has 'density' instead of conductivity", of(flows + "kw 1e8 density 1000"));
  EXPECT_IN("conductivity is 0 [length/time]; it must be greater than 0",
            of(flows + "kw 1e8 conductivity 0"));
  EXPECT_IN("water has 'density' instead of gravity",
            of(flows + "kw 1e8 conductivity 1e-3 density 1000"));
  EXPECT_IN("the flow number of the water, 2 D dt k (kw/n)/(density gravity h^2), is 8.155",
            of(flows + "kw 1e8 conductivity 0.1 gravity 9.81 density 1000 porosity 0.4"));
  EXPECT_IN("must be below 2.452e-05 [time]",
            of(flows + "kw 1e8 conductivity 0.1 gravity 9.81 density 1000 porosity 0.4"));
  EXPECT_IN("water that flows needs the scheme musl",
            of(flows +
               "kw 1e8 conductivity 1e-3 gravity 9.81 density 1000 porosity 0.4 scheme "
               "usavg"));
  EXPECT_IN("water submerged has no water_table",
            of(SAND +
               "water all submerged density 1000 porosity 0.4 insitu gravity 9.81 k0 0.5 "
               "water_table 2"));
  EXPECT_IN("the density of atom 1 with its water is 800 [mass/length^3]; submerged ground must be "
            "denser than water, 1000 (atoms with an invalid value: 12)",
            of("model all elastic 1e7 0.3 density 400 water all submerged density 1000 porosity "
               "0.4"));
  const std::string disks = GROUND + SETTINGS + "fix grains all rve " + grains_script::PACKING +
      " drive mpm threads 1 device cpu\n" +
      soil("model all rve grains water all undrained kw 1e8 density 1000 porosity rve") + "run 0\n";
  EXPECT_IN("atom 1 has disks, which only give the area of their voids; give the porosity as a "
            "number",
            message_of(disks));
  // the time step 2e-4 is too large for real water: c = 1669 m/s
  EXPECT_IN("the Courant number is", of(begin + "kw 2.2e9 density 1000 porosity 0.4 cfl 0.1 0.5"));
}

TEST(FixMpmWaterErrors, RestartFilesWithAndWithoutWaterAreNotMixed)
{
  const std::string file = file_of_rank("water.restart");
  const std::string read = "read_restart " + file + "\npair_style none\n" + SETTINGS;
  Script(MPI_COMM_SELF) << GROUND + SETTINGS + soil(SAND + SATURATED) + "run 1\nwrite_restart " +
          file + "\n";
  EXPECT_IN("the points of the restart file have the numbers water_volume grain_volume "
            "initial_pore_pressure initial_vertical_stress, but those of the script have no water; "
            "give the keyword water",
            message_of(read + soil(SAND) + "run 1\n"));
  Script(MPI_COMM_SELF) << GROUND + SETTINGS + soil(SAND) + "run 1\nwrite_restart " + file + "\n";
  EXPECT_IN(
      "the points of the restart file have no water, but those of the script have the numbers",
      message_of(read + soil(SAND + SATURATED) + "run 1\n"));
  std::remove(file.c_str());
}
