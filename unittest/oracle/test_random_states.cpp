// SPDX-License-Identifier: GPL-2.0-only
// Compares the results of the engine for random states with sums over all pairs and all images.

#include "oracle/contact_sum.h"
#include "support/random.h"
#include "support/rve_rig.h"

#include <gtest/gtest.h>

using namespace rve;
using namespace rve_test;

namespace {

constexpr int NUM_STATES = 100;

/// Returns a random state. Its units of length, mass and time are random. Its cell is sheared and
/// rotated, and the widths of the cell are 1 to 4 times the least allowed width. Radii differ by up
/// to a factor of four. The limit of the overlaps is between 1e-6 and 0.45 times the smaller
/// radius. Tangential and rolling forces are within or beyond their Coulomb limits, and some belong
/// to pairs without contact.
RveState random_state(std::uint64_t seed)
{
  Random random(seed);
  const auto magnitude = [&](double lo, double hi) {
    return std::pow(10.0, random.uniform(lo, hi));
  };
  RveState state;
  Material &m = state.material;
  const double length = magnitude(-4.0, 2.0);
  m.normal_stiffness = magnitude(2.0, 10.0);
  m.tangential_stiffness =
      random.integer(0, 5) == 0 ? 0.0 : random.uniform(0.1, 1.5) * m.normal_stiffness;
  const double frictions[] = {0.0, 0.1, 0.5, 1.0, 4.0};
  m.friction = frictions[random.integer(0, 4)];
  if (random.integer(0, 2) == 0) {
    m.rolling_stiffness = random.uniform(0.1, 1.0) * m.normal_stiffness;
    m.rolling_friction = random.uniform(0.05, 1.0);
  }
  m.density = magnitude(0.0, 4.0);
  m.thickness = magnitude(-2.0, 1.0);

  const int wanted = random.integer(2, 60);
  const double spread = random.uniform(1.0, 4.0);
  std::vector<double> radius;
  for (int i = 0; i < wanted; ++i) radius.push_back(length * random.uniform(1.0, spread));
  radius[0] = length * spread;

  // The cell vectors are at an angle of 40 to 140 degrees. In half of the states one width is just
  // above the least allowed width.
  const double turn = random.uniform(0.0, 2.0 * M_PI), angle = random.uniform(0.7, 2.44);
  const double least = 4.0 * radius[0] + 0.3 * length * spread;
  const double across = least * (random.integer(0, 1) ? 1.001 : random.uniform(1.001, 4.0)),
               along = least * random.uniform(1.001, 4.0);
  const double a = across / std::sin(angle), b = along / std::sin(angle);
  state.cell = Tensor2{{a * std::cos(turn), b * std::cos(turn + angle), a * std::sin(turn),
                        b * std::sin(turn + angle)}};

  // Each grain touches an earlier grain with a random overlap. No overlap exceeds `most` times the
  // smaller radius.
  const double most = magnitude(-6.0, std::log10(0.45));
  std::vector<std::uint64_t> fractional;
  const Tensor2 to_fraction = inverse(state.cell);
  const auto overlap_share = [&](std::uint64_t x, std::uint64_t y, double r, std::size_t other) {
    double largest = -1.0;
    const double dx = static_cast<double>(static_cast<std::int64_t>(x - fractional[2 * other])),
                 dy = static_cast<double>(static_cast<std::int64_t>(y - fractional[2 * other + 1]));
    for (int p = -2; p <= 2; ++p)
      for (int q = -2; q <= 2; ++q) {
        const double sx = dx * 0x1p-64 + p, sy = dy * 0x1p-64 + q;
        const double distance = std::hypot(state.cell(0, 0) * sx + state.cell(0, 1) * sy,
                                           state.cell(1, 0) * sx + state.cell(1, 1) * sy);
        largest = std::max(largest,
                           (r + state.radius[other] - distance) / std::min(r, state.radius[other]));
      }
    return largest;
  };
  for (const double r : radius)
    for (int attempt = 0; attempt < 100; ++attempt) {
      std::uint64_t s[2] = {random.bits(), random.bits()};
      if (!state.radius.empty()) {
        const int partner = random.integer(0, state.num_grains() - 1);
        const double rj = state.radius[partner], direction = random.uniform(0.0, 2.0 * M_PI);
        const double d = r + rj - most * random.uniform(0.0, 1.0) * std::min(r, rj);
        const double x = d * std::cos(direction), y = d * std::sin(direction);
        for (int c = 0; c < 2; ++c) {
          const double ds = to_fraction(c, 0) * x + to_fraction(c, 1) * y;
          s[c] = fractional[2 * partner + c] +
              static_cast<std::uint64_t>(static_cast<std::int64_t>(
                  std::ldexp(ds - std::nearbyint(ds), 63) * 2.0 * (1.0 - 0x1p-53)));
        }
      }
      bool fits = true;
      for (int k = 0; k < state.num_grains() && fits; ++k)
        fits = overlap_share(s[0], s[1], r, k) <= most;
      if (!fits) continue;
      state.radius.push_back(r);
      fractional.insert(fractional.end(), {s[0], s[1]});
      break;
    }
  state.fractional = fractional;
  const int n = state.num_grains();
  state.velocity.resize(2 * n);
  state.spin.resize(n);
  for (double &c : state.velocity) c = random.uniform(-1.0, 1.0) * length;
  for (double &spin : state.spin) spin = random.uniform(-1.0, 1.0);

  for (int i = 0; i < n; ++i)
    for (int j = i + 1; j < n; ++j) {
      const double share =
          overlap_share(fractional[2 * i], fractional[2 * i + 1], state.radius[i], j);
      if (share < -0.05 || random.integer(0, 3) == 0) continue;
      const double normal =
          m.normal_stiffness * std::fabs(share) * std::min(state.radius[i], state.radius[j]);
      Pair pair{i, j, random.uniform(-1.5, 1.5) * m.friction * normal, 0.0};
      if (resists_rolling(m))
        pair.rolling_force = random.uniform(-1.5, 1.5) * m.rolling_friction * normal;
      if (random.integer(0, 1)) {
        std::swap(pair.first, pair.second);
        pair.rolling_force = -pair.rolling_force;
      }
      state.pairs.push_back(pair);
    }
  return state;
}

void expect_within(long double value, const Bounded &oracle, const std::string &what)
{
  EXPECT_LE(std::fabs(value - oracle.value), oracle.error)
      << what << ": " << static_cast<double>(value) << ", the oracle has "
      << static_cast<double>(oracle.value) << " within " << static_cast<double>(oracle.error);
}

class RandomStates : public ::testing::TestWithParam<Format> {};

std::string name_of(const ::testing::TestParamInfo<Format> &info)
{
  return to_string(info.param);
}

INSTANTIATE_TEST_SUITE_P(Formats, RandomStates,
                         ::testing::Values(Format::Fast, Format::Mixed, Format::Double,
                                           Format::Single),
                         name_of);

}    // namespace

