// SPDX-License-Identifier: GPL-2.0-only
// The contact laws of LAMMPS' pair_style granular for disks. LAMMPS and an RVE run the same grains,
// and the RVE reads its material from the same words of pair_coeff. While the grains collide,
// slide, load and unload, forces and torques of both codes must agree. Other tests in this file
// check the values of the words and error messages.

#include "grains_script.h"
#include "rve/core/pi.h"
#include "rve/engine/contact_laws.h"
#include "support/random.h"
#include "support/rounding.h"
#include "support/rve_rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

using namespace grains_script;
using rve::Material;
using rve::RveState;

namespace {

// ---- disks without initial contacts, so dense that all of them collide several times ----

constexpr int ROWS = 4, NUM_GRAINS = ROWS * ROWS;
constexpr double SPACING = 0.0101, WIDTH = ROWS * SPACING;    // [m]
constexpr double DENSITY = 2650.0;                            // [kg/m^3], disks of 1 m depth
constexpr double DT = 2.5e-5;    // [s], a collision takes about 200 steps

struct Grains {
  std::vector<double> radius, place, velocity, spin;
};

Grains random_grains()
{
  rve_test::Random random(20);
  Grains grains;
  for (int i = 0; i < NUM_GRAINS; ++i) {
    grains.radius.push_back(random.uniform(0.0046, 0.005));
    grains.place.push_back((0.5 + i % ROWS) * SPACING);
    grains.place.push_back((0.5 + i / ROWS) * SPACING);
    grains.velocity.push_back(random.uniform(-0.2, 0.2));
    grains.velocity.push_back(random.uniform(-0.2, 0.2));
    grains.spin.push_back(random.uniform(-40.0, 40.0));
  }
  return grains;
}

RveState state_of(const Grains &grains, const Material &material)
{
  RveState state =
      rve_test::state_of(material, WIDTH * rve::Tensor2::identity(), grains.radius, grains.place);
  state.velocity = grains.velocity;
  state.spin = grains.spin;
  return state;
}

/// Returns a path for `name` that no other test uses; names in tables have slashes.
std::string path_of(const std::string &name)
{
  std::string test = testing::UnitTest::GetInstance()->current_test_info()->name();
  std::replace(test.begin(), test.end(), '/', '_');
  return testing::TempDir() + "rve_granular_" + test + "_" + name;
}

/// Returns a packing file of the disks with linear springs.
std::string gas_file()
{
  Material material = rve_test::paper_material();
  material.local_damping = 0.0;
  material.density = DENSITY;
  const std::string path = path_of("gas.rve");
  rve::write_packing(path, state_of(random_grains(), material));
  return path;
}

/// Returns the material of a fix rve with these words, from the packing file that it writes.
Material material_of(const std::string &words)
{
  const std::string out = path_of("material.rve");
  Script script;
  script << FOUR_ATOMS + "fix grains all rve " + gas_file() + " threads 1 dt 1e-6 " + words +
          "\nrun 0\nwrite_rve grains atom 1 file " + out + " format rve";
  return rve::read_packing(out).material;
}

// ---- both codes ----

std::string digits(double x)
{
  char text[32];
  std::snprintf(text, sizeof(text), "%.17g", x);
  return text;
}

/// Numbers of each grain at a step: x, y, v_x, v_y, spin, f_x, f_y, torque. Velocities and spins
/// belong to the time half a step after that of the positions.
using Step = std::vector<std::vector<double>>;
enum { X, Y, VX, VY, SPIN, FX, FY, TORQUE, WIDTH_OF_ROW };

class GranularScript : public Script {
 public:
  GranularScript(const Grains &grains, const std::string &law) : grains_(grains)
  {
    const std::string width = digits(WIDTH);
    *this << "units si\ndimension 2\nboundary p p p\natom_style sphere\natom_modify sort 0 0\n"
             "newton off\ncomm_modify vel yes\nregion box block 0 " +
            width + " 0 " + width + " -0.005 0.005 units box\ncreate_box 1 box\n";
    for (int i = 0; i < NUM_GRAINS; ++i) {
      const std::string id = std::to_string(i + 1);
      *this << "create_atoms 1 single " + digits(grains.place[2 * i]) + " " +
              digits(grains.place[2 * i + 1]) + " 0 units box\nset atom " + id + " diameter " +
              digits(2.0 * grains.radius[i]) + "\nset atom " + id + " density/disc " +
              digits(DENSITY) + "\nset atom " + id + " vx " + digits(grains.velocity[2 * i]) +
              " vy " + digits(grains.velocity[2 * i + 1]) + " omega 0 0 " + digits(grains.spin[i]) +
              "\n";
    }
    *this << "pair_style granular\npair_coeff * * " + law + "\ntimestep " + digits(DT) +
            "\nneighbor 2e-3 bin\nneigh_modify delay 0 every 1 check yes\n"
            "fix integrate all nve/sphere disc\nfix plane all enforce2d\nrun 0\n";
  }

