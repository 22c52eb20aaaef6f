// SPDX-License-Identifier: GPL-2.0-only
// Tests arrays of spheres with sliding contacts. The stress ratios of an array depend only on
// geometry and friction, not on the springs.
//
// An array consists of layers. In a layer, spheres form rectangles with edges a_x and a_y. Spheres
// of a layer do not touch. The layers are a height h apart. Each sphere is above the middle of a
// rectangle of the layer below. For a_x = a_y = sqrt(2) h the array is face-centred cubic. Spheres
// of neighbouring layers touch, with the branch vectors b = (+-a_x/2, +-a_y/2, h). A deformation
// with a velocity gradient L that does not change |b| makes these contacts slide in the direction
// s = L b / |L b|. With the normal n and the friction mu, the contact force is proportional to
// n - mu s, so that
//   sigma_zz / sigma_xx = (n_z - mu s_z) b_z / ((n_x - mu s_x) b_x).
// For a_x = a_y = a this ratio is 2 t (t + mu) / (1 - mu t), with t = sqrt(2) h / a. For t = 1 the
// ratio is the strength of the array of Thornton (1979, Geotechnique 29, 441-459):
//   2 (1 + mu) / (1 - mu) in axisymmetric compression,
//   2 (sqrt(3) + sqrt(2) mu) / (sqrt(3) - 2 sqrt(2) mu) in plane strain.

#include "engine/test_states.h"
#include "support/spheres.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

constexpr double RADIUS = 0.005, FRICTION = 0.25;
/// The overlap is so small that tangential springs take the direction of sliding at once.
constexpr double OVERLAP = 1e-7 * RADIUS;

struct Layers {
  double ax, ay, h;    ///< edges of a rectangle and height of a layer [length]
};

using Vector = Vec<double, 3>;

Vector branch(const Layers &layers)
{
  return {{0.5 * layers.ax, 0.5 * layers.ay, layers.h}};
}

/// Returns eight layers of four by four spheres.
Spheres array_of(const Layers &layers)
{
  Material material = paper_material();
  material.thickness = 1.0;
  material.friction = FRICTION;
  std::vector<double> x;
  for (int k = 0; k < 8; ++k)
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        const double shift = 0.25 + 0.5 * (k % 2);
        x.insert(x.end(), {(i + shift) * layers.ax, (j + shift) * layers.ay, (k + 0.5) * layers.h});
      }
  const Tensor3 cell{{4 * layers.ax, 0.0, 0.0, 0.0, 4 * layers.ay, 0.0, 0.0, 0.0, 8 * layers.h}};
  return spheres(material, cell, std::vector<double>(x.size() / 3, RADIUS), x);
}

/// Returns layers with t = 0.999. Spheres of the same layer have gaps of 5e-4 of a diameter.
Layers square_layers()
{
  const double t = 0.999, contact = 2.0 * RADIUS - OVERLAP,
               a = contact / std::sqrt(0.5 * (1.0 + t * t));
  return {a, a, t * a / std::sqrt(2.0)};
}

/// Returns the layers after a compression that reduces their height by `share` and keeps the length
/// of the branch vectors. In plane strain a_y does not change.
Layers compressed(const Layers &layers, double share, bool plane)
{
  const double squared = dot(branch(layers), branch(layers)), h = (1.0 - share) * layers.h;
  const double rest = squared - h * h;
  const double ax = plane ? 2.0 * std::sqrt(rest - 0.25 * layers.ay * layers.ay)
                          : std::sqrt(2.0 * rest);
  return {ax, plane ? layers.ay : ax, h};
}

struct Ratios {
  double zz_xx, yy_xx;
};

Vector unit(const Vector &x)
{
  return (1.0 / std::sqrt(dot(x, x))) * x;
}

/// Returns the stress ratios of an array in which all contacts slide. The contacts have branch
/// vectors b, which have just changed by db.
Ratios sliding_ratios(const Vector &b, const Vector &db)
{
  const Vector n = unit(b), s = unit(db - dot(db, n) * n);
  double sigma[3];
  for (int a = 0; a < 3; ++a) sigma[a] = (n[a] - FRICTION * s[a]) * b[a];
  return {sigma[2] / sigma[0], sigma[1] / sigma[0]};
}

void expect_ratios_of_sliding(bool plane)
{
  Layers layers = square_layers();
  SphereRig rig(array_of(layers));
  for (int call = 0; call < 100; ++call) {
    const Layers next = compressed(layers, 1e-5, plane);
    DriveOf<3> drive;
    drive.dt = 1e-6;
    drive.substeps = 10;
    drive.deformation = Tensor3{{next.ax / layers.ax, 0.0, 0.0, 0.0, next.ay / layers.ay, 0.0, 0.0,
                                 0.0, next.h / layers.h}};
    const ResultOf<3> result = rig.advance(drive);
    const Vector before = branch(layers), now = branch(next);
    layers = next;
    if (call % 25 != 24) continue;

    SCOPED_TRACE(call);
    EXPECT_EQ(result.num_contacts, 4 * result.num_grains);
    EXPECT_EQ(result.sliding_fraction, 1.0);
    const Ratios expected = sliding_ratios(now, now - before);
    EXPECT_NEAR(result.stress(2, 2) / result.stress(0, 0), expected.zz_xx, 1e-6 * expected.zz_xx);
    EXPECT_NEAR(result.stress(1, 1) / result.stress(0, 0), expected.yy_xx, 1e-6 * expected.yy_xx);
    EXPECT_LT(result.stress(2, 2), 0.0);
    EXPECT_NEAR(result.stress(0, 1), 0.0, 1e-9 * result.mean_stress());
    EXPECT_NEAR(result.kinetic_energy, 0.0, 1e-12 * result.elastic_energy);
  }
}

}    // namespace

TEST(SlidingArray, OracleIsTheFormulaOfFiniteStrainsAndThorntonsStrength)
{
  const double mu = FRICTION, root2 = std::sqrt(2.0), root3 = std::sqrt(3.0);
  // The length of b stays constant if b . db = 0, that is if the sphere moves outwards and
  // downwards at the right ratio.
  const Vector b{{0.5, 0.5, 0.7}};
  const double outwards = 0.7 * 0.7 / (0.5 * 0.5 + 0.5 * 0.5), t = root2 * 0.7;
  EXPECT_NEAR(sliding_ratios(b, {{0.5 * outwards, 0.5 * outwards, -0.7}}).zz_xx,
              2.0 * t * (t + mu) / (1.0 - mu * t), 1e-14);

  const Vector cubic{{0.5 * root2, 0.5 * root2, 1.0}};
  EXPECT_NEAR(sliding_ratios(cubic, {{0.5 * root2, 0.5 * root2, -1.0}}).zz_xx,
              2.0 * (1.0 + mu) / (1.0 - mu), 1e-14);
  const Ratios plane = sliding_ratios(cubic, {{root2, 0.0, -1.0}});
  EXPECT_NEAR(plane.zz_xx, 2.0 * (root3 + root2 * mu) / (root3 - 2.0 * root2 * mu), 1e-14);
  EXPECT_NEAR(plane.yy_xx, root3 / (root3 - 2.0 * root2 * mu), 1e-14);
}

TEST(SlidingArray, HasTheStressRatioOfAxisymmetricCompression)
{
  expect_ratios_of_sliding(false);
}

TEST(SlidingArray, HasTheStressRatiosOfPlaneStrain)
{
  expect_ratios_of_sliding(true);
}
