// SPDX-License-Identifier: GPL-2.0-only
// Adhesion that acts beyond the contact, up to a reach h, in the whole engine. The tests cover the
// force as a function of the gap, the work of separation, and packings whose grains attract each
// other at a distance.

#include "rve/core/error.h"
#include "rve/engine/contact_network.h"
#include "rve/engine/stability.h"
#include "support/messages.h"
#include "support/packings.h"
#include "support/rve_rig.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double RADIUS = 0.005, REDUCED_RADIUS = 0.5 * RADIUS, REACH = 0.2 * RADIUS;    // [m]

Material sticky()
{
  Material material;
  material.law = ContactLaw::Dmt;
  material.density = 2650.0;
  material.hertz_stiffness = 1e9;
  material.mindlin_displacement = 1.0;
  material.surface_energy = 5.0;
  material.adhesion_reach = REACH;
  return material;
}

Material sticky_with_everything()
{
  Material material = sticky();
  material.friction = 0.5;
  material.mindlin_stiffness = 8e8;
  material.normal_viscosity = 2.0;
  material.mindlin_damping = 0.25;
  material.local_damping = 0.2;
  material.rolling_stiffness = 4e5;
  material.rolling_friction = 0.1;
  return material;
}

double pull(const Material &material)
{
  return 4.0 * kPi * material.surface_energy * REDUCED_RADIUS;
}

template <class State> Options options_for(const State &state, Format format = Format::Double)
{
  Options options = sphere_options(format);
  options.contacts = contacts_of(state);
  return options;
}

/// Returns 4^3 spheres in a simple cubic array with this gap between neighbours.
Spheres cubic_with_gaps(const Material &material, double gap)
{
  return simple_cubic(material, 4, RADIUS, -gap);
}

/// Returns two spheres with a gap along x that separate with a velocity.
Spheres parting(const Material &material, double gap, double velocity)
{
  const double x = RADIUS + 0.5 * gap;
  Spheres state = spheres(material, 0.1 * Tensor3::identity(), {RADIUS, RADIUS},
                          {0.05 - x, 0.05, 0.05, 0.05 + x, 0.05, 0.05});
  state.velocity = {-0.5 * velocity, 0.0, 0.0, 0.5 * velocity, 0.0, 0.0};
  return state;
}

double gap_of(const Spheres &state)
{
  const auto wrapped = static_cast<std::int64_t>(state.fractional[3] - state.fractional[0]);
  return std::fabs(0.1 * std::ldexp(static_cast<double>(wrapped), -64)) - 2.0 * RADIUS;
}

double relative_velocity(const Spheres &state)
{
  return state.velocity[3] - state.velocity[0];
}

/// Returns the escape velocity v of two touching spheres. The kinetic energy m* v^2/2 equals the
/// work of adhesion f_a h/2, with the reduced mass m*, the pull-off force f_a and the reach h.
double escape_velocity(const Material &material)
{
  return std::sqrt(pull(material) * REACH / (0.5 * sphere_mass(material, RADIUS)));
}

}    // namespace

TEST(AdhesionAtADistance, DecreasesLinearlyToZero)
{
  const Material material = sticky();
  for (const Format format : {Format::Double, Format::Mixed, Format::Fast})
    for (const double share : {0.01, 0.25, 0.5, 0.99}) {
      const double gap = share * REACH, spacing = 2.0 * RADIUS + gap;
      const Spheres state = cubic_with_gaps(material, gap);
      const ResultOf<3> result = SphereRig(state, options_for(state, format)).advance(DriveOf<3>());
      const double full = pull(material) / (spacing * spacing);
      // Forces are fp32 in `mixed` and `fast`. In `fast`, the gap is also rounded, to the last
      // digit of a radius.
      const double error = format == Format::Double ? 1e-10 : format == Format::Mixed ? 5e-6 : 1e-4;
      for (int a = 0; a < 3; ++a)
        EXPECT_NEAR(result.stress(a, a), (1.0 - share) * full, error * full)
            << to_string(format) << " at " << share;
      EXPECT_EQ(result.num_contacts, 3 * state.num_grains());
      EXPECT_EQ(result.largest_overlap, 0.0);
      EXPECT_EQ(result.sliding_fraction, 0.0);
      EXPECT_NEAR(result.elastic_energy,
                  -3.0 * state.num_grains() * 0.5 * pull(material) * REACH * (1.0 - share) *
                      (1.0 - share),
                  10.0 * error * state.num_grains() * pull(material) * REACH);
    }
}

