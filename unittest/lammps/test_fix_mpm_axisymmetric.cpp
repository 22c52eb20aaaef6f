// SPDX-License-Identifier: GPL-2.0-only
// fix mpm with axisymmetric yes through LAMMPS scripts: masses and forces of a full turn, hoop
// stresses of laws and RVEs of spheres, bitwise equal results on any number of ranks and after a
// restart, and messages for wrong input. The tests also run under mpirun.

#include "comm.h"
#include "grains_script.h"
#include "rve/core/pi.h"
#include "support/tests_of_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

using namespace LAMMPS_NS;

namespace {

// Indices, from 1, of the global vector of a fix with one body that has a face
enum { UNBALANCED = 1, MASS = 4, FORCE_X, FORCE_Y };
// Columns of the per-atom array
enum { SXX = 3, SYY, SXY, P, Q, EPS_V, SZZ = 15, PLASTIC, FIRST_COLUMN };

class SoilScript : public Script {
 public:
  using Script::Script;

  Fix *fix() { return lmp->modify->get_fix_by_id("soil"); }
  /// Returns the columns of all points, then positions and velocities, by atom ID.
  Rows points()
  {
    const Atom *atom = lmp->atom;
    const int columns = fix()->size_peratom_cols;
    return rows_by_id(columns + 4, [&](int i, std::vector<double> &list) {
      list.insert(list.end(), fix()->array_atom[i], fix()->array_atom[i] + columns);
      list.insert(list.end(), {atom->x[i][0], atom->x[i][1], atom->v[i][0], atom->v[i][1]});
    });
  }
};

/// A cylinder of the radius 1 and the height 1 in cells of edge 0.25, with four points each if
/// `spacing` is 0.125, and a disk on it.
std::string cylinder(const std::string &spacing)
{
  return "units si\ndimension 2\nboundary f f p\natom_style sphere\natom_modify map array\n"
         "processors 1 * 1\n"
         "region box block 0 1.5 0 1.5 -0.1 0.1 units box\ncreate_box 2 box\n"
         "lattice sq " +
      spacing +
      " origin 0.5 0.5 0.0\n"
      "region ground block 0 1 0 1 -0.05 0.05 units box\ncreate_atoms 1 region ground\n"
      "region plate block 0 1.25 1 1.25 -0.05 0.05 units box\ncreate_atoms 2 region plate\n"
      "set group all diameter 0.25\ngroup ground type 1\ngroup plate type 2\n"
      "region side block 0.85 1 0 1 -0.05 0.05 units box\n"
      "pair_style none\ncomm_modify cutoff 0.25\nneighbor 0.25 bin\n"
      "neigh_modify every 5 delay 0 check no\nthermo_modify lost error\ntimestep 0.0005\n";
}

const std::string SIDES =
    "axisymmetric yes boundary xlo roller boundary ylo roller rigid plate vx 0 vy v_vy smooth ";

std::string spheres()
{
  static const std::string path = [] {
    Script() << "create_rve test_axisymmetric.rve shape sphere grains 60 radius uniform 0.0025 "
                "0.005 kn 1e5 friction 0.5 density 2650 damping 0.3 pressure 2e4";
    MPI_Barrier(MPI_COMM_WORLD);
    return std::string("test_axisymmetric.rve");
  }();
  return path;
}

struct RemoveFiles : ::testing::Environment {
  void TearDown() override
  {
    if (!rve_test::runs_tests_of(__FILE__)) return;
    MPI_Barrier(MPI_COMM_WORLD);
    int rank;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    if (rank > 0) return;
    for (const char *file :
         {"test_axisymmetric.rve", "test_axisymmetric_disks.rve", "test_axisymmetric.restart"})
      std::remove(file);
  }
};
const auto *const remove_files = ::testing::AddGlobalTestEnvironment(new RemoveFiles);

/// Specimen under the pressure of a membrane, between a smooth base and a smooth disk.
std::string triaxial(const std::string &model)
{
  return "variable vy equal -0.05*((step<400)*step/400+(step>=400))\n" + model + SIDES +
      "pressure side 20000 face xhi column hoop_stress ";
}

std::string of_law()
{
  return cylinder("0.125") +
      triaxial("fix soil all mpm 0.25 device cpu points_per_cell 4 damping 0.1 model ground "
               "mohr_coulomb 1e7 0.3 0 30 0 density 2000 stress -20000 -20000 0 ") +
      "\n";
}

std::string of_spheres()
{
  return cylinder("0.25") +
      triaxial("fix grains ground rve " + spheres() +
               " drive mpm dt auto substeps match packing_image random 1 device cpu threads 1\n"
               "fix soil all mpm 0.25 device cpu model ground rve grains ") +
      "\n";
}

void expect_same_bits_on_ranks_and_after_a_restart(const std::string &scene)
{
  SoilScript whole, alone(MPI_COMM_SELF), first, second;
  whole << scene + "run 60\n";
  alone << scene + "run 60\n";
  EXPECT_EQ(whole.points(), alone.points());
  EXPECT_EQ(whole.fix_value("soil", FORCE_Y), alone.fix_value("soil", FORCE_Y));

  first << scene + "run 35\nwrite_restart test_axisymmetric.restart\n";
  const std::size_t fixes = scene.find("variable vy");
  second << "read_restart test_axisymmetric.restart\npair_style none\ncomm_modify cutoff 0.25\n"
            "neighbor 0.25 bin\nneigh_modify every 5 delay 0 check no\ntimestep 0.0005\n"
            "region side block 0.85 1 0 1 -0.05 0.05 units box\n" +
          scene.substr(fixes) + "run 25\n";
  EXPECT_EQ(whole.points(), second.points());
}

}    // namespace