  Step after(int steps)
  {
    // `pre no` avoids another setup, which would compute forces with velocities at the whole step.
    *this << "run " + std::to_string(steps) + " pre no post no";
    const LAMMPS_NS::Atom *atom = lmp->atom;
    Step all;
    for (const auto &row : rows_by_id(WIDTH_OF_ROW, [&](int i, std::vector<double> &list) {
           const double radius = atom->radius[i], mass = atom->rmass[i];
           const double kick = 0.5 * DT / mass, turn = kick / (0.5 * radius * radius);
           list.insert(list.end(),
                       {atom->x[i][0], atom->x[i][1], atom->v[i][0] + kick * atom->f[i][0],
                        atom->v[i][1] + kick * atom->f[i][1],
                        atom->omega[i][2] + turn * atom->torque[i][2], atom->f[i][0], atom->f[i][1],
                        atom->torque[i][2]});
         }))
      all.push_back(row.second);
    return all;
  }

 private:
  const Grains &grains_;
};

rve::Options as_lammps()
{
  rve::Options options = rve_test::cpu_options(rve::Format::Double);
  options.arms = rve::Arms::Lammps;
  return options;
}

class RveSteps {
 public:
  explicit RveSteps(const RveState &state) : rig_(state, as_lammps()) {}

  Step after(int steps)
  {
    rig_.strain(rve::Tensor2::zero(), DT, 1, steps - 1);
    const RveState before = rig_.state();
    rig_.strain(rve::Tensor2::zero(), DT, 1);
    const RveState state = rig_.state();
    EXPECT_EQ(rig_.result().status & rve::status::Fatal, 0u);
    const std::vector<double> place = state.positions();
    Step all;
    for (int i = 0; i < NUM_GRAINS; ++i) {
      const double radius = state.radius[i], mass = DENSITY * rve::kPi * radius * radius;
      const auto force = [&](int a) {
        return mass * (state.velocity[2 * i + a] - before.velocity[2 * i + a]) / DT;
      };
      all.push_back({place[2 * i], place[2 * i + 1], state.velocity[2 * i],
                     state.velocity[2 * i + 1], state.spin[i], force(0), force(1),
                     0.5 * mass * radius * radius * (state.spin[i] - before.spin[i]) / DT});
    }
    return all;
  }
  const rve::Result &result() const { return rig_.result(); }

