// SPDX-License-Identifier: GPL-2.0-only
#include "rve/core/error.h"
#include "rve/engine/packing_io.h"
#include "rve/engine/stability.h"
#include "test_states.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

using namespace rve;
using namespace rve_test;

namespace {

/// Returns a triangular lattice of equal disks. Each disk touches six others with this overlap
/// [length].
RveState hexagonal_lattice(int columns, int rows, double radius, double overlap)
{
  const double spacing = 2.0 * radius - overlap;
  Tensor2 cell = Tensor2::zero();
  cell(0, 0) = columns * spacing;
  cell(1, 1) = rows * spacing * std::sqrt(0.75);
  std::vector<double> xy;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      xy.push_back((column + 0.5 * (row % 2)) * spacing);
      xy.push_back((row + 0.25) * spacing * std::sqrt(0.75));
    }
  return state_of(paper_material(), cell, std::vector<double>(rows * columns, radius), xy);
}

/// Returns the elastic energy of sticking contacts to second order, summed over all pairs. `u` has
/// the displacements x, y and theta of each grain from `state`, shape (N, 3).
double elastic_energy(const RveState &state, const std::vector<double> &u)
{
  const std::vector<double> x = state.positions();
  double energy = 0.0;
  for (int i = 0; i < state.num_grains(); ++i)
    for (int j = 0; j < i; ++j)
      for (int shift_x = -1; shift_x <= 1; ++shift_x)
        for (int shift_y = -1; shift_y <= 1; ++shift_y) {
          const double bx =
              x[2 * j] - x[2 * i] + shift_x * state.cell(0, 0) + shift_y * state.cell(0, 1);
          const double by =
              x[2 * j + 1] - x[2 * i + 1] + shift_x * state.cell(1, 0) + shift_y * state.cell(1, 1);
          const double distance = std::sqrt(bx * bx + by * by);
          const double overlap = state.radius[i] + state.radius[j] - distance;
          if (overlap <= 0.0) continue;
          const double nx = bx / distance, ny = by / distance;
          // Relative displacement of the surfaces at the contact point: u_j - u_i plus the
          // displacements theta x arm of both surfaces.
          const double arm_i = state.radius[i] - 0.5 * overlap,
                       arm_j = state.radius[j] - 0.5 * overlap;
          const double dx =
              u[3 * j] + u[3 * j + 2] * arm_j * ny - (u[3 * i] - u[3 * i + 2] * arm_i * ny);
          const double dy =
              u[3 * j + 1] - u[3 * j + 2] * arm_j * nx - (u[3 * i + 1] + u[3 * i + 2] * arm_i * nx);
          const double normal = dx * nx + dy * ny;
          const double tangential = dy * nx - dx * ny;
          const double reduced_radius =
              state.radius[i] * state.radius[j] / (state.radius[i] + state.radius[j]);
          const double rolling = reduced_radius * (u[3 * j + 2] - u[3 * i + 2]);
          energy += 0.5 * state.material.normal_stiffness * normal * normal +
              0.5 * state.material.tangential_stiffness * tangential * tangential +
              0.5 * state.material.rolling_stiffness * rolling * rolling;
        }
  return energy;
}

/// Returns the largest eigenvalue of a symmetric matrix by Jacobi rotations.
double jacobi_largest(std::vector<double> a, int n)
{
  for (int sweep = 0; sweep < 30; ++sweep)
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q) {
        if (std::fabs(a[p * n + q]) < 1e-300) continue;
        const double angle = 0.5 * std::atan2(2.0 * a[p * n + q], a[q * n + q] - a[p * n + p]);
        const double c = std::cos(angle), s = std::sin(angle);
        for (int k = 0; k < n; ++k) {
          const double x = a[k * n + p], y = a[k * n + q];
          a[k * n + p] = c * x - s * y;
          a[k * n + q] = s * x + c * y;
        }
        for (int k = 0; k < n; ++k) {
          const double x = a[p * n + k], y = a[q * n + k];
          a[p * n + k] = c * x - s * y;
          a[q * n + k] = s * x + c * y;
        }
      }
  double largest = a[0];
  for (int k = 0; k < n; ++k) largest = std::max(largest, a[k * n + k]);
  return largest;
}

/// Integrates z'' = -w^2 z - b z', with the frequency w and the dashpot rate b. The dashpot uses
/// the velocity half a step earlier. Returns true if z grows.
bool oscillator_grows(double frequency, double dashpot_rate, double dt)
{
  double x = 1.0, v = 0.0;
  for (int step = 0; step < 20000; ++step) {
    v -= dt * (frequency * frequency * x + dashpot_rate * v);
    x += dt * v;
  }
  return std::fabs(x) > 1e3;
}

RveState reference_packing(const std::string &name)
{
  return read_packing(std::string(GPU_RVE_SOURCE_DIR) + "/examples/packings/" + name + ".rve");
}

}    // namespace

