// SPDX-License-Identifier: GPL-2.0-only
// fix rve, compute rve/atom, create_rve and write_rve through LAMMPS scripts. The tests cover the
// commands that advance the time of RVEs, restart and deletion, and messages for wrong input.

#include "grains_script.h"
#include "rve/engine/packing_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

using namespace LAMMPS_NS;
using namespace grains_script;
using rve_test::temporary_path;
using rve_test::text_of;

namespace {

/// Returns the part of a text that starts with `begin` and stops before `end`.
std::string part_of(const std::string &text, const std::string &begin, const std::string &end)
{
  return text.substr(text.find(begin), text.find(end) - text.find(begin));
}

/// Writes the packing file with one line replaced and without its checksum.
std::string edited_packing(const std::string &name, const std::string &line_start,
                           const std::string &replacement)
{
  std::ifstream in(PACKING);
  const std::string path = temporary_path(name);
  std::ofstream out(path);
  for (std::string line; std::getline(in, line);)
    out << (line.rfind(line_start, 0) == 0       ? replacement
                : line.rfind("checksum", 0) == 0 ? "checksum none"
                                                 : line)
        << "\n";
  return path;
}

}    // namespace

TEST(FixRve, AdvancesOncePerTimestepAndNotInSetup)
{
  GrainsScript script;
  script << FOUR_ATOMS + SHEAR;

  script << "run 0\nrun 0";
  EXPECT_EQ(script.fix_value(3), 0.0);
  script << "run 3\nrun 0\nrun 2";

  EXPECT_EQ(script.fix_value(1), 4.0);
  EXPECT_EQ(script.fix_value(3), 4 * 5 * 10.0);    // RVEs, LAMMPS steps, DEM steps each
  EXPECT_EQ(script.fix_value(9), 10.0);
}

TEST(FixRve, TwoRunsEqualOne)
{
  GrainsScript once, twice;

  once << FOUR_ATOMS + SHEAR + "run 10";
  twice << FOUR_ATOMS + SHEAR + "run 4\nrun 6";

  EXPECT_EQ(once.state(3), twice.state(3));
}

TEST(FixRve, VelocityGradientGivesItsExponentialAsDeformation)
{
  GrainsScript script;
  script << FOUR_ATOMS + SHEAR + "compute f all rve/atom def_yy\nrun 10";

  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(script.per_atom("f", i), std::exp(-0.05 * (i + 1) * 0.01), 1e-14);
}

TEST(FixRve, SubstepsOfTheUserAdvanceTheirOwnTime)
{
  GrainsScript script;
  script << FOUR_ATOMS + FIX + "dt 1e-4 substeps 3 drive velocity_gradient yy -1.0\n" +
          "compute f all rve/atom def_yy\nrun 10";

  EXPECT_EQ(script.fix_value(3), 4 * 10 * 3.0);
  EXPECT_NEAR(script.per_atom("f", 0), std::exp(-1.0 * 10 * 3e-4), 1e-14);
}

TEST(FixRve, ServoHoldsItsStressUnderCompression)
{
  GrainsScript script;
  script << FOUR_ATOMS + FIX + "dt 1e-4 drive velocity_gradient yy -0.02 servo xx -1e5\n" +
          "compute s all rve/atom sxx\nrun 200";

  EXPECT_NEAR(script.per_atom("s", 0), -1e5, 2e3);
}

TEST(FixRve, ServoRatesAreThoseOfTheDeformation)
{
  // The macro step has one DEM step. In this step, a controlled component of ln F grows at the rate
  // that the servo had before. The step multiplies F by 1 + a + a^2/2 with a = rate dt. The
  // logarithm of this factor is a - a^3/6, up to higher powers of a.
  constexpr double DT = 5e-6;
  struct Case {
    std::string packing, component, drive, stress;
  };
  for (const Case &c : {Case{PACKING, "yy", "xx 0.02", "-1.2e5"},
                        {EXAMPLE_PACKINGS "/S500.rve", "zz", "xx 0.02 yy -0.01", "-1.2e5"}}) {
    SCOPED_TRACE(c.component);
    GrainsScript script;
    script << FOUR_ATOMS + "timestep 5e-6\nfix grains all rve " + c.packing +
            " threads 1 dt 5e-6 substeps 1 drive velocity_gradient " + c.drive + " servo " +
            c.component + " " + c.stress + "\ncompute f all rve/atom def_" + c.component +
            "\ncompute servo all rve/atom servo_" + c.component +
            "\ncompute x all rve/atom servo_xx\nrun 20";
    for (int step = 0; step < 5; ++step) {
      const double before = script.per_atom("f", 0), servo = script.per_atom("servo", 0);
      script << "run 1";
      const double rate = std::log(script.per_atom("f", 0) / before) / DT;
      const double rounding = 4.0 * std::numeric_limits<double>::epsilon() / DT;
      EXPECT_NEAR(rate, servo, std::fabs(servo) * servo * servo * DT * DT / 4.0 + rounding);
      EXPECT_LT(servo, -1e-3);    // the RVE is compressed
      EXPECT_NE(script.per_atom("servo", 0), servo);
      EXPECT_EQ(script.per_atom("x", 0), 0.02);    // prescribed, not controlled
    }
  }
}

TEST(FixRve, PackingVariableChoosesPerAtom)
{
  const std::string other = EXAMPLE_PACKINGS "/A20_h0075.rve";
  GrainsScript script;
  script << FOUR_ATOMS + "variable which atom id>2\n" + FIX + "packings " + other +
          " packing_variable v_which\ncompute p all rve/atom p\nrun 0";

  EXPECT_NEAR(script.per_atom("p", 0), 1e5, 1e3);
  EXPECT_NEAR(script.per_atom("p", 3), 2e4, 2e2);
}

TEST(FixRve, InertialNumberIsThatOfDaCruz)
{
  GrainsScript script;
  script << FOUR_ATOMS + FIX + "dt 1e-4 drive velocity_gradient yy -1.0\n" +
          "compute i all rve/atom inertial\ncompute p all rve/atom p\nrun 0";
  EXPECT_EQ(script.per_atom("i", 0), 0.0) << "no DEM step yet";
  script << "run 5";

  double sum = 0.0;
  const rve::RveState packing = rve::read_packing(PACKING);
  for (const double r : packing.radius) sum += r * r;
  const double d = 2.0 * std::sqrt(sum / packing.num_grains());
  // The strain rate is the strain |U - 1| of a step divided by the duration of the step, with the
  // stretch U.
  const double rate = (1.0 - std::exp(-1.0 * 1e-3)) / 1e-3;
  // The mass is that of disks 1 m long; the stress refers to the thickness of 0.075 m.
  const double expected = rate * d * std::sqrt(2650.0 * 1.0 / (0.075 * script.per_atom("p", 0)));
  EXPECT_NEAR(script.per_atom("i", 0) / expected, 1.0, 1e-9);
}

TEST(FixRve, DeletedAtomsDeleteTheirRves)
{
  GrainsScript script;
  script << FOUR_ATOMS + SHEAR + "run 1";
  const std::string of_four = script.state(4);

  script << "group gone id 1 3\ndelete_atoms group gone compress no";

  EXPECT_EQ(script.fix_value(1), 2.0);
  EXPECT_EQ(script.state(4), of_four);
  EXPECT_IN("atom 3 has no RVE of fix grains", [&] {
    try {
      script.state(3);
    } catch (const LAMMPSException &e) {
      return std::string(e.what());
    }
    return std::string();
  }());
  script << "run 1";
  EXPECT_EQ(script.fix_value(3), 2 * 2 * 10.0);
}

TEST(FixRve, AtomsCreatedLaterGetRvesAtTheNextRun)
{
  GrainsScript script;
  script << FOUR_ATOMS + SHEAR + "run 1\ncreate_atoms 1 single 1.5 1.5 0\nrun 1";

  EXPECT_EQ(script.fix_value(1), 5.0);
  EXPECT_EQ(script.fix_value(3), 4 * 2 * 10.0 + 10.0);
}

TEST(FixRve, RestartContinuesBitForBit)
{
  const std::string file = temporary_path("restart");
  const std::string rate = "variable fast atom -0.3*id\n";
  const std::string fast = rate + FIX + "dt 1e-4 drive velocity_gradient yy v_fast xy 1.0\n";
  GrainsScript whole, first, second;
  whole << FOUR_ATOMS + fast + "run 40";

  first << FOUR_ATOMS + fast + "run 17\nwrite_restart " + file + "\nclear";
  second << "read_restart " + file + "\n" + fast + "run 23";

  for (int atom = 1; atom <= 4; ++atom) EXPECT_EQ(second.state(atom), whole.state(atom));
  for (int n = 1; n <= 7; ++n) EXPECT_EQ(second.fix_value(n), whole.fix_value(n)) << "value " << n;
  EXPECT_GT(whole.fix_value(4), 2 * 4.0);    // more than two rebuilds of lists per RVE
}