TEST(AdhesionAtADistance, EndsAtItsReach)
{
  const Spheres apart = cubic_with_gaps(sticky(), 1.0001 * REACH);
  const ResultOf<3> result = SphereRig(apart, options_for(apart)).advance(DriveOf<3>());
  EXPECT_EQ(result.num_contacts, 0);
  EXPECT_EQ(result.stress(0, 0), 0.0);
  EXPECT_TRUE(find_contacts(apart).empty());
  EXPECT_EQ(find_contacts(cubic_with_gaps(sticky(), 0.9999 * REACH)).size(),
            3u * apart.num_grains());
}

TEST(AdhesionAtADistance, SoftensAnArray)
{
  // sigma_xx = f/(l_y l_z) and df = -f_a/h dl_x, with the attraction f, the distances l of
  // neighbours along the axes, the pull-off force f_a and the reach h.
  const Material material = sticky();
  const double gap = 0.4 * REACH, l = 2.0 * RADIUS + gap;
  const Spheres state = cubic_with_gaps(material, gap);
  const ElasticResultOf<3> answer = SphereRig(state, options_for(state)).stiffness();
  const double c11 = -pull(material) / REACH / l, tension = 0.6 * pull(material) / (l * l);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      // The tolerance is the rounding error of the integer sums. Their unit is coarse, since it
      // allows overlaps as large as grains.
      EXPECT_NEAR(answer.stiffness.component[4 * i][j], i == j ? c11 : -tension,
                  1e-6 * std::fabs(c11));
}

TEST(AdhesionAtADistance, GrainsSeparateAfterTheWorkOfAdhesion)
{
  // Separation by a gap g takes the work f_a (g - g^2/(2 h)), with the pull-off force f_a and the
  // reach h.
  const Material material = sticky();
  const double escape = escape_velocity(material);
  for (const Format format : {Format::Double, Format::Mixed, Format::Fast}) {
    // The first kick lasts a whole step, which is half a step too long. The excess of half a step
    // changes the velocity by 1.25e-4 of the escape velocity. The relative change of the results is
    // up to 5/3 times 1.25e-4.
    const double error = format == Format::Fast ? 1e-3 : 3e-4;
    const double fast = 1.25 * escape, slow = 0.8 * escape, dt = REACH / escape / 4000;
    const Spheres leaves = parting(material, 0.0, fast), returns = parting(material, 0.0, slow);
    SphereRig free(leaves, options_for(leaves, format));
    free.strain(Tensor3::zero(), dt, 8000);
    EXPECT_GT(gap_of(free.state()), REACH);
    EXPECT_NEAR(relative_velocity(free.state()), 0.75 * escape, error * escape)
        << to_string(format);

    SphereRig held(returns, options_for(returns, format));
    double farthest = 0.0;
    for (int call = 0; call < 250 && relative_velocity(held.state()) > 0.0; ++call) {
      held.strain(Tensor3::zero(), dt, 20);
      farthest = std::max(farthest, gap_of(held.state()));
    }
    EXPECT_NEAR(farthest, (1.0 - 0.6) * REACH, error * REACH) << to_string(format);
    // Momentum is conserved to the last bit, although many slots for pairs are empty.
    const Spheres end = held.state();
    for (int a = 0; a < 3; ++a) EXPECT_EQ(end.velocity[a], -end.velocity[3 + a]);
  }
}

TEST(AdhesionAtADistance, PullsGrainsIntoContact)
{
  const Material material = sticky();
  const double share = 0.9, dt = REACH / escape_velocity(material) / 4000;
  const Spheres begin = parting(material, share * REACH, 0.0);
  SphereRig rig(begin, options_for(begin));
  double before = 0.0;
  int call = 0;
  for (; call < 4000 && gap_of(rig.state()) > 0.0; ++call) {
    before = relative_velocity(rig.state());
    rig.strain(Tensor3::zero(), dt, 10);
  }
  ASSERT_LE(gap_of(rig.state()), 0.0);
  const double expected =
      escape_velocity(material) * std::sqrt(1.0 - (1.0 - share) * (1.0 - share));
  // The tolerance is the change of velocity in the last ten steps.
  EXPECT_NEAR(-before, expected, 5e-3 * expected);
}

