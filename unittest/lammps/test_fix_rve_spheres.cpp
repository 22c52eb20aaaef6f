// SPDX-License-Identifier: GPL-2.0-only
// RVEs of spheres through LAMMPS scripts: in dimension 3, and in plane strain in dimension 2. The
// tests also run under mpirun.

#include "comm.h"
#include "grains_script.h"
#include "rve/engine/packing_io.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

using namespace LAMMPS_NS;
using namespace grains_script;
using rve_test::temporary_path;
using rve_test::text_of;

namespace {

constexpr double RADIUS = 0.005, OVERLAP = 5e-6;

rve::Material lattice_material()
{
  rve::Material material = rve_test::spheres_material();
  material.tangential_stiffness = 0.3 * material.normal_stiffness;
  material.local_damping = 0.7;
  return material;
}

/// Writes a packing file of this rank and returns its path.
std::string file_of(const std::string &name, const rve_test::Spheres &state)
{
  const std::string path = file_of_rank(name);
  rve::write_packing(path, state);
  return path;
}

/// Returns the packing file of a face-centred cubic array of 32 spheres.
std::string lattice()
{
  return file_of("lattice.rve",
                 rve_test::face_centred_cubic(lattice_material(), 2, RADIUS, OVERLAP));
}

double lattice_pressure()
{
  return rve_test::face_centred_pressure(lattice_material(), RADIUS, OVERLAP);
}

rve_test::CubicConstants lattice_constants()
{
  return rve_test::face_centred_constants(lattice_material(), RADIUS);
}

/// Returns the packing file of 125 moving spheres.
std::string disorder()
{
  return file_of("disorder.rve", rve_test::disordered_spheres(rve_test::spheres_material(), 5, 7));
}

/// Returns four atoms in a box of this dimension.
std::string atoms_in(int dimension)
{
  const bool flat = dimension == 2;
  return std::string("units si\ndimension ") + (flat ? "2" : "3") +
      "\nboundary p p p\natom_style atomic\natom_modify map array\nregion box block 0 4 0 4 " +
      (flat ? "-0.5 0.5" : "0 4") + R"(
create_box 1 box
mass 1 1.0
timestep 1e-4
)" +
      "create_atoms 1 single 0.5 0.5 0\ncreate_atoms 1 single 2.5 0.5 0\ncreate_atoms 1 single 0.5 "
      "2.5 0\n"
      "create_atoms 1 single 2.5 2.5 0\n";
}

std::string fix_with(const std::string &packing)
{
  return "fix grains all rve " + packing + " device cpu threads 1 format double ";
}

/// Commands for computes of all stress components; the compute of a component is s<component>.
const std::string STRESSES = [] {
  std::string lines;
  for (const char *c : {"xx", "yy", "zz", "xy", "xz", "yz"})
    lines += std::string("compute s") + c + " all rve/atom s" + c + "\n";
  return lines;
}();

}    // namespace

TEST(SpheresOfFixRve, StrainedAlongAnAxisOfTheirLatticeHaveItsElasticConstants)
{
  const double strain = 2e-5;
  const rve_test::CubicConstants c = lattice_constants();
  const double error = 5e-3 * c.c11 * strain;
  for (const int dimension : {2, 3}) {
    // The RVEs strain at a constant rate for 0.02 s and are then held at rest.
    const std::string axis = dimension == 2 ? "yy" : "zz";
    GrainsScript script;
    script << atoms_in(dimension) + fix_with(lattice()) + "drive velocity_gradient " + axis + " " +
            std::to_string(-strain / 0.02) + "\n" + STRESSES +
            "compute f all rve/atom def_zz\nrun 200\nfix_modify grains drive none\nrun 100";

    for (const char *component : {"xx", "yy", "zz"}) {
      const double expected = -lattice_pressure() - (component == axis ? c.c11 : c.c12) * strain;
      EXPECT_NEAR(script.compute(std::string("s") + component).at(1), expected, error)
          << component << " in dimension " << dimension;
    }
    for (const char *component : {"xy", "xz", "yz"})
      EXPECT_NEAR(script.compute(std::string("s") + component).at(1), 0.0, error);
    EXPECT_NEAR(script.compute("f").at(1), dimension == 2 ? 1.0 : std::exp(-strain), 1e-12);
  }
}