TEST(FixRve, RestartFilesOfDifferentStepsAreRefused)
{
  // If a restart has several files, LAMMPS writes the file with the header first. If the run is
  // killed then, the other files still have the atoms of the previous restart.
  const std::string early = temporary_path("early."), late = temporary_path("late.");
  Script first;
  first << FOUR_ATOMS + SHEAR + "run 5\nwrite_restart " + early + "%\nrun 5\nwrite_restart " +
          late + "%";
  const std::string rate = "variable rate atom -0.05*id\n";
  ASSERT_EQ(message_of("read_restart " + late + "%\n" + rate + SHEAR), "");
  std::ofstream(late + "0", std::ios::binary) << text_of(early + "0");

  EXPECT_IN("is of step 5, but the header of the restart files is of step 10: these files were "
            "written at different steps",
            message_of("read_restart " + late + "%\n" + rate + SHEAR));
}

TEST(FixRve, RestartFileOfAnotherVersionIsRefused)
{
  const std::string file = temporary_path("restart");
  Script first;
  first << FOUR_ATOMS + SHEAR + "run 5\nwrite_restart " + file;
  std::string text = text_of(file);
  // The data of the fix begin with the negative version and the step.
  const double head[] = {-6.0, 5.0}, older[] = {-5.0, 5.0}, newer[] = {-7.0, 5.0},
               none[] = {1e-4, 5.0};
  const std::size_t place =
      text.find(std::string(reinterpret_cast<const char *>(head), sizeof(head)));
  ASSERT_NE(place, std::string::npos);
  const auto message_with = [&](const double *other) {
    text.replace(place, sizeof(head), reinterpret_cast<const char *>(other), sizeof(head));
    std::ofstream(file, std::ios::binary) << text;
    return message_of("read_restart " + file + "\nvariable rate atom -0.05*id\n" + SHEAR);
  };

  EXPECT_IN("has version 5 of the data of this fix; this program reads version 6",
            message_with(older));
  EXPECT_IN("has version 7 of the data of this fix; this program reads version 6",
            message_with(newer));
  EXPECT_IN("has version 1 or 2 of the data of this fix; this program reads version 6",
            message_with(none));
}

TEST(FixRve, ClearAndRunAgainGivesTheSame)
{
  GrainsScript script;
  script << FOUR_ATOMS + SHEAR + "run 5";
  const std::string before = script.state(2);

  script << "clear\n" + FOUR_ATOMS + SHEAR + "run 5";

  EXPECT_EQ(script.state(2), before);
}

TEST(FixRve, FrozenRveIsFlaggedAndTheOthersContinue)
{
  GrainsScript script;
  script << FOUR_ATOMS + "variable crush atom -400*(id==2)\n" + FIX +
          "dt 1e-4 policy freeze overlap_limit 0.1 drive velocity_gradient yy v_crush\n" +
          "compute status all rve/atom status\nrun 20";

  EXPECT_EQ(script.fix_value(2), 1.0);
  EXPECT_NE(script.per_atom("status", 1), 0.0);
  EXPECT_EQ(script.per_atom("status", 0), 0.0);
}

TEST(FixRve, AutomaticTimeStepFollowsTheStiffeningNetwork)
{
  GrainsScript script;
  script << FOUR_ATOMS + FIX +
          "dt auto 0.94 dt_check 10 substeps 10 drive velocity_gradient yy -1\n";
  const double at_first = script.fix_value(8);

  script << "run 100";

  EXPECT_LT(script.fix_value(8), 0.99 * at_first);
  EXPECT_GT(script.fix_value(8), 0.80 * at_first);
}

TEST(FixRve, DumpWritesTheChosenAtomsAtTheirTimes)
{
  const std::string prefix = temporary_path("snap");
  GrainsScript script;

  script << FOUR_ATOMS + SHEAR.substr(0, SHEAR.size() - 1) + " dump 2 " + prefix + " 1 3\nrun 3";

  EXPECT_IN("400 atoms", text_of(prefix + ".1.2.data"));
  EXPECT_FALSE(text_of(prefix + ".3.2.data.contacts").empty());
  EXPECT_TRUE(text_of(prefix + ".2.2.data").empty());
  EXPECT_TRUE(text_of(prefix + ".1.3.data").empty());
}

TEST(WriteRve, NativeFileReadsBackAsTheSameState)
{
  const std::string path = temporary_path("again.rve");
  GrainsScript script;
  script << FOUR_ATOMS + SHEAR + "run 5\nwrite_rve grains atom 1 file " + path + " format rve";

  GrainsScript again;
  again << FOUR_ATOMS + "fix grains all rve " + path + " drive none\n";

  EXPECT_EQ(again.state(4), script.state(1));
}

TEST(WriteRve, PlainLammpsReadsTheDataFile)
{
  const std::string path = temporary_path("grains.data");
  GrainsScript script;
  script << FOUR_ATOMS + SHEAR + "run 5\nwrite_rve grains atom 1 file " + path;

  GrainsScript plain;
  plain << "units si\ndimension 2\natom_style sphere\nread_data " + path +
          "\ncompute m all reduce sum vx\n";

  EXPECT_EQ(text_of(path + ".contacts").empty(), false);
}

TEST(CreateRve, SameSeedGivesTheSameFileAtTheRequestedPressure)
{
  const std::string a = temporary_path("made_a.rve"), b = temporary_path("made_b.rve");
  const std::string words = " grains 40 seed 5 radius uniform 0.003 0.005 kn 1e6 friction 0.5 "
                            "density 2650 damping 0.3 pressure 1e5 thickness 0.075";
  GrainsScript script;

  script << "units si\ncreate_rve " + a + words + "\ncreate_rve " + b + words;

  EXPECT_EQ(text_of(a), text_of(b));
  script << FOUR_ATOMS.substr(FOUR_ATOMS.find('\n') + 1) + "fix grains all rve " + a +
          "\ncompute p all rve/atom p\nrun 0";
  EXPECT_NEAR(script.per_atom("p", 0), 1e5, 2e2);
}

// ---- rolling resistance ----

namespace {

/// Returns the rolling stiffness and rolling friction of the RVE for these keywords of fix rve and
/// a packing file.
std::string material_with(const std::string &keywords, const std::string &packing = PACKING)
{
  GrainsScript script;
  script << FOUR_ATOMS + "fix grains all rve " + packing + " threads 1 dt auto 0.5 " + keywords +
          "\nrun 0";
  const std::string state = script.state(1);
  return value_in(state, "rolling_stiffness") + " " + value_in(state, "rolling_friction");
}

const std::string ROLLING_SHEAR =
    FIX + "dt 5e-5 drive velocity_gradient yy v_rate xy 0.5 kr 5e5 rolling_friction 0.1 ";

}    // namespace

TEST(RollingResistance, KeywordsReplaceTheMaterialOneByOne)
{
  EXPECT_EQ(material_with(""), " ");    // the file has neither value
  EXPECT_EQ(material_with("kr 2e5 rolling_friction 0.1"), "2e+05 0.1");
  EXPECT_EQ(material_with("rolling_friction 0.1 kr 2e5"), "2e+05 0.1");

  const std::string file = temporary_path("rolling.rve");
  GrainsScript script;
  script << FOUR_ATOMS + ROLLING_SHEAR + "\nrun 2\nwrite_rve grains atom 1 file " + file +
          " format rve";
  EXPECT_EQ(material_with("", file), "5e+05 0.1");
  EXPECT_EQ(material_with("rolling_friction 0.3", file), "5e+05 0.3");
  EXPECT_EQ(material_with("kr 1e5", file), "1e+05 0.1");

  // A stiffness of zero is stored in a packing file and read again.
  script << "unfix grains\n" + FIX + "dt 5e-5 kr 0 rolling_friction 0.1\nrun 0\nwrite_rve grains " +
          "atom 1 file " + file + " format rve";
  EXPECT_EQ(material_with("", file), "0 0.1");
}

TEST(RollingResistance, StiffnessIsTheTangentialOneUnlessItIsGiven)
{
  EXPECT_EQ(material_with("kt 3e5 rolling_friction 0.1"), "3e+05 0.1");
  EXPECT_EQ(material_with("rolling_friction 0.1 kt 3e5"), "3e+05 0.1");
  // Keywords replace the values of the file.
  EXPECT_EQ(material_with("rolling_friction 0.1 kr 0"), "0 0.1");
  EXPECT_EQ(material_with("kr 2e5"), "2e+05 0");
}

TEST(RollingResistance, IsOffWithoutACoefficientOrAStiffnessToTheLastBit)
{
  const std::string shear = FIX + "dt 5e-5 drive velocity_gradient yy v_rate xy 0.5 ";
  GrainsScript plain, without_friction, without_stiffness, with;
  plain << FOUR_ATOMS + shear + "\nrun 10";
  without_friction << FOUR_ATOMS + shear + "kr 1e6\nrun 10";
  without_stiffness << FOUR_ATOMS + shear + "kr 0 rolling_friction 0.5\nrun 10";
  with << FOUR_ATOMS + shear + "rolling_friction 0.5\nrun 10";

  const auto grains = [](GrainsScript &script) {
    const std::string state = script.state(2);
    return part_of(state, "\ngrains", "\nchecksum");
  };
  EXPECT_EQ(grains(without_friction), grains(plain));
  EXPECT_EQ(grains(without_stiffness), grains(plain));
  EXPECT_NE(grains(with), grains(plain));
}

