// SPDX-License-Identifier: GPL-2.0-only
// create_rve and write_rve: errors before anything runs, output paths, and warnings. The images of
// packings that fix rve makes are also tested. Under mpirun every rank runs the scripts alone.

#include "rve/engine/contact_network.h"
#include "rve/engine/packing_io.h"
#include "script.h"
#include "support/files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

using namespace LAMMPS_NS;
using rve_test::text_of;
namespace fs = std::filesystem;

namespace {

const std::string RECIPE =
    " grains 40 seed 5 radius uniform 0.003 0.005 kn 1e6 friction 0.5 density "
    "2650 damping 0.3 pressure 1e5 thickness 0.075 ";

std::string without(std::string words, const std::string &part)
{
  return words.erase(words.find(part), part.size());
}

const std::string FOUR_ATOMS = R"(units si
dimension 2
boundary p p p
atom_style atomic
region box block 0 4 0 4 -0.5 0.5
create_box 1 box
mass 1 1.0
timestep 1e-3
pair_style none
comm_modify cutoff 1.0
create_atoms 1 single 0.5 0.5 0
create_atoms 1 single 2.5 0.5 0
create_atoms 1 single 0.5 2.5 0
create_atoms 1 single 2.5 2.5 0
)";

const std::string FIX = "fix grains all rve " EXAMPLE_PACKINGS
                        "/A_h0075.rve threads 1 device cpu dt 5e-5 ";

/// Returns the log of the lines, which must run without an error.
std::string log_of(const std::string &lines)
{
  const std::string path = file_of_rank("log");
  {
    Script script(MPI_COMM_SELF, path);
    script << lines;
  }
  return text_of(path);
}

#define EXPECT_IN(part, whole) EXPECT_PRED_FORMAT2(::testing::IsSubstring, part, whole)
#define EXPECT_NOT_IN(part, whole) EXPECT_PRED_FORMAT2(::testing::IsNotSubstring, part, whole)

}    // namespace

// ---- arguments ----

TEST(CreateRve, MissingKeywordsAreNamed)
{
  EXPECT_IN("create_rve: radius, kn, density, pressure must be given",
            message_of("create_rve none.rve grains 40\n"));
  EXPECT_IN("create_rve: pressure must be given",
            message_of("create_rve none.rve" + without(RECIPE, "pressure 1e5") + "\n"));
}

TEST(CreateRve, AKeywordGivenTwiceIsAnError)
{
  EXPECT_IN("create_rve: kn is given twice, as 'kn 1e6' and as 'kn 1e7'; give it once",
            message_of("create_rve none.rve" + RECIPE + "kn 1e7\n"));
  EXPECT_IN("create_rve: grains is given twice, as 'grains 40' and as 'grains 50'",
            message_of("create_rve none.rve" + RECIPE + "grains 50\n"));
  EXPECT_IN("create_rve: seed and seeds exclude each other",
            message_of("create_rve none.rve" + RECIPE + "seeds 1 2\n"));
}

TEST(CreateRve, ContactInTheWordsOfLammpsGivesTheSamePacking)
{
  const std::string file = file_of_rank("contact.rve");
  const auto packing_with = [&](const std::string &contact) {
    log_of("units si\ncreate_rve " + file + without(without(RECIPE, "kn 1e6"), "friction 0.5") +
           contact + "\n");
    return text_of(file);
  };

  EXPECT_EQ(packing_with("contact hooke 1e6 20 tangential linear_history 5e5 0.5 0.4 damping "
                         "velocity rolling sds 2e5 0 0.1"),
            packing_with("kn 1e6 gamma_n 20 kt 5e5 gamma_t 10 friction 0.4 kr 2e5 "
                         "rolling_friction 0.1"));
}

TEST(CreateRve, MisspeltKeywordGetsASuggestion)
{
  EXPECT_IN("create_rve: unknown keyword 'grians'; did you mean grains?",
            message_of("create_rve none.rve grians 40\n"));
  EXPECT_IN("create_rve: unknown keyword 'presure'; did you mean pressure?",
            message_of("create_rve none.rve" + RECIPE + "presure\n"))
      << "before it is said that it has no value";
  EXPECT_IN("create_rve: unknown keyword 'colour'; the keywords are kn, kt, friction, ",
            message_of("create_rve none.rve colour red\n"));
  EXPECT_IN("create_rve: found '60' after 'grains 40', where a keyword or the end was expected",
            message_of("create_rve none.rve grains 40 60 seed 1\n"));
  EXPECT_IN("create_rve: void_ratio is 'low'; it must be a number",
            message_of("create_rve none.rve" + RECIPE + "void_ratio low\n"));
}

