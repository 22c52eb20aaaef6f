// SPDX-License-Identifier: GPL-2.0-only
// Benchmarks of one contact with closed forms, after Chung & Ooi, Granular Matter 13, 643 (2011),
// for disks with linear springs. The section headings have the test numbers of Chung & Ooi. A disk
// with a hundred times the mass of the other disk replaces their wall. The closed forms apply to a
// pair of disks.
//
// If the environment variable GPU_RVE_WRITE_CURVES names a folder, the curves of oblique impacts
// are written there as oblique_impact.csv. plot_contact_benchmarks.py draws them. With
// --gtest_output=xml, the properties of a test contain its largest errors.

#include "oracle/linear_impact.h"
#include "support/rve_rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double RADIUS = 0.005;
constexpr double STIFFNESS = 1e6;
constexpr double CELL = 0.1;

Material elastic(double friction = 0.0, double tangential_stiffness = STIFFNESS)
{
  Material material = paper_material();
  material.normal_stiffness = STIFFNESS;
  material.tangential_stiffness = tangential_stiffness;
  material.friction = friction;
  material.local_damping = 0.0;
  return material;
}

DiskPair disks(double radius_1 = RADIUS, double radius_2 = RADIUS)
{
  const Material material = elastic();
  return {{radius_1, radius_2}, material.density * material.mass_depth};
}

double frequency(const DiskPair &pair)
{
  return std::sqrt(STIFFNESS / pair.mass_eff());
}

/// Position of the contact point and direction of the line of centres.
struct Frame {
  const char *name;
  double turn;    ///< angle of the normal from the x axis [rad]
  double x, y;    ///< position of the contact [length]
  Tensor2 cell;
};

Frame plain_frame()
{
  return {"along x", 0.0, 0.05, 0.05, CELL * Tensor2::identity()};
}

std::vector<Frame> all_frames()
{
  const Tensor2 square = CELL * Tensor2::identity();
  const Tensor2 sheared{{CELL, 0.3 * CELL, 0.0, CELL}};
  return {plain_frame(),
          {"along -y", -0.5 * M_PI, 0.05, 0.05, square},
          {"turned by 37 degrees", 37.0 * M_PI / 180.0, 0.05, 0.05, square},
          {"turned by 200 degrees", 200.0 * M_PI / 180.0, 0.03, 0.07, square},
          {"across the boundary x = 0", 0.1, 0.0, 0.04, square},
          {"across the boundary y = 0", 1.4, 0.03, 0.0, square},
          {"across the corner of a sheared cell", 2.4, 0.0, 0.0, sheared}};
}

/// Relative velocity of the centres and spins, before or after the impact.
struct Motion {
  double approach;      ///< normal velocity, positive when the centres approach
  double tangential;    ///< velocity of centre 2 relative to centre 1, along t = (-n_y, n_x)
  double spin[2];
};

double slip(const DiskPair &pair, const Motion &m)
{
  return m.tangential - pair.radius[0] * m.spin[0] - pair.radius[1] * m.spin[1];
}

Vec<double, 2> normal_of(const Frame &frame)
{
  return {{std::cos(frame.turn), std::sin(frame.turn)}};
}

/// Returns the pair at its first touch, with zero momentum.
RveState touching(const Material &material, const DiskPair &pair, const Motion &motion,
                  const Frame &frame)
{
  const Vec<double, 2> n = normal_of(frame);
  const double r1 = pair.radius[0], r2 = pair.radius[1];
  RveState state = state_of(
      material, frame.cell, {r1, r2},
      {frame.x - r1 * n[0], frame.y - r1 * n[1], frame.x + r2 * n[0], frame.y + r2 * n[1]});
  const double share_1 = -pair.mass(1) / (pair.mass(0) + pair.mass(1)), share_2 = 1.0 + share_1;
  const Vec<double, 2> relative{{-motion.approach * n[0] - motion.tangential * n[1],
                                 -motion.approach * n[1] + motion.tangential * n[0]}};
  state.velocity = {share_1 * relative[0], share_1 * relative[1], share_2 * relative[0],
                    share_2 * relative[1]};
  state.spin = {motion.spin[0], motion.spin[1]};
  // The force scale fits this collision. The estimate of the engine from the radii would not fit.
  state.largest_contact_force = motion.approach * std::sqrt(STIFFNESS * pair.mass_eff());
  return state;
}

Motion motion_of(const RveState &state, const Frame &frame)
{
  const Vec<double, 2> n = normal_of(frame);
  const Vec<double, 2> relative{
      {state.velocity[2] - state.velocity[0], state.velocity[3] - state.velocity[1]}};
  return {-dot(relative, n), cross(n, relative), {state.spin[0], state.spin[1]}};
}