TEST(SpheresOfFixRve, HaveSixStressesThatAServoControls)
{
  GrainsScript script;
  script << atoms_in(3) + fix_with(lattice()) +
          "servo xx -1.6e5 yy -1.5e5 zz -1.8e5 xy 4e3 xz -3e3 yz 2e3\n" + STRESSES + "run 2000";

  EXPECT_NEAR(script.compute("sxx").at(1), -1.6e5, 200);
  EXPECT_NEAR(script.compute("syy").at(1), -1.5e5, 200);
  EXPECT_NEAR(script.compute("szz").at(1), -1.8e5, 200);
  EXPECT_NEAR(script.compute("sxy").at(1), 4e3, 200);
  EXPECT_NEAR(script.compute("sxz").at(1), -3e3, 200);
  EXPECT_NEAR(script.compute("syz").at(1), 2e3, 200);
}

namespace {

const std::string SHEAR_OF_SPHERES =
    "dt 2e-6 substeps 20 drive velocity_gradient xx -1 zz v_rate xy 2 yz -1 zx 0.5\n";
const std::string RATE = "variable rate atom -0.5*id\n";

}    // namespace

TEST(SpheresOfFixRve, ContinueFromARestartFileBitForBit)
{
  const std::string file = temporary_path("restart_of_spheres"), packing = disorder();
  const std::string fix = fix_with(packing) + SHEAR_OF_SPHERES;
  GrainsScript whole, first, second;
  whole << atoms_in(3) + RATE + fix + "run 40";
  first << atoms_in(3) + RATE + fix + "run 17\nwrite_restart " + file + "\nclear";
  second << "read_restart " + file + "\n" + RATE + fix + "run 23";

  for (const int atom : {1, 4}) EXPECT_EQ(whole.state(atom), second.state(atom));
  EXPECT_EQ(whole.fix_value(3), second.fix_value(3));
  EXPECT_IN(
      "made of other packings than those of this fix",
      message_of("read_restart " + file + "\n" + RATE + fix_with(lattice()) + SHEAR_OF_SPHERES));
}

TEST(SpheresOfFixRve, QuiescenceAndShadowsSurviveARestart)
{
  const std::string file = temporary_path("restart_of_sleepers"), packing = lattice();
  const std::string fix = fix_with(packing) +
      "dt auto substeps adaptive 1e-5 1e-2 quiescent 5e-5 shadow 1 2 drive velocity_gradient zz "
      "-0.05 xz 0.02\n";
  GrainsScript whole, first, second;
  whole << atoms_in(3) + fix + STRESSES + "run 40";
  first << atoms_in(3) + fix + "run 17\nwrite_restart " + file + "\nclear";
  second << "read_restart " + file + "\n" + fix + STRESSES + "run 23";

  EXPECT_EQ(whole.state(2), second.state(2));
  for (const char *component : {"xx", "yy", "zz", "xy", "xz", "yz"})
    EXPECT_EQ(whole.compute(std::string("s") + component).at(2),
              second.compute(std::string("s") + component).at(2));
  EXPECT_LT(whole.fix_value(3), 4 * 40 * 2.0);    // the RVEs are skipped in most steps
  EXPECT_LT(whole.fix_value(12), 0.05);           // deviation from the shadow
}

TEST(SpheresOfFixRve, HaveTheSameBitsOnAnyNumberOfRanksAndMoveBetweenThem)
{
  const std::string fix = fix_with(disorder()) + SHEAR_OF_SPHERES;
  const std::string scene = atoms_in(3) + RATE +
      "neighbor 0.1 bin\nneigh_modify every 1 delay 0 check no\ncomm_modify cutoff 0.5\n"
      "pair_style zero 0.5\npair_coeff * *\nfix go all move linear 40 30 20 units box\n" +
      fix + STRESSES + "run 40";
  Script together, alone(MPI_COMM_SELF);
  together << scene;
  alone << scene;

  for (const char *component : {"xx", "yy", "zz", "xy", "xz", "yz"}) {
    const std::string id = std::string("s") + component;
    EXPECT_EQ(together.compute(id), alone.compute(id)) << component;
  }
}

