// SPDX-License-Identifier: GPL-2.0-only
// Fabric tensors of contacts, branch vectors and forces, and the elastic energy of each kind of
// spring. Arrays of grains have closed forms. unittest/lammps/test_fabric.cpp compares fabric
// tensors with compute fabric of LAMMPS.

#include "rve/engine/contact_measures.h"
#include "rve/engine/contact_model.h"
#include "support/lattice.h"
#include "support/rve_rig.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double RADIUS = 0.005;    // [m]

/// Returns 4 by 4 disks in a rectangular array with these distances.
RveState rectangles(double along_x, double along_y)
{
  std::vector<double> xy;
  for (int k = 0; k < 16; ++k) {
    xy.push_back((k % 4 + 0.5) * along_x);
    xy.push_back((k / 4 + 0.5) * along_y);
  }
  return state_of(paper_material(), Tensor2{{4 * along_x, 0.0, 0.0, 4 * along_y}},
                  std::vector<double>(16, RADIUS), xy);
}

/// Returns 4 by 4 by 4 spheres in an orthorhombic array with these overlaps along the axes.
Spheres boxes(const Vec<double, 3> &overlap)
{
  std::vector<double> xyz;
  Tensor3 cell = Tensor3::zero();
  for (int a = 0; a < 3; ++a) cell(a, a) = 4.0 * (2.0 * RADIUS - overlap[a]);
  for (int k = 0; k < 64; ++k) {
    const int place[3] = {k % 4, k / 4 % 4, k / 16};
    for (int a = 0; a < 3; ++a) xyz.push_back(0.25 * (place[a] + 0.5) * cell(a, a));
  }
  return spheres(spheres_material(), cell, std::vector<double>(64, RADIUS), xyz);
}

void expect_zero(const Tensor2 &tensor)
{
  for (const double x : tensor.component) EXPECT_NEAR(x, 0.0, 1e-12);
}

}    // namespace

TEST(Fabric, OfTheHexagonalLatticeIsIsotropic)
{
  const auto measures = contact_measures(hexagonal_lattice(paper_material(), RADIUS, 1e-5));

  expect_zero(measures.contact);
  expect_zero(measures.branch);
  expect_zero(measures.normal_force);
  expect_zero(measures.tangential_force);
  EXPECT_NEAR(measures.mean_branch, 2.0 * RADIUS - 1e-5, 1e-14);
  EXPECT_NEAR(measures.mean_normal_force, 1e6 * 1e-5, 1e-9);
}

TEST(Fabric, OfRectanglesHasTheContrastOfForcesAndBranchesAlongTheAxes)
{
  // The forces k (2r - l) are 10 N along x and 30 N along y. In the plane, the fabric tensor of
  // normal forces is N_xx = 2 (f_x - f_y)/(f_x + f_y). The fabric tensor B of branch vectors has
  // the same form, with branch lengths in place of forces.
  const double lx = 2.0 * RADIUS - 1e-5, ly = 2.0 * RADIUS - 3e-5;
  const auto measures = contact_measures(rectangles(lx, ly));

  expect_zero(measures.contact);
  EXPECT_NEAR(measures.normal_force(0, 0), -1.0, 1e-9);
  EXPECT_NEAR(measures.normal_force(1, 1), 1.0, 1e-9);
  EXPECT_NEAR(measures.branch(0, 0), 2.0 * (lx - ly) / (lx + ly), 1e-12);
  EXPECT_NEAR(measures.mean_normal_force, 20.0, 1e-8);
}

TEST(Fabric, OfColumnsIsAlongThem)
{
  // All contacts are along x. With the mean <n n> of the normals, the fabric tensor of contacts is
  // C = 4 (<n n> - 1/2).
  const auto measures = contact_measures(rectangles(2.0 * RADIUS - 1e-5, 2.1 * RADIUS));

  EXPECT_NEAR(measures.contact(0, 0), 2.0, 1e-12);
  EXPECT_NEAR(measures.contact(1, 1), -2.0, 1e-12);
  EXPECT_NEAR(measures.contact(0, 1), 0.0, 1e-12);
}

