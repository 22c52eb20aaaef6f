// SPDX-License-Identifier: GPL-2.0-only
// Changes of existing RVEs by a script: continued runs, fix_modify and unfix. Messages for damaged
// restart files, and errors for words that would have no effect.

#include "grains_script.h"
#include "input.h"
#include "update.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>

using namespace LAMMPS_NS;
using namespace grains_script;
using rve_test::temporary_path;
using rve_test::text_of;

namespace {

const std::string RATE = "variable rate atom -0.05*id\n";

/// Writes the restart file of a run of `first` and returns its name.
std::string restart_of(const std::string &first, const std::string &name = "restart")
{
  const std::string file = temporary_path(name);
  GrainsScript script;
  script << FOUR_ATOMS + first + "run 17\nwrite_restart " + file;
  return file;
}

/// Returns the log of a run of `next` from a restart file.
std::string log_of_rest(const std::string &file, const std::string &next)
{
  return log_of("read_restart " + file + "\n" + RATE + next + "run 3\n");
}

const std::string DRIVE = "drive velocity_gradient yy v_rate xy 0.1 ";

}    // namespace

// ---- a continued run ----

TEST(ContinuedRun, AppliesAndListsTheMaterialOfItsFix)
{
  const std::string file = restart_of(SHEAR);
  const std::string words = FIX + "dt 1e-4 " + DRIVE + "friction 0.3 damping 0.2\n";

  EXPECT_IN("continues the run that wrote the restart file with changes: friction 0.5 -> 0.3 (4 "
            "RVEs), damping 0.3 -> 0.2 (4 RVEs)",
            log_of_rest(file, words));
  GrainsScript script;
  script << "read_restart " + file + "\n" + RATE + words + "run 3";
  for (int atom = 1; atom <= 4; ++atom) {
    EXPECT_EQ(value_in(script.state(atom), "friction"), "0.3");
    EXPECT_EQ(value_in(script.state(atom), "local_damping"), "0.2");
  }
}

TEST(ContinuedRun, KeepsSettingsThatItsFixOmits)
{
  const std::string file =
      restart_of(FIX + "dt auto 0.3 mass_scaling 4 friction 0.3 " + DRIVE + "\n");
  GrainsScript before, after;
  before << FOUR_ATOMS + FIX + "dt auto 0.3 mass_scaling 4 friction 0.3 " + DRIVE + "\nrun 20";

  after << "read_restart " + file + "\n" + RATE + FIX + DRIVE + "\nrun 3";

  for (int atom = 1; atom <= 4; ++atom) EXPECT_EQ(after.state(atom), before.state(atom));
  EXPECT_EQ(after.fix_value(8), before.fix_value(8));
  EXPECT_EQ(log_of_rest(file, FIX + DRIVE + "\n").find("with changes"), std::string::npos);
  // RVEs that are created later also get the settings of the restart file.
  after << "create_atoms 1 single 1.5 1.5 0\nrun 0";
  EXPECT_EQ(value_in(after.state(5), "mass_depth"), "4");
  EXPECT_EQ(value_in(after.state(5), "friction"), "0.3");
}

TEST(ContinuedRun, AppliesTheFractionOfTheStabilityBound)
{
  const std::string file = restart_of(FIX + "dt auto 0.9 substeps 10 " + DRIVE + "\n");
  const std::string words = FIX + "dt auto 0.3 substeps 10 " + DRIVE + "\n";
  GrainsScript same, lower;
  same << "read_restart " + file + "\n" + RATE + FIX + "dt auto 0.9 substeps 10 " + DRIVE +
          "\nrun 0";
  lower << "read_restart " + file + "\n" + RATE + words + "run 0";

  // Each bound is that of the present RVEs. Their contacts have changed since the start, so the
  // ratio is not exactly 0.3/0.9.
  EXPECT_NEAR(lower.fix_value(8) / same.fix_value(8), 0.3 / 0.9, 0.02);
  EXPECT_IN("dt auto 0.9 -> auto 0.3", log_of_rest(file, words));
}