/// Returns the time step for which the contact lasts `steps` + 0.5 steps. It then ends in the
/// middle of a step, which is the worst case.
double time_step(const DiskPair &pair, int steps)
{
  return M_PI / frequency(pair) / (steps + 0.5);
}

/// Runs the whole contact in one call.
Motion collide(const Material &material, const DiskPair &pair, const Motion &before, int steps,
               const Frame &frame = plain_frame(), Format format = Format::Double)
{
  RveRig rig(touching(material, pair, before, frame), cpu_options(format));
  const double dt = time_step(pair, steps);
  rig.strain(Tensor2::zero(), dt, steps + steps / 10 + 5);
  EXPECT_EQ(rig.result().status & status::Fatal, 0u) << frame.name;
  EXPECT_EQ(rig.result().num_contacts, 0) << frame.name;
  return motion_of(rig.state(), frame);
}

/// Returns the closed form of an impact without normal losses. The tangential impulse J changes the
/// slip by -J/m_t, the relative velocity of the centres by -J/m*, and each spin by r J/I.
Motion exact_rebound(const Material &material, const DiskPair &pair, const Motion &before)
{
  const LinearImpact impact(pair, material.normal_stiffness, material.tangential_stiffness,
                            material.friction);
  const double change = impact.rebound(before.approach, slip(pair, before)) - slip(pair, before);
  const double impulse = -pair.tangential_mass() * change;
  Motion after{-before.approach, before.tangential - impulse / pair.mass_eff(), {0.0, 0.0}};
  for (int i = 0; i < 2; ++i)
    after.spin[i] = before.spin[i] + pair.radius[i] * impulse / pair.inertia(i);
  return after;
}

/// Returns the largest difference of the velocities and of the surface velocities r w, divided by
/// `speed`.
double difference(const DiskPair &pair, const Motion &a, const Motion &b, double speed)
{
  double most =
      std::max(std::fabs(a.approach - b.approach), std::fabs(a.tangential - b.tangential));
  for (int i = 0; i < 2; ++i)
    most = std::max(most, pair.radius[i] * std::fabs(a.spin[i] - b.spin[i]));
  return most / speed;
}

/// Stores the largest error of a test as a property of the test.
class Worst {
 public:
  explicit Worst(const std::string &name_in = "largest_error") : name(name_in) {}
  ~Worst() { ::testing::Test::RecordProperty(name, std::to_string(1e9 * most) + "e-9"); }
  double see(double error)
  {
    most = std::max(most, std::fabs(error));
    return error;
  }

 private:
  std::string name;
  double most = 0.0;
};

/// Speed of oblique impacts [m/s]. It is small, since the closed forms hold for small overlaps. At
/// this speed the overlaps are 3e-10 m, and their relative rounding error is 1e-8. During the
/// contact the centres pass each other by 1e-9 m, or 2e-7 of a radius.
constexpr double SLOW = 1e-6;

/// Returns the bound of the error of velocities after an impact, relative to `speed`, the largest
/// speed before the impact. The last step of the contact contributes (w dt)^2/8 (see
/// ForceFollowsTheHalfSineInEveryFrame). The steps in which sliding begins and ends together
/// contribute the same amount. The closed form neglects the rotation of the line of centres.
/// According to measurements, this adds an error of half the angle of rotation, which is
/// proportional to the speed.
double impact_error(const DiskPair &pair, int steps, double speed)
{
  const double turn = speed * M_PI / frequency(pair) / std::min(pair.radius[0], pair.radius[1]);
  return 0.25 * std::pow(M_PI / steps, 2) + 0.7 * turn;
}

double radians(double degrees)
{
  return degrees * M_PI / 180.0;
}

Motion oblique(double speed, double angle)    ///< angle between velocity and normal
{
  return {speed * std::cos(angle), speed * std::sin(angle), {0.0, 0.0}};
}

}    // namespace

// ---- 1, 2: elastic normal impact

