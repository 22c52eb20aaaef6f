// SPDX-License-Identifier: GPL-2.0-only
// fix mpm in dimension 3 through LAMMPS scripts: physics in closed form, RVEs of spheres as its
// material, bitwise equal results on any number of ranks and after a restart, and messages for
// wrong input. Also runs under mpirun.

#include "comm.h"
#include "grains_script.h"
#include "rve/engine/packing_io.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

using namespace LAMMPS_NS;

namespace {

// The enumerators are column indices of the per-atom array of the fix, from 0. The constants are
// lengths of parts of its global vector: HEAD values at the beginning, PER_BODY values of each
// body, TIMES wall times, DAMPING components of the damping force, and PER_TURNING_BODY values of
// each rotating body.
enum { UX, UZ = 2, U, SXX, SYY, SZZ, SXY, SXZ, SYZ, P, Q, EPS_V, EPS_Q, RHO, FXX, FZZ = FXX + 8 };
enum { PLASTIC = FZZ + 1, COLUMNS };
constexpr int HEAD = 4, PER_BODY = 6, TIMES = 3, DAMPING = 3, PER_TURNING_BODY = 12;

class SoilScript : public Script {
 public:
  using Script::Script;

  Fix *fix() { return lmp->modify->get_fix_by_id("soil"); }

  /// Returns positions, velocities and columns of the fix by atom ID on every rank.
  Rows points()
  {
    const Atom *atom = lmp->atom;
    return rows_by_id(6 + COLUMNS, [&](int i, std::vector<double> &list) {
      list.insert(list.end(), atom->x[i], atom->x[i] + 3);
      list.insert(list.end(), atom->v[i], atom->v[i] + 3);
      list.insert(list.end(), fix()->array_atom[i], fix()->array_atom[i] + COLUMNS);
    });
  }
  static double column(const std::vector<double> &row, int k) { return row[6 + k]; }