 private:
  rve_test::RveRig rig_;
};

double largest(const Step &step, int column)
{
  double all = 0.0;
  for (const auto &row : step) all = std::fmax(all, std::fabs(row[column]));
  return all;
}

struct Law {
  const char *name;
  const char *words;
};

class GranularLaws : public ::testing::TestWithParam<Law> {};

/// Returns forces and torques (N rows of 3) of grains at the positions of step `at`. The velocities
/// are those half a step earlier, from which LAMMPS computed its forces. Advances the histories.
template <class ContactLaw, class Histories>
std::vector<std::array<double, 3>> forces_of(const ContactLaw &law, const Grains &grains,
                                             const Step &at, Histories &histories)
{
  const auto disk = [&](int i) {
    const double radius = grains.radius[i], mass = DENSITY * rve::kPi * radius * radius;
    const double kick = DT / mass, turn = kick / (0.5 * radius * radius);
    return rve::DiskMotion<double>{{{at[i][VX] - kick * at[i][FX], at[i][VY] - kick * at[i][FY]}},
                                   at[i][SPIN] - turn * at[i][TORQUE],
                                   radius};
  };
  std::vector<std::array<double, 3>> sum(NUM_GRAINS, {0.0, 0.0, 0.0});
  for (int i = 0; i < NUM_GRAINS; ++i)
    for (int j = i + 1; j < NUM_GRAINS; ++j) {
      const rve::DiskMotion<double> one = disk(i), other = disk(j);
      const rve::Vec<double, 2> branch{
          {std::remainder(at[j][X] - at[i][X], WIDTH), std::remainder(at[j][Y] - at[i][Y], WIDTH)}};
      const auto contact = rve::contact_geometry<double>(branch, one.radius + other.radius);
      if (!(contact.overlap > 0.0)) {
        histories.erase({i, j});
        continue;
      }
      auto &history = histories[{i, j}];
      const auto force =
          evaluate(law, contact, one, other, rve::Tensor<double, 2>::zero(), history, DT);
      history = force.history();
      for (int a = 0; a < 2; ++a) {
        sum[i][a] += force.force[a];
        sum[j][a] -= force.force[a];
      }
      sum[i][2] += force.torque_i;
      sum[j][2] += force.torque_j;
    }
  return sum;
}

}    // namespace

/// Returns `step` with a changed last digit of each number on which forces depend. A position
/// changes by the last digit of its periodic image, whose coordinates have the size of the box.
Step with_other_last_digits(Step step, rve_test::Random &random)
{
  const double digit_of_image = std::nextafter(WIDTH, 1.0) - WIDTH;
  for (auto &row : step) {
    for (const int column : {X, Y})
      row[column] = rve_test::with_another_digit(row[column], digit_of_image, random);
    for (const int column : {VX, VY, SPIN})
      row[column] = rve_test::with_another_last_digit(row[column], random);
  }
  return step;
}

/// Returns the largest difference over all grains: of torques if `torques` is true, otherwise of
/// force components.
double largest_difference(const std::vector<std::array<double, 3>> &some,
                          const std::vector<std::array<double, 3>> &others, bool torques)
{
  double largest = 0.0;
  for (int i = 0; i < NUM_GRAINS; ++i)
    for (int a = torques ? 2 : 0; a < (torques ? 3 : 2); ++a)
      largest = std::fmax(largest, std::fabs(some[i][a] - others[i][a]));
  return largest;
}

// A LAMMPS run gives the positions and velocities of each step. The law computes the forces of this
// step from them. Both forces must agree except for rounding errors.
TEST_P(GranularLaws, GiveTheForcesOfLammpsInTheSameConfiguration)
{
  const std::string words = GetParam().words;
  const Grains grains = random_grains();
  const Material material = material_of("contact " + words);
  GranularScript lammps(grains, words);

  rve::with_law(material, [&](auto law) {
    using ContactLaw = decltype(law);
    typename ContactLaw::Constants constants;
    constants.set(material, rve::LawUnits::same(), 0.0);    // lever arm r of LAMMPS
    law.take(constants);
    using Histories = std::map<std::pair<int, int>, typename ContactLaw::History>;
    constexpr int kTwins = 8, kSteps = 600;
    Histories histories, twin_histories[kTwins];
    rve_test::Random random(21);
    rve_test::RoundingErrors compared[2];    // 0: forces, 1: torques
    for (int step = 0; step < kSteps; ++step) {
      const Step at = lammps.after(1);
      std::vector<std::array<double, 3>> expected;
      for (const auto &row : at) expected.push_back({row[FX], row[FY], row[TORQUE]});
      const auto found = forces_of(law, grains, at, histories);
      const std::vector<std::array<double, 3>> nothing(NUM_GRAINS, {0.0, 0.0, 0.0});
      for (const bool torques : {false, true}) {
        double &most = compared[torques].most;
        most = std::fmax(most, largest_difference(expected, nothing, torques));
        compared[torques].errors.push_back(largest_difference(found, expected, torques));
      }
      for (Histories &twin : twin_histories) {
        const auto other = forces_of(law, grains, with_other_last_digits(at, random), twin);
        for (const bool torques : {false, true}) {
          double &of_digits = compared[torques].of_digits;
          of_digits = std::fmax(of_digits, largest_difference(found, other, torques));
        }
      }
    }
    for (const bool torques : {false, true}) {
      SCOPED_TRACE(torques ? "torques" : "forces");
      rve_test::expect_rounding_only(compared[torques], torques ? 2e-11 : 1e-11);
    }
  });
}