// A head-on collision is exactly linear. In step k, the leapfrog scheme gives the overlap v dt
// sin(k theta)/sin(theta), with sin(theta/2) = w dt/2. The overlap in the engine differs from this
// formula only by rounding. The half sine of the continuous oscillator differs from the formula by
// (w dt)^2/8 in amplitude and by k (w dt)^3/24 in phase.
TEST(NormalImpact, ForceFollowsTheHalfSineInEveryFrame)
{
  const double speed = 0.1;
  const int steps = 200;
  const DiskPair pair = disks();
  const double omega = frequency(pair), dt = time_step(pair, steps);
  const double peak = speed * std::sqrt(STIFFNESS * pair.mass_eff());
  const double theta = 2.0 * std::asin(0.5 * omega * dt);
  Worst leapfrog("against_leapfrog"), half_sine("against_half_sine");

  for (const Frame &frame : all_frames()) {
    RveRig rig(touching(elastic(), pair, {speed, 0.0, {0.0, 0.0}}, frame));
    double largest_overlap = 0.0;
    int in_contact = 0;
    for (int k = 1; k <= steps + 5; ++k) {
      const Result &result = rig.strain(Tensor2::zero(), dt, 1);
      const double force = result.largest_contact_force;
      if (k <= steps) {
        const double of_leapfrog = STIFFNESS * speed * dt * std::sin(k * theta) / std::sin(theta);
        // A position in the cell is exact to 1e-17 m. An overlap of 3e-5 m then has a relative
        // error of 3e-13. The errors of 200 steps add up.
        EXPECT_NEAR(leapfrog.see((force - of_leapfrog) / peak), 0.0, 1e-10) << frame.name;
        EXPECT_NEAR(half_sine.see((force - peak * std::sin(omega * k * dt)) / peak), 0.0,
                    0.3 * std::pow(omega * dt, 2))
            << frame.name;
      }
      largest_overlap =
          std::max(largest_overlap, result.largest_overlap * (pair.radius[0] + pair.radius[1]));
      in_contact += result.num_contacts;
    }
    const Motion after = motion_of(rig.state(), frame);

    EXPECT_NEAR(largest_overlap * omega / speed, 1.0, 0.3 * std::pow(omega * dt, 2)) << frame.name;
    EXPECT_NEAR(in_contact * dt, M_PI / omega, 1.01 * dt) << frame.name;
    // The leapfrog scheme conserves c^2 + w^2 delta_k delta_(k+1), with the approach velocity c and
    // the overlap delta_k of step k. If the last overlap is delta and the gap one step later is v
    // dt - delta, the final speed is too large, by at most (w dt)^2/8 of itself.
    EXPECT_GE(-after.approach / speed, 1.0 - 1e-10) << frame.name;
    EXPECT_LE(-after.approach / speed, 1.0 + 0.13 * std::pow(omega * dt, 2)) << frame.name;
    EXPECT_NEAR(after.tangential / speed, 0.0, 1e-10) << frame.name;
  }
}

TEST(NormalImpact, UnequalDisksExchangeMomentumAndEnergy)
{
  const double speed = 0.1;
  const int steps = 1000;
  Worst worst;

  for (const double ratio :
       {1.0, 1.5, 3.0, 10.0}) {    // ratio of the radii; its square is the ratio of the masses
    const DiskPair pair = disks(0.01 / ratio, 0.01);
    const double m1 = pair.mass(0), m2 = pair.mass(1);
    for (const Frame &frame : all_frames()) {
      RveState state = touching(elastic(), pair, {speed, 0.0, {0.0, 0.0}}, frame);
      const Vec<double, 2> n = normal_of(frame);
      state.velocity = {speed * n[0], speed * n[1], 0.0, 0.0};    // the second disk rests
      RveRig rig(state);
      const double dt = time_step(pair, steps);

      const Result &result = rig.strain(Tensor2::zero(), dt, steps + 10);

      ASSERT_EQ(result.num_contacts, 0);
      const std::vector<double> after = rig.state().velocity;
      const double v1 = after[0] * n[0] + after[1] * n[1], v2 = after[2] * n[0] + after[3] * n[1];
      const double error = 0.13 * std::pow(M_PI / steps, 2);    // error of the leapfrog, see above
      EXPECT_NEAR(worst.see(v1 / speed - (m1 - m2) / (m1 + m2)), 0.0, error + 1e-10) << frame.name;
      EXPECT_NEAR(worst.see(v2 / speed - 2.0 * m1 / (m1 + m2)), 0.0, error + 1e-10) << frame.name;
      // Both disks get the same integer as force, with opposite signs.
      EXPECT_NEAR((m1 * v1 + m2 * v2) / (m1 * speed), 1.0, 1e-12) << frame.name;
    }
  }
}

// ---- 3: restitution by a dashpot