TEST(CreateRve, APressureIsPositiveInCompression)
{
  const std::string recipe = without(RECIPE, "pressure 1e5");
  EXPECT_IN("create_rve: pressure of the packing is -100000 [stress]; it must be greater than 0: a "
            "pressure is positive in compression, where stresses are negative",
            message_of("create_rve none.rve" + recipe + "pressure -1e5\n"));
}

// The curve has one class from 4 to 16 mm, so d_x is 4 mm 4^x. Its grains have steps of 3 %.
TEST(CreateRve, AGradingIsLoggedWithItsDiametersAndTheGrainsThatItNeeds)
{
  const std::string file = file_of_rank("graded.rve");
  const std::string words = without(RECIPE, "radius uniform 0.003 0.005 ");
  const std::string log =
      log_of("units si\ncreate_rve " + file + words + "grading 0.004 0 0.016 100\n");

  EXPECT_IN("create_rve " + file + ": 40 grains with diameters from 0.00402", log);
  EXPECT_IN("of them in the coarsest tenth of the mass; the distribution needs 235 grains", log);
  EXPECT_IN("create_rve: 40 grains represent the distribution of sizes poorly; use at least 235 "
            "grains (5 in the coarsest tenth of the mass, and a cell 2.5 of the largest diameters "
            "wide)",
            log);
  EXPECT_NOT_IN("cut off", log);
  EXPECT_IN(" [length] by mass, coefficient of uniformity ", log);
  const rve::RveState state = rve::read_packing(file);
  double below = 0.0, all = 0.0;
  for (const double r : state.radius) (2.0 * r < 0.008 ? below : all) += r * r;
  EXPECT_NEAR(below / (below + all), 0.5, 0.04);
}

TEST(CreateRve, ALibraryHasTheSameGrainsForAllSeeds)
{
  const std::string file = file_of_rank("graded.library");
  const std::string words = without(without(RECIPE, "radius uniform 0.003 0.005 "), "seed 5 ");
  const std::string log = log_of("units si\ncreate_rve " + file + words +
                                 "seeds 1 2 grading 0.004 20 0.008 100 threads 1 device cpu\n");

  EXPECT_IN("create_rve " + file + ": fines below 0.004 [length], 20 % of the mass, are cut off",
            log);
  const rve::PackingLibrary library = rve::read_library<2>(file);
  ASSERT_EQ(library.packings.size(), 2u);
  EXPECT_EQ(library.packings[0].radius, library.packings[1].radius);
  EXPECT_NE(library.packings[0].fractional, library.packings[1].fractional);
}

TEST(CreateRve, RadiiOfDistributionsAreRead)
{
  const std::string file = file_of_rank("sizes.rve");
  const std::string words = without(RECIPE, "radius uniform 0.003 0.005 ");
  for (const char *radii :
       {"radius lognormal 0.004 0.2 0.003 0.006", "radius power_law 2 0.003 0.006"}) {
    EXPECT_IN("create_rve " + file + ": 40 grains with diameters from 0.006",
              log_of("units si\ncreate_rve " + file + words + radii + "\n"));
    EXPECT_EQ(rve::read_packing(file).num_grains(), 40);
  }
}

TEST(CreateRve, WrongSizesAreNamed)
{
  const std::string words = "create_rve none.rve" + without(RECIPE, "radius uniform 0.003 0.005 ");
  EXPECT_IN("create_rve: radius and grading exclude each other",
            message_of("create_rve none.rve" + RECIPE + "grading 0.1 0 0.2 100\n"));
  EXPECT_IN("create_rve: grading has 3 numbers; it must have pairs of a diameter and the percent "
            "passing",
            message_of(words + "grading 0.1 0 0.2\n"));
  EXPECT_IN("create_rve: percent passing of the last grading point is 90; it must be 100",
            message_of(words + "grading 0.1 0 0.2 90\n"));
  EXPECT_IN("create_rve: radius is 'normal'; it must be uniform, lognormal or power_law",
            message_of(words + "radius normal 1 2\n"));
  EXPECT_IN("create_rve: ratio of largest to smallest diameter is ",
            message_of(without(without(words, "thickness 0.075 "), "grains 40 ") +
                       "shape sphere grading 0.001 0 0.1 100 grains 4000\n"));
}