TEST_P(GranularLaws, GiveTheForcesAndTorquesOfLammps)
{
  const std::string words = GetParam().words;
  const Grains grains = random_grains();
  Material material = material_of("contact " + words);
  GranularScript lammps(grains, words);
  RveSteps rve(state_of(grains, material));

  int sliding = 0, sticking = 0;
  for (int step = 0; step < 1200; step += 100) {
    SCOPED_TRACE("step " + std::to_string(step + 100));
    const Step expected = lammps.after(100), found = rve.after(100);
    ASSERT_EQ(expected.size(), found.size());
    const int in_contact = rve.result().num_contacts;
    sliding += static_cast<int>(std::lround(in_contact * rve.result().sliding_fraction));
    sticking += static_cast<int>(std::lround(in_contact * (1.0 - rve.result().sliding_fraction)));
    // Positions are rounded to 1e-17 m, which is 1e-13 of an overlap. Collisions amplify this
    // error. The amplification is largest for a contact that begins with a nearly vanishing
    // overlap, since the force then depends on a displacement divided by the root of the overlap.
    const double tolerance = step < 300 ? 1e-10 : 5e-9;
    for (int column = 0; column < WIDTH_OF_ROW; ++column) {
      double scale = largest(expected, column);
      if (column == FX || column == FY)
        scale = std::fmax(largest(expected, FX), largest(expected, FY));
      for (int i = 0; i < NUM_GRAINS; ++i) {
        double difference = found[i][column] - expected[i][column];
        if (column == X || column == Y) difference = std::remainder(difference, WIDTH);
        EXPECT_NEAR(difference, 0.0, tolerance * scale) << "grain " << i << " column " << column;
      }
    }
  }
  EXPECT_GT(sliding, 5);
  EXPECT_GT(sticking, 5);
}

INSTANTIATE_TEST_SUITE_P(
    OfPairCoeff, GranularLaws,
    ::testing::Values(
        Law{"Hooke", "hooke 1e5 30 tangential linear_history 8e4 0.5 0.4 damping velocity"},
        Law{"HertzVelocityMindlin", "hertz 7e7 20 tangential mindlin 6e7 0.5 0.4 damping velocity"},
        Law{"HertzVelocityMindlinForce",
            "hertz 7e7 20 tangential mindlin/force 6e7 0.5 0.4 damping velocity"},
        Law{"HertzViscoelasticMindlin",
            "hertz 7e7 3e5 tangential mindlin 6e7 0.5 0.4 damping viscoelastic"},
        Law{"HertzDefaultDampingMindlinForce", "hertz 7e7 3e5 tangential mindlin/force 6e7 1 0.4"},
        Law{"HertzRestitutionMindlin",
            "hertz 7e7 0.8 tangential mindlin 6e7 0.5 0.4 damping coeff_restitution"},
        Law{"HertzRestitutionMindlinForce",
            "hertz 7e7 0.8 tangential mindlin/force 6e7 0 0.4 damping coeff_restitution"},
        Law{"HertzMaterialMindlin",
            "hertz/material 1e8 0.7 0.25 tangential mindlin NULL 1 0.3 "
            "damping coeff_restitution"},
        Law{"HertzMaterialMindlinForce",
            "hertz/material 1e8 1e5 0.4 tangential mindlin/force NULL 0.5 0.5 damping "
            "viscoelastic"},
        Law{"DmtMindlin", "dmt 1e8 3e5 0.3 20 tangential mindlin NULL 0.5 0.4"},
        Law{"DmtMindlinForce",
            "dmt 1e8 30 0.3 20 tangential mindlin/force NULL 0.5 0.4 damping velocity"},
        Law{"HookeRolling",
            "hooke 1e5 30 tangential linear_history 8e4 0.5 0.4 damping velocity "
            "rolling sds 2e4 0 0.1"},
        Law{"HookeRollingDashpot",
            "hooke 1e5 30 tangential linear_history 8e4 0.5 0.4 damping velocity "
            "rolling sds 2e4 20 0.1"},
        Law{"HertzMindlinRolling",
            "hertz 7e7 20 tangential mindlin 6e7 0.5 0.4 damping velocity rolling sds 2e4 0 0.1"},
        Law{"HertzMaterialMindlinForceRolling",
            "hertz/material 1e8 0.7 0.25 tangential mindlin/force NULL 1 0.3 damping "
            "coeff_restitution rolling sds 2e4 0 0.1"},
        Law{"DmtMindlinRolling",
            "dmt 1e8 3e5 0.3 20 tangential mindlin NULL 0.5 0.4 rolling sds 2e4 0 0.1"}),
    [](const auto &info) { return info.param.name; });