// The damping ratio for the restitution e is zeta = -ln e/sqrt(pi^2 + ln^2 e). The contact law
// allows tension. After the phase pi - 2 asin(zeta), the force of the dashpot exceeds the force of
// the spring. The disks then attract each other until the overlap vanishes.
TEST(DashpotImpact, RestitutionDurationAndTensionAreThoseOfADampedOscillator)
{
  const double speed = 0.1;
  const int steps = 4000;
  Worst worst;

  for (const double restitution : {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9}) {
    const DiskPair pair = disks(0.003, 0.006);
    const double omega = frequency(pair), dt = time_step(pair, steps);
    const double logarithm = std::log(restitution);
    const double zeta = -logarithm / std::sqrt(M_PI * M_PI + logarithm * logarithm);
    const double damped = omega * std::sqrt(1.0 - zeta * zeta);
    Material material = elastic();
    material.normal_viscosity = 2.0 * zeta * omega * pair.mass_eff();
    const Frame frame = all_frames()[2];
    RveRig rig(touching(material, pair, {speed, 0.0, {0.0, 0.0}}, frame));
    int in_contact = 0, pushing = 0;
    do {
      const Result &result = rig.strain(Tensor2::zero(), dt, 1);
      in_contact += result.num_contacts;
      pushing += trace(result.stress) < 0.0;
    } while (rig.result().num_contacts > 0);

    // The dashpot uses the velocity half a step earlier. The resulting error is of first order in w
    // dt, times the damping ratio.
    const double error = 2.0 * zeta * omega * dt;
    EXPECT_NEAR(worst.see(-motion_of(rig.state(), frame).approach / speed - restitution), 0.0,
                error)
        << restitution;
    EXPECT_NEAR(in_contact * dt, M_PI / damped, 2.0 * dt) << restitution;
    EXPECT_NEAR(pushing * dt, (M_PI - 2.0 * std::asin(zeta)) / damped, 2.0 * dt) << restitution;
  }
}

// ---- 4, 5: oblique impact

// The next three tests have closed forms that do not contain the times at which sliding begins and
// ends. These tests also check the oracle (oracle/linear_impact.h).
TEST(ObliqueImpact, GrossSlidingTransfersTheCoulombImpulse)
{
  // For k_t = k_n the contact slides throughout if tan(angle) > mu (6 - k_n/k_t) = 5 mu.
  const double friction = 0.1;
  const Material material = elastic(friction);
  Worst worst;
  for (const DiskPair &pair : {disks(), disks(0.001, 0.01)})
    for (double angle = 30.0; angle < 89.0; angle += 5.0) {
      const Motion before = oblique(SLOW, radians(angle));

      const Motion after = collide(material, pair, before, 1000);

      // The impulse J = mu 2 m* v_n changes the velocities of the centres. The angular impulse r J,
      // with the radius r, changes the spins of the disks with the inertia I = m r^2/2.
      const double impulse = friction * 2.0 * pair.mass_eff() * before.approach;
      const Motion exact{-before.approach,
                         before.tangential - impulse / pair.mass_eff(),
                         {2.0 * impulse / (pair.mass(0) * pair.radius[0]),
                          2.0 * impulse / (pair.mass(1) * pair.radius[1])}};
      EXPECT_LT(worst.see(difference(pair, after, exact, SLOW)), impact_error(pair, 1000, SLOW))
          << angle;
      EXPECT_LT(difference(pair, exact_rebound(material, pair, before), exact, SLOW), 1e-12);
    }
}

// For k_t = k_n/3, the tangential and the normal oscillation have the same frequency. The contact
// lasts half a period, which reverses the slip. From tan(angle) = 3 mu on, the contact slides
// throughout. The whole curve therefore has a closed form.
TEST(ObliqueImpact, EqualFrequenciesReverseTheSlipOrSlide)
{
  const double friction = 0.4;
  const Material material = elastic(friction, STIFFNESS / 3.0);
  const DiskPair pair = disks(0.004, 0.006);
  Worst worst;
  for (double angle = 5.0; angle < 89.0; angle += 5.0) {
    const Motion before = oblique(SLOW, radians(angle));

    const double rebound = slip(pair, collide(material, pair, before, 1000));

    const double exact = std::tan(radians(angle)) < 3.0 * friction
        ? -before.tangential
        : before.tangential - 6.0 * friction * before.approach;
    // The slip is the sum of three velocities, whose errors add up.
    EXPECT_NEAR(worst.see((rebound - exact) / SLOW), 0.0, 3.0 * impact_error(pair, 1000, SLOW))
        << angle;
    EXPECT_NEAR(exact_rebound(material, pair, before).tangential,
                before.tangential + (exact - before.tangential) / 3.0, 1e-9 * SLOW);
  }
}

// For k_t = 4/3 k_n, the tangential frequency is twice the normal one. The contact lasts a whole
// tangential period, so that the disks have their initial tangential velocity again and no spin.
// The contact must stick throughout. This requires (2/3)(v_t/v_n) |sin 2s| < mu sin s for all s = w
// t, or tan(angle) < 3/4 mu.
TEST(ObliqueImpact, TwiceTheFrequencyGivesTheSlipBack)
{
  const double friction = 1.0;
  const Material material = elastic(friction, 4.0 / 3.0 * STIFFNESS);
  const DiskPair pair = disks();
  for (const double angle : {5.0, 15.0, 25.0, 35.0}) {
    const Motion before = oblique(SLOW, radians(angle));

    const Motion after = collide(material, pair, before, 1000);

    EXPECT_NEAR(after.tangential / SLOW, before.tangential / SLOW, impact_error(pair, 1000, SLOW))
        << angle;
    EXPECT_NEAR(after.spin[0] * RADIUS / SLOW, 0.0, impact_error(pair, 1000, SLOW)) << angle;
  }
}

