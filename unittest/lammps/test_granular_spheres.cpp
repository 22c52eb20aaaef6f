// SPDX-License-Identifier: GPL-2.0-only
// The contact laws of LAMMPS' pair_style granular between spheres in a triclinic periodic box.
// LAMMPS runs the spheres. For the positions and velocities of each step, the contact laws of an
// engine must give the same forces and torques. The engine reads its material from the same words
// of pair_coeff.
//
// LAMMPS differs from the engine in two points. In both, the test uses the form of LAMMPS:
// - For the surface velocity by spins, LAMMPS uses the contact normal at the end of a step. The
//   engine uses the normal at the middle of the step. LAMMPS projects histories onto the plane of
//   the new normal, keeps their length and does not rotate them about the normal (vector_spring.h
//   states the error).
// - If a twisting moment exceeds its limit, LAMMPS gives the moment the direction of the twisting
//   velocity. In the engine the moment keeps its direction. In LAMMPS the moment changes sign if
//   the limit decreases while the grains twist back.

#include "grains_script.h"
#include "lammps/material_arguments.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/contact_model.h"
#include "support/random.h"
#include "support/rounding.h"
#include "support/spheres.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>

using namespace grains_script;
using rve::Material;
using rve::Tensor3;
using Vector = rve::Vec<double, 3>;

namespace {

constexpr int ROWS = 4, NUM_GRAINS = ROWS * ROWS * ROWS;
constexpr double SPACING = 0.0096, WIDTH = ROWS * SPACING;    // [m]
constexpr double DENSITY = 2650.0;                            // [kg/m^3]
constexpr double DT = 1e-5;    // [s], a collision takes about 100 steps

/// A box with all three tilts.
const Tensor3 BOX_MATRIX{
    {WIDTH, 0.2 * WIDTH, -0.15 * WIDTH, 0.0, WIDTH, 0.25 * WIDTH, 0.0, 0.0, WIDTH}};

struct Grains {
  std::vector<double> radius;
  std::vector<Vector> place, velocity, spin;
};

/// Returns a sheared cubic array with random displacements. Some grains touch at the start, and all
/// grains touch later.
Grains random_grains()
{
  rve_test::Random random(20);
  const auto random_vector = [&](double size) {
    Vector v;
    for (double &x : v.component) x = random.uniform(-size, size);
    return v;
  };
  Grains grains;
  for (int i = 0; i < NUM_GRAINS; ++i) {
    grains.radius.push_back(random.uniform(0.0046, 0.005));
    const Vector share{
        {(0.5 + i % ROWS) / ROWS, (0.5 + i / ROWS % ROWS) / ROWS, (0.5 + i / ROWS / ROWS) / ROWS}};
    grains.place.push_back(BOX_MATRIX * share + random_vector(5e-5));
    grains.velocity.push_back(random_vector(0.3));
    grains.spin.push_back(random_vector(60.0));
  }
  return grains;
}

std::string digits(double x)
{
  char text[32];
  std::snprintf(text, sizeof(text), "%.17g ", x);
  return text;
}

std::string digits(const Vector &v)
{
  return digits(v[0]) + digits(v[1]) + digits(v[2]);
}

/// Numbers of a grain at a step. The velocities belong to the time half a step before that of the
/// positions; LAMMPS computed the forces from them.
struct Grain {
  Vector place, velocity, spin, force, torque;
};

class GranularScript : public Script {
 public:
  GranularScript(const Grains &grains, const std::string &law)
  {
    *this << "units si\ndimension 3\nboundary p p p\natom_style sphere\natom_modify sort 0 0\n"
             "newton off\ncomm_modify vel yes\nregion box prism 0 " +
            digits(WIDTH) + "0 " + digits(WIDTH) + "0 " + digits(WIDTH) + digits(BOX_MATRIX(0, 1)) +
            digits(BOX_MATRIX(0, 2)) + digits(BOX_MATRIX(1, 2)) + "units box\ncreate_box 1 box\n";
    for (int i = 0; i < NUM_GRAINS; ++i) {
      const std::string id = std::to_string(i + 1);
      *this << "create_atoms 1 single " + digits(grains.place[i]) + "units box\nset atom " + id +
              " diameter " + digits(2.0 * grains.radius[i]) + "\nset atom " + id + " density " +
              digits(DENSITY) + "\nset atom " + id + " vx " + digits(grains.velocity[i][0]) +
              "vy " + digits(grains.velocity[i][1]) + "vz " + digits(grains.velocity[i][2]) +
              "omega " + digits(grains.spin[i]) + "\n";
    }
    *this << "pair_style granular\npair_coeff * * " + law + "\ntimestep " + digits(DT) +
            "\nneighbor 2e-3 bin\nneigh_modify delay 0 every 1 check yes\n"
            "fix integrate all nve/sphere\nrun 0\n";
  }