TEST(Axisymmetric, MassAndForceOnADiskAreThoseOfAFullTurn)
{
  SoilScript script;
  script << cylinder("0.125") +
          "variable vy equal -0.01*(step*dt<0.05)*step*dt/0.05-0.01*(step*dt>=0.05)\n"
          "fix soil all mpm 0.25 device cpu points_per_cell 4 model ground elastic 1e6 0.25 "
          "density 2000 damping 0.1 boundary xhi free " +
          SIDES + "\nrun 800\n";

  EXPECT_NEAR(script.fix_value("soil", MASS), 2000.0 * rve::kPi, 1e-6);
  const double strain = 0.01 * (0.4 - 0.025);    // no lateral stress
  const double force = 1e6 * strain * rve::kPi;
  EXPECT_NEAR(script.fix_value("soil", FORCE_Y), force, 0.03 * force);
  for (const auto &[id, row] : script.points()) {
    if (row[SYY] == 0.0) continue;
    EXPECT_NEAR(row[SYY], -1e6 * strain, 0.05 * 1e6 * strain);
    EXPECT_NEAR(row[SZZ], 0.0, 0.05 * 1e6 * strain) << "hoop stress";
    EXPECT_NEAR(row[P], -(row[SXX] + row[SYY] + row[SZZ]) / 3.0, 1e-9 * 1e6);
    EXPECT_NEAR(row[EPS_V], -strain * 0.5, 0.05 * strain) << "(1 - 2 nu) strain";
  }
}

TEST(Axisymmetric, GroundInSituIsInBalanceWithItsWeight)
{
  SoilScript script;
  script << cylinder("0.25") +
          "fix gravity all gravity 9.81 vector 0 -1 0\n"
          "fix soil all mpm 0.25 device cpu model ground mohr_coulomb 1e7 0.3 0 30 0 density 2000 "
          "axisymmetric yes boundary xlo roller boundary ylo fixed boundary xhi free rigid plate "
          "vx 0 vy 0 smooth insitu gravity 9.81 k0 0.5 surcharge 3000\nrun 0\n";
  for (const auto &[id, row] : script.points()) {
    EXPECT_NEAR(row[SXX], 0.5 * row[SYY], 1e-9 * 3000.0);
    EXPECT_NEAR(row[SZZ], row[SXX], 1e-9 * 3000.0) << "lateral stresses are equal";
  }
}

TEST(Axisymmetric, TriaxialSpecimenOfMohrCoulombYieldsAtItsStrength)
{
  SoilScript script;
  script << of_law() + "run 1200\n";
  const double axial = 3.0 * 20000.0;    // (1 + sin φ)/(1 - sin φ) = 3
  double sum = 0.0, radii = 0.0;         // a ring has a volume proportional to its radius
  for (const auto &[id, row] : script.points()) {
    if (row[SYY] == 0.0) continue;    // the disk
    const double radius = row[row.size() - 4];
    sum += radius * row[SYY];
    radii += radius;
    EXPECT_NEAR(row[SYY], -axial, 0.1 * axial) << "neighbouring points differ by up to 6 %";
    EXPECT_NEAR(row[FIRST_COLUMN], row[SXX], 0.1 * axial);
    EXPECT_EQ(row[FIRST_COLUMN], row[SZZ]);
    EXPECT_GT(row[PLASTIC], 1e-3);
  }
  EXPECT_NEAR(sum / radii, -axial, 0.02 * axial) << "1.3 % with four cells along the radius";
  const double force = axial * rve::kPi;    // of the initial section, 2 % smaller than the present
  EXPECT_NEAR(script.fix_value("soil", FORCE_Y), force, 0.05 * force);
}