namespace {

struct ObliqueCase {
  double friction, stiffness_ratio, radius_1, radius_2;
};

/// Surface velocities r w of the disks before the impact, divided by the speed.
struct Surface {
  double first, second;
};

constexpr ObliqueCase OBLIQUE_CASES[] = {{0.1, 1.0, 0.005, 0.005},
                                         {0.5, 1.0, 0.005, 0.005},
                                         {0.3, 0.5, 0.005, 0.005},
                                         {0.3, 2.0 / 7.0, 0.003, 0.007},
                                         {0.092, 0.8, 0.001, 0.01}};

/// Errors over all impact angles, relative to the speed.
struct ObliqueErrors {
  double largest;    ///< largest error of all velocities
  double slip;       ///< root mean square error of the slip
};

ObliqueErrors oblique_errors(const ObliqueCase &c, int steps, const Frame &frame, Surface surface,
                             double speed = SLOW, Format format = Format::Double)
{
  const Material material = elastic(c.friction, c.stiffness_ratio * STIFFNESS);
  const DiskPair pair = disks(c.radius_1, c.radius_2);
  double most = 0.0, squares = 0.0;
  int count = 0;
  for (double angle = 5.0; angle < 89.0; angle += 5.0, ++count) {
    Motion before = oblique(speed, radians(angle));
    before.spin[0] = surface.first * speed / pair.radius[0];
    before.spin[1] = surface.second * speed / pair.radius[1];
    const Motion after = collide(material, pair, before, steps, frame, format);
    const Motion exact = exact_rebound(material, pair, before);
    most = std::max(most, difference(pair, after, exact, speed));
    squares += std::pow((slip(pair, after) - slip(pair, exact)) / speed, 2);
  }
  return {most, std::sqrt(squares / count)};
}

}    // namespace

TEST(ObliqueImpact, SticksAndSlidesAsTheLinearOscillators)
{
  Worst worst;
  for (const ObliqueCase &c : OBLIQUE_CASES)
    for (const Surface surface : {Surface{0.0, 0.0}, Surface{0.7, 0.7}, Surface{-0.4, 1.1}})
      EXPECT_LT(worst.see(oblique_errors(c, 1000, plain_frame(), surface).largest),
                impact_error(disks(c.radius_1, c.radius_2), 1000, SLOW))
          << c.friction << " " << c.stiffness_ratio << " " << surface.first;
}

TEST(ObliqueImpact, DoesNotDependOnDirectionsAndBoundaries)
{
  Worst worst;
  for (const Frame &frame : all_frames())
    EXPECT_LT(worst.see(oblique_errors(OBLIQUE_CASES[3], 1000, frame, {0.0, 0.3}).largest),
              impact_error(disks(OBLIQUE_CASES[3].radius_1, OBLIQUE_CASES[3].radius_2), 1000, SLOW))
        << frame.name;
}

// The convergence is of second order. The force has kinks where sliding begins and ends, but is
// continuous there. The error at a single angle depends on the position of the kink within a step.
// The root mean square over all angles does not scatter.
TEST(ObliqueImpact, ErrorFallsWithTheSquareOfTheTimeStep)
{
  const double coarse = oblique_errors(OBLIQUE_CASES[1], 50, plain_frame(), {0.0, 0.0}).slip;
  const double middle = oblique_errors(OBLIQUE_CASES[1], 200, plain_frame(), {0.0, 0.0}).slip;
  const double fine = oblique_errors(OBLIQUE_CASES[1], 800, plain_frame(), {0.0, 0.0}).slip;
  RecordProperty("coarse", std::to_string(1e9 * coarse) + "e-9");
  RecordProperty("middle", std::to_string(1e9 * middle) + "e-9");
  RecordProperty("fine", std::to_string(1e9 * fine) + "e-9");

  EXPECT_NEAR(std::log(coarse / middle) / std::log(4.0), 2.0, 0.25);
  EXPECT_NEAR(std::log(middle / fine) / std::log(4.0), 2.0, 0.25);
}

// The closed form holds in the limit of small overlaps. With short time steps, the remaining
// difference is proportional to the speed.
TEST(ObliqueImpact, DistanceToTheClosedFormFallsWithTheSpeed)
{
  const double fast =
      oblique_errors(OBLIQUE_CASES[1], 4000, plain_frame(), {0.0, 0.0}, 0.1).largest;
  const double slow =
      oblique_errors(OBLIQUE_CASES[1], 4000, plain_frame(), {0.0, 0.0}, 0.01).largest;

  EXPECT_NEAR(std::log10(fast / slow), 1.0, 0.2);
}