  /// Returns the material of an RVE for the words after `pair_coeff * *`.
  Material material(const std::string &law)
  {
    std::vector<std::string> list = {"contact"};
    std::istringstream stream(law);
    for (std::string word; stream >> word;) list.push_back(word);
    std::vector<char *> argv;
    for (std::string &word : list) argv.push_back(word.data());
    LAMMPS_NS::ScriptArguments words(lmp.get(), "fix rve", static_cast<int>(argv.size()),
                                     argv.data(), 0);
    words.set_keywords(LAMMPS_NS::material_keywords());
    LAMMPS_NS::MaterialArguments given;
    while (words.next_keyword()) EXPECT_TRUE(given.read(words));
    Material material;
    given.apply(material);
    material.density = DENSITY;
    return material;
  }

  std::vector<Grain> next_step()
  {
    // `pre no` avoids another setup, which would compute forces with velocities at the whole step.
    *this << "run 1 pre no post no";
    const LAMMPS_NS::Atom *atom = lmp->atom;
    const auto vector = [](const double *x) { return Vector{{x[0], x[1], x[2]}}; };
    std::vector<Grain> all(NUM_GRAINS);
    for (int i = 0; i < atom->nlocal; ++i) {
      const double radius = atom->radius[i], mass = atom->rmass[i];
      const double kick = 0.5 * DT / mass, turn = kick / (0.4 * radius * radius);
      Grain grain;
      grain.place = vector(atom->x[i]);
      grain.force = vector(atom->f[i]);
      grain.torque = vector(atom->torque[i]);
      grain.velocity = vector(atom->v[i]) - kick * grain.force;
      grain.spin = vector(atom->omega[i]) - turn * grain.torque;
      all[atom->tag[i] - 1] = grain;
    }
    return all;
  }
};

/// Returns the branch from one of two touching grains to the nearest image of the other. Touching
/// grains are at most a quarter of the box apart, so their fractional coordinates differ by less
/// than one half.
Vector branch_between(const Vector &from, const Vector &to)
{
  static const Tensor3 inverse_box = rve::inverse(BOX_MATRIX);
  Vector s = inverse_box * (to - from);
  Vector shift;
  for (int a = 0; a < 3; ++a) shift[a] = -std::round(s[a]);
  return (to - from) + BOX_MATRIX * shift;
}

// ---- histories of contacts in LAMMPS' form ----

void project(Vector &h, const Vector &n)
{
  const double before = dot(h, h);
  h = h - dot(h, n) * n;
  const double after = dot(h, h);
  if (after > 0.0) h = std::sqrt(before / after) * h;
}
void project(rve::MindlinHistory<double, 3> &history, const Vector &n)
{
  project(history.tangential, n);
}
template <class Contact>
void project(rve::RollingHistory<Contact, rve::TurningHistory<double, 3>> &history, const Vector &n)
{
  project(history.contact, n);
  project(history.turning.rolling, n);
}

/// Errors of forces (index 0) and torques (index 1), and counts of contact events.
struct Comparison {
  rve_test::RoundingErrors of[2];
  int sliding = 0, sticking = 0, rolled = 0, twisted = 0;
};

/// Adds the forces and torques of all contacts of the law to `sum` and advances their histories.
template <class Law, class Histories>
void add_contacts(const Law &law, const Grains &grains, const std::vector<Grain> &at,
                  Histories &histories, std::vector<std::array<Vector, 2>> &sum,
                  Comparison &compared)
{
  const auto motion = [&](int i) {
    return rve::SphereMotion<double>{at[i].velocity, at[i].spin, grains.radius[i]};
  };
  for (int i = 0; i < NUM_GRAINS; ++i)
    for (int j = i + 1; j < NUM_GRAINS; ++j) {
      const rve::SphereMotion<double> one = motion(i), other = motion(j);
      const auto contact = rve::contact_geometry<double>(branch_between(at[i].place, at[j].place),
                                                         one.radius + other.radius);
      if (!(contact.overlap > 0.0)) {
        histories.erase({i, j});
        continue;
      }
      auto &history = histories[{i, j}];
      project(history, contact.normal);
      // With dt = 0 the function uses the normal at the end of the step, as LAMMPS does.
      auto moving =
          rve::motion_at_contact(law, contact, one, other, rve::Tensor<double, 3>::zero(), 0.0);
      moving.turn = {Vector::zero(), 0.0};
      auto force = law.answer(contact, one, other, moving, history, DT);
      ++(force.sliding ? compared.sliding : compared.sticking);
      if constexpr (Law::has_rolling) {
        auto &turned = force.turned;
        compared.rolled += dot(turned.slipped, turned.slipped) > 0.0;
        compared.twisted += turned.twisted.slipped != 0.0;
        const double moment = turned.twisted.moment;
        if (turned.twisted.slipped != 0.0 && moment * turned.twisted.velocity < 0.0) {
          turned.history.twisting -= 2.0 * moment / turned.twisted.share;
          force.torque_i = force.torque_i - (2.0 * moment) * contact.normal;
          force.torque_j = force.torque_j + (2.0 * moment) * contact.normal;
        }
      }
      history = force.history();
      sum[i][0] = sum[i][0] + force.force;
      sum[j][0] = sum[j][0] - force.force;
      sum[i][1] = sum[i][1] + force.torque_i;
      sum[j][1] = sum[j][1] + force.torque_j;
    }
}

/// Returns grains with a changed last digit of each number on which forces depend. A position
/// changes by the last digit of its periodic image, whose coordinates have the size of the box.
std::vector<Grain> with_other_last_digits(std::vector<Grain> grains, rve_test::Random &random)
{
  const double digit_of_image = std::nextafter(WIDTH, 1.0) - WIDTH;
  for (Grain &grain : grains)
    for (int a = 0; a < 3; ++a) {
      grain.place[a] = rve_test::with_another_digit(grain.place[a], digit_of_image, random);
      for (Vector *vector : {&grain.velocity, &grain.spin})
        (*vector)[a] = rve_test::with_another_last_digit((*vector)[a], random);
    }
  return grains;
}

void raise(double &largest, const Vector &difference)
{
  for (int a = 0; a < 3; ++a) largest = std::fmax(largest, std::fabs(difference[a]));
}

template <class Law> Comparison compare(const Law &law, GranularScript &lammps, int steps)
{
  using Histories = std::map<std::pair<int, int>, typename Law::History>;
  using Forces = std::vector<std::array<Vector, 2>>;
  const Grains grains = random_grains();
  const Forces nothing(NUM_GRAINS, {Vector::zero(), Vector::zero()});
  constexpr int kTwins = 8;
  Histories histories, twin_histories[kTwins];
  rve_test::Random random(21);
  Comparison compared;
  for (int step = 0; step < steps; ++step) {
    const std::vector<Grain> at = lammps.next_step();
    Forces found = nothing;
    add_contacts(law, grains, at, histories, found, compared);
    for (int kind = 0; kind < 2; ++kind) {
      double error = 0.0;
      for (int i = 0; i < NUM_GRAINS; ++i) {
        const Vector &expected = kind ? at[i].torque : at[i].force;
        raise(compared.of[kind].most, expected);
        raise(error, found[i][kind] - expected);
      }
      compared.of[kind].errors.push_back(error);
    }
    for (Histories &twin : twin_histories) {
      Forces other = nothing;
      Comparison uncounted;
      add_contacts(law, grains, with_other_last_digits(at, random), twin, other, uncounted);
      for (int i = 0; i < NUM_GRAINS; ++i)
        for (int kind = 0; kind < 2; ++kind)
          raise(compared.of[kind].of_digits, other[i][kind] - found[i][kind]);
    }
  }
  return compared;
}

void expect_rounding_only(const Comparison &compared, double bound)
{
  for (int kind = 0; kind < 2; ++kind) {
    SCOPED_TRACE(kind ? "torques" : "forces");
    rve_test::expect_rounding_only(compared.of[kind], bound);
  }
}

template <class Work> void with_law_of_lammps(const Material &material, const Work &work)
{
  rve::with_law<3>(material, [&](auto law) {
    typename decltype(law)::Constants constants;
    constants.set(material, rve::LawUnits::same(), 0.0);    // lever arm r of LAMMPS
    law.take(constants);
    work(law);
  });
}

struct Law {
  const char *name;
  const char *words;
};

class GranularSpheres : public ::testing::TestWithParam<Law> {};

}    // namespace

