// SPDX-License-Identifier: GPL-2.0-only
// Libraries of packings through LAMMPS scripts: create_rve writes them, and fix rve chooses
// packings from them. The chosen packings must not depend on the number of ranks or the order of
// atoms. Messages for wrong input are also tested. Under mpirun every rank also runs the script
// alone.

#include "rve/engine/packing_image.h"
#include "rve/engine/packing_io.h"
#include "script.h"
#include "support/files.h"
#include "support/tests_of_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <set>

using namespace LAMMPS_NS;
using rve_test::text_of;

namespace {

const std::string RECIPE = " grains 60 radius uniform 0.0025 0.005 kn 1e6 friction 0.5 density "
                           "2650 damping 0.3 thickness 0.075 pressure 2e4 ";
const std::string GRAINS = RECIPE + "threads 1 device cpu ";

int rank()
{
  int me;
  MPI_Comm_rank(MPI_COMM_WORLD, &me);
  return me;
}

/// Returns the file of a library of nine packings: three seeds with three preparation frictions
/// each. Void ratios are from about 0.18 to 0.28. All ranks make the library together once.
const std::string &library()
{
  static const std::string path = [] {
    Script() << "create_rve test_rve_library.lib" + GRAINS + "seeds 1 3 friction_prep 0 0.1 0.8";
    MPI_Barrier(MPI_COMM_WORLD);
    return std::string("test_rve_library.lib");
  }();
  return path;
}

/// Removes the library file after the last test of the process, if tests of this file have run.
struct RemoveLibrary : ::testing::Environment {
  void TearDown() override
  {
    if (!rve_test::runs_tests_of(__FILE__)) return;
    MPI_Barrier(MPI_COMM_WORLD);
    if (rank() == 0) std::remove("test_rve_library.lib");
  }
};
const auto *const remove_library = ::testing::AddGlobalTestEnvironment(new RemoveLibrary);

/// 12 by 8 points. Ranks divide y, so that the IDs do not depend on the number of ranks.
const std::string points = R"(units si
dimension 2
boundary p p p
atom_style atomic
processors 1 * 1
region box block 0 12 0 8 -0.1 0.1 units box
create_box 1 box
mass 1 1.0
lattice sq 1 origin 0.5 0.5 0
create_atoms 1 box
pair_style none
comm_modify cutoff 1.0
timestep 1e-3
)";

std::string with_fix(const std::string &keywords, const std::string &before = "")
{
  const std::string dt = keywords.rfind("dt ", 0) == 0 ? "" : "dt 1e-4 ";
  return points + before + "\nfix grains all rve " + library() + " threads 1 device cpu " + dt +
      keywords + "\n" +
      "compute e all rve/atom void_ratio\ncompute sxx all rve/atom sxx\n"
      "compute sxy all rve/atom sxy\nrun 0 post no\n";
}

std::vector<double> void_ratios()
{
  std::vector<double> list;
  for (const auto &row : rve::read_library(library()).index) list.push_back(row.void_ratio);
  return list;
}

/// Returns the index of the packing with this void ratio. The void ratios of all packings differ.
int packing_with(double void_ratio)
{
  const std::vector<double> all = void_ratios();
  const auto nearest = std::min_element(all.begin(), all.end(), [&](double a, double b) {
    return std::fabs(a - void_ratio) < std::fabs(b - void_ratio);
  });
  EXPECT_NEAR(*nearest, void_ratio, 1e-6);    // radii are floats in format mixed
  return static_cast<int>(nearest - all.begin());
}

}    // namespace

TEST(CreateRveLibrary, TheFileIsTheSameOnAnyNumberOfRanksAndThreads)
{
  const std::string own = "test_rve_library.lib." + std::to_string(rank());
  Script alone(MPI_COMM_SELF);

  alone << "create_rve " + own + RECIPE + "device cpu seeds 1 3 friction_prep 0 0.1 0.8 threads 2";

  EXPECT_EQ(text_of(own), text_of(library()));
  std::remove(own.c_str());
}