// ---- materials from arguments ----

TEST(GranularWords, ElasticConstantsGiveStiffnesses)
{
  const double young = 70e9, nu = 0.3;
  const Material material = material_of("contact hertz/material 70e9 0.5 0.3 tangential mindlin "
                                        "NULL 0.7 0.4 damping coeff_restitution");
  EXPECT_EQ(material.law, rve::ContactLaw::Hertz);
  // E* and G* of two equal bodies are E/(2 (1 - nu^2)) and G/(2 (2 - nu)) with G = E/(2 (1 + nu)).
  EXPECT_DOUBLE_EQ(material.hertz_stiffness, 4.0 / 3.0 * young / (2.0 * (1.0 - nu * nu)));
  EXPECT_DOUBLE_EQ(material.mindlin_stiffness,
                   8.0 * young / (2.0 * (1.0 + nu)) / (2.0 * (2.0 - nu)));
  EXPECT_EQ(material.mindlin_damping, 0.7);
  EXPECT_EQ(material.friction, 0.4);
  EXPECT_EQ(material.mindlin_displacement, 1.0);
  EXPECT_EQ(material.normal_viscosity, 0.0);
  EXPECT_EQ(material.viscoelastic_damping, 0.0);
  // Tsuji's constant depends on the restitution only: sqrt(5) |ln e| / sqrt(pi^2 + ln^2 e).
  const double log_e = std::log(0.5);
  EXPECT_DOUBLE_EQ(material.restitution_damping,
                   std::sqrt(5.0) * -log_e / std::sqrt(rve::kPi * rve::kPi + log_e * log_e));
  EXPECT_EQ(material.normal_stiffness, 0.0);
  EXPECT_EQ(material.tangential_stiffness, 0.0);
}

TEST(GranularWords, NumericalStiffnessesAreUnchanged)
{
  Material material = material_of(
      "contact hertz 2e9 40 tangential mindlin/force 1.5e9 0.5 0.4 damping velocity damping 0.2");
  EXPECT_EQ(material.hertz_stiffness, 2e9);
  EXPECT_EQ(material.mindlin_stiffness, 1.5e9);
  EXPECT_EQ(material.normal_viscosity, 40.0);
  EXPECT_EQ(material.viscoelastic_damping, 0.0);
  EXPECT_EQ(material.restitution_damping, 0.0);
  EXPECT_EQ(material.mindlin_displacement, 0.0);
  EXPECT_EQ(material.local_damping, 0.2);

  // With a restitution of 1, nothing is dissipated. Without the word `damping`, LAMMPS uses
  // viscoelastic damping.
  material = material_of("contact hertz 2e9 1 tangential mindlin 0 0 0 damping coeff_restitution");
  EXPECT_EQ(material.restitution_damping, 0.0);
  material = material_of("contact hertz 2e9 3e6 tangential mindlin 0 0 0");
  EXPECT_EQ(material.viscoelastic_damping, 3e6);
}