TEST(RollingResistance, RestartContinuesBitForBit)
{
  const std::string file = temporary_path("restart");
  const std::string rate = "variable rate atom -0.05*id\n";
  const std::string shear = "dt 5e-5 drive velocity_gradient yy v_rate xy 0.5 ";
  for (const std::string material :
       {"kr 5e5 rolling_friction 0.1",
        "contact hertz 2e9 0.7 tangential mindlin 1.7e9 0.5 0.5 damping coeff_restitution "
        "rolling sds 5e5 0 0.1",
        "contact dmt 4e9 5 0.25 20 tangential mindlin NULL 0.5 0.5 damping velocity "
        "rolling sds 5e5 0 0.1",
        "contact dmt 4e9 5 0.25 20 tangential mindlin NULL 0.5 0.5 damping velocity "
        "rolling sds 5e5 0 0.1 reach 3e-4"}) {
    SCOPED_TRACE(material);
    GrainsScript whole, first, second;
    whole << FOUR_ATOMS + FIX + shear + material + "\nrun 40";

    first << FOUR_ATOMS + FIX + shear + material + "\nrun 17\nwrite_restart " + file + "\nclear";
    // The second script omits the keywords of the material, which then comes from the restart file.
    second << "read_restart " + file + "\n" + rate + FIX + shear + "\nrun 23";

    for (int atom = 1; atom <= 4; ++atom) EXPECT_EQ(second.state(atom), whole.state(atom));
    EXPECT_EQ(value_in(second.state(1), "rolling_friction"), "0.1");
  }
}

TEST(RollingResistance, NativeFileReadsBackAsTheSameState)
{
  const std::string path = temporary_path("again.rve");
  GrainsScript script, again;
  script << FOUR_ATOMS + ROLLING_SHEAR + "\nrun 5\nwrite_rve grains atom 1 file " + path +
          " format rve";

  again << FOUR_ATOMS + "fix grains all rve " + path + " drive none\n";

  // A file lists the contacts in the order of their owners. Which of two grains owns a contact
  // depends on the Verlet list. The file does not store the list, so both texts are compared with
  // sorted contacts.
  const auto with_contacts_in_order = [](const std::string &state) {
    std::istringstream text(state.substr(0, state.rfind("\nchecksum")));
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) lines.push_back(line);
    const auto contacts = std::find_if(lines.begin(), lines.end(), [](const std::string &line) {
      return line.rfind("contacts ", 0) == 0;
    });
    EXPECT_GT(lines.end() - contacts, 500);
    std::sort(contacts, lines.end());
    return lines;
  };
  EXPECT_EQ(with_contacts_in_order(again.state(4)), with_contacts_in_order(script.state(1)));
}

TEST(RollingResistance, OfTheScriptCountsInTheStableTimeStep)
{
  GrainsScript soft, stiff;
  soft << FOUR_ATOMS + FIX + "dt auto 0.5\n";
  stiff << FOUR_ATOMS + FIX + "dt auto 0.5 kr 4e6 rolling_friction 0.1\n";

  // For spins alone, rolling resistance increases the stiffness of a contact from k_t r^2 to k_t
  // r^2 + k_r r^2/4, with k_t = 1e6, k_r = 4e6 and the radius r. The square of the largest
  // frequency therefore increases by at most a factor of two.
  EXPECT_LT(stiff.fix_value(8), 0.95 * soft.fix_value(8));
  EXPECT_GT(stiff.fix_value(8), 0.70 * soft.fix_value(8));
}

TEST(RollingResistance, ContactsOfTheDataFileHaveItsForce)
{
  const std::string path = temporary_path("grains.data");
  GrainsScript script;
  script << FOUR_ATOMS + ROLLING_SHEAR + "\nrun 5\nwrite_rve grains atom 1 file " + path;

  // Column 12 of the table is the rolling force f_r. It is at most mu_r f_n, with the normal force
  // f_n and mu_r = 0.1.
  std::istringstream table(text_of(path + ".contacts"));
  std::string line;
  std::getline(table, line);
  std::getline(table, line);
  EXPECT_IN("force_y f_r", line);
  double largest = 0.0;
  int rows = 0;
  while (std::getline(table, line)) {
    std::istringstream row(line);
    double value[12];
    for (double &v : value) ASSERT_TRUE(row >> v) << line;
    largest = std::max(largest, std::fabs(value[11]) / value[7]);
    ++rows;
  }
  EXPECT_GT(rows, 400);
  // At least one rolling force is at its limit, except for the rounding of the format.
  EXPECT_NEAR(largest, 0.1, 1e-5);
}

TEST(RollingResistance, PackingIsPreparedWithoutIt)
{
  const std::string plain = temporary_path("plain.rve"), rolling = temporary_path("rolling.rve");
  const std::string words =
      " grains 40 seed 5 radius uniform 0.003 0.005 kn 1e6 kt 5e5 friction 0.5 "
      "density 2650 damping 0.3 pressure 1e5 thickness 0.075";
  GrainsScript script;

  script << "units si\ncreate_rve " + plain + words + "\ncreate_rve " + rolling + words +
          " rolling_friction 0.2";

  const std::string with = text_of(rolling), without = text_of(plain);
  EXPECT_EQ(value_in(with, "rolling_stiffness"), "5e+05");    // the value of kt
  EXPECT_EQ(value_in(with, "rolling_friction"), "0.2");
  EXPECT_EQ(value_in(without, "rolling_friction"), "");
  EXPECT_EQ(part_of(with, "\ncell", "\nchecksum"), part_of(without, "\ncell", "\nchecksum"));
}

TEST(RollingResistance, ShadowOfTheSameStepsInDoubleIsTheRveItself)
{
  GrainsScript script;
  script << FOUR_ATOMS + ROLLING_SHEAR + "format double shadow 2 1\nrun 10";

  EXPECT_EQ(script.fix_value(12), 0.0);
}

// ---- conversion of a macro step into DEM steps ----

namespace {

/// Four atoms and computes of their RVEs. The time step is 1e-3.
const std::string KNOBS = FOUR_ATOMS + "compute s all rve/atom sxx syy sxy syx\n" +
    "compute f all rve/atom def_yy\ncompute p all rve/atom p\ncompute q all rve/atom q\n";

std::vector<double> stress_of(GrainsScript &script, int i)
{
  Compute *c = script.lmp->modify->get_compute_by_id("s");
  c->compute_peratom();
  return {c->array_atom[i], c->array_atom[i] + 4};
}

double largest_difference(const std::vector<double> &a, const std::vector<double> &b)
{
  double largest = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::fabs(a[k] - b[k]));
  return largest;
}

}    // namespace

TEST(AdaptiveSubsteps, FollowTheStrainAndGiveTheQuasiStaticStress)
{
  // At 0.02/s a macro step of 1 ms has a strain of 2e-5. With a limit of 1e-6 per DEM step this
  // takes 20 DEM steps. With `substeps match` the macro step has 10 DEM steps of 1e-4.
  const std::string drive = "dt 1e-4 drive velocity_gradient yy -0.02\n";
  GrainsScript matched, fine, coarse;
  matched << KNOBS + FIX + drive + "run 100";
  fine << KNOBS + FIX + "substeps adaptive 1e-6 1 " + drive + "run 100";
  coarse << KNOBS + FIX + "substeps adaptive 1e-2 1 " + drive + "run 100";

  EXPECT_EQ(matched.fix_value(9), 10.0);
  EXPECT_EQ(fine.fix_value(9), 20.0);
  EXPECT_EQ(fine.fix_value(3), 4 * 100 * 20.0);
  EXPECT_EQ(coarse.fix_value(3), 4 * 100 * 1.0);
  // With either limit the RVE gets the whole strain of the run, 2e-3. With the limit of 1e-6, the
  // stress also agrees with the stress of `matched`.
  for (GrainsScript *script : {&fine, &coarse})
    EXPECT_NEAR(script->per_atom("f", 0), std::exp(-0.02 * 0.1), 1e-14);
  const double p = matched.per_atom("p", 0);
  EXPECT_LT(largest_difference(stress_of(fine, 0), stress_of(matched, 0)), 0.02 * p);
}