TEST_P(GranularSpheres, HaveTheForcesOfLammpsInTheFirstStep)
{
  // In the first step, contacts have no history yet.
  const std::string words = GetParam().words;
  GranularScript lammps(random_grains(), words);
  with_law_of_lammps(lammps.material(words), [&](const auto &law) {
    const Comparison compared = compare(law, lammps, 1);
    EXPECT_GT(compared.sliding + compared.sticking, 20);
    expect_rounding_only(compared, 1e-12);
  });
}

TEST_P(GranularSpheres, HaveTheForcesOfLammpsWithProjectedHistories)
{
  const std::string words = GetParam().words;
  GranularScript lammps(random_grains(), words);
  with_law_of_lammps(lammps.material(words), [&](const auto &law) {
    const Comparison compared = compare(law, lammps, 400);
    EXPECT_GT(compared.sliding, 100);
    EXPECT_GT(compared.sticking, 100);
    const auto has = [&](const char *word) { return words.find(word) != std::string::npos; };
    EXPECT_TRUE(!has("rolling") || compared.rolled > 100);
    EXPECT_TRUE(!has("twisting") || compared.twisted > 100);
    expect_rounding_only(compared, 1e-11);
  });
}

INSTANTIATE_TEST_SUITE_P(
    OfPairCoeff, GranularSpheres,
    ::testing::Values(
        Law{"Hooke", "hooke 1e5 3 tangential linear_history 8e4 0.5 0.4 damping velocity"},
        Law{"HookeRolling",
            "hooke 1e5 3 tangential linear_history 8e4 0.5 0.4 damping velocity "
            "rolling sds 2e4 0 0.05"},
        Law{"HookeTwisting",
            "hooke 1e5 3 tangential linear_history 8e4 0.5 0.4 damping velocity "
            "twisting sds 0.5 0 5e-5"},
        Law{"HookeRollingDashpot",
            "hooke 1e5 3 tangential linear_history 8e4 0.5 0.4 damping velocity "
            "rolling sds 2e4 5 0.05"},
        Law{"HookeTwistingDashpot",
            "hooke 1e5 3 tangential linear_history 8e4 0.5 0.4 damping velocity "
            "twisting sds 0.5 1e-5 5e-5"},
        Law{"HookeMarshall",
            "hooke 1e5 3 tangential linear_history 8e4 0.5 0.4 damping velocity twisting marshall"},
        Law{"HookeRollingDashpotMarshall",
            "hooke 1e5 3 tangential linear_history 8e4 0.5 0.4 damping velocity "
            "rolling sds 2e4 5 0.05 twisting marshall"},
        Law{"HertzVelocityMindlin", "hertz 7e7 2 tangential mindlin 6e7 0.5 0.4 damping velocity"},
        Law{"HertzVelocityMindlinForce",
            "hertz 7e7 2 tangential mindlin/force 6e7 0.5 0.4 damping velocity"},
        Law{"HertzMindlinRescale",
            "hertz 7e7 2 tangential mindlin_rescale 6e7 0.5 0.4 damping velocity"},
        Law{"HertzMindlinRescaleForce",
            "hertz 7e7 2 tangential mindlin_rescale/force 6e7 0.5 0.4 damping velocity"},
        Law{"HertzViscoelasticMindlin",
            "hertz 7e7 3e6 tangential mindlin 6e7 0.5 0.4 damping viscoelastic"},
        Law{"HertzRestitutionMindlin",
            "hertz 7e7 0.8 tangential mindlin 6e7 0.5 0.4 damping coeff_restitution"},
        Law{"HertzMaterialMindlinForce",
            "hertz/material 1e8 1e6 0.4 tangential mindlin/force NULL 0.5 0.3 damping "
            "viscoelastic"},
        Law{"HertzMindlinRollingTwisting",
            "hertz 7e7 2 tangential mindlin 6e7 0.5 0.4 damping velocity rolling sds 2e4 0 0.05 "
            "twisting sds 0.5 0 5e-5"},
        Law{"HertzMaterialRestitutionRollingTwisting",
            "hertz/material 1e8 0.7 0.25 tangential mindlin/force NULL 1 0.3 damping "
            "coeff_restitution rolling sds 2e4 0 0.05 twisting sds 0.5 0 5e-5"},
        Law{"HertzMindlinRollingTwistingDashpots",
            "hertz 7e7 2 tangential mindlin 6e7 0.5 0.4 damping velocity rolling sds 2e4 5 0.05 "
            "twisting sds 0.5 1e-5 5e-5"},
        Law{"DmtMindlin", "dmt 1e8 3e5 0.3 10 tangential mindlin NULL 0.5 0.4"},
        Law{"DmtMindlinRollingTwisting",
            "dmt 1e8 3e5 0.3 10 tangential mindlin NULL 0.5 0.4 rolling sds 2e4 0 0.05 "
            "twisting sds 0.5 0 5e-5"}),
    [](const auto &info) { return info.param.name; });