TEST(Fabric, OfBoxesOfSpheresHasTheContrastOfForcesAlongTheAxes)
{
  // In space N_aa = 15/2 (f_a - f)/(3 f), with the force f_a of the contacts along axis a and the
  // mean force f.
  const double kn = spheres_material().normal_stiffness;
  const Vec<double, 3> overlap{{1e-5, 2e-5, 3e-5}};
  const auto measures = contact_measures(boxes(overlap));

  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(measures.contact(a, a), 0.0, 1e-12);
    EXPECT_NEAR(measures.normal_force(a, a), 2.5 * (overlap[a] - 2e-5) / 2e-5, 1e-8);
  }
  EXPECT_NEAR(measures.mean_normal_force, kn * 2e-5, 1e-8);
}

TEST(Fabric, TangentialForcesAreComparedWithNormalOnes)
{
  // All normal forces are f = 20 N. Contacts along x have tangential forces of 10 N, contacts along
  // y have none. The fabric tensor of tangential forces is T = 4/f (X - tr X/2), with X = diag(5 N,
  // 0).
  RveState state = rectangles(2.0 * RADIUS - 2e-5, 2.0 * RADIUS - 2e-5);
  for (int i = 0; i < 16; ++i)
    state.pairs.push_back({i, i / 4 * 4 + (i + 1) % 4, i % 2 ? 10.0 : -10.0});
  const auto measures = contact_measures(state);

  EXPECT_NEAR(measures.tangential_force(0, 0), 4.0 / 20.0 * 2.5, 1e-9);
  EXPECT_NEAR(measures.tangential_force(1, 1), -4.0 / 20.0 * 2.5, 1e-9);
  EXPECT_NEAR(measures.elastic_tangential, 16 * 0.5 * 100.0 / 1e6, 1e-12);
  EXPECT_NEAR(measures.elastic_normal, 32 * 0.5 * 1e6 * 4e-10, 1e-12);
}

TEST(Fabric, RotatesWithTheRve)
{
  // A sheared packing is compared with the same packing rotated by 90 degrees, which maps x to y
  // and y to -x.
  RveRig rig(paper_packing());
  rig.strain(gradient(0, 1, 1.0), 2e-5, 500);
  RveState state = rig.state(), turned = state;
  turned.cell = Tensor2{{0.0, -1.0, 1.0, 0.0}} * state.cell;
  const auto one = contact_measures(state), other = contact_measures(turned);

  const auto expect_turned = [](const Tensor2 &x, const Tensor2 &y) {
    EXPECT_NEAR(y(1, 1), x(0, 0), 1e-9);
    EXPECT_NEAR(y(0, 1), -x(0, 1), 1e-9);
    EXPECT_GT(std::fabs(x(0, 1)), 0.01);
  };
  expect_turned(one.contact, other.contact);
  expect_turned(one.normal_force, other.normal_force);
  expect_turned(one.tangential_force, other.tangential_force);
}

TEST(Fabric, OfGrainsThatDoNotTouchIsZero)
{
  const auto measures = contact_measures(paper_gas());

  expect_zero(measures.contact);
  expect_zero(measures.branch);
  EXPECT_EQ(measures.mean_branch, 0.0);
  EXPECT_EQ(measures.elastic_normal, 0.0);
}