TEST(AdaptiveSubsteps, KeepTheInertialNumberBelowItsBound)
{
  const std::string drive = "dt 1e-4 drive velocity_gradient yy -0.2\n";
  GrainsScript tight, loose;
  tight << KNOBS + FIX + "substeps adaptive 1e-2 1e-4 " + drive + "run 1";
  loose << KNOBS + FIX + "substeps adaptive 1e-2 1e-3 " + drive + "run 1";

  // The inertial number of n DEM steps per macro step is I = strain/(n dt) d sqrt(rho
  // depth/(thickness p)). Here d = 0.0077 m, rho = 2650 kg/m^3, depth = 1 m, thickness = 0.075 m
  // and p = 1e5 Pa, so that I = 1e-4 requires n = 91.
  EXPECT_NEAR(tight.fix_value(9), 91.0, 3.0);
  EXPECT_NEAR(loose.fix_value(9), 9.0, 2.0);
}

TEST(Quiescent, SkippedRveUsesItsStiffness)
{
  // Atom 1 strains by 1e-8 per step, atom 4 by 4e-8.
  const std::string drive = "variable slow atom -1e-5*id\n" + FIX +
      "dt 1e-4 drive velocity_gradient yy v_slow quiescent 1e-6\n";
  GrainsScript script;
  script << KNOBS + drive + "run 0";
  const std::vector<double> before = stress_of(script, 0);

  script << "run 45";

  EXPECT_EQ(script.fix_value(14), 4.0);
  EXPECT_EQ(script.fix_value(3), 6 * 10.0);    // 4 in the first step, then atoms 3 and 4 once
  EXPECT_NEAR(script.per_atom("f", 0), 1.0 - 4.5e-7, 1e-12);
  const std::vector<double> after = stress_of(script, 0);
  // Voigt's estimate of the plane modulus is about 10 MPa, so the stress changes by several Pa.
  EXPECT_LT(after[1] - before[1], -2.0);
  EXPECT_GT(after[1] - before[1], -20.0);
  EXPECT_EQ(script.fix_value(2), 0.0);
}

TEST(Quiescent, AppliesTheWholeDeferredDeformation)
{
  const std::string drive = FIX + "dt 1e-4 substeps 100 drive velocity_gradient yy -1e-3\n";
  const std::string skipping = drive.substr(0, drive.size() - 1) + " quiescent 4.5e-5\n";
  GrainsScript always, sometimes;
  always << KNOBS + drive + "run 120";
  sometimes << KNOBS + skipping + "run 120";

  // The strain per step is 1e-5. Only one macro step in five is computed, but the total strain must
  // be equal.
  EXPECT_EQ(always.fix_value(3), 4 * 120 * 100.0);
  EXPECT_EQ(sometimes.fix_value(3), 4 * 24 * 100.0);
  EXPECT_NEAR(sometimes.per_atom("f", 0), always.per_atom("f", 0), 1e-14);
  const double p = always.per_atom("p", 0);
  EXPECT_LT(largest_difference(stress_of(sometimes, 0), stress_of(always, 0)), 5e-3 * p);
}

TEST(Quiescent, QuiescentRveRotatesItsStress)
{
  // A rotation is no strain. The RVE is quiescent from the second step on and rotates by half a
  // radian.
  GrainsScript script;
  script << KNOBS + "variable left equal 5*(step>1)\nvariable right equal -v_left\n" + FIX +
          "dt 1e-4 drive velocity_gradient xy v_right yx v_left quiescent 1e-6\nrun 1";
  const std::vector<double> s = stress_of(script, 0);
  const double p = script.per_atom("p", 0), q = script.per_atom("q", 0);

  script << "run 100";

  EXPECT_EQ(script.fix_value(3), 4 * 10.0);
  EXPECT_EQ(script.fix_value(14), 4.0);
  EXPECT_NEAR(script.per_atom("p", 0), p, 1e-10 * p);
  EXPECT_NEAR(script.per_atom("q", 0), q, 1e-10 * p);
  const double c = std::cos(0.5), r = std::sin(0.5);
  EXPECT_NEAR(stress_of(script, 0)[0], c * c * s[0] + r * r * s[1] - c * r * (s[2] + s[3]),
              1e-9 * p);
}

namespace {

void check_that_a_turned_rve_wakes_as_if_it_had_not(const std::string &keywords)
{
  SCOPED_TRACE(keywords);
  // After a step at rest, the RVE of `turned` is quiescent and rotates by a quarter turn in 100
  // steps of a millisecond. Then it is compressed by 5e-4 along the axis of the material that was y
  // at first. The RVE of `still` does not rotate and is compressed along y.
  const auto script_of = [&](const std::string &turn, const std::string &xx,
                             const std::string &yy) {
    return KNOBS + "variable left equal (step>1)*(step<=101)*" + turn +
        "\nvariable right equal -v_left\n" + "variable xx equal -0.01*(step>101)*" + xx +
        "\nvariable yy equal -0.01*(step>101)*" + yy + "\n" + FIX +
        "dt 1e-4 quiescent 1e-6 drive velocity_gradient xx v_xx xy v_right yx v_left yy v_yy " +
        keywords + "\nrun 101\n";
  };
  GrainsScript still, turned;
  still << script_of("0", "0", "1");
  turned << script_of("PI/0.2", "1", "0");
  EXPECT_EQ(turned.fix_value(14), 4.0);
  EXPECT_EQ(turned.fix_value(3), 4 * 10.0);

  still << "run 50";
  turned << "run 50";

  EXPECT_EQ(turned.fix_value(3), 4 * 51 * 10.0);
  const double p = still.per_atom("p", 0);
  EXPECT_GT(std::fabs(stress_of(still, 0)[1] - stress_of(still, 0)[0]), 1e3);
  EXPECT_NEAR(stress_of(turned, 0)[0], stress_of(still, 0)[1], 1e-5 * p);
  EXPECT_NEAR(stress_of(turned, 0)[1], stress_of(still, 0)[0], 1e-5 * p);
}

}    // namespace

TEST(Quiescent, RotationWhileQuiescentIsRecovered)
{
  check_that_a_turned_rve_wakes_as_if_it_had_not("");
}

TEST(Quiescent, RotationWhileQuiescentIsRecoveredWithRollingResistance)
{
  check_that_a_turned_rve_wakes_as_if_it_had_not("kr 2e5 rolling_friction 0.1");
}

TEST(Quiescent, RveThatIsNotAtRestIsNotSkipped)
{
  // A sudden strain of 2 % leaves the grains in motion; no strain follows.
  GrainsScript script;
  script << KNOBS + "variable kick equal -20*(step<=1)\n" + FIX +
          "dt 1e-4 drive velocity_gradient yy v_kick quiescent 1e-6\nrun 3";

  EXPECT_EQ(script.fix_value(3), 4 * 3 * 10.0);
  script << "run 200";
  EXPECT_LT(script.fix_value(3), 4 * 203 * 10.0);    // the grains came to rest and were skipped
  EXPECT_EQ(script.fix_value(14), 4.0);
}

TEST(Quiescent, RestartOfAQuiescentRveContinuesBitForBit)
{
  const std::string file = temporary_path("restart_asleep");
  const std::string fix = "variable slow atom -1e-3*id\n" + FIX +
      "dt 1e-4 drive velocity_gradient yy v_slow xy 1e-3 quiescent 2e-5 shadow 2 3 "
      "substeps adaptive 1e-6 1e-3 stress average 3 2\n";
  const std::string computes = KNOBS.substr(FOUR_ATOMS.size());
  GrainsScript whole, first, second;
  whole << KNOBS + fix + "run 40";

  first << KNOBS + fix + "run 17\nwrite_restart " + file + "\nclear";
  second << "read_restart " + file + "\n" + computes + fix + "run 23";

  EXPECT_GT(whole.fix_value(14), 0.0);
  for (int atom = 1; atom <= 4; ++atom) EXPECT_EQ(second.state(atom), whole.state(atom));
  for (int i = 0; i < 4; ++i) EXPECT_EQ(stress_of(second, i), stress_of(whole, i));
  for (const int n : {1, 2, 3, 4, 5, 6, 7, 11, 12, 13, 14})
    EXPECT_EQ(second.fix_value(n), whole.fix_value(n)) << "value " << n;
}

TEST(MassScaling, IncreasesTheStepAndKeepsTheQuasiStaticStress)
{
  const std::string drive = "dt auto 0.5 drive velocity_gradient yy -0.02\n";
  GrainsScript light, heavy;
  light << KNOBS + FIX + drive + "run 200";
  heavy << KNOBS + FIX + "mass_scaling 4 " + drive + "run 200";

  // A macro step of 1 ms takes 17 DEM steps without mass scaling and 9 with it.
  EXPECT_NEAR(light.fix_value(9) / heavy.fix_value(9), 2.0, 0.2);
  const double p = light.per_atom("p", 0);
  EXPECT_GT(p, 1.1e5);
  EXPECT_LT(largest_difference(stress_of(light, 0), stress_of(heavy, 0)), 0.01 * p);
  EXPECT_NE(stress_of(light, 0), stress_of(heavy, 0));
}