TEST(ContinuedRun, AppliesAPresetAndListsItsSettings)
{
  const std::string file = restart_of(FIX + "mass_scaling 4 format fast " + DRIVE + "\n");
  const std::string words =
      "fix grains all rve " + PACKING + " preset reference threads 1 " + DRIVE + "\n";

  const std::string log = log_of_rest(file, words);

  EXPECT_IN("format fast -> double, dt auto 0.9 -> auto 0.1, mass_scaling 4 -> 1", log);
  GrainsScript script;
  script << "read_restart " + file + "\n" + RATE + words + "run 0";
  EXPECT_EQ(value_in(script.state(2), "mass_depth"), "1");
}

TEST(ContinuedRun, RefusesADtAboveTheBoundOfItsRves)
{
  // The time step of 1e-4 is stable for the packing file, but not for the RVEs of the restart file,
  // which are four times as stiff.
  const std::string file = restart_of(FIX + "dt 5e-5 kn 4e6 kt 2e6 " + DRIVE + "\n");

  EXPECT_IN(
      "DEM time step 0.0001 [time] is above the stability bound",
      message_of("read_restart " + file + "\n" + RATE + FIX + "dt 1e-4 " + DRIVE + "\nrun 1"));
}

TEST(ContinuedRun, RefusesOtherPackingsWithTheListOfDifferences)
{
  const std::string file = restart_of(SHEAR);
  const std::string other = "fix grains all rve " EXAMPLE_PACKINGS "/A20_h0075.rve threads 1 ";

  const std::string message = message_of("read_restart " + file + "\n" + RATE + other +
                                         "format fast dt 1e-4 " + DRIVE + "\n");

  EXPECT_IN("were made of other packings than those of this fix (packings: 1 with checksum ",
            message);
  EXPECT_IN("format mixed -> fast", message);
  EXPECT_IN("give the packing files of the run before", message);
}

TEST(ContinuedRun, WithTheSameFixHasTheSameBitsInEveryFormat)
{
  // The default gain of the servo depends on radii, which some formats round.
  for (const std::string format : {"fast", "single", "mixed", "double"}) {
    const std::string words = FIX + "dt 1e-4 servo xx -1.3e5 yy -1.3e5 format " + format + "\n";
    const std::string file = restart_of(words);
    GrainsScript whole, rest;
    whole << FOUR_ATOMS + words + "run 40";

    rest << "read_restart " + file + "\n" + RATE + words + "run 23";

    EXPECT_EQ(rest.state(3), whole.state(3)) << format;
  }
}

TEST(ContinuedRun, HasTheNumberOfShadowsOfItsFix)
{
  const std::string file = restart_of(FIX + "dt 1e-4 shadow 3 2 " + DRIVE + "\n");
  const auto shadows_of = [&](const std::string &words) {
    return log_of_rest(file, FIX + "dt 1e-4 " + words + DRIVE + "\n");
  };

  EXPECT_IN("shadow 3 2 -> 1 2", shadows_of("shadow 1 2 "));
  EXPECT_IN("1 of 4 RVEs have shadows", shadows_of("shadow 1 2 "));
  EXPECT_IN("4 of 4 RVEs have shadows", shadows_of("shadow 4 2 "));
}

// ---- fix_modify ----

TEST(FixModify, ChangesDriveAndServoAndKeepsTheRves)
{
  GrainsScript script;
  script << FOUR_ATOMS + FIX + "dt 1e-4 drive velocity_gradient yy -1\n" +
          "compute f all rve/atom def_yy\ncompute s all rve/atom sxx\nrun 5";

  script << "fix_modify grains drive velocity_gradient xx -1\nrun 5";
  EXPECT_NEAR(script.per_atom("f", 0), std::exp(-5e-3), 1e-12);
  EXPECT_EQ(script.fix_value(3), 4 * 10 * 10.0);
  script << "fix_modify grains drive none servo xx -1.5e5 yy -1.5e5\nrun 400";
  EXPECT_NEAR(script.per_atom("s", 0), -1.5e5, 3e3);
  script << "fix_modify grains servo none\nrun 2";
  EXPECT_EQ(script.fix_value(3), 4 * 412 * 10.0);
}