// `mixed` has gap and history in double precision and all else in single precision. The error of a
// thousand steps is 2e-6. `fast` rounds the gap to single precision, which is 1e-9 m for these
// radii. It is therefore tested at 1 cm/s, where overlaps are between 1e-6 m (radii of 1 and 10 mm)
// and 3e-6 m.
TEST(ObliqueImpact, EveryFormatIsAccurateAtItsOverlaps)
{
  struct {
    Format format;
    double speed, rounding;
  } const cases[] = {
      {Format::Double, SLOW, 0.0}, {Format::Mixed, SLOW, 2e-6}, {Format::Fast, 1e-2, 3e-3}};
  for (const auto &c : cases) {
    Worst worst(to_string(c.format));
    for (const ObliqueCase &o : OBLIQUE_CASES)
      EXPECT_LT(
          worst.see(
              oblique_errors(o, 1000, all_frames()[2], {0.2, 0.5}, c.speed, c.format).largest),
          impact_error(disks(o.radius_1, o.radius_2), 1000, c.speed) + c.rounding)
          << to_string(c.format);
  }
}

// ---- 6, 7, 8: normal impact of spinning disks

TEST(SpinningImpact, SpinIsConvertedIntoTangentialVelocity)
{
  Worst worst;
  for (const DiskPair &pair : {disks(), disks(0.003, 0.006), disks(0.001, 0.01)})
    for (const double friction : {0.1, 0.4})
      for (const double surface :
           {-5.0, -1.0, -0.2, 0.05, 0.3, 0.8, 1.5, 3.0, 10.0}) {    // r w/v_n
        const Material material = elastic(friction, 0.7 * STIFFNESS);
        const double fastest = SLOW * std::max(1.0, std::fabs(surface));
        // Either one disk spins, or both spin with equal surface velocities.
        for (const double partner : {0.0, 1.0}) {
          const Motion before{
              SLOW,
              0.0,
              {surface * SLOW / pair.radius[0], partner * surface * SLOW / pair.radius[1]}};

          const Motion after = collide(material, pair, before, 1000);

          EXPECT_LT(
              worst.see(difference(pair, after, exact_rebound(material, pair, before), fastest)),
              impact_error(pair, 1000, fastest))
              << friction << " " << surface << " " << partner;
        }
      }
}

// Disks have no slip and no friction if they roll on each other, or if their tangential velocity
// compensates the spin.
TEST(SpinningImpact, WithoutSlipThereIsNoFriction)
{
  const Material material = elastic(0.5);
  const DiskPair pair = disks(0.003, 0.006);
  Worst worst;
  for (const double tangential : {0.0, 0.5 * SLOW}) {
    Motion before{SLOW, tangential, {10.0 * SLOW / pair.radius[0], 0.0}};
    before.spin[1] = (tangential - 10.0 * SLOW) / pair.radius[1];

    const Motion after = collide(material, pair, before, 1000);

    // The lever arms are shorter than the radii by half the overlap. This length is 1e-7 of the
    // radius, so that the slip is 1e-7 of r w.
    const Motion exact{-SLOW, before.tangential, {before.spin[0], before.spin[1]}};
    const Motion rebound{-SLOW, after.tangential, {after.spin[0], after.spin[1]}};
    EXPECT_LT(worst.see(difference(pair, rebound, exact, SLOW)), 1e-6);
  }
}

// ---- sliding to rolling under a constant load

namespace {

/// A compressed column of six disks, alternately large and small, which closes through the periodic
/// boundary. The tangential forces on a disk from the neighbours above and below cancel, and their
/// torques add up. Therefore only the spins change, and the load stays constant. The surface
/// velocity of every contact is a_1 w_1 + a_2 w_2, with the spins w and the lever arms a = r -
/// overlap/2.
struct Column {
  double overlap;
  DiskPair pair = disks(0.005, 0.004);