TEST(AdhesionAtADistance, HasNoHistory)
{
  // When a pair separates, the energy of its tangential spring is lost. The bookkeeping must count
  // this loss as dissipation.
  Material material = sticky_with_everything();
  material.local_damping = material.normal_viscosity = 0.0;
  Spheres state = disordered_spheres(material, 5, 3);
  Options options = options_for(state);
  options.track_energy = true;
  SphereRig rig(state, options);
  rig.strain(Tensor3{{-2.0, 3.0, 1.0, 0.0, 1.0, -2.0, 0.0, 0.0, 0.5}}, 2e-6, 300);
  const Spheres pressed = rig.state();
  int touching = 0, apart = 0;
  for (const TouchingPairOf<3> &contact : find_contacts(pressed))
    ++(contact.overlap > 0.0 ? touching : apart);
  EXPECT_GT(touching, 50);
  EXPECT_GT(apart, 50);
  for (const PairOf<3> &pair : remembered_pairs(pressed, find_contacts(pressed))) {
    const Vec<double, 3> branch = branch_vector(pressed, pair.first, pair.second);
    if (std::sqrt(dot(branch, branch)) > pressed.radius[pair.first] + pressed.radius[pair.second]) {
      EXPECT_EQ(dot(pair.tangential_force, pair.tangential_force), 0.0);
      EXPECT_EQ(pair.contact_radius, 0.0);
    }
  }
}

TEST(AdhesionAtADistance, BalancesItsEnergy)
{
  for (const bool rolls : {false, true}) {
    Material material = sticky_with_everything();
    if (!rolls) material.rolling_stiffness = material.rolling_friction = 0.0;
    const Spheres state = disordered_spheres(material, 6, 2);
    Options options = options_for(state);
    options.track_energy = true;
    SphereRig rig(state, options);
    const ResultOf<3> first = rig.advance(DriveOf<3>());
    ResultOf<3> last;
    const Tensor3 shear{{-2.0, 3.0, 1.0, 0.0, 1.0, -2.0, 0.0, 0.0, 0.5}};
    for (int call = 0; call < 5; ++call) last = rig.strain(shear, 1e-6, 400);

    const double gained =
        last.kinetic_energy + last.elastic_energy - first.kinetic_energy - first.elastic_energy;
    const double lost = last.energy.friction + last.energy.local_damping + last.energy.viscous;
    EXPECT_GT(last.energy.friction, 0.0);
    EXPECT_GT(last.energy.viscous, 0.0);
    EXPECT_NEAR(last.energy.work, gained + lost, 0.01 * (std::fabs(last.energy.work) + lost));
  }
}

TEST(AdhesionAtADistance, OfDisksBalancesItsEnergy)
{
  RveState state = paper_packing();
  Material material = sticky_with_everything();
  material.thickness = material.mass_depth = 1.0;
  material.adhesion_reach = 3e-4;
  material.surface_energy = 100.0;
  state.material = material;
  Options options = cpu_options();
  options.track_energy = true;
  RveRig rig(state, options);
  const Result before = rig.evaluate();
  const Result after = rig.strain(gradient(0, 1, 0.05), 1e-5, 4000, 2);
  const double gained =
      after.elastic_energy - before.elastic_energy + after.kinetic_energy - before.kinetic_energy;
  const double lost = after.energy.friction + after.energy.local_damping + after.energy.viscous;
  EXPECT_NEAR(after.energy.work, gained + lost, 2e-3 * (std::fabs(after.energy.work) + lost));
  EXPECT_GT(after.num_contacts, 1.1 * before.num_grains);
}

TEST(AdhesionAtADistance, DoesNotDependOnTheListOfNeighbours)
{
  // The results are the same for a narrow skin with many rebuilds and for a wide skin with few
  // rebuilds.
  const Spheres state = disordered_spheres(sticky_with_everything(), 6, 7);
  std::vector<Spheres> ends;
  std::vector<std::int64_t> rebuilds;
  for (const double skin : {2e-5, 1e-3}) {
    Options options = options_for(state);
    options.skin = skin;
    SphereRig rig(state, options);
    const Tensor3 stretch{{4.0, 2.0, 0.0, 0.0, 3.0, 0.0, 0.0, 1.0, 5.0}};
    rebuilds.push_back(rig.strain(stretch, 2e-6, 2000).counters.rebuilds);
    ends.push_back(rig.state());
  }
  EXPECT_GT(rebuilds[0], 5 * rebuilds[1]);
  EXPECT_EQ(ends[0].fractional, ends[1].fractional);
  EXPECT_EQ(ends[0].velocity, ends[1].velocity);
  EXPECT_EQ(ends[0].spin, ends[1].spin);
}