TEST(StressSamples, AverageIsTheMeanOverTheLastSubsteps)
{
  // `single` makes the same DEM steps one by one. The samples are its stresses after 4, 7 and 10
  // steps.
  const std::string drive = "dt 1e-4 drive velocity_gradient yy -1\n";
  GrainsScript average, regression, single;
  average << KNOBS + FIX + "format double substeps 10 stress average 3 3 " + drive + "run 1";
  regression << KNOBS + FIX + "format double substeps 10 stress regression 3 3 " + drive + "run 1";
  single << KNOBS + FIX + "format double substeps 1 " + drive;

  std::vector<std::vector<double>> samples;
  for (const int steps : {4, 3, 3}) {
    single << "run " + std::to_string(steps);
    samples.push_back(stress_of(single, 0));
  }

  // The two scripts differ slightly: within a macro step of ten DEM steps the cell moves along a
  // straight path, in `single` along an exponential one. For a strain of 1e-3 this changes the
  // intermediate strains by about 1e-6.
  const double p = single.per_atom("p", 0);
  for (int k = 0; k < 4; ++k) {
    const double mean = (samples[0][k] + samples[1][k] + samples[2][k]) / 3.0;
    EXPECT_NEAR(stress_of(average, 0)[k], mean, 1e-4 * p);
    // The fitted line ends above the mean by half the difference of the outer two samples.
    EXPECT_NEAR(stress_of(regression, 0)[k], mean + 0.5 * (samples[2][k] - samples[0][k]),
                1e-4 * p);
  }
  EXPECT_NEAR(average.per_atom("f", 0), single.per_atom("f", 0), 1e-14);
  EXPECT_EQ(average.fix_value(3), 40.0);
}

TEST(Shadow, OfTheSameStepsInDoubleIsTheRveItself)
{
  GrainsScript script;
  script << KNOBS + FIX +
          "format double shadow 3 1 dt 1e-4 drive velocity_gradient yy v_rate xy 0.1\n" + "run 20";

  EXPECT_EQ(script.fix_value(11), 0.0);
  EXPECT_EQ(script.fix_value(12), 0.0);
}

TEST(Shadow, MeasuresTheErrorOfFormatAndStep)
{
  const std::string drive = "dt 1e-4 drive velocity_gradient yy v_rate xy 0.1\n";
  GrainsScript fast, finer, alone;
  fast << KNOBS + FIX + "format fast shadow 2 1 " + drive + "run 20";
  finer << KNOBS + FIX + "format double shadow 2 4 " + drive + "run 20";
  alone << KNOBS + FIX + "format fast " + drive + "run 20";

  EXPECT_GT(fast.fix_value(12), 0.0);
  EXPECT_LT(fast.fix_value(12), 1e-3);
  EXPECT_GT(finer.fix_value(12), 0.0);
  EXPECT_LT(finer.fix_value(12), 1e-2);
  EXPECT_GE(fast.fix_value(12), fast.fix_value(11));
  EXPECT_EQ(fast.fix_value(13), std::floor(fast.fix_value(13)));
  EXPECT_GE(fast.fix_value(13), 1.0);
  EXPECT_LE(fast.fix_value(13), 4.0);
  // A shadow does not change its RVE.
  for (int atom = 1; atom <= 4; ++atom) EXPECT_EQ(fast.state(atom), alone.state(atom));
}

TEST(Shadow, DetectsTheErrorOfASkippedRve)
{
  // The RVE is quiescent from the second step on. Its stress follows from Voigt's stiffness. Its
  // shadow is not quiescent and has the true stress.
  GrainsScript script;
  script << KNOBS + FIX +
          "dt 1e-4 substeps 100 quiescent 1e-3 shadow 1 1 drive velocity_gradient yy -1e-3\nrun 50";

  EXPECT_EQ(script.fix_value(3), 4 * 100.0);
  EXPECT_GT(script.fix_value(12), 1e-4);
  EXPECT_LT(script.fix_value(12), 0.1);
}

TEST(Preset, SetsItsOptionsAndKeywordsReplaceThem)
{
  const std::string fix = "fix grains all rve " + PACKING + " ";
  GrainsScript plain, draft, standard, reference, replaced;
  plain << FOUR_ATOMS + fix + "\n";
  draft << FOUR_ATOMS + fix + "preset draft\n";
  standard << FOUR_ATOMS + fix + "preset standard\n";
  reference << FOUR_ATOMS + fix + "preset reference substeps 1\n";
  replaced << FOUR_ATOMS + fix + "preset reference dt auto 0.9 substeps 1\n";

  EXPECT_EQ(standard.fix_value(8), plain.fix_value(8));
  EXPECT_NEAR(draft.fix_value(9), std::ceil(0.5 * plain.fix_value(9)), 0.0);
  EXPECT_NEAR(replaced.fix_value(8) / reference.fix_value(8), 9.0, 1e-9);
}

TEST(Warnings, NameValueLimitAndRemedyOnce)
{
  const std::string log =
      log_of(FOUR_ATOMS + FIX + "dt 1e-4 dt_check 5 drive velocity_gradient yy -5\nrun 20");

  EXPECT_IN("WARNING: fix rve grains: in the RVE of atom", log);
  EXPECT_IN("(and 3 others, 100 % of the RVEs) at step 5, the inertial number is 0.0", log);
  EXPECT_IN("above 0.001, the limit of quasi-static deformation", log);
  EXPECT_IN("use a lower strain rate", log);
  EXPECT_EQ(log.find("inertial", log.find("inertial") + 1), std::string::npos);
}

/// Returns a script with 25 RVEs. The first `fast` of them have a high strain rate.
std::string some_fast_rves(int fast)
{
  return R"(units si
dimension 2
boundary p p p
atom_style atomic
region box block 0 5 0 5 -0.5 0.5
create_box 1 box
lattice sq 1.0 origin 0.5 0.5 0.0
create_atoms 1 box
mass 1 1.0
timestep 1e-3
variable rate atom -1e-3-5*(id<=)" +
      std::to_string(fast) + ")\nfix grains all rve " + few_grains() +
      " threads 1 dt 1e-4 dt_check 5 drive velocity_gradient yy v_rate\n";
}

TEST(Warnings, OfInertialNumbersAppearOncePerRunAboveAShare)
{
  const auto count = [](const std::string &log, const std::string &part) {
    int number = 0;
    for (auto at = log.find(part); at != std::string::npos; at = log.find(part, at + 1)) ++number;
    return number;
  };
  const std::string one = log_of(some_fast_rves(1) + "run 20\nrun 0\nrun 20");
  EXPECT_EQ(count(one, "the inertial number is"), 0) << one;
  EXPECT_EQ(count(one,
                  "fix rve grains: up to 4 % of the RVEs had inertial numbers above 0.001, the "
                  "limit of quasi-static deformation; the largest was 0.0"),
            2)
      << one;
  EXPECT_IN("in the RVE of atom 1 at step", one);

  const std::string two = log_of(some_fast_rves(2) + "run 20\nrun 0\nrun 20");
  EXPECT_EQ(count(two, "the inertial number is"), 2) << two;
  EXPECT_IN("(and 1 other, 8 % of the RVEs) at step 25, the inertial number is", two);
  EXPECT_EQ(count(two, "had inertial numbers"), 0) << two;

  const std::string none = log_of(some_fast_rves(0) + "run 20");
  EXPECT_EQ(count(none, "inertial"), 0) << none;
}

TEST(Warnings, AppearForCellSizesUnderStrainAndForInitialOverlaps)
{
  const std::string path = temporary_path("few.rve");
  const std::string make = "create_rve " + path +
      " grains 40 seed 5 radius uniform 0.003 0.005 kn 1e6 friction 0.5 "
      "density 2650 damping 0.3 pressure 1e5 thickness 0.075\n";
  const std::string log = log_of(FOUR_ATOMS + make + "fix grains all rve " + path +
                                 " drive velocity_gradient xy 10\nrun 1\nrun 2");

  EXPECT_IN("fix rve grains: cells are at least 5.8 grains wide", log);
  const std::size_t warning = log.find("grains wide, below 16, the width of a shear band");
  ASSERT_NE(warning, std::string::npos);
  EXPECT_GT(warning, log.find("Step", log.find("Step") + 1)) << "a strain of 1 % makes no band";
  EXPECT_IN("use more grains", log);
  EXPECT_EQ(log_of(FOUR_ATOMS + FIX + "\nrun 0").find("WARNING: fix rve grains"),
            std::string::npos);

  // Grains a thousand times as stiff have overlaps of 5e-6, which `fast` does not resolve.
  std::string stiff = make;
  stiff.replace(stiff.find("kn 1e6"), 6, "kn 1e9");
  const std::string fix = "fix grains all rve " + path + " format ";
  EXPECT_IN("that format fast resolves within 0.1 %; use format mixed or double",
            log_of(FOUR_ATOMS + stiff + fix + "fast\nrun 0"));
  EXPECT_EQ(log_of(FOUR_ATOMS + fix + "mixed\nrun 0").find("resolves"), std::string::npos);
}