TEST(FixModify, BeforeTheFirstRunIsEquivalentToTheFix)
{
  GrainsScript said, modified;
  said << FOUR_ATOMS + FIX + "dt auto 0.5 friction 0.3 mass_scaling 2 " + DRIVE + "\nrun 10";

  modified << FOUR_ATOMS + FIX + "\nfix_modify grains dt auto 0.5 friction 0.3 mass_scaling 2 " +
          DRIVE + "\nrun 10";

  EXPECT_EQ(modified.state(3), said.state(3));
  EXPECT_EQ(modified.fix_value(8), said.fix_value(8));
}

TEST(FixModify, IsEquivalentToAContinuedRunWithAnotherFix)
{
  const std::string file = restart_of(FIX + "dt auto 0.5 " + DRIVE + "\n");
  GrainsScript modified, continued;
  modified << FOUR_ATOMS + FIX + "dt auto 0.5 " + DRIVE +
          "\nrun 17\nfix_modify grains friction 0.2 kn 1.1e6 dt auto 0.4\nrun 20";

  continued << "read_restart " + file + "\n" + RATE + FIX + "dt auto 0.4 friction 0.2 kn 1.1e6 " +
          DRIVE + "\nrun 20";

  for (int atom = 1; atom <= 4; ++atom) EXPECT_EQ(continued.state(atom), modified.state(atom));
}

TEST(FixModify, MaterialAppliesAtOnce)
{
  // Overlaps and contact forces f = k_n delta do not change. With half the thickness, the volume is
  // half as large and the stress twice as large.
  GrainsScript script;
  script << FOUR_ATOMS + FIX + "kt 0 dt auto 0.5 " + DRIVE +
          "\ncompute p all rve/atom p\nrun 5\nfix_modify grains thickness 0.15\nrun 0";
  const double thick = script.per_atom("p", 1);

  script << "fix_modify grains thickness 0.075\nrun 0";

  EXPECT_NEAR(script.per_atom("p", 1) / thick, 2.0, 1e-9);
  EXPECT_IN("from step 5 on, friction 0.5 -> 0.4 (4 RVEs)",
            log_of(FOUR_ATOMS + SHEAR + "run 5\nfix_modify grains friction 0.4\n"));
}

TEST(FixModify, UnchangedSettingsChangeNothing)
{
  GrainsScript alone, told;
  alone << FOUR_ATOMS + SHEAR + "run 10";

  told << FOUR_ATOMS + SHEAR + "run 4\nfix_modify grains friction 0.5 dt 1e-4 substeps match " +
          DRIVE + "\nrun 6";

  EXPECT_EQ(told.state(3), alone.state(3));
}

TEST(FixModify, QuiescentRvesGetTheirDeferredIncrement)
{
  const std::string slow = FIX + "dt 1e-4 drive velocity_gradient yy -1e-3 quiescent 1e-3\n";
  for (const std::string change : {"quiescent none", "drive none servo yy -1e5"}) {
    GrainsScript script;
    script << FOUR_ATOMS + slow + "compute f all rve/atom def_yy def_xx\nrun 10";
    EXPECT_EQ(script.fix_value(14), 4.0);
    EXPECT_EQ(script.fix_value(3), 4 * 10.0);

    script << "fix_modify grains servo_max_rate 1e-9 quiescent none " +
            (change == "quiescent none" ? std::string("drive none") : change) + "\nrun 1";

    EXPECT_EQ(script.fix_value(14), 0.0);
    Compute *c = script.lmp->modify->get_compute_by_id("f");
    c->compute_peratom();
    EXPECT_NEAR(c->array_atom[0][0], std::exp(-1e-5), 1e-11) << change;
  }
}