TEST(AdhesionAtADistance, ExistingRveFindsItsNewContacts)
{
  // The list of this state was built for contacts without a reach.
  Material without = sticky_with_everything();
  without.adhesion_reach = 0.0;
  const Spheres state = disordered_spheres(without, 6, 7);
  const auto engine = make_engine<3>(options_for(state));
  const int rve = engine->add(state);
  const std::vector<DriveOf<3>> shear{DriveOf<3>::constant_velocity_gradient(
      Tensor3{{-2.0, 3.0, 1.0, 0.0, 1.0, -2.0, 0.0, 0.0, 0.5}}, 2e-6, 100)};
  std::vector<ResultOf<3>> before, after, fresh;
  engine->advance({rve}, shear, before);
  Spheres changed = engine->state(rve);
  changed.material.adhesion_reach = REACH;
  engine->set_material(rve, changed.material);
  engine->advance({rve}, shear, after);
  const auto other = make_engine<3>(options_for(changed));
  other->add(changed);
  other->advance({0}, shear, fresh);

  EXPECT_GT(after[0].num_contacts, 1.2 * before[0].num_contacts);
  EXPECT_EQ(serialize(engine->state(rve)), serialize(other->state(0)));
  const Spheres end = engine->state(rve);
  EXPECT_EQ(find_contacts(end).size(), static_cast<std::size_t>(after[0].num_contacts));
}

TEST(ListOfARecord, IsNotTrustedWithALargerSkinThanItWasBuiltFor)
{
  const Spheres state = disordered_spheres(sticky_with_everything(), 6, 7);
  const Tensor3 stretch{{-4.0, 2.0, 0.0, 0.0, -3.0, 0.0, 0.0, 1.0, -5.0}};
  Options narrow = options_for(state), wide = options_for(state);
  narrow.skin = 5e-5;
  wide.skin = 2e-3;
  SphereRig first(state, narrow), whole(state, wide);
  first.strain(stretch, 2e-6, 50);
  whole.strain(stretch, 2e-6, 50);
  const std::vector<char> record = serialize(first.state());
  SphereRig again(deserialize<3>(record.data(), record.size()), wide);
  again.strain(stretch, 2e-6, 2000);
  whole.strain(stretch, 2e-6, 2000);
  EXPECT_EQ(again.state().fractional, whole.state().fractional);
  EXPECT_EQ(again.state().velocity, whole.state().velocity);
  // Control: the list of this state was built for the narrow skin but is marked as built for the
  // wide skin. The run then misses contacts.
  Spheres claims = deserialize<3>(record.data(), record.size());
  claims.list_margin = wide.skin + REACH;
  SphereRig deceived(claims, wide);
  deceived.strain(stretch, 2e-6, 2000);
  EXPECT_NE(deceived.state().fractional, whole.state().fractional);
  // An engine that has the skin for which the list was built uses the list.
  const std::vector<char> same = serialize(SphereRig(first.state(), narrow).state());
  EXPECT_EQ(same, record);
}

TEST(AdhesionAtADistance, DoesNotLimitTheTimeStep)
{
  // Neighbours are within the reach but do not touch. The time step is then limited only by
  // contacts that can form, as it is for grains that are far apart.
  const Spheres near = cubic_with_gaps(sticky(), 0.5 * REACH),
                far = cubic_with_gaps(sticky(), 2.0 * REACH);
  EXPECT_EQ(stable_time_step(near), stable_time_step(far));
}

TEST(AdhesionAtADistance, InvalidReachIsAnError)
{
  for (const double share : {1e-7, 1.1}) {
    Material material = sticky();
    material.adhesion_reach = share * RADIUS;
    const Spheres state = cubic_with_gaps(material, 0.0);
    const std::string message = message_of([&] { state.check(); });
    EXPECT_NE(message.find("reach of the adhesion is"), std::string::npos) << message;
    EXPECT_NE(message.find("[length]; it must be 0, or between 1e-6 and 1 times the smallest "
                           "radius, 5e-09 and 0.005"),
              std::string::npos)
        << message;
  }
}

TEST(AdhesionAtADistance, TooLongAReachForTheCellIsAnError)
{
  // The cell is slightly wider than two contact distances without a reach. The reach increases the
  // contact distance, so that the cell becomes too narrow.
  Material material = sticky();
  std::vector<double> x{0.01, 0.01, 0.01};
  material.adhesion_reach = 0.0;
  spheres(material, 0.0201 * Tensor3::identity(), {RADIUS}, x).check();
  material.adhesion_reach = REACH;
  const std::string message =
      message_of([&] { spheres(material, 0.0201 * Tensor3::identity(), {RADIUS}, x).check(); });
  EXPECT_NE(message.find("must exceed twice the largest contact distance, 0.022"),
            std::string::npos)
      << message;
}