TEST(Warnings, NameASlowRateInFast)
{
  const std::string slow = "dt 1e-4 dt_check 2 drive velocity_gradient yy -1e-7\nrun 4";

  EXPECT_IN("use format mixed", log_of(FOUR_ATOMS + FIX + "format fast " + slow));
  EXPECT_EQ(log_of(FOUR_ATOMS + FIX + "format mixed " + slow).find("WARNING: fix rve grains"),
            std::string::npos);
}

TEST(Shadow, StatesItsCostInTheLog)
{
  const std::string log =
      log_of(FOUR_ATOMS + FIX + "shadow 1 dt 1e-4 drive velocity_gradient yy -0.1\nrun 5");

  EXPECT_IN("1 of 4 RVEs have shadows in format double with 4 DEM steps for each DEM step of the "
            "RVE; on average an RVE has 1 DEM steps of shadows for each of its own",
            log);
  EXPECT_IN("shadows took", log);
  EXPECT_IN("% of the wall time of RVEs", log);
}

// ---- wrong input ----

TEST(FixRveMessage, KnobsOutOfRange)
{
  EXPECT_IN("quiescent strain is 0.5 [-]; it must be greater than 0 and at most 0.01",
            message_of(FOUR_ATOMS + FIX + "quiescent 0.5\n"));
  EXPECT_IN("quiescent and servo exclude each other",
            message_of(FOUR_ATOMS + FIX + "quiescent 1e-6 servo xx -1e5\n"));
  EXPECT_IN("substeps adaptive and servo exclude each other",
            message_of(FOUR_ATOMS + FIX + "substeps adaptive 1e-6 1e-3 servo xx -1e5\n"));
  EXPECT_IN("substeps adaptive strain is 0 [-]; it must be greater than 0",
            message_of(FOUR_ATOMS + FIX + "substeps adaptive 0 1e-3\n"));
  EXPECT_IN("mass_scaling is -1 [-]; it must be greater than 0",
            message_of(FOUR_ATOMS + FIX + "mass_scaling -1\n"));
  EXPECT_IN("stress is 'start'; it must be end, average or regression",
            message_of(FOUR_ATOMS + FIX + "stress start\n"));
  EXPECT_IN("stress samples is 1; it must be at least 2",
            message_of(FOUR_ATOMS + FIX + "stress average 1 5\n"));
  EXPECT_IN("shadow is 0; it must be at least 1", message_of(FOUR_ATOMS + FIX + "shadow 0\n"));
  EXPECT_IN("preset must be the first keyword", message_of(FOUR_ATOMS + FIX + "preset draft\n"));
  EXPECT_IN("preset is 'best'; it must be draft, standard or reference",
            message_of(FOUR_ATOMS + "fix grains all rve " + PACKING + " preset best\n"));
}

TEST(FixRveMessage, ListOfPackingsEndsAtAnyKeyword)
{
  // Each keyword lacks its value. If fix rve took a keyword for a file name, the message would say
  // that a file is missing.
  for (const char *keyword : {"drive",
                              "servo",
                              "servo_gain",
                              "servo_max_rate",
                              "dt",
                              "dt_check",
                              "substeps",
                              "quiescent",
                              "stress",
                              "mass_scaling",
                              "shadow",
                              "packing_variable",
                              "packing_random",
                              "packing_void_ratio",
                              "packing_image",
                              "format",
                              "arithmetic",
                              "device",
                              "threads",
                              "skin",
                              "block_size",
                              "arms",
                              "overlap_limit",
                              "policy",
                              "energy",
                              "dump",
                              "kn",
                              "kt",
                              "friction",
                              "kr",
                              "rolling_friction",
                              "density",
                              "damping",
                              "gamma_n",
                              "gamma_t",
                              "thickness",
                              "mass_depth",
                              "contact"}) {
    const std::string message =
        message_of(FOUR_ATOMS + FIX + "packings " + PACKING + " " + keyword + "\n");
    EXPECT_TRUE(message.find("has no value") != std::string::npos ||
                message.find("servo needs at least one of the components") != std::string::npos)
        << keyword << ": " << message;
  }
  EXPECT_IN("preset must be the first keyword",
            message_of(FOUR_ATOMS + FIX + "packings " + PACKING + " preset draft\n"));
}

// FOUR_ATOMS has no pair_style, comm_modify or atom_modify command.
TEST(Warnings, OfLammpsDoNotAppearForPointsWithRves)
{
  const std::string log = log_of(FOUR_ATOMS + SHEAR + "run 2\nrun 2");

  EXPECT_EQ(log.find("WARNING"), std::string::npos) << log.substr(log.find("WARNING"), 200);
}

TEST(Warnings, OfLammpsAppearWhereTheyApply)
{
  const std::string nve = "velocity all set 0 0 0\nfix move all nve\n";
  const std::string moved = log_of(FOUR_ATOMS + SHEAR + nve + "run 2");
  const std::string several =
      log_of(FOUR_ATOMS + FIX + "\nfix other all rve " + PACKING + "\nrun 2");
  const std::string twice = log_of(FOUR_ATOMS + SHEAR + nve + "fix again all nve\nrun 2");
  const std::string later = log_of(FOUR_ATOMS + SHEAR + nve + "run 2\nunfix move\nrun 2");

  for (const std::string &log : {moved, several, later})
    EXPECT_EQ(log.find("WARNING"), std::string::npos) << log.substr(log.find("WARNING"), 200);
  EXPECT_IN("WARNING: One or more atoms are time integrated more than once", twice);
}

TEST(Progress, LogsStepShareRemainingTimeAndThroughput)
{
  // Each step takes longer than the interval of 1e-9 s, so each step is logged.
  const std::string log = log_of(FOUR_ATOMS + SHEAR + "unfix grains\n" + FIX +
                                 "dt 1e-4 drive velocity_gradient xy 0.1 progress 1e-9\nrun 8\n");

  for (int step = 1; step <= 8; ++step)
    EXPECT_IN("fix rve grains: step " + std::to_string(step) + ", " +
                  std::to_string(12 * step + step / 2) + (step % 2 ? ".5" : ".0") +
                  " % of the run, 0:00:0",
              log);
  EXPECT_IN(" left, ", log);
  const std::size_t line = log.find("fix rve grains: step 8"), begin = log.find("left, ", line) + 6;
  // This LAMMPS step has 40 DEM steps and takes between a microsecond and ten seconds.
  const double throughput = 1e6 * std::stod(log.substr(begin));
  EXPECT_GT(throughput, 4.0);
  EXPECT_LT(throughput, 4e7);
  EXPECT_IN(" million RVE-steps per second\n", log.substr(begin, 60));
}

TEST(Progress, OfADividedRunIsThatOfTheWholeRun)
{
  const std::string log = log_of(FOUR_ATOMS + SHEAR.substr(0, SHEAR.size() - 1) +
                                 " progress 1e-9\nrun 2 start 0 stop 4\nrun 2 start 0 stop 4\n");

  for (const char *share :
       {"step 1, 25.0 %", "step 2, 50.0 %", "step 3, 75.0 %", "step 4, 100.0 %"})
    EXPECT_IN(share, log);
}

TEST(Progress, IsSilentWithZeroAndForShortRuns)
{
  for (const char *words : {"", " progress 0"}) {
    const std::string log =
        log_of(FOUR_ATOMS + SHEAR.substr(0, SHEAR.size() - 1) + words + "\nrun 3\n");

    EXPECT_EQ(log.find("of the run"), std::string::npos);
  }
}

TEST(Progress, ChangesNoResult)
{
  GrainsScript silent, talking;
  silent << FOUR_ATOMS + SHEAR + "run 20";
  talking << FOUR_ATOMS + SHEAR.substr(0, SHEAR.size() - 1) + " progress 1e-9\nrun 20";

  EXPECT_EQ(talking.state(3), silent.state(3));
}

TEST(FixRveMessage, NegativeProgress)
{
  EXPECT_IN("progress is -1 [seconds of wall time]; it must be at least 0",
            message_of(FOUR_ATOMS + FIX + "progress -1\n"));
}

namespace {

/// Sets GPU_RVE_MEMORY_LIMIT and removes it in the destructor.
class MemoryLimit {
 public:
  explicit MemoryLimit(const std::string &bytes)
  {
    setenv("GPU_RVE_MEMORY_LIMIT", bytes.c_str(), 1);
  }
  ~MemoryLimit() { unsetenv("GPU_RVE_MEMORY_LIMIT"); }
};

std::string this_many_rves(int number)
{
  std::string lines = BOX;
  for (int k = 0; k < number; ++k)
    lines += "create_atoms 1 single " + std::to_string(0.1 * k) + " 0.5 0\n";
  return lines + FIX + "device cpu dt 1e-4\n";
}

/// Returns the number that stands before `words` in a message.
int number_before(const std::string &words, const std::string &message)
{
  const std::size_t end = message.find(words), begin = message.rfind(' ', end - 2);
  return end == std::string::npos ? -1 : std::stoi(message.substr(begin));
}

}    // namespace