  /// Returns the global vector without the wall times. Its last entries belong to the rotating
  /// bodies, whose number is `turning_bodies`.
  std::vector<double> vector(int turning_bodies = 0)
  {
    std::vector<double> values;
    const int times = fix()->size_vector - TIMES - DAMPING - PER_TURNING_BODY * turning_bodies;
    for (int k = 0; k < fix()->size_vector; ++k)
      if (k < times || k >= times + TIMES) values.push_back(fix()->compute_vector(k));
    return values;
  }
};

/// Settings that a restart file does not store.
const std::string SETTINGS =
    "pair_style none\ncomm_modify cutoff 1.0\nneighbor 0.5 bin\nneigh_modify every 5 delay 0 check "
    "no\nthermo_modify lost error\n";

/// Returns a box with nx by ny by nz cells of edge 1, with one point of type 1 in each cell. Above
/// these cells the box has `room` layers of empty cells.
std::string points_in_box(int nx, int ny, int nz, int room = 2)
{
  const std::string x = std::to_string(nx), y = std::to_string(ny), z = std::to_string(nz);
  return "units si\ndimension 3\nboundary f f f\natom_style sphere\natom_modify map array\n"
         "region box block 0 " +
      x + " 0 " + y + " 0 " + std::to_string(nz + room) +
      " units box\ncreate_box 2 box\nlattice sc 1.0 origin 0.5 0.5 0.5\nregion ground block 0 " +
      x + " 0 " + y + " 0 " + z +
      " units box\ncreate_atoms 1 region ground\nset group all diameter 1.0\n" + SETTINGS;
}

/// Returns a quarter of a square footing on elastic ground with a frictional upper layer. The
/// footing is pressed down, and a surcharge acts next to it. Points migrate between ranks.
std::string footing()
{
  return points_in_box(5, 5, 4) +
      "region plate block 0 2 0 2 4 5 units box\ncreate_atoms 2 region plate\nset type 2 diameter "
      "1.0\n"
      "group plate type 2\nregion low block INF INF INF INF 0 2 units box\n"
      "group low region low\ngroup ground type 1\ngroup upper subtract ground low\n"
      "region top block INF INF 2.01 INF 3 4 units box\ngroup surface region top\n"
      "timestep 0.005\nfix g all gravity 9.81 vector 0 0 -1\n"
      "fix soil all mpm 1.0 model low elastic 1.0e7 0.3 model upper mohr_coulomb 1.0e7 0.3 5000 25 "
      "5 density 2000 stress -20000 -20000 -30000 0 0 0 boundary xlo roller boundary xhi roller "
      "boundary ylo roller boundary yhi fixed boundary zlo fixed damping 0.05 "
      "rigid plate vx 0.02 vy 0 vz -0.3 rough separation yes round yes traction surface 100 0 "
      "-20000\n";
}

/// Returns a ball that falls on elastic ground next to a wall. The wall rotates about an oblique
/// axis through its foot. `form` is the keyword value for the shape of the ball.
std::string falling_body_and_turning_wall(const std::string &form)
{
  // Ranks divide z, so that atoms get the same numbers on any number of ranks.
  return "processors 1 1 *\n" + points_in_box(9, 4, 3, 5) +
      "region ball sphere 5.4 2.1 5.2 1.3\nregion wall block 1 2 1 3 3 7 units box\n"
      "create_atoms 2 region ball\ncreate_atoms 2 region wall\nset group all diameter 1.0\n"
      "group ground region ground\ngroup ball region ball\ngroup wall region wall\n"
      "timestep 0.005\nfix g all gravity 9.81 vector 0 0 -1\nvelocity ball set 0.3 0.1 -0.5\n"
      "variable tip equal 0.2*(step>20)\nvariable lean equal -0.05*(step>20)\n"
      "fix soil all mpm 1.0 model ground elastic 1.0e6 0.3 density 2000 damping 0.02 "
      "boundary xlo roller boundary xhi roller boundary ylo roller boundary yhi roller boundary "
      "zlo fixed rigid ball vx free vy free vz free friction 0.5 form " +
      form +
      " spin free free free rigid wall vx 0 vy 0 vz 0 rough form box separation yes spin v_lean "
      "v_tip 0.01 pivot 1 2 3\n";
}

void expect_same_bits_on_ranks_and_after_a_restart(const std::string &scene)
{
  SoilScript together, alone(MPI_COMM_SELF);
  together << scene + "run 120\n";
  alone << scene + "run 120\n";
  EXPECT_EQ(together.points(), alone.points());
  EXPECT_EQ(together.vector(2), alone.vector(2));

  // The last numbers are velocity, spin, angles and torque of the ball and of the wall.
  const std::vector<double> all = alone.vector(2);
  const double *ball = all.data() + all.size() - 2 * PER_TURNING_BODY,
               *wall = ball + PER_TURNING_BODY;
  for (int k = 0; k < 12; ++k) EXPECT_NE(ball[k], 0.0) << k;
  for (int k = 3; k < 9; ++k) EXPECT_NE(wall[k], 0.0) << k;

  const std::string file = "test_fix_mpm_space_bodies.restart";
  SoilScript first, second;
  first << scene + "run 70\nwrite_restart " + file + "\n";
  second << "read_restart " + file + "\n" + SETTINGS + scene.substr(scene.find("timestep")) +
          "run 50\n";
  EXPECT_EQ(second.points(), alone.points());
  EXPECT_EQ(second.vector(2), alone.vector(2));
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove(file.c_str());
}

/// Returns a packing file of this rank with 125 moving spheres.
std::string spheres()
{
  const std::string path = file_of_rank("disorder.rve");
  rve::write_packing(path, rve_test::disordered_spheres(rve_test::spheres_material(), 5, 7));
  return path;
}

}    // namespace

TEST(FixMpmInSpace, UniformStressUnderTractionsOnThreeFacesIsInEquilibrium)
{
  for (const auto &edge : {std::string("1"), std::string("2")})
    for (const auto &shape : {std::string("gimp"), std::string("linear")}) {
      std::string scene = points_in_box(4, 3, 4);
      const std::string usual = "lattice sc 1.0 origin 0.5 0.5 0.5";
      scene.replace(scene.find(usual), usual.size(),
                    "lattice sc " + std::to_string(1.0 / std::stod(edge)) + " origin 0.5 0.5 0.5");
      SoilScript script;
      script << "variable e equal " + edge + "\n" + scene +
              "variable low equal 1/${e}\nregion right block $(4-v_low) INF INF INF INF INF units "
              "box\n"
              "region back block INF INF $(3-v_low) INF INF INF units box\n"
              "region top block INF INF INF INF $(4-v_low) 4 units box\ntimestep 0.001\n"
              "fix soil all mpm 1.0 domain 0 6 0 5 0 6 shape " +
              shape +
              " points_per_cell $(v_e^3) model all elastic 1.0e6 0.3 density 2000 stress -20000 "
              "-30000 -40000 1000 -2000 3000 boundary xlo fixed boundary ylo fixed boundary zlo "
              "fixed traction right -20000 1000 -2000 face xhi traction back 1000 -30000 3000 face "
              "yhi traction top -2000 3000 -40000\nrun 0\n";

      EXPECT_LT(script.fix()->compute_vector(0), 1e-6 * 40000)
          << shape << ", " << edge << " points per cell edge";
      EXPECT_NEAR(script.fix()->compute_vector(3), 2000 * 48.0, 1e-6);
    }
}