  double arm(int kind) const { return pair.radius[kind] - 0.5 * overlap; }
  double surface_velocity(const double *spin) const { return arm(0) * spin[0] + arm(1) * spin[1]; }
  /// Returns the mass m_r [mass] in the equation of motion m_r v' = -f, with the surface velocity v
  /// and the tangential force f of a contact. Each disk has two contacts.
  double mass() const
  {
    double compliance = 0.0;
    for (int i = 0; i < 2; ++i) compliance += 2.0 * arm(i) * arm(i) / pair.inertia(i);
    return 1.0 / compliance;
  }
  /// Returns the spin of the disks in the final state of rolling. `kind` is 0 for the large disks
  /// and 1 for the small disks. The torque divided by the lever arm is the same for all disks, so
  /// that I_1 w_1/a_1 - I_2 w_2/a_2 is conserved.
  double rolling_spin(int kind, const double *spin) const
  {
    const double conserved =
        pair.inertia(0) * spin[0] / arm(0) - pair.inertia(1) * spin[1] / arm(1);
    const double first =
        conserved / (pair.inertia(0) / arm(0) + pair.inertia(1) * arm(0) / (arm(1) * arm(1)));
    return kind == 0 ? first : -first * arm(0) / arm(1);
  }

  RveState state(const Material &material, double spin_1, double spin_2) const
  {
    const double distance = pair.radius[0] + pair.radius[1] - overlap;
    const Tensor2 cell{{CELL, 0.0, 0.0, 6.0 * distance}};
    std::vector<double> radius, xy, spin;
    for (int k = 0; k < 6; ++k) {
      radius.push_back(pair.radius[k % 2]);
      xy.insert(xy.end(), {0.05, (k + 0.5) * distance});
      spin.push_back(k % 2 == 0 ? spin_1 : spin_2);
    }
    RveState state = state_of(material, cell, radius, xy);
    state.spin = spin;
    return state;
  }
};

}    // namespace

// Without dashpots the tangential spring is first loaded up to the limit mu N, with the normal
// force N. Then the spins decrease at the rate 2 mu N a/I until the surface velocity is zero. The
// energy of the spring then makes the spins oscillate about the state of rolling.
TEST(RollingTransition, SpinsSlowDownByFrictionUntilTheSurfacesStop)
{
  const Column column{1e-6};
  const Material material = elastic(0.5);
  const double limit = material.friction * STIFFNESS * column.overlap;
  const double mass = column.mass(), omega = std::sqrt(STIFFNESS / mass);
  const double spin[2] = {10.0, 3.0}, v0 = column.surface_velocity(spin);
  const double loaded = std::asin(limit / (v0 * mass * omega)) / omega;
  const double v1 = v0 * std::cos(omega * loaded), stopped = loaded + v1 * mass / limit;
  const double dt = 0.005 / omega;
  const auto exact = [&](double t) {
    if (t < loaded) return v0 * std::cos(omega * t);
    if (t < stopped) return v1 - limit / mass * (t - loaded);
    return -limit / (mass * omega) * std::sin(omega * (t - stopped));
  };
  const auto spin_of = [&](int kind, double velocity) {    // torque / lever arm is equal for both
    return spin[kind] + (velocity - v0) * 2.0 * mass * column.arm(kind) / column.pair.inertia(kind);
  };
  // The step in which sliding begins gives the impulse an error of k_t v dt^2/8. The oscillation
  // has an amplitude of 6 % of the velocity and lasts 15 radians. Its phase error is (omega
  // dt)^2/24 per radian.
  const double tolerance =
      0.2 * std::pow(omega * dt, 2) * std::fabs(spin_of(1, 0.0) - spin[1]) / spin[0];
  RveRig rig(column.state(material, spin[0], spin[1]));
  Worst worst;

  const int calls = 60, substeps = static_cast<int>((stopped + 15.0 / omega) / dt / calls) + 1;
  for (int call = 1; call <= calls; ++call) {
    rig.strain(Tensor2::zero(), dt, substeps);

    ASSERT_EQ(rig.result().num_contacts, 6);
    const RveState state = rig.state();
    const double velocity = exact((call * substeps + 0.5) * dt);    // spins are half a step ahead
    for (int i = 0; i < 6; ++i) {
      const double error = (state.spin[i] - spin_of(i % 2, velocity)) / spin[0];
      EXPECT_NEAR(worst.see(error), 0.0, tolerance) << call;
    }
    if (call > 1 && call * substeps * dt < stopped) {
      EXPECT_EQ(rig.result().sliding_fraction, 1.0) << call;
    }
  }
}