TEST(CreateRveLibrary, IndexDescribesThePackings)
{
  const rve::PackingLibrary lib = rve::read_library(library());

  ASSERT_EQ(lib.index.size(), 9u);
  const double frictions[] = {0.0, 0.1, 0.8};
  for (int k = 0; k < 9; ++k) {
    EXPECT_EQ(lib.index[k].seed, 1u + k % 3);
    EXPECT_EQ(lib.index[k].preparation_friction, frictions[k / 3]);
    EXPECT_EQ(lib.index[k].overconsolidation_ratio, 1.0);
    EXPECT_EQ(lib.index[k].pressure, 2e4);
    EXPECT_EQ(lib.index[k].num_grains, 60);
    EXPECT_EQ(lib.packings[k].material.friction, 0.5);
  }
}

TEST(CreateRveLibrary, PackingsAreThoseOfSingleFiles)
{
  const std::string own = "test_rve_single." + std::to_string(rank());
  Script alone(MPI_COMM_SELF);

  alone << "create_rve " + own + GRAINS + "seed 2 friction_prep 0.1";

  const std::string single = text_of(own), lib = text_of(library());
  EXPECT_NE(lib.find("\npacking 4\n" + single.substr(single.find("gpu_rve_packing"))),
            std::string::npos);
  std::remove(own.c_str());
}

TEST(CreateRveLibrary, SkipOmitsPackingsThatCannotBePrepared)
{
  const std::string own = "test_rve_skip." + std::to_string(rank());
  Script alone(MPI_COMM_SELF);

  alone << "create_rve " + own + GRAINS + "seeds 1 2 friction_prep 0.1 void_ratio 0.9 policy skip";

  EXPECT_EQ(rve::read_library(own).index.size(), 2u);
  std::remove(own.c_str());
}

TEST(PackingChoice, IsTheSameOnAnyNumberOfRanks)
{
  const std::string wanted = "variable e atom 0.2+0.002*x";
  for (const char *choice :
       {"packing_random 1", "packing_random 1 packing_image random 2",
        "packing_void_ratio v_e 0.03", "packing_void_ratio v_e 0.03 packing_random 7",
        "packing_void_ratio v_e 0.03 packing_random 7 packing_image random 7"}) {
    Script together, alone(MPI_COMM_SELF);

    together << with_fix(choice, wanted);
    alone << with_fix(choice, wanted);

    for (const char *what : {"e", "sxx", "sxy"})
      EXPECT_EQ(together.compute(what), alone.compute(what)) << choice;
    std::set<double> different;
    for (const auto &one : alone.compute("e")) different.insert(one.second);
    EXPECT_GE(different.size(), 3u) << choice;
  }
}

TEST(PackingChoice, DoesNotDependOnTheOrderOfAtoms)
{
  const auto in_order = [](const std::vector<int> &ids) {
    const std::string path = "test_rve_order." + std::to_string(rank());
    std::ofstream data(path);
    data << "points\n\n8 atoms\n1 atom types\n0 12 xlo xhi\n0 8 ylo yhi\n-0.1 0.1 zlo "
            "zhi\n\nMasses\n\n1 1\n\nAtoms # atomic\n\n";
    for (const int id : ids) data << id << " 1 " << id << ".5 4 0\n";
    data.close();
    Script script(MPI_COMM_SELF);
    script << "units si\ndimension 2\natom_style atomic\natom_modify sort 0 0\nread_data " + path +
            "\npair_style none\ncomm_modify cutoff 1.0\nfix grains all rve " + library() +
            " packing_random 5 packing_image random 5 threads 1 device cpu dt 1e-4\n"
            "compute sxx all rve/atom sxx\ncompute sxy all rve/atom sxy\nrun 0 post no";
    std::remove(path.c_str());
    return std::make_pair(script.compute("sxx"), script.compute("sxy"));
  };
  library();

  EXPECT_EQ(in_order({1, 2, 3, 4, 5, 6, 7, 8}), in_order({5, 8, 2, 1, 7, 3, 6, 4}));
}