TEST(FixMpmInSpace, FallsFreelyUnderFixGravity)
{
  SoilScript script;
  script << points_in_box(3, 3, 3, 6) +
          "fix soil all mpm 1.0 model all elastic 1.0e5 0.3 density 1000\ntimestep 0.001\n"
          "fix g all gravity 9.81 vector 1 2 2\nvelocity all set 0 0 0\nrun 100\n";

  for (const auto &[id, row] : script.points()) {
    EXPECT_NEAR(row[3], 0.981 / 3.0, 1e-6);
    EXPECT_NEAR(row[5], 0.981 * 2.0 / 3.0, 1e-6);
    EXPECT_NEAR(script.column(row, UZ), 0.5 * 0.0981 * 1.01 * 2.0 / 3.0, 1e-6) << "leaps";
  }
}

TEST(FixMpmInSpace, ColumnsAreThoseOfAHomogeneousDeformation)
{
  // The ground is so heavy that its stress does not move it. The velocities stay v = L X, with the
  // velocity gradient L and the initial position X, and F = 1 + L t. The test reads the middle of 4
  // x 4 x 4 points after one step.
  SoilScript script;
  script << points_in_box(4, 4, 4) +
          "variable vx atom 0.02*x+0.01*y\nvariable vy atom -0.03*z\nvariable vz "
          "atom 0.04*x-0.01*z\nvelocity all set v_vx v_vy v_vz\ntimestep 0.01\n"
          "fix soil all mpm 1.0 model all elastic 1.0e6 0.25 density 1e12 cfl 0.9 1.0\nrun 1\n";

  const double dt = 0.01;
  const double L[3][3] = {{0.02, 0.01, 0.0}, {0.0, 0.0, -0.03}, {0.04, 0.0, -0.01}};
  int inside = 0;
  for (const auto &[id, row] : script.points()) {
    const double *x = row.data(), *c = row.data() + 6;
    if (std::abs(x[0] - 2) > 1 || std::abs(x[1] - 2) > 1 || std::abs(x[2] - 2) > 1) continue;
    ++inside;
    double square = 0.0;
    for (int a = 0; a < 3; ++a) square += c[UX + a] * c[UX + a];
    EXPECT_NEAR(c[U], std::sqrt(square), 1e-15);
    EXPECT_NEAR(c[UZ], dt * (0.04 * x[0] - 0.01 * x[2]), 1e-6);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        EXPECT_NEAR(c[FXX + 3 * a + b], (a == b) + dt * L[a][b], 1e-12) << a << b;
    // E = 1e6 and nu = 1/4 give lambda = mu = 4e5. Terms of second order in L dt are smaller by a
    // factor of order L dt.
    const double tr = 0.01, m = 4e5 * dt, tolerance = 1e-3 * m * 0.04;
    EXPECT_NEAR(c[SXX], m * (tr + 2 * 0.02), tolerance);
    EXPECT_NEAR(c[SYY], m * tr, tolerance);
    EXPECT_NEAR(c[SZZ], m * (tr - 2 * 0.01), tolerance);
    EXPECT_NEAR(c[SXY], m * 0.01, tolerance);
    EXPECT_NEAR(c[SXZ], m * 0.04, tolerance);
    EXPECT_NEAR(c[SYZ], m * -0.03, tolerance);
    EXPECT_NEAR(c[P], -(c[SXX] + c[SYY] + c[SZZ]) / 3, 1e-9);
    const double xx = c[SXX] - c[SYY], yy = c[SYY] - c[SZZ], zz = c[SZZ] - c[SXX];
    const double shear = c[SXY] * c[SXY] + c[SXZ] * c[SXZ] + c[SYZ] * c[SYZ];
    EXPECT_NEAR(c[Q], std::sqrt(0.5 * (xx * xx + yy * yy + zz * zz) + 3 * shear), 1e-9)
        << "von Mises";
    EXPECT_NEAR(c[EPS_V], dt * tr, 1e-12);
    // For an isotropic law, q = 3 mu eps_q.
    EXPECT_NEAR(c[EPS_Q], c[Q] / (3 * 4e5), 2e-3 * c[EPS_Q]);
    EXPECT_NEAR(c[RHO], 1e12 / (1 + dt * tr), 1e-6 * 1e12);
    EXPECT_EQ(c[PLASTIC], 0.0);
  }
  EXPECT_EQ(inside, 8);
  EXPECT_EQ(script.fix()->size_peratom_cols, (int) COLUMNS);
}