TEST(SpheresOfFixRve, AreAvailableToOtherCommands)
{
  const std::string dump = temporary_path("grains.dump");
  GrainsScript script;
  script << atoms_in(3) + "group one id 1\n" + fix_with(lattice()) +
          "dt auto\ncompute c one rve/contact/local id1 id2 normal_x normal_y normal_z fn force_z "
          "ft_x\n"
          "compute n all rve/atom grains\ncompute fabric all rve/atom fabric_zz\n"
          "dump d one rve/grain 1 " +
          dump + " id x y z radius omegax fz contacts\nrun 0\n";

  EXPECT_EQ(script.compute("n").at(1), 32.0);
  EXPECT_NEAR(script.compute("fabric").at(1), 1.0 / 3.0, 1e-6);
  Compute *contacts = script.lmp->modify->get_compute_by_id("c");
  contacts->compute_local();
  // Only the rank of the atom has rows.
  ASSERT_TRUE(contacts->size_local_rows == 6 * 32 || contacts->size_local_rows == 0);
  for (int k = 0; k < contacts->size_local_rows; ++k) {
    const double *row = contacts->array_local[k];
    EXPECT_NEAR(row[2] * row[2] + row[3] * row[3] + row[4] * row[4], 1.0, 1e-12);
    EXPECT_NEAR(row[5], lattice_material().normal_stiffness * OVERLAP, 1e-5);
    EXPECT_NEAR(row[6], -row[5] * row[4], 1e-9);
    EXPECT_EQ(row[7], 0.0);
  }
  if (script.lmp->comm->me > 0) return;
  const std::string text = text_of(dump);
  EXPECT_IN("ITEM: BOX BOUNDS abc origin pp pp pp", text);
  EXPECT_IN("ITEM: ATOMS id x y z radius omegax fz contacts", text);
  EXPECT_IN(" 12\n", text);    // the last sphere has 12 contacts
}

TEST(SpheresOfFixRve, OutputRollingAndTwistingResistance)
{
  GrainsScript script;
  script << atoms_in(3) + "group one id 1\n" + fix_with(disorder()) +
          "dt 1e-6 substeps 200 drive velocity_gradient xy 3 contact hooke 1e6 0 tangential "
          "linear_history 5e5 0 0.4 rolling sds 2e5 3 0.2 twisting marshall\n"
          "compute c one rve/contact/local fn overlap normal_x normal_y normal_z fr fr_x fr_y fr_z "
          "mt\nrun 1\n";

  Compute *contacts = script.lmp->modify->get_compute_by_id("c");
  contacts->compute_local();
  int rolls = 0, twists = 0;
  for (int k = 0; k < contacts->size_local_rows; ++k) {
    const double *row = contacts->array_local[k];
    const double fn = row[0], overlap = row[1], fr = row[5], mt = row[9];
    EXPECT_NEAR(fr * fr, row[6] * row[6] + row[7] * row[7] + row[8] * row[8], 1e-12 * fn * fn);
    EXPECT_NEAR(row[2] * row[6] + row[3] * row[7] + row[4] * row[8], 0.0, 1e-5 * fn);
    // The twisting moment is at most 2/3 mu a f_n, with the friction mu = 0.4, the normal force f_n
    // and the radius a = sqrt(R overlap) of the contact area. R is the reduced radius, at most half
    // of the largest radius.
    EXPECT_LE(std::fabs(mt),
              1.001 * 2.0 / 3.0 * 0.4 * std::sqrt(0.5 * RADIUS * overlap) * fn + 1e-15);
    rolls += fr > 1e-3 * fn;
    twists += std::fabs(mt) > 1e-3 * std::sqrt(0.5 * RADIUS * overlap) * fn;
  }
  if (contacts->size_local_rows == 0) return;    // another rank has the atom
  EXPECT_GT(rolls, 20);
  EXPECT_GT(twists, 20);
}