TEST(PackingChoice, ByNumber)
{
  Script script;
  script << with_fix("packing_variable v_which", "variable which atom (id-1)%9");

  for (const auto &one : script.compute("e"))
    EXPECT_EQ(packing_with(one.second), (one.first - 1) % 9);
}

TEST(PackingChoice, RandomDrawsAreUniform)
{
  Script script;
  script << with_fix("packing_random 3");

  std::vector<int> times(9, 0);
  for (const auto &one : script.compute("e")) ++times[packing_with(one.second)];

  // For 96 points and 9 packings, chi-square has 8 degrees of freedom and exceeds 31.8 once in ten
  // thousand times.
  double chi_square = 0.0;
  for (const int count : times) chi_square += std::pow(count - 96.0 / 9, 2) / (96.0 / 9);
  EXPECT_LT(chi_square, 31.8);
}

TEST(PackingChoice, ByVoidRatioIsTheNearest)
{
  Script script;
  script << with_fix("packing_void_ratio v_e 0.05", "variable e atom 0.18+0.008*x");

  const std::vector<double> all = void_ratios();
  for (const auto &one : script.compute("e")) {
    const double wanted = 0.18 + 0.008 * (0.5 + (one.first - 1) % 12);
    double least = 1.0;
    for (const double e : all) least = std::min(least, std::fabs(e - wanted));
    EXPECT_NEAR(std::fabs(one.second - wanted), least, 1e-6);
  }
}

TEST(PackingChoice, DrawsWithinTheToleranceOfTheVoidRatio)
{
  const std::vector<double> all = void_ratios();
  const double middle = 0.5 * (all[0] + all[1]);
  const double tolerance = 0.5 * std::fabs(all[0] - all[1]) + 1e-9;
  char words[100];
  snprintf(words, sizeof(words), "packing_void_ratio %.17g %.17g packing_random 3", middle,
           tolerance);
  Script script;
  script << with_fix(words);

  std::set<int> drawn;
  for (const auto &one : script.compute("e")) {
    EXPECT_LE(std::fabs(one.second - middle), tolerance + 1e-6);
    drawn.insert(packing_with(one.second));
  }
  EXPECT_GE(drawn.size(), 2u);
}

TEST(PackingChoice, ARandomFieldOfTheVoidRatioIsFollowed)
{
  Script script;
  script << with_fix("packing_void_ratio v_e 0.06",
                     "fix soil all property/atom d_e\nrandom_field all d_e covariance exponential "
                     "lengths 3 1 spacing 0.5 0.5 marginal uniform 0.19 0.26 seed 4\n"
                     "variable e atom d_e");

  const auto wanted = script.property("e"), got = script.compute("e");
  const std::vector<double> all = void_ratios();
  for (const auto &one : got) {
    double least = 1.0;
    for (const double e : all) least = std::min(least, std::fabs(e - wanted.at(one.first)));
    EXPECT_NEAR(std::fabs(one.second - wanted.at(one.first)), least, 1e-6);
  }
}

TEST(PackingImage, PointsGetTheStressOfTheImage)
{
  Script plain, images;
  plain << with_fix("packing_variable v_which", "variable which atom id%9") +
          "compute syy all rve/atom syy\ncompute syx all rve/atom syx\nrun 0 post no";
  images << with_fix("packing_variable v_which packing_image v_image",
                     "variable which atom id%9\nvariable image atom id%8");

  const auto xx = plain.compute("sxx"), yy = plain.compute("syy"), xy = plain.compute("sxy"),
             yx = plain.compute("syx");
  const auto image_xx = images.compute("sxx"), image_xy = images.compute("sxy");
  for (const auto &one : image_xx) {
    const tagint id = one.first;
    const int image = id % 8;
    // Both scripts add up the contact forces in float, but in another order. This is the rounding
    // error of the stress.
    const double rounding = 2e4 * 1e-5;
    EXPECT_NEAR(one.second, image % 2 ? yy.at(id) : xx.at(id), rounding);
    // Shear stress changes sign under a quarter turn and under a mirror.
    EXPECT_NEAR(image_xy.at(id), (image % 2 ? -yx.at(id) : xy.at(id)) * (image >= 4 ? -1 : 1),
                rounding);
  }
}