TEST(FixModify, MaterialOfAQuiescentRveGetsTheNewStiffness)
{
  // The RVE is quiescent, and its deferred strain is 1e-4. The drive also rotates it. Twice the
  // stiffness must give twice the stress.
  const std::string words = FIX +
      "format double kt 0 friction 0 dt auto 0.3 quiescent 9e-3 "
      "drive velocity_gradient yy -1e-2 xy 1e-2\n";
  GrainsScript script;
  script << FOUR_ATOMS + words + "compute s all rve/atom syy\nrun 10";
  ASSERT_EQ(script.fix_value(14), 4.0);
  const double before = script.per_atom("s", 2);

  script << "fix_modify grains kn 2e6\nrun 0";

  EXPECT_NEAR(script.per_atom("s", 2) / before, 2.0, 1e-9);
}

TEST(FixModify, MaterialAppliesToShadows)
{
  // A shadow with the same DEM steps in double is equal to an RVE in double.
  GrainsScript script;
  script << FOUR_ATOMS + FIX + "format double dt auto 0.5 shadow 2 1 " + DRIVE +
          "\nrun 5\nfix_modify grains kn 2e6 friction 0.2\nrun 0";
  EXPECT_EQ(script.fix_value(12), 0.0);

  script << "run 5";

  EXPECT_EQ(script.fix_value(12), 0.0);
}

TEST(FixModify, RefusesFixedSettingsWithTheReason)
{
  const auto message_with = [](const std::string &words) {
    return message_of(FOUR_ATOMS + SHEAR + "run 1\nfix_modify grains " + words);
  };

  EXPECT_IN("format cannot be changed: it is fixed when the RVEs are created",
            message_with("format fast"));
  EXPECT_IN("packing_random cannot be changed: it selects the grains of new RVEs only",
            message_with("packing_random 5"));
  EXPECT_IN("fix_modify grains: unknown keyword 'frition'; did you mean friction?",
            message_with("frition 0.3"));
  EXPECT_IN("friction coefficient is -1 [-]; it must be finite and at least 0",
            message_with("friction -1"));
  EXPECT_IN("is above the stability bound", message_with("dt 5e-4"));
  EXPECT_IN("is above the stability bound", message_with("kn 1e8"));
  EXPECT_IN("is prescribed by both", message_with("servo yy -1e5"));
}

// ---- deleted RVEs ----

TEST(Unfix, OfAdvancedRvesGivesAWarning)
{
  const std::string run = FOUR_ATOMS + SHEAR + "run 5\n";
  const std::string warning =
      "fix rve grains: the fix is deleted with its RVEs, which have advanced";

  EXPECT_IN(warning, log_of(run + "unfix grains\n"));
  EXPECT_IN("Use fix_modify grains", log_of(run + "unfix grains\n"));
  EXPECT_IN(warning, log_of(run + SHEAR));
  EXPECT_EQ(log_of(FOUR_ATOMS + SHEAR + "run 0\nunfix grains\n").find(warning), std::string::npos);
  EXPECT_EQ(log_of(run + "clear\n").find(warning), std::string::npos);
}

// ---- damaged restart files ----

namespace {

/// A restart file of one atom. `head` is the position of the data of fix rve, and `record` is the
/// position of the record of the RVE.
struct RestartFile {
  std::string path, text;
  std::size_t head, record;

  explicit RestartFile(const std::string &name) : path(temporary_path(name))
  {
    GrainsScript script;
    script << BOX + "create_atoms 1 single 0.5 0.5 0\n" + FIX +
            "dt 1e-4 drive velocity_gradient yy -0.1\nrun 5\nwrite_restart " + path;
    text = text_of(path);
    const double version_and_step[] = {-6.0, 5.0};
    head = place_of(version_and_step, 2);
    // The header of the record begins with its length and the step.
    const int length = script.lmp->modify->get_fix_by_id("grains")->size_restart(0);
    const double length_and_step[] = {static_cast<double>(length), 5.0};
    record = place_of(length_and_step, 2);
  }