TEST(Sliding, IsSharedByStrongAndWeakContacts)
{
  // The normal forces are 30 N along x and 10 N along y, with a mean of 20 N. The tangential force
  // is at the friction limit in two of 16 contacts along x and in four of 16 contacts along y.
  RveState state = rectangles(2.0 * RADIUS - 3e-5, 2.0 * RADIUS - 1e-5);
  const double friction = state.material.friction;
  ASSERT_GT(friction, 0.0);
  for (int i = 0; i < 16; ++i) {
    const int right = i / 4 * 4 + (i + 1) % 4, above = (i + 4) % 16;
    state.pairs.push_back({i, right, friction * (i < 2 ? 30.0 : 29.0)});
    state.pairs.push_back({i, above, friction * (i < 4 ? 10.0 : 9.0)});
  }
  const auto measures = contact_measures(state);

  EXPECT_EQ(measures.strong, 0.5);
  EXPECT_EQ(measures.sliding_strong, 2.0 / 16.0);
  EXPECT_EQ(measures.sliding_weak, 4.0 / 16.0);
}

TEST(Sliding, IsThatOfTheEngineAndOfWeakContacts)
{
  // In a sheared packing nearly all sliding contacts are weak (Radjai et al. 1998).
  RveRig rig(paper_packing());
  const Result &result = rig.strain(gradient(0, 1, 1.0), 2e-5, 500);
  const auto measures = contact_measures(rig.state());

  EXPECT_NEAR(measures.strong, 0.42, 0.08);
  EXPECT_GT(measures.sliding_weak, 3.0 * measures.sliding_strong);
  const double all =
      measures.strong * measures.sliding_strong + (1.0 - measures.strong) * measures.sliding_weak;
  EXPECT_GT(all, 0.02);
  // A few contacts are so close to the limit, within 1e-3, that the host and the engine can count
  // them differently.
  EXPECT_NEAR(all, result.sliding_fraction, 5.0 / result.num_contacts);
}

TEST(ElasticEnergy, OfDisksIsThatOfTheEngineByKinds)
{
  RveState state = paper_packing();
  state.material.rolling_stiffness = 5e5;
  state.material.rolling_friction = 0.2;
  RveRig rig(state);
  const Result &result = rig.strain(gradient(0, 1, 1.0), 2e-5, 500);
  const auto measures = contact_measures(rig.state());

  EXPECT_GT(measures.elastic_tangential, 0.01 * result.elastic_energy);
  EXPECT_GT(measures.elastic_rolling, 1e-4 * result.elastic_energy);
  EXPECT_NEAR(measures.elastic_normal + measures.elastic_tangential + measures.elastic_rolling,
              result.elastic_energy, 1e-7 * result.elastic_energy);    // the engine adds integers
}

TEST(ElasticEnergy, OfRollingIsThatOfItsSprings)
{
  // A rolling force f stores the energy f^2 / (2 k_r). 16 contacts have 3 N and 16 contacts have -2
  // N. Normal forces of 20 N allow up to 4 N.
  RveState state = rectangles(2.0 * RADIUS - 2e-5, 2.0 * RADIUS - 2e-5);
  state.material.rolling_stiffness = 5e5;
  state.material.rolling_friction = 0.2;
  for (int i = 0; i < 16; ++i)
    for (const bool above : {false, true}) {
      Pair pair{i, above ? (i + 4) % 16 : i / 4 * 4 + (i + 1) % 4, 0.0};
      pair.rolling_force = above ? -2.0 : 3.0;
      state.pairs.push_back(pair);
    }
  const auto measures = contact_measures(state);

  const double expected = 16 * (9.0 + 4.0) / (2.0 * 5e5);
  EXPECT_NEAR(measures.elastic_rolling, expected, 1e-9 * expected);
  EXPECT_EQ(measures.elastic_tangential, 0.0);
}