// ---- libraries with other keywords of fix rve ----

TEST(MassScalingOfLibraries, IncreasesTheStableStepOfAllPackingsAndKeepsTheirStress)
{
  const auto script_of = [](const std::string &keywords) {
    return with_fix("dt auto 0.5 substeps 1 packing_random 3 packing_image random 5 " + keywords);
  };
  Script light, heavy;
  light << script_of("");
  heavy << script_of("mass_scaling 4");

  // The bound of the time step is 2 over the largest frequency, which is proportional to
  // 1/sqrt(mass).
  const double step = light.fix_value("grains", 8);
  EXPECT_NEAR(heavy.fix_value("grains", 8), 2.0 * step, 1e-12 * step);
  for (const char *what : {"e", "sxx", "sxy"}) EXPECT_EQ(light.compute(what), heavy.compute(what));

  // In both scripts a point has the same packing and image. The materials differ only in
  // mass_depth.
  for (const int id : {1, 40, 96}) {
    const auto material = [&](Script &script) {
      script << "write_rve grains atom " + std::to_string(id) + " file test_rve_heavy format rve";
      MPI_Barrier(MPI_COMM_WORLD);
      const rve::Material one = rve::read_packing("test_rve_heavy").material;
      MPI_Barrier(MPI_COMM_WORLD);
      return one;
    };
    const rve::Material plain = material(light), scaled = material(heavy);
    EXPECT_EQ(scaled.mass_depth, 4.0 * plain.mass_depth) << "atom " << id;
    EXPECT_EQ(scaled.density, plain.density) << "atom " << id;
  }
  if (rank() == 0) std::remove("test_rve_heavy");
}

TEST(MassScalingOfLibraries, GivenTimeStepIsCheckedWithTheScaledMass)
{
  Script script;
  script << with_fix("dt auto 1.0 substeps 1 packing_random 3");
  char words[100];
  snprintf(words, sizeof(words), "dt %.17g packing_random 3 ", 1.2 * script.fix_value("grains", 8));

  const std::string message = message_of(with_fix(words));
  EXPECT_NE(message.find("above the stability bound"), std::string::npos) << message;
  EXPECT_NE(message.find("of packing "), std::string::npos) << message;
  EXPECT_EQ(message_of(with_fix(words + std::string("mass_scaling 4"))), "");
}

TEST(KnobsOnLibraries, AreTheSameOnAnyNumberOfRanks)
{
  // Points on the left are quiescent, points on the right are not. The atom ID determines the
  // packing, the image and whether an RVE has a shadow.
  const std::string keywords = "drive velocity_gradient yy v_rate packing_random 1 packing_image "
                               "random 2 mass_scaling 4 substeps adaptive 1e-6 1e-3 quiescent 5e-5 "
                               "stress average 2 3 shadow 5 2";
  Script together, alone(MPI_COMM_SELF);
  for (Script *script : {&together, &alone})
    *script << with_fix(keywords, "variable rate atom -0.002*x") + "run 10";

  for (const char *what : {"e", "sxx", "sxy"})
    EXPECT_EQ(together.compute(what), alone.compute(what)) << what;
  for (const int n : {1, 3, 8, 9, 11, 12, 13, 14})
    EXPECT_EQ(together.fix_value("grains", n), alone.fix_value("grains", n)) << "value " << n;
  EXPECT_GT(alone.fix_value("grains", 14), 0.0);
  EXPECT_LT(alone.fix_value("grains", 14), 96.0);
  EXPECT_GT(alone.fix_value("grains", 12), 0.0);
}

