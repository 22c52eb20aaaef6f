// SPDX-License-Identifier: GPL-2.0-only
// RVEs open until no grains touch, as at a free surface, and are closed again. They must have no
// stress without contacts, stress when grains touch again, and balanced energy bookkeeping.

#include "macro/rve_points.h"

#include "rve/engine/finite_strain.h"
#include "support/small_packings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

using macro::MacroStepOptions;
using namespace rve_test;

namespace {

template <int D> using Points = macro::RvePointsOf<D>;
template <int D> using Matrix = rve::Tensor<double, D>;
template <int D> using Result = rve::ResultOf<D>;

constexpr double RADIUS = 0.005, OVERLAP = 1e-3 * RADIUS;

template <int D> Points<D> points_of(const rve::RveStateOf<D> &state)
{
  MacroStepOptions macro;
  macro.most_copies = 2;
  Points<D> points(rve::make_engine<D>(options_of_dimension(D)), nullptr, macro);
  points.add({&state});
  return points;
}

/// Returns an equal stretch of all axes by `strain` in `steps` DEM steps.
template <int D> rve::DriveOf<D> swell(double strain, int steps)
{
  rve::DriveOf<D> drive;
  drive.dt = DT_OF_SMALL_PACKINGS<D>;
  drive.substeps = steps;
  drive.deformation = (1.0 + strain) * Matrix<D>::identity();
  return drive;
}

/// Returns equal grains in the densest lattice; every grain is in balance for any overlap.
template <int D> rve::RveStateOf<D> lattice()
{
  if constexpr (D == 3) {
    return face_centred_cubic(spheres_material(), 3, RADIUS, OVERLAP);
  } else {
    constexpr int n = 6;
    const double l = 2.0 * RADIUS - OVERLAP;
    std::vector<double> x;
    for (int row = 0; row < n; ++row)
      for (int k = 0; k < n; ++k) {
        x.push_back((k + 0.5 * (row % 2) + 0.25) * l);
        x.push_back((row + 0.25) * l * std::sqrt(0.75));
      }
    return state_of(paper_material(), Matrix<2>{{n * l, 0.0, 0.0, n * l * std::sqrt(0.75)}},
                    std::vector<double>(n * n, RADIUS), x);
  }
}

/// Returns the pressure of the lattice at the distance l of neighbours [stress]. The force k_n
/// overlap acts at each of the 6 or 12 contacts of a grain.
template <int D> double lattice_pressure(const rve::Material &material, double l)
{
  const double overlap = 2.0 * RADIUS - l;
  if (overlap <= 0.0) return 0.0;
  if constexpr (D == 2)
    return std::sqrt(3.0) * material.normal_stiffness * overlap / (l * material.thickness);
  else
    return face_centred_pressure(material, RADIUS, overlap);
}

/// Returns the work that is neither dissipated nor stored [force length].
template <int D> double missing(const Result<D> &r)
{
  return r.energy.work - r.energy.friction - r.energy.local_damping - r.energy.viscous -
      r.kinetic_energy - r.elastic_energy;
}

/// A pair of grains that would touch at the cell stretch `stretch` if all grains moved affinely.
struct Touch {
  double stretch, distance, sum_of_radii;    // [-]; the lengths are those at stretch 1 [length]
};

template <int D> std::vector<Touch> touches(const rve::RveStateOf<D> &state)
{
  std::vector<Touch> all;
  for (int i = 0; i < state.num_grains(); ++i)
    for (int j = i + 1; j < state.num_grains(); ++j) {
      rve::Vec<double, D> s;
      for (int a = 0; a < D; ++a)
        s[a] = std::ldexp(static_cast<double>(static_cast<std::int64_t>(
                              state.fractional[D * j + a] - state.fractional[D * i + a])),
                          -64);
      const rve::Vec<double, D> b = state.cell * s;
      const double distance = std::sqrt(dot(b, b)), radii = state.radius[i] + state.radius[j];
      all.push_back({radii / distance, distance, radii});
    }
  std::sort(all.begin(), all.end(),
            [](const Touch &a, const Touch &b) { return a.stretch > b.stretch; });
  return all;
}

/// Drops the list and the histories of contacts, which do not belong to the changed packing.
template <int D> void forget_list(rve::RveStateOf<D> &state)
{
  state.pairs.clear();
  state.list_fractional.clear();
  state.list_cell = Matrix<D>::zero();
}

template <class Dimension> class OpenAndClosed : public OnDeviceOf<testing::Test> {
};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(OpenAndClosed, Dimensions);

}    // namespace