TEST(FixMpmInSpace, PlateReactionIsOedometricModulusTimesStrain)
{
  SoilScript script;
  script << points_in_box(2, 2, 6) +
          "region plate block 0 2 0 2 6 7 units box\ncreate_atoms 2 region plate\nset type 2 "
          "diameter 1.0\n"
          "group ground type 1\ngroup plate type 2\ntimestep 0.01\n"
          "variable vz equal ramp(0,-0.02)\n"
          "fix soil all mpm 1.0 model ground elastic 1.0e6 0.25 density 2000 damping 0.1 boundary "
          "xlo roller boundary xhi roller boundary ylo roller boundary yhi roller boundary zlo "
          "fixed rigid plate vx 0 vy 0 vz v_vz smooth\nrun 600\n";

  const double strain = 0.5 * 0.02 * 6.0 / 6.0;    // velocity ramp over 6 s; height 6
  const double modulus = 1.0e6 * 0.75 / (1.25 * 0.5);
  EXPECT_NEAR(script.fix()->compute_vector(HEAD + 2), 4.0 * modulus * strain,
              0.04 * 4.0 * modulus * strain);
  EXPECT_NEAR(script.fix()->compute_vector(HEAD + 5), -0.01 * 0.02 / 600 * 0.5 * 600 * 601, 1e-12)
      << "of velocities at the ends of steps";
}

TEST(FixMpmInSpace, RanksGiveTheSameBits)
{
  const std::string scene = footing() + "run 150\n";
  SoilScript together, alone(MPI_COMM_SELF);
  together << scene;
  alone << scene;

  EXPECT_GT(alone.fix()->compute_vector(HEAD + 2), 1e4) << "the footing feels something";
  double plastic = 0.0;
  for (const auto &[id, row] : alone.points()) plastic += alone.column(row, PLASTIC);
  EXPECT_GT(plastic, 0.01) << "the layer yields";
  EXPECT_EQ(together.points(), alone.points());
  EXPECT_EQ(together.vector(), alone.vector());
}

TEST(FixMpmInSpace, RestartContinuesBitForBit)
{
  const std::string scene = footing(), file = "test_fix_mpm_space.restart";
  SoilScript whole, first, second;
  whole << scene + "run 100\n";
  first << scene + "run 37\nwrite_restart " + file + "\n";
  second << "read_restart " + file + "\n" + SETTINGS + "timestep 0.005\n" +
          scene.substr(scene.find("fix g")) + "run 63\n";

  EXPECT_EQ(whole.points(), second.points());
  EXPECT_EQ(whole.vector(), second.vector());
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove(file.c_str());
}

TEST(BodiesInSpace, FreeBallAndTurningWallHaveTheSameBitsOnRanksAndAfterARestart)
{
  expect_same_bits_on_ranks_and_after_a_restart(falling_body_and_turning_wall("ball"));
}

TEST(BodiesInSpace, FreeOctahedronAndTurningWallHaveTheSameBitsOnRanksAndAfterARestart)
{
  expect_same_bits_on_ranks_and_after_a_restart(falling_body_and_turning_wall(
      "convex 6 3.6 2.1 5.2 7.2 2.1 5.2 5.4 0.4 5.2 5.4 3.8 5.2 5.4 2.1 3.4 5.4 2.1 7"));
}

// ---- RVEs of spheres as the material ------------------------------------------------------------