TEST(PackingChoiceErrors, AreReported)
{
  const std::string broken = "test_rve_broken.lib." + std::to_string(rank());
  std::string text = text_of(library());
  text.replace(text.find("\npacking 3\n"), 11, "\npacking 8\n");
  std::ofstream(broken) << text;
  const std::string create = "create_rve test_rve_none.lib" + GRAINS;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {with_fix(""),
       "9 packings are given; choose among them with packing_variable, packing_random, "
       "packing_stress or packing_void_ratio"},
      {with_fix("packing_variable v_which", "variable which atom id"),
       "packing_variable of atom 9 is 9; it must be a whole number from 0 to 8 (atoms with an "
       "invalid value: 88)"},
      {with_fix("packing_variable v_which", "variable which atom 0.5*(id==7)"),
       "packing_variable of atom 7 is 0.5"},
      {with_fix("packing_variable v_none"), "variable none does not exist"},
      {with_fix("packing_random 1 packing_image v_image", "variable image atom 8*(id==3)"),
       "packing_image of atom 3 is 8; it must be a whole number from 0 to 7 (atoms with an invalid "
       "value: 1)"},
      {with_fix("packing_void_ratio v_e 0.01", "variable e atom 0.2+0.4*(id>90)"),
       "packing_void_ratio of atom 91 is 0.6 [-], and no packing has a void ratio within 0.01 of "
       "it; void ratios of the packings are from 0."},
      {with_fix("packing_void_ratio 0.6 0.01"), "(atoms without a packing: 96)"},
      {with_fix("packing_void_ratio 0.6 0.01 packing_random 1"), "(atoms without a packing: 96)"},
      {with_fix("packing_void_ratio 0.2"), "packing_void_ratio tolerance has no value"},
      {with_fix("packing_void_ratio 0.2 0"),
       "packing_void_ratio tolerance is 0 [-]; it must be greater than 0"},
      {with_fix("packing_random -1"), "packing_random is -1; it must be at least 0"},
      {with_fix("packing_image random -1"),
       "packing_image random seed is -1; it must be at least 0"},
      {with_fix("packing_random 1 packing_variable v_which", "variable which atom 0"),
       "packing_variable and packing_random exclude each other"},
      {with_fix("packing_void_ratio 0.2 0.1 packing_variable v_which", "variable which atom 0"),
       "packing_variable and packing_void_ratio exclude each other"},
      {points + "fix grains all rve " + broken + " packing_random 1",
       "number of the packing is '8'; it must be an integer from 3 to 3"},
      {create + "seeds 1 0", "seeds number is 0; it must be at least 1"},
      {create + "seeds -1 2", "seeds first is -1; it must be at least 0"},
      {create + "seeds 1",
       "seeds number has no value; the command ends there; it must read: seeds first N"},
      {create + "seeds 1 2 policy ask", "policy is 'ask'; it must be stop or skip"},
      {"create_rve test_rve_none.lib" + RECIPE + "seeds 1 2 device tpu",
       "device is 'tpu'; it must be auto, cpu or cuda"},
      {create + "policy skip", "policy skip is for libraries"},
      {create + "void_ratio 0.2 friction_prep 0.1",
       "void_ratio and friction_prep exclude each other"},
      {create + "seeds 1 2 friction_prep 0.1 -0.1",
       "preparation friction [-] is -0.1; it must lie between 0"},
      {create + "seeds 1 2 void_ratio 0.2 void_ratio_tolerance 0",
       "void ratio tolerance [-] is 0; it must lie between"},
      {create + "seeds 1 2 void_ratio 0.9",
       "2 of 2 packings cannot be prepared:\n  seed 1: void ratio 0.9 cannot be reached"},
      {create + "seeds 1 2 void_ratio 0.9 policy skip", "2 of 2 packings cannot be prepared"},
  };

  for (const auto &one : cases) {
    const std::string message = message_of(one.first);
    EXPECT_NE(message.find(one.second), std::string::npos)
        << "expected '" << one.second << "' in '" << message << "'";
  }
  EXPECT_FALSE(std::ifstream("test_rve_none.lib").is_open()) << "whole or not at all";
  std::remove(broken.c_str());
}