TEST(ElasticEnergy, OfRollingAndTwistingSpheresIsThatOfTheirSprings)
{
  // The 64 contacts along x have a normal force of 20 N. A rolling force of f_r = 1.5 N across the
  // normal stores the energy f_r^2 / (2 k_r), and a twisting moment of m = 1 mN m stores m^2 / (2
  // k_q). After Marshall, k_q = k_t R d / 2, with the reduced radius R and the overlap d. The
  // history then contains the number M for the angle M / (k_t R^2 / 2).
  for (const double marshall : {0.0, 1.0}) {
    SCOPED_TRACE(marshall);
    const double overlap = 2e-5, reduced_radius = 0.5 * RADIUS;
    Spheres state = boxes({{overlap, -1e-3, -1e-3}});
    state.material.rolling_stiffness = 4e5;
    state.material.rolling_friction = 0.2;
    state.material.twisting_marshall = marshall;
    double remembered = 1e-3, energy = remembered * remembered / (2.0 * 2.0);
    if (marshall == 0.0) {
      state.material.twisting_stiffness = 2.0;
      state.material.twisting_friction = 1e-3;    // 20 mN m
    } else {
      remembered = 0.05;
      const double kt = state.material.tangential_stiffness;
      const double angle = remembered / (0.5 * kt * reduced_radius * reduced_radius);
      energy = 0.5 * (0.5 * kt * reduced_radius * overlap) * angle * angle;
    }
    for (int i = 0; i < 64; ++i) {
      PairOf<3> pair{i, i / 4 * 4 + (i + 1) % 4, Vec<double, 3>::zero()};
      pair.rolling_force = {{0.0, 1.2, -0.9}};
      pair.twisting_moment = remembered;
      state.pairs.push_back(pair);
    }
    const auto measures = contact_measures(state);

    const double rolling = 64 * 1.5 * 1.5 / (2.0 * 4e5);
    EXPECT_NEAR(measures.elastic_rolling, rolling, 1e-9 * rolling);
    EXPECT_NEAR(measures.elastic_twisting, 64 * energy,
                1e-8 * 64 * energy);    // the overlap is a difference of close numbers
    EXPECT_EQ(measures.elastic_tangential, 0.0);
  }
}

TEST(ElasticEnergy, OfSpheresIsThatOfTheEngineByKindsInEveryLaw)
{
  struct Case {
    const char *name;
    ContactLaw law;
    double twisting_marshall;
  };
  for (const Case &c : {Case{"hooke", ContactLaw::Linear, 0.0},
                        {"hooke, marshall", ContactLaw::Linear, 1.0},
                        {"hertz", ContactLaw::Hertz, 0.0},
                        {"dmt", ContactLaw::Dmt, 1.0}}) {
    SCOPED_TRACE(c.name);
    Material material;
    material.law = c.law;
    material.density = 2650.0;
    material.friction = 0.5;
    material.rolling_stiffness = 4e5;
    material.rolling_friction = 0.1;
    material.twisting_marshall = c.twisting_marshall;
    if (c.twisting_marshall == 0.0) {
      material.twisting_stiffness = 2.0;
      material.twisting_friction = 2e-4;
    }
    if (c.law == ContactLaw::Linear) {
      material.normal_stiffness = material.tangential_stiffness = 1e6;
    } else {
      material.hertz_stiffness = 1e9;
      material.mindlin_stiffness = 8e8;
      material.mindlin_displacement = 1.0;
    }
    if (c.law == ContactLaw::Dmt) material.surface_energy = 5.0;
    const Spheres state = disordered_spheres(material, 4, 3);
    Options options = sphere_options();
    options.contacts = contacts_of(state);
    SphereRig rig(state, options);
    Tensor3 shear = Tensor3::zero();
    shear(0, 1) = 5.0;
    shear(0, 2) = -3.0;
    const auto result = rig.strain(shear, 1e-6, 2000);
    const auto measures = contact_measures(rig.state());

    EXPECT_GT(measures.elastic_tangential, 0.0);
    EXPECT_GT(measures.elastic_rolling, 0.0);
    EXPECT_GT(measures.elastic_twisting, 0.0);
    EXPECT_NEAR(measures.elastic_normal + measures.elastic_tangential + measures.elastic_rolling +
                    measures.elastic_twisting,
                result.elastic_energy,
                1e-7 * std::fabs(result.elastic_energy));    // the engine adds integers
  }
}