namespace {

const std::string STRESSES = [] {
  std::string lines;
  for (const char *c : {"xx", "yy", "zz", "xy", "xz", "yz"})
    lines += std::string("compute s") + c + " all rve/atom s" + c + "\n";
  return lines;
}();

/// Returns a cell with eight points, each with an RVE. Three sides of the cell are smooth walls,
/// and three are smooth plates. A step of 2^-15 s has 16 DEM steps.
std::string pressed_cell(const std::string &packing)
{
  return "units si\ndimension 3\nboundary f f f\natom_style sphere\natom_modify map array\n"
         "region box block 0 2 0 2 0 2 units box\ncreate_box 2 box\nlattice sc 0.5 origin 0.5 0.5 "
         "0.5\n"
         "region ground block 0 1 0 1 0 1 units box\ncreate_atoms 1 region ground\n"
         "create_atoms 2 single 1.75 0.25 0.25 units box\ncreate_atoms 2 single 1.75 0.75 0.75 "
         "units box\ncreate_atoms 2 single 1.25 0.75 0.75 units box\n"
         "group px id 9 10 11\n"
         "create_atoms 2 single 0.25 1.25 0.25 units box\ncreate_atoms 2 single 0.75 1.75 0.75 "
         "units box\ngroup py id 12 13\n"
         "create_atoms 2 single 0.25 0.25 1.25 units box\ncreate_atoms 2 single 0.75 0.75 1.75 "
         "units box\ngroup pz id 14 15\ngroup ground type 1\nset group all diameter 0.5\n" +
      SETTINGS + "timestep $(2^(-15))\nfix grains ground rve " + packing +
      " dt $(2^(-19)) substeps 16 device cpu threads 1 format double drive mpm\n"
      "fix soil all mpm 1.0 shape linear points_per_cell 8 model ground rve grains density 2000 "
      "boundary xlo roller boundary ylo roller boundary zlo roller "
      "rigid px vx -8 vy 0 vz 0 smooth face xlo rigid py vx 0 vy 4 vz 0 smooth face ylo "
      "rigid pz vx 0 vy 0 vz -16 smooth face zlo cfl 1 10\n" +
      STRESSES;
}

}    // namespace

TEST(SpheresInSpace, StrainByThreePlatesGivesTheStressOfFixRveAlone)
{
  // The cell edge is 1, so the velocity v of a plate is the velocity gradient along its axis in
  // each step. The stretch of a step is 1 + v dt. fix rve gets the rate ln(1 + v dt)/dt, whose
  // exponential gives the same stretch.
  const int steps = 40;
  const std::string packing = spheres();
  SoilScript pressed;
  pressed << pressed_cell(packing) + "run " + std::to_string(steps) + "\n";
  grains_script::GrainsScript driven;
  driven << "units si\ndimension 3\nboundary p p p\natom_style atomic\natom_modify map array\n"
            "region box block 0 4 0 4 0 4\ncreate_box 1 box\nmass 1 1.0\n"
            "create_atoms 1 single 1 1 1\ntimestep $(2^(-15))\n"
            "variable lx equal ln(1-8*dt)/dt\nvariable ly equal ln(1+4*dt)/dt\n"
            "variable lz equal ln(1-16*dt)/dt\nfix grains all rve " +
          packing +
          " dt $(2^(-19)) substeps 16 device cpu threads 1 format double drive velocity_gradient "
          "xx v_lx "
          "yy v_ly zz v_lz\n" +
          STRESSES + "run " + std::to_string(steps) + "\n";

  double largest = 0.0;
  for (const char *component : {"xx", "yy", "zz", "xy", "xz", "yz"}) {
    const std::string id = std::string("s") + component;
    const double expected = driven.compute(id).at(1);
    largest = std::max(largest, std::abs(expected));
    const auto found = pressed.compute(id);
    for (int atom = 1; atom <= 8; ++atom)
      EXPECT_NEAR(found.at(atom), expected, 1e-9 * largest) << component << " of point " << atom;
  }
  EXPECT_GT(largest, 1e3) << "they are pressed";
  const auto points = pressed.points();
  for (int atom = 1; atom <= 8; ++atom) {
    const double stretch = std::pow(1.0 - 16.0 / 32768.0, steps);
    EXPECT_NEAR(pressed.column(points.at(atom), FZZ), stretch, 1e-12);
    EXPECT_NEAR(pressed.column(points.at(atom), SZZ), driven.compute("szz").at(1), 1e-9 * largest);
  }
}