  std::size_t place_of(const double *values, int count) const
  {
    return text.find(std::string(reinterpret_cast<const char *>(values), count * sizeof(double)));
  }

  std::string message_with_flip(std::size_t byte, int bit) const
  {
    std::string damaged = text;
    damaged[byte] = static_cast<char>(damaged[byte] ^ (1 << bit));
    std::ofstream(path, std::ios::binary) << damaged;
    return message_of("read_restart " + path + "\n" + FIX +
                      "dt 1e-4 drive velocity_gradient yy -0.1\nrun 1");
  }
};

}    // namespace

TEST(DamagedRestart, HeadOfTheFixIsRefused)
{
  const RestartFile file("head");
  ASSERT_NE(file.head, std::string::npos);

  // The loop flips one bit in every third byte. The data begin with version, step, time step, mass
  // scaling and packings. Then follow checksums and the text that lists the settings.
  for (std::size_t byte = 0; byte < 120; byte += 3) {
    const std::string message = file.message_with_flip(file.head + byte, byte % 8);
    EXPECT_TRUE(message.find("damaged") != std::string::npos ||
                message.find("this program reads version 6") != std::string::npos)
        << byte << ": " << message;
  }
  // The message shows all digits of a version that is not a whole number.
  EXPECT_IN("damaged: its version is -6.00000000000", file.message_with_flip(file.head, 3));
}

TEST(DamagedRestart, LengthOfARecordIsRefusedInEveryBit)
{
  const RestartFile file("length");
  ASSERT_NE(file.record, std::string::npos);

  for (int bit = 0; bit < 64; ++bit) {
    const std::string message = file.message_with_flip(file.record + bit / 8, bit % 8);
    EXPECT_IN("damaged", message) << bit;
    EXPECT_IN("atom 1", message) << bit;
  }
}

TEST(DamagedRestart, RecordOfAnRveIsRefused)
{
  const RestartFile file("record");
  ASSERT_NE(file.record, std::string::npos);

  // After the header of the record come the head and the state of the RVE. The loop damages every
  // 13th byte in the first 700 bytes, then every 1501st.
  for (std::size_t byte = 8; byte < file.text.size() - file.record - 512;
       byte += byte < 700 ? 13 : 1501) {
    const std::string message = file.message_with_flip(file.record + byte, byte % 8);
    EXPECT_IN("atom 1", message) << byte;
    EXPECT_TRUE(message.find("damaged") != std::string::npos ||
                message.find("byte order of another machine") != std::string::npos ||
                message.find("this program reads version") != std::string::npos)
        << byte << ": " << message;
  }
}

// ---- numbers of DEM steps ----

TEST(NumberOfDemSteps, BeyondTheRangeOfIntegersIsAnErrorBeforeAnythingRuns)
{
  // The step needs 5e10 DEM steps, which would overflow an integer.
  const std::string message =
      message_of(FOUR_ATOMS + FIX + "dt 2e-14 drive velocity_gradient yy -0.05\nrun 1");
  EXPECT_IN("a timestep of 0.001 [time] needs 5e+10 DEM steps of dt 2e-14 [time]; the limit is "
            "2147483647: use a longer dt or a shorter timestep",
            message);
  EXPECT_IN("4 times as many for a shadow",
            message_of(FOUR_ATOMS + FIX + "dt 1e-12 shadow 1 4 " + DRIVE + "\nrun 1"));
  EXPECT_IN("needs 1e+10 DEM steps",
            message_of(FOUR_ATOMS + FIX + "dt 1e-4 " + DRIVE + "\nrun 1\ntimestep 1e6\nrun 1"));
}

TEST(NumberOfDemSteps, TimesTheRefinementOfShadowsHasTheSameLimit)
{
  EXPECT_IN("1000000000 DEM steps per LAMMPS step, times 4 for a shadow, are 4e+09; the limit is "
            "2147483647",
            message_of(FOUR_ATOMS + FIX + "dt 1e-4 substeps 1000000000 shadow 1 4\n"));
  EXPECT_IN(
      "1000000000 DEM steps per LAMMPS step (the most of substeps adaptive), times 3 for a shadow",
      message_of(FOUR_ATOMS + FIX + "substeps adaptive 1e-6 1e-3 1000000000 shadow 1 3\n"));
}