TEST(SpheresOfFixRve, AreWrittenForLammpsAtTheirTimes)
{
  const std::string prefix = temporary_path("snap");
  GrainsScript script;
  script << atoms_in(3) + fix_with(lattice()) + "dt auto dump 1 " + prefix + " 1\nrun 1\n";

  if (script.lmp->comm->me > 0) return;
  EXPECT_IN("32 atoms", text_of(prefix + ".1.1.data"));
  EXPECT_FALSE(text_of(prefix + ".1.1.data.contacts").empty());
  EXPECT_TRUE(text_of(prefix + ".2.1.data").empty());
}

TEST(SpheresOfFixRve, WarningsNameLimitsOfSpheres)
{
  const std::string squeezed =
      file_of("squeezed.rve", rve_test::face_centred_cubic(lattice_material(), 2, RADIUS, 4e-4));
  const std::string log = log_of(atoms_in(3) + fix_with(squeezed) + "\nrun 0");

  EXPECT_IN("such overlaps of spheres cause errors of the same size", log);
  EXPECT_IN("of its width along x", log);
}

// ---- RVEs under a plane continuum ---------------------------------------------------------------

namespace {

/// Returns a column of 2 by 2 points with RVEs of spheres. The column stands between rollers and
/// bears a surcharge [Pa].
std::string column(const std::string &packing, double surcharge)
{
  return "units si\ndimension 2\nboundary f f p\natom_style sphere\natom_modify map array\n"
         "region box block 0 2 0 4 -0.1 0.1 units box\ncreate_box 1 box\n"
         "lattice sq 1.0 origin 0.5 0.5 0.0\nregion ground block 0 2 0 2 -0.05 0.05 units box\n"
         "create_atoms 1 region ground\nset group all diameter 1.0\npair_style none\n"
         "comm_modify cutoff 1.0\nneighbor 0.5 bin\ntimestep 1e-3\n"
         "region top block 0 2 1 2 -0.05 0.05 units box\ngroup surface region top\n"
         "fix grains all rve " +
      packing +
      " drive mpm dt auto substeps match device cpu threads 1\n"
      "fix soil all mpm 1.0 domain 0 2 0 4 model all rve grains boundary xlo roller boundary xhi "
      "roller boundary ylo roller damping 0.3 traction surface 0 " +
      std::to_string(-surcharge) + "\n" + STRESSES + "compute def all rve/atom def_yy\n";
}

}    // namespace

TEST(SpheresUnderFixMpm, BalanceASurchargeInPlaneStrain)
{
  // The surcharge is a hundredth larger than the initial stress of the lattice. As in an oedometer,
  // the column has no lateral strain. The lateral stress therefore increases by C12/C11 times the
  // excess.
  const double more = 0.01 * lattice_pressure();
  const rve_test::CubicConstants c = lattice_constants();
  Script script;
  script << column(lattice(), lattice_pressure() + more) + "run 400";

  const auto sxx = script.compute("sxx"), syy = script.compute("syy"), szz = script.compute("szz"),
             def = script.compute("def");
  for (const auto &[id, stress] : syy) {
    EXPECT_NEAR(stress, -lattice_pressure() - more, 0.05 * more) << id;
    EXPECT_NEAR(sxx.at(id), -lattice_pressure() - c.c12 / c.c11 * more, 0.05 * more) << id;
    EXPECT_NEAR(szz.at(id), sxx.at(id), 0.01 * more) << id;
    EXPECT_NEAR(1.0 - def.at(id), more / c.c11, 0.05 * more / c.c11) << id;
  }
}