TEST(SpheresInSpace, HaveTheSameBitsOnAnyNumberOfRanksAndAfterARestart)
{
  const std::string scene = pressed_cell(spheres()), file = "test_spheres_in_space.restart";
  SoilScript whole, alone(MPI_COMM_SELF), first, second;
  // The run is so long that the fix checks the Courant number during it.
  whole << scene + "run 104\n";
  alone << scene + "run 104\n";
  first << scene + "run 9\nwrite_restart " + file + "\n";
  second << "read_restart " + file + "\n" + SETTINGS + "timestep $(2^(-15))\n" +
          scene.substr(scene.find("fix grains")) + "run 95\n";

  EXPECT_EQ(whole.points(), alone.points());
  EXPECT_EQ(whole.points(), second.points());
  EXPECT_EQ(whole.vector(), second.vector());
  for (const char *id : {"sxx", "szz", "sxy", "syz"})
    EXPECT_EQ(whole.compute(id), second.compute(id)) << id;
  MPI_Barrier(MPI_COMM_WORLD);
  std::remove(file.c_str());
}

// ---- wrong input --------------------------------------------------------------------------------

TEST(FixMpmInSpaceMessage, NamesTheArgumentsOfTheThirdAxis)
{
  const std::string scene = points_in_box(2, 2, 2) + "group ground type 1\n";
  const std::string model = "fix soil all mpm 1.0 model all elastic 1e6 0.3 density 2000 ";
  EXPECT_IN("rigid has 'rough' instead of vz; it must read: rigid group-ID vx value vy value vz "
            "value rough | smooth",
            message_of(scene + model + "rigid ground vx 0 vy 0 rough\n"));
  EXPECT_IN("sxx syy szz sxy sxz syz", message_of(scene + model + "stress -1 -1 0\n"));
  EXPECT_IN("round must follow a rigid body", message_of(scene + model + "round yes\n"));
  EXPECT_IN("'zl'", message_of(scene + model + "boundary zl fixed\n"));
  EXPECT_IN("tx ty tz", message_of(scene + model + "traction ground 0 -1\n"));
  EXPECT_IN("xlo xhi ylo yhi zlo zhi", message_of(scene + model + "domain 0 2 0 2\n"));
  EXPECT_IN("volume is 1.5 [length^3]; it must be from 0.0001 to 1 (the volume of a cell)",
            message_of(scene + model + "volume 1.5\n"));
  EXPECT_IN("grid extent in z must be a whole number of cells",
            message_of(scene + model + "domain 0 2 0 2 0 2.5\n"));
}

TEST(FixMpmInSpaceMessage, OfAPeriodicAxisNamesAllThree)
{
  std::string scene = points_in_box(2, 2, 2);
  scene.replace(scene.find("boundary f f f"), 14, "boundary f f p");
  EXPECT_IN("fix mpm soil: the grid is not periodic; use boundary f, s or m in x, y and z",
            message_of(scene + "fix soil all mpm 1.0 model all elastic 1e6 0.3 density 2000\n"));
}

TEST(FixMpmInSpaceMessage, OfOverfullCellsNamesVolumes)
{
  const std::string message = message_of(
      points_in_box(2, 2, 2) + "create_atoms 1 region ground\nset group all diameter 1.0\n" +
      "fix soil all mpm 1.0 model all elastic 1e6 0.3 density 2000\nrun 0\n");
  EXPECT_IN("8 of 8 cells with points, 1 by 1 by 1 [distance] each, contain more than 1.3 times "
            "their volume, the fullest 2 times",
            message);
  EXPECT_IN("Each new point has the volume 1 [distance^3]", message);
}

TEST(FixMpmInSpaceMessage, OfAPointThatLeavesTheGridHasThreeCoordinates)
{
  const std::string message =
      message_of(points_in_box(2, 2, 2) +
                 "velocity all set 0 0 20\ntimestep 0.01\n"
                 "fix soil all mpm 1.0 model all elastic 1e4 0.3 density 2000\nrun 100\n");
  EXPECT_IN("is outside of the grid, x from 0 to 2, y from 0 to 2, z from 0 to 4 [length]",
            message);
}