TEST(Axisymmetric, LawHasTheSameBitsOnRanksAndAfterARestart)
{
  expect_same_bits_on_ranks_and_after_a_restart(of_law());
}

TEST(Axisymmetric, SpheresHaveTheSameBitsOnRanksAndAfterARestart)
{
  expect_same_bits_on_ranks_and_after_a_restart(of_spheres());
}

TEST(Axisymmetric, HoopStressIsTheThirdNormalStressOfTheSpheres)
{
  SoilScript script;
  script << of_spheres() +
          "compute szz all rve/atom szz\ncompute sxx all rve/atom sxx\n"
          "run 60\n";
  const auto szz = script.compute("szz"), sxx = script.compute("sxx");
  for (const auto &[id, row] : script.points()) {
    EXPECT_EQ(row[SZZ], szz.at(id));
    EXPECT_EQ(row[SXX], sxx.at(id));
  }
}

TEST(AxisymmetricErrors, AreReported)
{
  Script() << "create_rve test_axisymmetric_disks.rve grains 60 seed 1 radius uniform 0.0025 0.005 "
              "pressure 20000 kn 1e6 friction 0.5 density 2650 damping 0.3 thickness 0.075";
  MPI_Barrier(MPI_COMM_WORLD);
  const std::string scene = cylinder("0.25");
  const std::string law = "fix soil all mpm 0.25 device cpu model ground elastic 1e6 0.3 density "
                          "2000 axisymmetric yes ";
  const std::string axis = "boundary xlo roller ", plate = "rigid plate vx 0 vy 0 smooth ";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {scene + law + plate,
       "the side xlo of an axisymmetric grid from x = 0 is the axis, so it must "
       "be a roller"},
      {scene + law + plate + "domain -1 1.5 0 1.5", "lower limit in x must be at least 0, got -1"},
      {scene + law + axis + plate + "shape linear", "gimp or cpgimp"},
      {scene + law + axis + "rigid plate vx 0.1 vy 0 smooth\nrun 1",
       "velocity of rigid body plate along x must be 0"},
      {scene + law + axis + "rigid plate vx free vy 0 smooth form box", "moves along y only"},
      {scene + law + axis + "rigid plate vx 0 vy 0 smooth form ball spin 0", "is a ball"},
      {scene + law + axis + "rigid plate vx 0 vy 0 smooth form box turned 10", "is turned"},
      {scene + law + axis + "rigid plate vx 0 vy 0 smooth form convex 4 -1 1 1 1 1 1.25 -1 1.25",
       "vertex at the radius -1"},
      {scene + law + axis + plate +
           "\ncreate_atoms 1 single 0 0.5 0 units box\ngroup ground type 1\n"
           "run 1",
       "has the radius x = 0 [length]; it must be above 0"},
      {scene +
           "fix soil all mpm 0.25 model ground elastic 1e6 0.3 density 2000 column hoop_stress " +
           plate,
       "column hoop_stress needs axisymmetric yes"},
      {scene +
           "fix disks ground rve test_axisymmetric_disks.rve drive mpm dt 1e-4 substeps match "
           "threads 1 device cpu\nfix soil all mpm 0.25 device cpu model ground rve disks "
           "axisymmetric yes " +
           axis + plate + "\nrun 0",
       "the RVEs of fix disks are disks, which have no hoop strain and no hoop stress"},
      {"units si\nboundary f f f\natom_style sphere\nregion box block 0 1 0 1 0 1\ncreate_box 1 "
       "box\n"
       "lattice sc 0.5 origin 0.5 0.5 0.5\ncreate_atoms 1 box\nfix soil all mpm 0.5 model all "
       "elastic "
       "1e6 0.3 density 2000 axisymmetric yes",
       "axisymmetric is yes, but the model has three dimensions; use dimension 2"}};
  for (const auto &[lines, part] : cases) EXPECT_IN(part, message_of(lines));

  const std::string path = file_of_rank("axisymmetric.restart");
  SoilScript(MPI_COMM_SELF) << scene + law + axis + plate + "\nrun 1\nwrite_restart " + path;
  const std::string plane = "read_restart " + path +
      "\npair_style none\ncomm_modify cutoff 0.25\nfix soil all mpm 0.25 device cpu model ground "
      "elastic 1e6 0.3 density 2000 " +
      axis + plate;
  EXPECT_IN("axisymmetric is no, but the run that wrote the restart file had yes",
            message_of(plane));
  std::remove(path.c_str());
}