TEST(CreateRve, ACellThatIsTooNarrowForItsGrainsHasARemedy)
{
  std::string few = RECIPE;
  few.replace(few.find("grains 40"), 9, "grains 6");
  const std::string message = message_of("create_rve none.rve" + few + "\n");

  EXPECT_IN("cell too narrow", message);
  EXPECT_IN("use a packing with more grains", message);
  EXPECT_NOT_IN("policy freeze", message) << "which create_rve does not have";
}

// The error comes before the preparation. The list of recipes alone would fill the memory of most
// machines.
TEST(CreateRve, LibraryBeyondAllMemoryIsRefused)
{
  EXPECT_IN("create_rve: a library of 2000000000 packings with 40 grains each is too large; the "
            "limit is 1000000 packings of this size, 100000000 grains in total, which take tens of "
            "GB: use fewer seeds, or make several libraries",
            message_of("create_rve none.rve" + RECIPE.substr(0, RECIPE.find("seed")) +
                       RECIPE.substr(RECIPE.find("radius")) + "seeds 1 2000000000\n"));
}

TEST(WriteRve, MisspeltKeywordGetsASuggestion)
{
  EXPECT_IN("write_rve: unknown keyword 'atm'; did you mean atom?",
            message_of(FOUR_ATOMS + FIX + "\nwrite_rve grains atm 1 file none.rve\n"));
  EXPECT_IN("write_rve: unknown keyword 'colour'; the keywords are atom, file, format",
            message_of(FOUR_ATOMS + FIX + "\nwrite_rve grains colour 1 file none.rve\n"));
}

TEST(WriteRve, AKeywordGivenTwiceIsAnError)
{
  EXPECT_IN(
      "write_rve: atom is given twice, as 'atom 1' and as 'atom 2'",
      message_of(FOUR_ATOMS + FIX + "\nrun 0\nwrite_rve grains atom 1 file none.rve atom 2\n"));
}

TEST(CreateRve, UnitsInWhichForcesDoNotFollowFromMassesAreRefused)
{
  for (const char *units : {"metal", "real", "electron"})
    EXPECT_IN(std::string("create_rve: units are ") + units + "; they must be lj, si, cgs or micro",
              message_of(std::string("units ") + units + "\ncreate_rve none.rve" + RECIPE + "\n"));
}

TEST(CreateRve, MoreThreadsThanAnyMachineHasAreRefused)
{
  EXPECT_IN("number of threads is 1000000; it must be from 1 to 1024",
            message_of("create_rve none.rve" + RECIPE + "threads 1000000\n"));
  EXPECT_IN("number of threads is 1000000; it must be from 1 to 1024",
            message_of(FOUR_ATOMS +
                       "fix grains all rve " EXAMPLE_PACKINGS "/A_h0075.rve threads 1000000\n"));
}

// ---- output paths ----

// The error comes before the preparation, which would write lines to the log.
TEST(CreateRve, UnwritableFileIsAnErrorBeforeThePreparation)
{
  const std::string log = file_of_rank("early.log"), path = file_of_rank("none") + "/p.rve";
  std::string message;
  {
    Script script(MPI_COMM_SELF, log);
    try {
      script << "create_rve " + path + RECIPE + "\n";
    } catch (const LAMMPSException &problem) {
      message = problem.what();
    }
  }

  EXPECT_IN("create_rve: cannot write file " + path + ": No such file or directory", message);
  EXPECT_NOT_IN("compression", text_of(log));
}

TEST(FixRve, UnwritableDumpIsAnErrorBeforeTheRun)
{
  const std::string prefix = file_of_rank("none") + "/grains";

  EXPECT_IN("cannot write file " + prefix + ".2.0.data: No such file or directory",
            message_of(FOUR_ATOMS + FIX + "dump 1000 " + prefix + " 2\nrun 0\n"));
}