TEST(GranularWords, ArgumentsOutOfRangeAreErrors)
{
  const auto message_with = [](const std::string &words) {
    return message_of(FOUR_ATOMS + FIX + "dt 1e-6 contact " + words + "\nrun 0\n");
  };
  const std::string sheared = " tangential mindlin NULL 0.5 0.4 ";
  for (const char *nu : {"-1", "0.51", "2"})
    EXPECT_IN(std::string("contact nu is ") + nu + " [-]; it must lie in (-1, 0.5]",
              message_with("hertz/material 1e9 0 " + std::string(nu) + sheared));
  for (const char *e : {"0", "-0.5", "1.5"})
    EXPECT_IN(std::string("contact coefficient of restitution is ") + e +
                  " [-]; it must lie in (0, 1]",
              message_with("hertz/material 1e9 " + std::string(e) + " 0.2" + sheared +
                           "damping coeff_restitution"));
  EXPECT_IN("contact tangential k_t is NULL, which takes it from E and nu of hertz/material",
            message_with("hertz 1e9 0" + sheared));
  EXPECT_IN("contact E is -1e+09 [stress]; it must be greater than 0",
            message_with("hertz/material -1e9 0 0.2" + sheared));
  EXPECT_IN("contact tangential model is 'linear_history'",
            message_with("hertz 1e9 0 tangential linear_history 1e9 0.5 0.4"));
  EXPECT_IN("contact tangential model is 'mindlin'", message_with("hooke 1e6 0" + sheared));
  EXPECT_IN("contact damping model is 'tsuji'",
            message_with("hertz 1e9 0.5 tangential mindlin 1e9 0 0.4 damping tsuji"));
}

TEST(GranularWords, RollingResistanceHasNoDefault)
{
  const std::string hertz = "contact hertz 2e9 0 tangential mindlin 1.7e9 0.5 0.4 ";
  const Material material = material_of(hertz + "rolling sds 5e5 0 0.1");
  EXPECT_EQ(material.rolling_stiffness, 5e5);
  EXPECT_EQ(material.rolling_friction, 0.1);

  const std::string packing = path_of("hertz.rve");
  RveState state = state_of(random_grains(), material_of(hertz));
  rve::write_packing(packing, state);
  const std::string fix =
      FOUR_ATOMS + "fix grains all rve " + packing + " threads 1 dt 1e-6 rolling_friction 0.1";
  EXPECT_IN("rolling_friction is 0.1 [-] without a kr [force/length]", message_of(fix + "\nrun 0"));
  const std::string out = path_of("rolling.rve");
  Script script;
  script << fix + " kr 2e5\nrun 0\nwrite_rve grains atom 1 file " + out + " format rve";
  EXPECT_EQ(rve::read_packing(out).material.rolling_stiffness, 2e5);
}

TEST(GranularWords, ArgumentsOfAnotherLawAreErrors)
{
  const std::string hertz = "contact hertz/material 1e9 0.5 0.2 tangential mindlin NULL 0.5 0.4 "
                            "damping coeff_restitution ";
  // kn is the stiffness of hooke. It cannot be set for contacts with the law hertz.
  const std::string message = message_of(FOUR_ATOMS + FIX + "dt 1e-6 " + hertz +
                                         "\nrun 0\nfix_modify grains kn 1e6\nrun 0");
  EXPECT_IN("normal stiffness", message);
  EXPECT_IN("hertz", message);

  // All contacts of a fix must have the same law.
  const std::string packing = path_of("hertz.rve");
  RveState state = rve::read_packing(PACKING);
  state.material = material_of(hertz);
  for (rve::Pair &pair : state.pairs) pair.tangential_force = 0.0;
  rve::write_packing(packing, state);
  const std::string mixed =
      message_of(FOUR_ATOMS + "variable which atom id>2\nfix grains all rve " + PACKING +
                 " packings " + packing + " packing_variable v_which threads 1 dt 1e-6\nrun 0");
  EXPECT_IN("hertz", mixed);
  EXPECT_IN("hooke", mixed);
}