TEST_P(RandomStates, ResultsAreThoseOfAllPairsAndAllImages)
{
  const Resolution resolution = Resolution::of(GetParam());
  int contacts = 0, sliding = 0;
  for (std::uint64_t seed = 1; seed <= NUM_STATES; ++seed) {
    SCOPED_TRACE("state " + std::to_string(seed));
    const RveState state = random_state(seed);
    ASSERT_GE(state.num_grains(), 2);
    Options options = cpu_options(GetParam());
    options.overlap_limit = 0.9;
    RveRig rig(state, options);

    const Result result = rig.evaluate();

    ASSERT_EQ(result.status & status::Fatal, 0u) << describe_status(result.status);
    const ContactSum oracle = contact_sum(state, resolution);
    EXPECT_GE(result.num_contacts, oracle.least_contacts);
    EXPECT_LE(result.num_contacts, oracle.most_contacts);
    EXPECT_EQ(result.coordination_number, 2.0 * result.num_contacts / state.num_grains());
    for (int k = 0; k < 4; ++k) {
      expect_within(result.stress.component[k], oracle.stress[k], "stress " + std::to_string(k));
      if (result.num_contacts > 0)
        expect_within(result.fabric.component[k], oracle.fabric[k], "fabric " + std::to_string(k));
      if (GetParam() == Format::Double) {
        EXPECT_LE(std::fabs(result.stress.component[k] - oracle.stress[k].value),
                  1e-13L * oracle.stress_of_full_overlap);
      }
    }
    expect_within(result.void_ratio, oracle.void_ratio, "void ratio");
    expect_within(result.elastic_energy, oracle.elastic_energy, "elastic energy");
    expect_within(result.kinetic_energy, oracle.kinetic_energy, "kinetic energy");
    expect_within(result.largest_overlap, oracle.largest_overlap, "largest overlap");
    expect_within(result.mean_overlap, oracle.mean_overlap, "mean overlap");
    expect_within(result.largest_contact_force, oracle.largest_contact_force, "largest force");
    expect_within(result.unbalanced_ratio, oracle.unbalanced_ratio, "unbalanced ratio");
    contacts += result.num_contacts;
    sliding += static_cast<int>(std::lround(result.sliding_fraction * result.num_contacts));
  }
  // The states must have enough contacts and enough sliding contacts for a significant test.
  EXPECT_GE(contacts, 20 * NUM_STATES);
  EXPECT_GE(sliding, 2 * NUM_STATES);
}

TEST_P(RandomStates, GrainsAtRestAreAcceleratedByTheForcesOfAllPairsAndAllImages)
{
  // Grains at rest do not move before the first kick. After one step the velocity of a grain is c =
  // dt F/m. The test computes the force F from it.
  constexpr double DT = 0x1p-20;
  const Resolution resolution = Resolution::of(GetParam());
  for (std::uint64_t seed = 1; seed <= NUM_STATES; ++seed) {
    SCOPED_TRACE("state " + std::to_string(seed));
    RveState state = random_state(seed);
    std::fill(state.velocity.begin(), state.velocity.end(), 0.0);
    std::fill(state.spin.begin(), state.spin.end(), 0.0);
    Options options = cpu_options(GetParam());
    options.overlap_limit = 0.9;
    RveRig rig(state, options);
    Drive step;
    step.dt = DT;
    step.substeps = 1;

    const Result result = rig.advance(step);

    ASSERT_EQ(result.status & status::Fatal, 0u) << describe_status(result.status);
    const ContactSum oracle = contact_sum(state, resolution);
    const RveState after = rig.state();
    for (int i = 0; i < state.num_grains(); ++i) {
      const long double r = state.radius[i];
      const long double mass = state.material.density * M_PIl * r * r * state.material.mass_depth;
      const auto expect_force = [&](long double force, Bounded expected, const char *what) {
        // The bound also covers roundings of mass and velocity.
        expected.error += 8.0L * resolution.force * std::fabs(expected.value);
        expect_within(force, expected, what + std::to_string(i));
      };
      for (int a = 0; a < 2; ++a)
        expect_force(mass * after.velocity[2 * i + a] / DT, oracle.force[2 * i + a], "force ");
      expect_force(0.5L * mass * r * r * after.spin[i] / DT, oracle.torque[i], "torque ");
    }
  }
}