TEST(OutOfMemory, IsReportedBeforeTheFirstRveWithTheNumberThatFits)
{
  const MemoryLimit limit("1000000");

  const std::string message = message_of(this_many_rves(30) + "run 0\n");

  EXPECT_IN("30 RVEs need", message);
  EXPECT_IN("of the memory of the host, where 1.0 MB are free", message);
  const int fit = number_before("RVEs would fit", message);
  ASSERT_GT(fit, 0) << message;
  ASSERT_LT(fit, 29) << message;
  EXPECT_EQ(message_of(this_many_rves(fit) + "run 1\n"), "");
  EXPECT_EQ(number_before("RVEs would fit", message_of(this_many_rves(fit + 1) + "run 0\n")), fit);
}

TEST(OutOfMemory, CountsShadowsToo)
{
  const MemoryLimit limit("1000000");

  const int fit = number_before("RVEs would fit", message_of(this_many_rves(30) + "run 0\n"));
  const int with_shadows = number_before("RVEs would fit",
                                         message_of(this_many_rves(30) + "unfix grains\n" + FIX +
                                                    "device cpu dt 1e-4 shadow 3\nrun 0\n"));

  EXPECT_GT(with_shadows, 0);
  EXPECT_LT(with_shadows, fit - 2);    // a shadow stores positions and forces in double
}

TEST(OutOfMemory, CountsRollingForces)
{
  const MemoryLimit limit("1000000");

  const int fit = number_before("RVEs would fit", message_of(this_many_rves(30) + "run 0\n"));
  const int rolling = number_before("RVEs would fit",
                                    message_of(this_many_rves(30) + "unfix grains\n" + FIX +
                                               "device cpu dt 5e-5 rolling_friction 0.1\nrun 0\n"));

  EXPECT_GT(rolling, 0);
  EXPECT_LT(rolling, fit);    // each pair of the capacity takes 8 more bytes
}

TEST(OutOfMemory, IsReportedBeforeTheRvesOfARestartFileAreMade)
{
  const std::string file = temporary_path("restart");
  Script first;
  first << this_many_rves(30) + "run 1\nwrite_restart " + file;
  const MemoryLimit limit("1000000");

  const std::string message =
      message_of("read_restart " + file + "\n" + FIX + "device cpu dt 1e-4\n");

  EXPECT_IN("30 RVEs need", message);
  EXPECT_IN("RVEs would fit", message);
}

TEST(OutOfMemory, LimitOfTheEnvironmentMustBeANumber)
{
  const MemoryLimit limit("2GB");

  EXPECT_IN(
      "GPU_RVE_MEMORY_LIMIT in the environment must be a number of bytes in [0, 2^53], got 2GB",
      message_of(this_many_rves(1) + "run 0\n"));
}

TEST(FixRveMessage, MissingPackingFile)
{
  const std::string message = message_of(FOUR_ATOMS + "fix grains all rve no/such/packing.rve\n");

  EXPECT_IN("fix rve", message);
  EXPECT_IN("no/such/packing.rve", message);
}

TEST(FixRveMessage, BrokenPackingFileNamesTheLine)
{
  const std::string path = edited_packing("broken.rve", "2 0.0046", "2 radius 1 2 0 0 0");

  const std::string message = message_of(FOUR_ATOMS + "fix grains all rve " + path + "\n");

  int line = 0;
  std::ifstream file(path);
  for (std::string text; std::getline(file, text);) {
    ++line;
    if (text.rfind("2 radius", 0) == 0) break;
  }
  EXPECT_IN(path + ":" + std::to_string(line), message);
}

TEST(FixRveMessage, NegativeStiffness)
{
  const std::string of_file =
      edited_packing("soft.rve", "  normal_stiffness", "  normal_stiffness -3.0");

  EXPECT_IN("normal stiffness is -7 [force/length]; it must be finite and greater than 0",
            message_of(FOUR_ATOMS + FIX + "kn -7\n"));
  EXPECT_IN("-3", message_of(FOUR_ATOMS + "fix grains all rve " + of_file + "\n"));
}

TEST(FixRveMessage, NegativeRollingResistance)
{
  EXPECT_IN("rolling stiffness is -7 [force/length]; it must be finite and at least 0",
            message_of(FOUR_ATOMS + FIX + "kr -7\n"));
  EXPECT_IN("rolling friction coefficient is -0.1 [-]; it must be finite and at least 0",
            message_of(FOUR_ATOMS + FIX + "kr 1e6 rolling_friction -0.1\n"));
  EXPECT_IN(
      "rolling friction coefficient is -0.1 [-]; it must be finite and at least 0",
      message_of("create_rve none.rve grains 40 radius uniform 0.003 0.005 kn 1e6 density 2650 "
                 "pressure 1e5 rolling_friction -0.1\n"));
}

TEST(FixRveMessage, TimeStepAboveTheBound)
{
  const std::string message = message_of(FOUR_ATOMS + FIX + "dt 2e-4\n");

  EXPECT_IN("DEM time step 0.0002 [time] is above the stability bound 0.0001", message);
  EXPECT_IN("dt auto", message);
}

TEST(FixRveMessage, CellNarrowerThanTheCutoff)
{
  const std::string path = edited_packing("narrow.rve", "  0.14296", "  0.0100 0.0");

  const std::string message = message_of(FOUR_ATOMS + "fix grains all rve " + path + "\n");

  EXPECT_IN("it must exceed twice the largest contact distance", message);
  EXPECT_IN("use more grains", message);
}

TEST(FixRveMessage, GroupWithoutAtoms)
{
  EXPECT_IN("group all has no atoms", message_of(BOX + FIX + "\n"));
}

TEST(FixRveMessage, ComputeWithoutFix)
{
  EXPECT_IN("compute rve/atom p: no fix of style rve is defined",
            message_of(FOUR_ATOMS + "compute p all rve/atom p\nrun 0"));
  EXPECT_IN("fix other does not exist",
            message_of(FOUR_ATOMS + FIX + "\ncompute p all rve/atom p fix other\nrun 0"));
  EXPECT_IN("compute rve/atom p: there is no quantity 'pp'; did you mean p",
            message_of(FOUR_ATOMS + "compute p all rve/atom pp\n"));
}

TEST(FixRveMessage, ThreeDimensions)
{
  std::string script = FOUR_ATOMS + FIX + "\n";
  script.replace(script.find("dimension 2"), 11, "dimension 3");

  EXPECT_IN("fix rve grains: the dimension is 3; it must be 2 for packings of disks",
            message_of(script));
}

TEST(FixRveMessage, UnitsThatAreNotConsistent)
{
  std::string script = FOUR_ATOMS + FIX + "\n";
  script.replace(script.find("units si"), 8, "units real");

  EXPECT_IN("fix rve grains: units are real; they must be lj, si, cgs or micro",
            message_of(script));
}

// ---- contact laws in the form of LAMMPS' pair_coeff ----

namespace {

/// Returns the RVE as text with all digits, after some steps with these keywords.
std::string state_with(const std::string &keywords)
{
  GrainsScript script;
  script << FOUR_ATOMS + FIX + "dt 5e-5 drive velocity_gradient yy v_rate xy 0.5 " + keywords +
          "\nrun 2";
  return script.state(1);
}

}    // namespace

TEST(ContactWords, PairCoeffIsEquivalentToTheKeywords)
{
  EXPECT_EQ(state_with("contact hooke 2e6 50 tangential linear_history 1e6 0.5 0.4 damping "
                       "velocity rolling sds 2e5 0.0 0.1 twisting none thickness 0.05"),
            state_with("kn 2e6 gamma_n 50 kt 1e6 gamma_t 25 friction 0.4 kr 2e5 rolling_friction "
                       "0.1 thickness 0.05"));
}

TEST(ContactWords, ReplaceTheWholeLawOfThePacking)
{
  EXPECT_EQ(state_with("contact hooke 2e6 0 tangential linear_nohistory 0.5 0 rolling none"),
            state_with("kn 2e6 kt 0 friction 0"));
  EXPECT_EQ(state_with("kn 2e6 kt 0 friction 0.5 gamma_n 0 gamma_t 0 kr 0 rolling_friction 0"),
            state_with("contact hooke 2e6 0 tangential linear_history 0 1 0.5"));
}

TEST(ContactWords, DampingCoefficientAppliesToAllGrains)
{
  EXPECT_EQ(state_with("contact hooke 2e6 50 damping velocity tangential linear_history 1e6 0 0.4 "
                       "damping 0.2"),
            state_with("kn 2e6 gamma_n 50 kt 1e6 gamma_t 0 friction 0.4 damping 0.2"));
}