// In opening and closing, the stress is a function of the distance of neighbours. It follows from
// the overlap, and is zero without overlap. The work is recovered.
TYPED_TEST(OpenAndClosed, LatticeHasTheStressOfItsOverlapInOpeningAndClosing)
{
  constexpr int D = TypeParam::value;
  const rve::RveStateOf<D> state = lattice<D>();
  Points<D> points = points_of<D>(state);
  const double p0 = lattice_pressure<D>(state.material, 2.0 * RADIUS - OVERLAP);
  ASSERT_NEAR(points.point(0).result.mean_stress(), p0, 1e-9 * p0);
  const double elastic = points.point(0).result.elastic_energy;

  int open = 0;
  for (int step = 0; step < 40; ++step) {
    const double length_before = points.point(0).result.cell(0, 0);
    const double strain = (step < 20 ? 1.0 : -1.0) * 1e-4;
    // the same lengths in reverse order
    points.advance({0}, {swell<D>(step < 20 ? strain : 1.0 / (1.0 - strain) - 1.0, 20)});

    const Result<D> &r = points.point(0).result;
    EXPECT_EQ(r.cell(0, 0) > length_before, step < 20);
    const double l = (2.0 * RADIUS - OVERLAP) * r.cell(0, 0) / state.cell(0, 0);
    const double p = lattice_pressure<D>(state.material, l);
    EXPECT_NEAR(r.mean_stress(), p, 1e-6 * p0) << step;
    EXPECT_LE(r.deviatoric_stress(), 1e-6 * p0) << step;
    if (p > 0.0) continue;
    ++open;
    EXPECT_EQ(rve::norm(r.stress), 0.0);
    EXPECT_EQ(r.status, rve::status::NoContacts);
    EXPECT_EQ(r.elastic_energy, 0.0);
    EXPECT_NEAR(r.energy.work, -elastic, 1e-3 * elastic);    // energy stored in the springs
  }

  EXPECT_GT(open, 20);
  EXPECT_NEAR(points.point(0).result.energy.work, 0.0, 1e-3 * elastic);
  EXPECT_LE(points.point(0).result.kinetic_energy, 1e-6 * elastic);
}

// No force acts on grains without contacts. Their velocities stay bitwise equal, and no work is
// done on them.
TYPED_TEST(OpenAndClosed, MotionAndEnergyWithoutContactsAreConstant)
{
  constexpr int D = TypeParam::value;
  rve::RveStateOf<D> state = small_packing<D>();
  for (double &r : state.radius) r *= 0.5;
  forget_list<D>(state);
  Random random(3);
  for (double &c : state.velocity) c = random.uniform(-1e-2, 1e-2);
  Points<D> points = points_of<D>(state);
  const double kinetic = points.point(0).result.kinetic_energy;

  for (int step = 0; step < 10; ++step) points.advance({0}, {swell<D>(1e-2, 10)});

  const Result<D> &r = points.point(0).result;
  EXPECT_EQ(r.status, rve::status::NoContacts);
  EXPECT_EQ(rve::norm(r.stress), 0.0);
  EXPECT_EQ(r.energy.work, 0.0);
  EXPECT_EQ(r.energy.local_damping, 0.0);
  EXPECT_EQ(r.kinetic_energy, kinetic);
  EXPECT_TRUE(points.state(0).velocity == state.velocity);
}