TEST(WriteRve, ALinkStaysALink)
{
  const std::string link = file_of_rank("link"), file = file_of_rank("file.rve");
  fs::remove(link);
  fs::remove(file);
  fs::create_symlink(fs::path(file).filename(), link);

  EXPECT_EQ(message_of(FOUR_ATOMS + FIX + "\nrun 0\nwrite_rve grains atom 1 file " + link +
                       " format rve\n"),
            "");

  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_IN("gpu_rve_packing 1", text_of(file));
  fs::remove(link);
}

TEST(WriteRve, ReportsWhyItCannotWrite)
{
  EXPECT_IN("write_rve: cannot write file /nowhere/p.rve: No such file or directory",
            message_of(FOUR_ATOMS + FIX +
                       "\nrun 0\nwrite_rve grains atom 1 file /nowhere/p.rve format rve\n"));
}

TEST(FixRve, PackingThatIsNoFileIsRefusedWithTheReason)
{
  const std::string folder = testing::TempDir();

  EXPECT_IN("fix rve grains: cannot open packing file " + folder + ": Is a directory",
            message_of(FOUR_ATOMS + "fix grains all rve " + folder + "\n"));
}

TEST(FixRve, MissingPackingNamesTheSearchedPathsAndACommand)
{
  const std::string here = fs::current_path().string();

  EXPECT_IN(
      "fix rve grains: cannot open packing file ground.rve: No such file or directory (looked in "
      "folder " +
          here + "). The command create_rve makes packings",
      message_of(FOUR_ATOMS + "fix grains all rve ground.rve\n"));
  EXPECT_IN("(looked in folder /nowhere)",
            message_of(FOUR_ATOMS + "fix grains all rve /nowhere/ground.rve\n"));
  EXPECT_IN("did you mean the keyword friction?",
            message_of(FOUR_ATOMS + FIX + "packings frition 0.3\n"));
}

// ---- warnings ----

// In SI units with the default thickness of 1 m, the estimated overlap is 0.1 of the diameter. In
// the packing, the mean overlap would be 6 % of the diameter, and the void ratio would be negative.
TEST(CreateRve, GrainsThatWouldFillThePlaneAreAnErrorBeforeAnythingRuns)
{
  const std::string message =
      message_of("create_rve none.rve" + without(RECIPE, "thickness 0.075"));

  EXPECT_IN("create_rve: overlap of the grains would be about 0.1 of their diameter (pressure * "
            "thickness / kn); it must be at most 0.05",
            message);
  EXPECT_IN("the pressure must be at most 50000 [stress]", message);
  EXPECT_IN("kn must be at least 2000000", message);
  EXPECT_IN("the thickness of the disks at most 0.5", message);
}

TEST(CreateRve, SoftGrainsGiveAWarning)
{
  const std::string path = file_of_rank("soft.rve");
  std::string soft = RECIPE;
  soft.replace(soft.find("kn 1e6"), 6, "kn 5e5");

  const std::string log = log_of("create_rve " + path + soft);

  EXPECT_IN("create_rve: grains will overlap by about 0.015 of their diameter, pressure 100000 "
            "[stress] * thickness 0.075 [length] / kn 500000 [force/length]",
            log);
  EXPECT_IN("use kn of at least 750000", log);
  EXPECT_NOT_IN("will overlap", log_of("create_rve " + path + RECIPE));
}

// The packing was compressed along y. Its image is rotated by 90 degrees, so the vertical stress
// becomes the horizontal one.
TEST(PackingImage, AnisotropicPackingGivesAWarning)
{
  const std::string path = file_of_rank("pressed.rve");
  log_of(FOUR_ATOMS + FIX +
         "drive velocity_gradient yy -1.0\nrun 5\nwrite_rve grains atom 1 file " + path +
         " format rve");
  const auto log_with = [](const std::string &packing, const std::string &image) {
    return log_of(FOUR_ATOMS + "fix grains all rve " + packing + " threads 1 device cpu dt 5e-5 " +
                  image + "\nrun 0");
  };

  const std::string log = log_with(path, "packing_image 1");

  EXPECT_IN("WARNING: fix rve grains: packing_image changes the stress of the ground: packing " +
                path + " has sxx, syy, sxy = ",
            log);
  EXPECT_IN("its image 1", log);
  EXPECT_IN("this applies to 1 of 1 packings", log);
  for (const char *image : {"packing_image 0", "packing_image 2", "packing_image 6"})
    EXPECT_NOT_IN("changes the stress of the ground", log_with(path, image)) << image;
  EXPECT_NOT_IN("changes the stress of the ground",
                log_with(EXAMPLE_PACKINGS "/A_h0075.rve", "packing_image random 1"));
}