// ---- keywords given twice ----

TEST(SaidTwice, KeywordGivenTwiceIsAnErrorThatNamesBoth)
{
  const auto message_with = [](const std::string &words) {
    return message_of(FOUR_ATOMS + FIX + words + "\n");
  };

  EXPECT_IN(
      "servo is given twice, as 'servo xx -1.2e5' and as 'servo yy -1.1e5'; give it once, with "
      "all its values",
      message_with("servo xx -1.2e5 servo yy -1.1e5"));
  EXPECT_IN("drive is given twice, as 'drive velocity_gradient yy -0.05' and as 'drive none'",
            message_with("drive velocity_gradient yy -0.05 drive none"));
  EXPECT_IN("dump is given twice", message_with("dump 1 a 1 dump 2 b 2"));
  EXPECT_IN("friction is given twice, as 'friction 0.5' and as 'friction 0.3'",
            message_with("friction 0.5 friction 0.3"));
  EXPECT_IN("dt is given twice, as 'dt auto 0.5' and as 'dt 1e-4'",
            message_with("dt auto 0.5 dt 1e-4"));
  EXPECT_IN("packings is given twice",
            message_with("packings " + PACKING + " packings " + PACKING));
  EXPECT_IN("threads is given twice", message_with("threads 1"));
  EXPECT_IN("fix is given twice, as grains and as other",
            message_of(FOUR_ATOMS + FIX + "\ncompute p all rve/atom p fix grains fix other\n"));
  EXPECT_IN("friction is given twice",
            message_of("units si\ncreate_rve none.rve grains 40 kn 1e6 friction 0.5 friction 0.3"));
}

// ---- cells ----

TEST(NarrowCell, IsReportedAtTheStartWithARemedy)
{
  // The cell of 16 grains is narrow, and the strain soon makes it too narrow.
  const std::string few = temporary_path("few.rve");
  const std::string make = "create_rve " + few +
      " grains 16 seed 5 radius uniform 0.004 0.005 kn 1e6 friction 0.5 damping 0.3 density 2650 "
      "pressure 2e4 thickness 0.075\n";
  const std::string crush = "fix grains all rve " + few +
      " threads 1 dt auto 0.5 copies 1 drive velocity_gradient xx 5 yy -5 ";

  const std::string log = log_of(FOUR_ATOMS + make + crush + "\nrun 0");
  const std::string message = message_of(FOUR_ATOMS + crush + "\nrun 400");

  const std::size_t end = log.find(" of its height is too narrow");
  const std::string before = "of its width or ";
  const std::size_t begin = log.rfind(before, end);
  ASSERT_NE(end, std::string::npos) << log;
  const double share = std::stod(log.substr(begin + before.size()));
  EXPECT_IN("and its RVE ends the run (policy stop)", log);
  EXPECT_IN("cell too narrow", message);
  EXPECT_IN("use a packing with more grains", message);
  EXPECT_IN("with policy freeze the run continues without this RVE", message);
  // The run must fail when the height of the cell is about `share` of its first height. The failure
  // is detected when the Verlet list is rebuilt, which can be a little later. A step has 1e-3 s.
  const std::size_t at = message.find("failed at step ");
  ASSERT_NE(at, std::string::npos) << message;
  const double height = std::exp(-5.0 * 1e-3 * std::stod(message.substr(at + 15)));
  EXPECT_LE(height, share * 1.01);
  EXPECT_GE(height, share * 0.90);
}

// ---- exceptions and probable mistakes ----

TEST(FixRveMessage, AmbiguousRotationNamesFixAtomAndStep)
{
  const std::string message = message_of(
      FOUR_ATOMS + FIX + "drive velocity_gradient xy -5 yx 5 dt 5e-5 substeps 20000\nrun 1");

  EXPECT_IN("fix rve grains: RVE of atom 1, step 1: an RVE must rotate by at most 3 rad in one "
            "call, got 5 rad",
            message);
}