TEST(ContactWords, UnsupportedLammpsOptionsAreNamed)
{
  const auto message_with = [](const std::string &words) {
    return message_of(FOUR_ATOMS + FIX + "contact " + words + "\n");
  };
  const std::string hooke = "hooke 1e6 0 ", history = "tangential linear_history 5e5 0 0.5 ";

  EXPECT_IN("contact normal model is 'jkr'; it must be hooke, hertz, hertz/material or dmt",
            message_with("jkr 1e6 0 "));
  EXPECT_IN("contact tangential model is 'mindlin'; it must be linear_history or linear_nohistory",
            message_with(hooke + "tangential mindlin NULL 0 0.5"));
  EXPECT_IN("tangential linear_nohistory (friction by a dashpot alone) is not supported",
            message_with("hooke 1e6 50 tangential linear_nohistory 1 0.5 damping velocity"));
  EXPECT_IN("contact damping model is 'tsuji'; it must be velocity",
            message_with(hooke + history + "damping tsuji"));
  EXPECT_IN("contact has eta_n 50 and no damping model; viscoelastic, the default of pair_style "
            "granular, is not supported",
            message_with("hooke 1e6 50 " + history));
  EXPECT_IN(
      "rolling viscosity is 3 [force time/length], but rolling stiffness is 0; with a rolling "
      "viscosity it must be above 0",
      message_with(hooke + history + "rolling sds 0 3 0.1"));
  EXPECT_IN("contact twisting model is 'coulomb'; it must be sds, marshall or none",
            message_with(hooke + history + "twisting coulomb"));
  EXPECT_IN("contact does not support limit_damping; of pair_style granular it supports "
            "tangential, damping, rolling and twisting",
            message_with(hooke + history + "limit_damping"));
  EXPECT_IN("contact hooke has no reach, because only dmt has an attraction beyond contact",
            message_with(hooke + history + "reach 1e-4"));
  EXPECT_IN("contact has no tangential model", message_with(hooke + "damping velocity"));
  EXPECT_IN("contact has rolling twice",
            message_with(hooke + history + "rolling none rolling none"));
  EXPECT_IN("contact tangential mu has no value; the command ends there; it must read: contact "
            "hooke k_n eta_n tangential linear_history k_t x_gammat mu",
            message_with(hooke + "tangential linear_history 5e5 0"));
  EXPECT_IN("contact and friction exclude each other",
            message_with(hooke + history + "friction 0.3"));
  EXPECT_IN("contact and kn exclude each other",
            message_of(FOUR_ATOMS + FIX + "kn 1e6 contact " + hooke + history + "\n"));
  EXPECT_IN("normal stiffness is -7 [force/length]; it must be finite and greater than 0",
            message_of(FOUR_ATOMS + FIX + "dt 5e-5 contact hooke -7 0 " + history + "\nrun 0\n"));
}

TEST(FixRveMessage, UnknownKeyword)
{
  EXPECT_IN("fix rve grains: unknown keyword 'frition'; did you mean friction?",
            message_of(FOUR_ATOMS + FIX + "frition 0.5\n"));
  EXPECT_IN("fix rve grains: packing file has no value; the command ends there",
            message_of(FOUR_ATOMS + "fix grains all rve\n"));
  EXPECT_IN("fix rve grains: unknown keyword 'yw'; did you mean yx or yy?",
            message_of(FOUR_ATOMS + FIX + "drive velocity_gradient xx 1 yw 2\n"));
  EXPECT_IN("drive velocity_gradient has component yz, but the RVEs consist of disks",
            message_of(FOUR_ATOMS + FIX + "drive velocity_gradient xx 1 yz 2\n"));
  EXPECT_IN("fix rve grains: found '0.5' after 'kn 1e6', where a keyword or the end was expected",
            message_of(FOUR_ATOMS + FIX + "kn 1e6 0.5\n"));
  EXPECT_IN("fix rve grains: dt is 'short'; it must be a number",
            message_of(FOUR_ATOMS + FIX + "dt short\n"));
  EXPECT_IN("fix rve grains: threads is '1.5'; it must be a whole number",
            message_of(FOUR_ATOMS + "fix grains all rve " + PACKING + " threads 1.5\n"));
  EXPECT_IN("fix rve grains: substeps is 'adaptiv'; it must be a whole number; it must read: "
            "substeps N | match "
            "| adaptive strain inertia [most]",
            message_of(FOUR_ATOMS + FIX + "substeps adaptiv 1e-5 1e-3\n"));
  EXPECT_IN(
      "drive velocity_gradient yy is 'rate'; it must be a number or v_name of a variable; did "
      "you mean v_rate?",
      message_of(FOUR_ATOMS + FIX + "drive velocity_gradient yy rate\n"));
  EXPECT_IN("format is 'half'; it must be fast, mixed, double or single",
            message_of(FOUR_ATOMS + FIX + "format half\n"));
  EXPECT_IN("component xx is prescribed by both",
            message_of(FOUR_ATOMS + FIX + "drive velocity_gradient xx 1 servo xx -1e5\n"));
}

TEST(FixRveMessage, MarksTheInvalidWord)
{
  const std::string before = FIX + "friction ";
  const std::string mark(("Last input line: " + before).size(), ' ');

  EXPECT_IN("\n" + mark + "^^^^^\n", message_of(FOUR_ATOMS + before + "rough dt 1e-4\n"));
}

TEST(FixRveMessage, NanVelocityGradientNamesAtomAndComponent)
{
  // LAMMPS detects sqrt(-1) but not infinity minus infinity.
  const std::string message = message_of(FOUR_ATOMS +
                                         "variable huge atom (id==3)*1e300*1e300\n"
                                         "variable bad atom v_huge-v_huge\n" +
                                         FIX + "drive velocity_gradient xy v_bad\nrun 1");

  EXPECT_IN("velocity gradient component xy of atom", message);
  EXPECT_IN("nan [1/time] at step 1; it must be a finite number", message);
}

TEST(FixRveMessage, FailedRveNamesAtomAndReason)
{
  const std::string message =
      message_of(FOUR_ATOMS + "variable crush atom -400*(id==2)\n" + FIX +
                 "dt 1e-4 overlap_limit 0.1 drive velocity_gradient yy v_crush\nrun 20");

  EXPECT_IN("RVE of atom 2 failed at step", message);
  EXPECT_IN("overlap too large", message);
  EXPECT_IN("use a shorter DEM time step, a lower strain rate or a larger kn; with "
            "policy freeze the run continues without this RVE",
            message);
}

TEST(FixRveMessage, MinimizeIsRefused)
{
  EXPECT_IN("fix rve grains: minimize cannot be used",
            message_of(FOUR_ATOMS + SHEAR + "minimize 0 0 10 10"));
}

TEST(FixRveMessage, PackingVariableOutOfRange)
{
  EXPECT_IN("it must be a whole number from 0 to 1",
            message_of(FOUR_ATOMS + "variable which atom id\n" + FIX + "packings " + PACKING +
                       " packing_variable v_which\nrun 0"));
}

TEST(FixRveMessage, DriveMpmWithoutFixMpm)
{
  EXPECT_IN("drive mpm requires a fix mpm", message_of(FOUR_ATOMS + FIX + "drive mpm\nrun 0"));
}

// LAMMPS deletes a file-style variable at the end of its file and renumbers the variables after it.
// The fix must then still read its own variable.
TEST(FixRveVariables, AreFoundByNameAfterOthersAreDeleted)
{
  const std::string numbers = file_of_rank("numbers.txt");
  std::ofstream(numbers) << "1\n2\n3\n";
  Script script(MPI_COMM_SELF);
  script << "units si\ndimension 2\nboundary f f p\natom_style sphere\natom_modify map array\n"
            "region box block 0 1 0 1 -0.5 0.5\ncreate_box 1 box\ncreate_atoms 1 single 0.5 0.5 0\n"
            "pair_style none\ncomm_modify cutoff 0.5\ntimestep 5e-4\nvariable ft file " +
          numbers +
          "\nvariable seen equal next(ft)\nvariable fast equal -0.05\nvariable slow equal -0.04\n"
          "fix grains all rve " EXAMPLE_PACKINGS
          "/A_h0075.rve threads 1 drive velocity_gradient yy "
          "v_fast dt 5e-5 substeps 10\ncompute c all rve/atom def_yy\n"
          "thermo_style custom step v_seen\nthermo 1\nrun 20\n";
  EXPECT_NEAR(script.compute("c")[1], std::exp(-0.05 * 20 * 5e-4), 1e-12);
}

TEST(FixRveVariables, ThatAreDeletedBetweenRunsAreNamed)
{
  const std::string message = message_of(
      "units si\ndimension 2\nboundary f f p\natom_style sphere\natom_modify map array\n"
      "region box block 0 1 0 1 -0.5 0.5\ncreate_box 1 box\ncreate_atoms 1 single 0.5 0.5 0\n"
      "pair_style none\ncomm_modify cutoff 0.5\ntimestep 5e-4\nvariable fast equal -0.05\n"
      "fix grains all rve " EXAMPLE_PACKINGS "/A_h0075.rve threads 1 drive velocity_gradient yy "
      "v_fast dt 5e-5 substeps 10\nrun 2\nvariable fast delete\nrun 2 pre no\n");
  EXPECT_NE(message.find("variable fast has been deleted"), std::string::npos) << message;
}