// ---- spheres ----

TEST(CreateRve, PackingsOfSpheresAreMadeAndWritten)
{
  const std::string path = file_of_rank("spheres.rve"), data = file_of_rank("spheres.data");
  const std::string recipe = " shape sphere grains 80 radius uniform 0.004 0.005 kn 1e6 friction "
                             "0.5 density 2650 damping 0.3 pressure 1e5 k0 0.6 tolerance 0.005";
  const std::string log =
      log_of("create_rve " + path + recipe + "\n" + FOUR_ATOMS + "fix grains all rve " + path +
             " threads 1 device cpu dt 5e-6 packing_image random 1 drive "
             "velocity_gradient xx 0.0\nrun 0\n" +
             "write_rve grains atom 1 file " + data);

  EXPECT_IN("anisotropic load", log);
  EXPECT_IN("its image", log);    // an image can have another vertical stress
  const rve::RveStateOf<3> packing = rve::read_packing<3>(path);
  EXPECT_EQ(packing.num_grains(), 80);
  const rve::Tensor3 stress = rve::spring_stress(packing);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(stress(a, a), a == 2 ? -1e5 : -6e4, 0.01 * 1e5);
  EXPECT_IN("xy xz yz", text_of(data));
  EXPECT_IN("# i j branch_x branch_y branch_z", text_of(data + ".contacts"));
}

TEST(CreateRve, SpheresHaveNoThickness)
{
  EXPECT_IN("create_rve: spheres have no thickness; it is for shape disk",
            message_of("create_rve none.rve shape sphere" + RECIPE));
  EXPECT_IN("create_rve: shape is 'cube'; it must be disk or sphere",
            message_of("create_rve none.rve shape cube" + RECIPE));
}

// LAMMPS reads the data file of write_rve, finds the contacts itself and computes the stress of
// their springs.
TEST(WriteRve, LammpsFindsTheStressOfSpheres)
{
  const std::string path = file_of_rank("read.rve"), data = file_of_rank("read.data");
  log_of(
      "create_rve " + path +
      " shape sphere grains 80 radius uniform 0.004 0.005 kn 1e6 density 2650 pressure 1e5\n" +
      FOUR_ATOMS + "fix grains all rve " + path +
      " threads 1 device cpu dt 5e-6 drive velocity_gradient yz 20.0 xz 30.0 xy -25.0\nrun 10\n" +
      "write_rve grains atom 1 file " + data + "\nwrite_rve grains atom 1 file " + path +
      " format rve");
  const rve::RveStateOf<3> packing = rve::read_packing<3>(path);
  ASSERT_NE(packing.cell(1, 2), 0.0);

  Script script(MPI_COMM_SELF, file_of_rank("log"));
  script << "units si\natom_style sphere\nnewton off\ncomm_modify vel yes\nread_data " + data +
          "\npair_style granular\npair_coeff * * hooke 1e6 0 tangential linear_nohistory 0 0\n"
          "fix move all nve/sphere\ncompute s all pressure NULL virial\n"
          "thermo_style custom step c_s[1] c_s[2] c_s[3] c_s[4] c_s[5] c_s[6]\nrun 0\n";

  const rve::Tensor3 stress = rve::spring_stress(packing);
  const int axes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  Compute *found = script.lmp->modify->get_compute_by_id("s");
  found->compute_vector();
  for (int k = 0; k < 6; ++k)
    EXPECT_NEAR(-found->vector[k], stress(axes[k][0], axes[k][1]), 1e-9 * std::fabs(trace(stress)));
}