// Grains at rest move affinely with the cell until the first two touch. The stress must then follow
// from the overlaps of this affine motion.
TYPED_TEST(OpenAndClosed, StressReturnsContinuouslyWhenGrainsTouch)
{
  constexpr int D = TypeParam::value;
  rve::RveStateOf<D> state = small_packing<D>();
  state.cell = 1.02 * state.cell;
  forget_list<D>(state);
  const std::vector<Touch> pairs = touches<D>(state);
  ASSERT_LT(pairs[0].stretch, 1.0);
  ASSERT_GT(pairs[0].stretch, 0.98);
  // The first call ends just before the first contact. The next step ends just after the first
  // contact, so that this contact has not yet moved other grains.
  const double until = pairs[0].stretch * (1.0 + 1e-9);
  Points<D> points = points_of<D>(state);

  points.advance({0}, {swell<D>(until - 1.0, 200)});
  const Result<D> before = points.point(0).result;
  constexpr double STEP = 1e-6;
  points.advance({0}, {swell<D>(-STEP, 1)});
  const Result<D> after = points.point(0).result;

  EXPECT_EQ(rve::norm(before.stress), 0.0);
  EXPECT_EQ(before.status, rve::status::NoContacts);
  EXPECT_EQ(before.energy.work, 0.0);
  const double stretch = until * (1.0 - STEP);
  double virial = 0.0;    // p times the volume: force times branch
  int contacts = 0;
  for (const Touch &pair : pairs) {
    const double overlap = pair.sum_of_radii - stretch * pair.distance;
    if (overlap <= 0.0) break;
    ++contacts;
    virial += state.material.normal_stiffness * overlap * stretch * pair.distance;
  }
  const double depth = D == 2 ? state.material.thickness : 1.0;
  const double pressure = virial / (D * depth * std::pow(stretch, D) * state.cell_volume());
  EXPECT_EQ(after.num_contacts, contacts);
  EXPECT_GT(pressure, 0.0);
  // The overlap is a difference of two lengths and about 1e-6 times as large as they are. It has
  // fewer digits than coordinates (64 bits) and radii (53 bits).
  EXPECT_NEAR(after.mean_stress(), pressure, 1e-6 * pressure);
}

// The packing opens until it has no contacts, and is compressed again. The work must equal the
// energy of springs and motion plus the dissipation. No work is done while the packing is open.
TYPED_TEST(OpenAndClosed, PackingBalancesItsEnergy)
{
  constexpr int D = TypeParam::value;
  Points<D> points = points_of<D>(small_packing<D>());
  const Result<D> begin = points.point(0).result;

  int open = 0;
  double work = 0.0, most = 0.0;
  for (int step = 0; step < 400; ++step) {
    points.advance({0}, {swell<D>(step < 200 ? 2e-4 : 1.0 / (1.0 + 2e-4) - 1.0, 50)});
    const Result<D> &r = points.point(0).result;
    most = std::max(most, std::fabs(r.energy.work));
    EXPECT_NEAR(missing(r), missing(begin), 1e-2 * (begin.elastic_energy + most)) << step;
    if (r.status == rve::status::NoContacts) {
      ++open;
      EXPECT_EQ(rve::norm(r.stress), 0.0);
    }
    work = r.energy.work;
  }

  EXPECT_GT(open, 100);
  const Result<D> &end = points.point(0).result;
  EXPECT_NEAR(end.void_ratio, begin.void_ratio, 1e-9);
  // At the same density, the packing has other contacts than at the start. Its stress can therefore
  // differ.
  EXPECT_GT(end.mean_stress(), 0.2 * begin.mean_stress());
  EXPECT_LT(end.mean_stress(), 10.0 * begin.mean_stress());
  EXPECT_GT(work, -begin.elastic_energy);
}

// If the cell of a packing without contacts becomes narrow, the packing is doubled.
TYPED_TEST(OpenAndClosed, CopiesWithoutContactsHaveNoStress)
{
  constexpr int D = TypeParam::value;
  rve::RveStateOf<D> state = small_packing<D>();
  state.cell = 1.1 * state.cell;
  forget_list<D>(state);
  Points<D> points = points_of<D>(state);
  rve::DriveOf<D> drive = swell<D>(0.0, 20);
  drive.deformation(0, 0) = 0.99;
  for (int a = 1; a < D; ++a) drive.deformation(a, a) = 1.05;

  for (int step = 0; step < 200 && points.copies(0) == 1; ++step)
    ASSERT_TRUE(points.advance({0}, {drive}).empty());

  EXPECT_EQ(points.copies(0), 2);
  const Result<D> &r = points.point(0).result;
  EXPECT_EQ(r.status, rve::status::NoContacts);
  EXPECT_EQ(rve::norm(r.stress), 0.0);
  EXPECT_EQ(r.num_grains, 2 * state.num_grains());
}