TEST(Stability, TwoDisksHaveTheClosedFormFrequencies)
{
  const double overlap = 1e-4;
  RveState state = two_disks(overlap);
  const double m1 = 2650.0 * M_PI * 25e-6, m2 = 2650.0 * M_PI * 16e-6;
  // Tangential mode: w^2 = k_t (1/m_1 + 1/m_2 + a_1^2/I_1 + a_2^2/I_2), with the lever arms a and
  // the inertia I = m r^2/2.
  const double arm1 = 1.0 - 0.5 * overlap / 0.005, arm2 = 1.0 - 0.5 * overlap / 0.004;
  const double tangential = 1e6 * ((1.0 + 2.0 * arm1 * arm1) / m1 + (1.0 + 2.0 * arm2 * arm2) / m2);
  const double normal = 1e6 * (1.0 / m1 + 1.0 / m2);

  EXPECT_NEAR(largest_frequency(state), std::sqrt(tangential), 1e-12 * std::sqrt(tangential));
  state.material.friction = 0.0;    // without friction the tangential spring does not act
  EXPECT_NEAR(largest_frequency(state), std::sqrt(normal), 1e-12 * std::sqrt(normal));
  EXPECT_NEAR(pair_frequency(state), std::sqrt(normal), 1e-12 * std::sqrt(normal));
  EXPECT_NEAR(stable_time_step(state), 2.0 / std::sqrt(1.3 * normal),
              1e-12 * 2.0 / std::sqrt(1.3 * normal));
}

TEST(Stability, HexagonalLatticeHasTheClosedFormFrequencies)
{
  const double radius = 0.004, overlap = 2e-5, mass = 2650.0 * M_PI * radius * radius;
  RveState state = hexagonal_lattice(8, 8, radius, overlap);
  const double arm = radius - 0.5 * overlap;

  // For k_n = k_t, all grains rotate by the same angle theta in the highest mode. Six contacts of
  // each grain slip by 2 a theta, with the lever arm a: w^2 = 24 (k_t/m) (a/r)^2.
  const double turning = std::sqrt(24.0 * 1e6 / mass) * arm / radius;
  EXPECT_NEAR(largest_frequency(state), turning, 1e-8 * turning);

  // Without tangential springs, the highest mode is longitudinal at the boundary of the Brillouin
  // zone: w^2 = 6 k_n/m.
  state.material.tangential_stiffness = 0.0;
  const double longitudinal = std::sqrt(6.0 * 1e6 / mass);
  EXPECT_NEAR(largest_frequency(state), longitudinal, 1e-8 * longitudinal);
}

TEST(Stability, LanczosFindsTheLargestEigenvalueOfTheAssembledStiffness)
{
  RveState state = crowded_state(25, 12);
  for (double &r : state.radius) r *= 1.5;
  state.material = paper_material();
  state.material.tangential_stiffness = 4e5;
  state.material.rolling_stiffness = 3e6;    // the highest mode is a rolling mode
  state.material.rolling_friction = 0.1;
  const int n = 3 * state.num_grains();
  std::vector<double> matrix(static_cast<std::size_t>(n) * n), u(n, 0.0), root_mass(n);
  for (int i = 0; i < state.num_grains(); ++i) {
    const double mass = 2650.0 * M_PI * state.radius[i] * state.radius[i];
    root_mass[3 * i] = root_mass[3 * i + 1] = std::sqrt(mass);
    root_mass[3 * i + 2] = std::sqrt(0.5 * mass) * state.radius[i];
  }
  // The energy is a quadratic form, so that its second differences give its matrix exactly.
  const auto energy_at = [&](int p, double x, int q, double y) {
    std::fill(u.begin(), u.end(), 0.0);
    u[p] += x;
    u[q] += y;
    return elastic_energy(state, u);
  };
  for (int p = 0; p < n; ++p)
    for (int q = 0; q < n; ++q)
      matrix[p * n + q] = 0.5 * (energy_at(p, 1.0, q, 1.0) - energy_at(p, 1.0, q, -1.0)) /
          (root_mass[p] * root_mass[q]);

  const double expected = std::sqrt(jacobi_largest(matrix, n));

  EXPECT_NEAR(largest_frequency(state), expected, 1e-8 * expected);
  const double damping = std::sqrt(1.0 + state.material.local_damping);
  EXPECT_LE(gershgorin_time_step(state), 2.0 / (expected * damping));
  // without rolling friction the rolling spring does not act
  state.material.rolling_friction = 0.0;
  EXPECT_LT(largest_frequency(state), 0.9 * expected);
}

