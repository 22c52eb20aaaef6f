// SPDX-License-Identifier: GPL-2.0-only
// Input of fix rve with numbers that are far from those of real grains. Either the result must be
// correct, or a message must name the number. The tests run LAMMPS scripts on one and on several
// ranks.

#include "rve/engine/packing_io.h"
#include "script.h"
#include "support/files.h"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

using namespace LAMMPS_NS;
using rve_test::text_of;

namespace {

#define EXPECT_IN(part, whole) EXPECT_PRED_FORMAT2(::testing::IsSubstring, part, whole)

const std::string PACKING = EXAMPLE_PACKINGS "/A20_h0075.rve";

const std::string ONE_ATOM = R"(units si
dimension 2
boundary p p p
atom_style atomic
region box block 0 1 0 1 -0.5 0.5
create_box 1 box
mass 1 1.0
timestep 1e-3
create_atoms 1 single 0.5 0.5 0
)";

std::string fix(const std::string &packing, const std::string &rest)
{
  return ONE_ATOM + "fix grains all rve " + packing + " threads 1 " + rest + "\n";
}

std::string log_of(const std::string &lines)
{
  const std::string path = file_of_rank("log.extreme");
  {
    Script script(MPI_COMM_SELF, path);
    script << lines;
  }
  return text_of(path);
}

double pressure(const std::string &lines)
{
  Script script(MPI_COMM_SELF);
  script << lines + "compute p all rve/atom p\nrun 0";
  return script.compute("p").at(1);
}

}    // namespace

TEST(ExtremeInput, FirstPressureIsCorrectForAnyFriction)
{
  const double expected = pressure(fix(PACKING, "format double"));
  for (const char *friction : {"1e3", "1e6", "1e8", "1e10"})
    for (const char *format : {"fast", "mixed", "double"})
      for (const char *rolling : {"", " rolling_friction 1e8"})
        EXPECT_NEAR(
            pressure(
                fix(PACKING, std::string("friction ") + friction + " format " + format + rolling)),
            expected, 1e-5 * expected)
            << friction << " " << format << rolling;
}

TEST(ExtremeInput, FrictionBeyondItsRangeIsRefused)
{
  EXPECT_IN("friction coefficient is 1e+12 [-]; it must be at most 1e10",
            message_of(fix(PACKING, "friction 1e12")));
}

TEST(ExtremeInput, FrictionThatLooksLikeAnAngleGivesAWarning)
{
  const std::string log = log_of(fix(PACKING, "friction 30") + "run 0");
  EXPECT_IN("the friction coefficient is 30 [-], above 2", log);
  EXPECT_IN("use its tangent, 0.577", log);
}

TEST(ExtremeInput, MassesAndStiffnessesOutsideAllFormatsAreRefused)
{
  EXPECT_IN("mass depth times mass scaling is 1e+300 [length]; it must be between 1e-30 and 1e30",
            message_of(fix(PACKING, "mass_scaling 1e300")));
  EXPECT_IN("normal stiffness is 1e+300 [force/length]; it must be between 1e-30 and 1e30",
            message_of(fix(PACKING, "kn 1e300")));
  EXPECT_IN("normal stiffness is 1e-300 [force/length]; it must be between 1e-30 and 1e30",
            message_of(fix(PACKING, "kn 1e-300")));
}

TEST(ExtremeInput, GainsOfTheServoHaveARange)
{
  const std::string servo = "dt 1e-5 substeps 1 drive none servo xx -2e4 servo_gain ";
  EXPECT_IN("servo gain must be positive, from 1e-30 to 1e30",
            message_of(fix(PACKING, servo + "1e300") + "run 1"));
  EXPECT_IN("largest servo rate must be positive, from 1e-30 to 1e30",
            message_of(fix(PACKING, servo + "1 servo_max_rate 1e300") + "run 1"));
}

// The packing file states a largest contact force of up to 1e20, but no contact has such a force.
// With a force scale for 1e20, the actual forces would keep no digits.
TEST(ExtremeInput, WrongLargestForceInAFileDoesNotSetTheScale)
{
  rve::RveState state = rve::read_packing(PACKING);
  const double expected = pressure(fix(PACKING, "format double"));
  for (const double force : {1e5, 1e9, 1e20}) {
    state.largest_contact_force = force;
    const std::string path = file_of_rank("force.rve");
    rve::write_packing(path, state);
    for (const char *format : {"fast", "mixed", "double"})
      EXPECT_NEAR(pressure(fix(path, std::string("format ") + format)), expected, 1e-5 * expected)
          << force << " " << format;
  }
}

// A packing file that was written during a run continues with the force scale of that run.
TEST(ExtremeInput, LargestForceOfARunSetsTheScaleOfTheNext)
{
  const std::string path = file_of_rank("continued.rve");
  const std::string shear = "dt 5e-5 substeps 10 drive velocity_gradient xy 1";
  Script whole(MPI_COMM_SELF), parts(MPI_COMM_SELF);
  whole << fix(PACKING, shear) + "run 20\nwrite_rve grains atom 1 file " + path +
          " format rve\nrun 20\ncompute p all rve/atom p\nrun 0";
  parts << fix(path, shear) + "run 20\ncompute p all rve/atom p\nrun 0";

  EXPECT_EQ(whole.compute("p"), parts.compute("p"));
}

TEST(ExtremeInput, SpinThatIsInfiniteInAFormatIsRefused)
{
  rve::RveState state = rve::read_packing(PACKING);
  state.spin[0] = 12345.0;
  const std::string path = file_of_rank("spin.rve");
  rve::write_packing(path, state);
  std::string text = text_of(path);
  text.replace(text.find("12345"), 5, "1e200");
  const std::size_t sum = text.find("checksum ");
  text.replace(sum, text.find('\n', sum) - sum, "checksum none");
  std::ofstream(path) << text;
  EXPECT_IN("spin of grain 1 is 1e+200 [1/time]; it must be at most 1e30",
            message_of(fix(path, "format fast")));
}

TEST(ExtremeInput, RveWithoutContactsGivesAWarning)
{
  const std::string log =
      log_of(fix(PACKING, "dt 5e-5 substeps 10 drive velocity_gradient xx 10 yy 10") + "run 40");
  EXPECT_IN("in the RVE of atom 1 at step", log);
  EXPECT_IN("the packing has no contacts", log);
  EXPECT_IN("its stress is zero", log);
}

TEST(ExtremeInput, ServoThatNeverReachesItsGoalGivesAWarning)
{
  const std::string log =
      log_of(fix(PACKING,
                 "dt 5e-5 substeps 10 dt_check 20 servo yy -2e4 servo_max_rate 1e-3 "
                 "drive velocity_gradient xx 5") +
             "run 200");
  EXPECT_IN("the stress servo is at its largest strain rate, 0.001 [1/time]", log);
  EXPECT_IN("away from its goal", log);
}

TEST(ExtremeInput, HugeOverlapsGiveAWarning)
{
  const std::string log = log_of(fix(EXAMPLE_PACKINGS "/A_h1.rve", "") + "run 0");
  EXPECT_IN("the mean overlap is 0.0", log);
  EXPECT_IN("use a larger kn, a smaller thickness or a lower pressure", log);
}