// With a tangential dashpot the oscillation decays. The contacts slide from the first step until
// the surface velocity is gamma mu N/(k_t m_r), with the viscosity gamma of the dashpot. The final
// state is rolling, w_1 a_1 = -w_2 a_2, and I_1 w_1/a_1 - I_2 w_2/a_2 is conserved.
TEST(RollingTransition, DashpotEndsInRollingForEveryFormat)
{
  // In `double` the relative rounding error of the overlap is 1e-11. In single precision, a spin
  // that decreases by the same amount in every step is rounded in the same direction in every step,
  // by at most 2^-24 of the initial spin. `fast` also rounds an overlap of 3e-5 m by 1e-9 m.
  struct {
    Format format;
    double overlap, error, error_per_step;
  } const cases[] = {{Format::Double, 1e-6, 1e-10, 0.0},
                     {Format::Mixed, 1e-6, 0.0, 0x1p-24},
                     {Format::Fast, 3e-5, 3e-5, 0x1p-24}};
  for (const auto &c : cases) {
    const std::string name = to_string(c.format);
    const Column column{c.overlap};
    Material material = elastic(0.5);
    const double mass = column.mass(), omega = std::sqrt(STIFFNESS / mass);
    material.tangential_viscosity = std::sqrt(STIFFNESS * mass);    // half of the critical damping
    const double limit = material.friction * STIFFNESS * column.overlap;
    const double spin[2] = {1e7 * column.overlap, 0.0}, v0 = column.surface_velocity(spin);
    const double last = material.tangential_viscosity * limit / (STIFFNESS * mass);
    const double dt = 0.005 / omega;
    const int sliding = static_cast<int>((v0 - last) * mass / limit / dt);
    const double error = c.error + c.error_per_step * sliding;
    RveRig rig(column.state(material, spin[0], spin[1]), cpu_options(c.format));
    Worst slide(name + "_sliding"), roll(name + "_rolling");

    rig.strain(Tensor2::zero(), dt, sliding - 2);

    EXPECT_EQ(rig.result().sliding_fraction, 1.0) << name;
    const RveState before = rig.state();
    for (int i = 0; i < 6; ++i) {
      // The force of every step, also of the first one, acts for a whole step. The decrease is
      // therefore linear except for rounding.
      const double exact = spin[i % 2] -
          (sliding - 2) * dt * 2.0 * limit * column.arm(i % 2) / column.pair.inertia(i % 2);
      EXPECT_NEAR(slide.see((before.spin[i] - exact) / spin[0]), 0.0, error) << name;
    }

    rig.strain(Tensor2::zero(), dt, 4000, 3);    // exp(-omega t/2) = 1e-13

    EXPECT_EQ(rig.result().sliding_fraction, 0.0) << name;
    const RveState after = rig.state();
    for (int i = 0; i < 6; ++i) {
      const double exact = column.rolling_spin(i % 2, spin);
      EXPECT_NEAR(roll.see((after.spin[i] - exact) / spin[0]), 0.0, error) << name;
    }
  }
}

TEST(RollingTransition, RollingUnderLoadContinuesWithoutLoss)
{
  const Column column{1e-6};
  const double spin[2] = {10.0, -10.0 * column.arm(0) / column.arm(1)};
  RveRig rig(column.state(elastic(0.5), spin[0], spin[1]));

  rig.strain(Tensor2::zero(), 1e-6, 20000);    // 0.2 rad

  const RveState after = rig.state();
  // Errors of the overlap, 1e-11, change the lever arms and cause a relative slip of 1e-15. The
  // spring counteracts it.
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(after.spin[i] / spin[i % 2], 1.0, 1e-12);
  EXPECT_EQ(rig.result().sliding_fraction, 0.0);
}

// ---- the figure

// Tests oblique impacts at all angles. Writes the results to a file if GPU_RVE_WRITE_CURVES is set.
TEST(ObliqueImpact, ReboundFollowsTheClosedFormAtEveryAngle)
{
  const char *folder = std::getenv("GPU_RVE_WRITE_CURVES");
  std::ofstream file;
  if (folder) {
    file.open(std::string(folder) + "/oblique_impact.csv");
    ASSERT_TRUE(file) << "cannot write to the folder GPU_RVE_WRITE_CURVES=" << folder;
    file << "source,friction,angle_deg,tangential_restitution,surface_velocity_of_spin\n";
  }
  const DiskPair pair = disks();
  const auto write = [&](const char *source, double friction, double angle, const Motion &before,
                         const Motion &after) {
    if (folder)
      file << source << "," << friction << "," << angle << ","
           << after.tangential / before.tangential << "," << RADIUS * after.spin[0] / SLOW << "\n";
  };
  for (const double friction : {0.1, 0.3, 0.6}) {
    const Material material = elastic(friction, 0.8 * STIFFNESS);
    for (double angle = 1.0; angle < 89.5; angle += 0.5) {
      const Motion before = oblique(SLOW, radians(angle));
      write("closed form", friction, angle, before, exact_rebound(material, pair, before));
    }
    for (double angle = 5.0; angle < 86.0; angle += 5.0) {
      const Motion before = oblique(SLOW, radians(angle));

      const Motion after = collide(material, pair, before, 1000);

      EXPECT_LT(difference(pair, after, exact_rebound(material, pair, before), SLOW),
                impact_error(pair, 1000, SLOW))
          << angle;
      write("engine", friction, angle, before, after);
    }
  }
}