TEST(SpheresUnderFixMpm, HaveTheSameBitsOnAnyNumberOfRanks)
{
  const std::string scene = column(lattice(), 1.2 * lattice_pressure()) + "run 40";
  Script together, alone(MPI_COMM_SELF);
  together << scene;
  alone << scene;

  for (const char *component : {"sxx", "syy", "szz", "sxy"})
    EXPECT_EQ(together.compute(component), alone.compute(component)) << component;
}

// ---- wrong input --------------------------------------------------------------------------------

TEST(SpheresMessage, OfAMixtureNamesTwoFiles)
{
  const std::string spheres = lattice();
  const std::string choose = " packing_random 1\n";
  EXPECT_IN("packing " + spheres + " consists of spheres and packing " + PACKING +
                " of disks; all packings of a fix must have the same kind of grains",
            message_of(atoms_in(2) + fix_with(spheres) + "packings " + PACKING + choose));
  EXPECT_IN("packing " + PACKING + " consists of disks and packing " + spheres + " of spheres",
            message_of(atoms_in(2) + fix_with(PACKING) + "packings " + spheres + choose));
}

TEST(SpheresMessage, OfDisksInSpaceNamesTheirNeeds)
{
  EXPECT_IN("the dimension is 3; it must be 2 for packings of disks",
            message_of(atoms_in(3) + fix_with(PACKING)));
}

TEST(SpheresMessage, OfAMissingFileNamesItInAnyDimension)
{
  for (const int dimension : {2, 3}) {
    const std::string message = message_of(atoms_in(dimension) + fix_with("missing.rve"));
    EXPECT_IN("missing.rve", message);
    EXPECT_EQ(message.find("packings of disks"), std::string::npos) << message;
  }
}

TEST(SpheresMessage, OfAMissingFileComesBeforeThatOfComponents)
{
  const std::string message =
      message_of(atoms_in(3) + fix_with("missing.rve") + "drive velocity_gradient zz -0.2 ");
  EXPECT_IN("missing.rve", message);
  EXPECT_IN("create_rve", message);
  EXPECT_EQ(message.find("disks"), std::string::npos) << message;
}

TEST(SpheresMessage, OfComponents)
{
  const std::string spheres = lattice(), servo = "servo xx -1e5 ";
  EXPECT_IN("servo has component zz, but the RVEs consist of disks",
            message_of(atoms_in(2) + fix_with(PACKING) + servo + "zz -1e5\n"));
  EXPECT_IN("servo has no component zy; use yz, because the stress is symmetric",
            message_of(atoms_in(3) + fix_with(spheres) + servo + "zy 1e3\n"));
  EXPECT_IN("servo needs at least one of the components xx yy zz xy xz yz, got 'up'",
            message_of(atoms_in(3) + fix_with(spheres) + "servo up -1e5\n"));
  EXPECT_IN("velocity_gradient needs at least one of the components xx yy zz xy xz yz yx zx zy",
            message_of(atoms_in(3) + fix_with(spheres) + "drive velocity_gradient up 1\n"));
  EXPECT_IN("component zz is prescribed by both velocity_gradient and servo",
            message_of(atoms_in(3) + fix_with(spheres) +
                       "drive velocity_gradient zz -1 servo zz -1e5\n"));
}

TEST(SpheresMessage, OfColumnsThatDisksDoNotHave)
{
  const std::string disks = atoms_in(2) + fix_with(PACKING) + "dt 1e-5\n";
  EXPECT_IN(
      "compute rve/atom c: szz is for spheres only, but the RVEs of fix grains consist of disks",
      message_of(disks + "compute c all rve/atom sxx szz\nrun 0"));
  EXPECT_IN("compute rve/contact/local c: normal_z is for spheres only",
            message_of(disks + "compute c all rve/contact/local normal_z\nrun 0"));
  EXPECT_IN("dump rve/grain d: omegax is for spheres only",
            message_of(disks + "group one id 1\ndump d one rve/grain 1 " +
                       temporary_path("d.dump") + " id omegax\nrun 0"));
  EXPECT_IN("compute rve/contact/local c: mt is for spheres only",
            message_of(disks + "compute c all rve/contact/local mt\nrun 0"));
}