namespace {

/// Material points for fix mpm and their RVEs; SOIL is the command of fix mpm up to the law of its
/// model.
const std::string POINTS =
    "units si\ndimension 2\nboundary f f p\natom_style sphere\natom_modify map array sort 0 0.0\n"
    "region box block 0 4 0 4 -0.05 0.05 units box\ncreate_box 1 box\n"
    "lattice sq 0.5 origin 0.5 0.5 0.0\nregion ground block 0 4 0 3 -0.04 0.04 units box\n"
    "create_atoms 1 region ground\nset group all diameter 0.5\npair_style none\n"
    "neighbor 0.5 bin\ncomm_modify cutoff 0.5\ntimestep 1e-4\n" +
    FIX + "drive mpm\n";
const std::string SOIL = "fix soil all mpm 0.5 domain 0 4 0 4 boundary ylo fixed model all ";

}    // namespace

TEST(FixRveMessage, DriveMpmThatNoModelUses)
{
  const std::string script = POINTS + SOIL;

  EXPECT_IN("fix rve grains: the drive is mpm, but no model of a fix mpm uses this fix",
            message_of(script + "elastic 1e7 0.2 density 2200\nrun 1"));
  EXPECT_EQ(message_of(script + "rve grains\nrun 1"), "");
}

TEST(FixRveMessage, FailureInAnMpmAnalysisIsReportedOnce)
{
  // The ground hits its bottom at high speed.
  const std::string message =
      message_of(POINTS + "velocity all set 0 -400 0\n" + SOIL + "rve grains\nrun 200");

  EXPECT_IN("fix rve grains: RVE of atom", message);
  EXPECT_EQ(message.find("fix mpm"), std::string::npos) << message;
  EXPECT_EQ(message.rfind("ERROR"), message.find("ERROR")) << message;
}

TEST(FixRveMessage, TensionAsTheGoalOfTheServo)
{
  EXPECT_IN("the goal of servo xx is 100000 [stress], which is a tension; grains without cohesion "
            "carry no tension. It must be at most 0",
            message_of(FOUR_ATOMS + FIX + "servo xx 1e5\n"));
  EXPECT_IN("the goal of servo yy is 100000 [stress] for atom 1 at step 3",
            log_of(FOUR_ATOMS +
                   "variable goal equal 1e5*(step>2)-1e4\nvariable s equal "
                   "-1e5*(step<3)+1e5*(step>2)\n" +
                   FIX + "dt 1e-4 servo yy v_s\nrun 4"));
}

TEST(FixRveMessage, DumpOfAnAtomThatIsNotThere)
{
  EXPECT_IN("dump: atom 7 has no RVE of this fix",
            message_of(FOUR_ATOMS + FIX + "dump 1 a 1 7\nrun 1"));
}

TEST(FixRveMessage, Rerun)
{
  const std::string dump = temporary_path("dump");
  EXPECT_IN("fix rve grains: rerun cannot be used",
            message_of(FOUR_ATOMS + SHEAR + "dump d all atom 1 " + dump +
                       "\nrun 2\nundump d\nrerun " + dump + " dump x y"));
}

TEST(Warnings, NameAnUnsetTimestep)
{
  std::string script = FOUR_ATOMS + FIX + DRIVE;
  script.replace(script.find("timestep 1e-3"), 13, "");

  EXPECT_IN("the timestep 1e-08 [time] is the default of units si and not longer than one DEM step",
            log_of(script + "\nrun 1"));
  EXPECT_EQ(log_of(script + "\nrun 0").find("the default of units"), std::string::npos)
      << "no step, whatever its length";
  EXPECT_EQ(log_of(script + "substeps 5\nrun 1").find("the default of units"), std::string::npos);
  EXPECT_EQ(log_of(FOUR_ATOMS + SHEAR + "run 1").find("the default of units"), std::string::npos);
}