TEST(Stability, HexagonalLatticeThatRollsHasTheClosedFormFrequency)
{
  const double radius = 0.004, overlap = 2e-5, mass = 2650.0 * M_PI * radius * radius;
  RveState state = hexagonal_lattice(6, 8, radius, overlap);
  state.material.friction = 0.0;
  state.material.rolling_stiffness = 2e7;
  state.material.rolling_friction = 0.1;

  // In the highest mode, the rotations on three sublattices differ in phase by a third of a period.
  // No two neighbours rotate alike, and each contact rolls by R |1 - exp(2 pi i/3)| theta. The six
  // contacts of a disk give 6 (3/2) k_r R^2 = 9 k_r R^2, with R = r/2 and I = m r^2/2.
  const double turning = std::sqrt(9.0 * 0.25 * 2e7 * 2.0 / mass);
  EXPECT_NEAR(largest_frequency(state), turning, 1e-8 * turning);
}

// Without contacts, the bound follows from a contact that can form: from the highest frequency of
// two touching grains, whose sliding and rolling are coupled.
TEST(Stability, RollingGrainsWithoutContactsAreBoundedByTheLightestOne)
{
  const double touch = 1e-12;
  for (const double rolling_stiffness : {1e5, 1e6, 2e7}) {
    RveState pair = two_disks(touch);
    pair.material.rolling_stiffness = rolling_stiffness;
    pair.material.rolling_friction = 0.2;
    EXPECT_NEAR(pair_frequency(pair), largest_frequency(pair), 1e-9 * pair_frequency(pair));

    // A small grain has a higher rolling frequency on a large grain than on a grain of its own
    // size.
    RveState gas = state_of(pair.material, 0.2 * Tensor2::identity(), {0.001, 0.001, 0.01},
                            {0.02, 0.02, 0.06, 0.02, 0.1, 0.1});
    double highest = 0.0;
    for (const double partner : {0.001, 0.01}) {
      const RveState both = state_of(pair.material, 0.2 * Tensor2::identity(), {0.001, partner},
                                     {0.02, 0.02, 0.021 + partner - touch, 0.02});
      highest = std::max(highest, largest_frequency(both));
    }
    EXPECT_NEAR(pair_frequency(gas), highest, 1e-9 * highest);
    EXPECT_EQ(gershgorin_time_step(gas), stable_time_step(gas));
  }
}

TEST(Stability, GasIsBoundedByOneContactOfItsLightestGrains)
{
  const RveState state = two_disks(-1e-3);
  const double m1 = 2650.0 * M_PI * 25e-6, m2 = 2650.0 * M_PI * 16e-6;
  const double frequency = std::sqrt(3.0 * 1e6 * (1.0 / m1 + 1.0 / m2));

  EXPECT_EQ(largest_frequency(state), 0.0);
  EXPECT_NEAR(stable_time_step(state), 2.0 / (frequency * std::sqrt(1.3)), 1e-12);
  EXPECT_EQ(gershgorin_time_step(state), stable_time_step(state));
}

TEST(Stability, DashpotShortensTheStepAsForADampedOscillator)
{
  RveState state = two_disks(-1e-3);
  state.material.friction = 0.0;
  state.material.local_damping = 0.0;
  state.material.normal_viscosity = 40.0;
  const double frequency = pair_frequency(state);
  const double dashpot_rate = 40.0 / 1e6 * frequency * frequency;

  const double bound = stable_time_step(state);

  const double ratio = 0.5 * dashpot_rate / frequency;
  EXPECT_NEAR(bound, 2.0 / frequency * (std::sqrt(1.0 + ratio * ratio) - ratio), 1e-12 * bound);
  EXPECT_FALSE(oscillator_grows(frequency, dashpot_rate, 0.999 * bound));
  EXPECT_TRUE(oscillator_grows(frequency, dashpot_rate, 1.001 * bound));
}

TEST(Stability, ReferencePackingHasTheMeasuredBound)
{
  const RveState state = reference_packing("A_h0075");

  // SudoDEM2D and YADE are stable with 1e-4 s and unstable with 1.5e-4 s. The limit of packings of
  // this recipe is 1.12e-4 s.
  EXPECT_NEAR(stable_time_step(state), 1.12e-4, 0.08e-4);
  EXPECT_NEAR(stable_time_step(reference_packing("A20_h0075")), 1.12e-4, 0.08e-4);
  EXPECT_GT(gershgorin_time_step(state), 0.7 * stable_time_step(state));
  EXPECT_LT(gershgorin_time_step(state), stable_time_step(state));
}

// Without the check, a bisection between infinite numbers would not end.
TEST(Stability, NonFiniteBoundIsAnError)
{
  for (const double factor : {1e300, 1e-300}) {
    RveState stiff = two_disks(1e-5), light = stiff;
    stiff.material.normal_stiffness *= factor;
    light.material.density /= factor;
    EXPECT_THROW(stable_time_step(stiff), InputError);
    EXPECT_THROW(gershgorin_time_step(stiff), InputError);
    EXPECT_THROW(stable_time_step(light), InputError);
  }
}
