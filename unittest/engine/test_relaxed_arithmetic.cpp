// SPDX-License-Identifier: GPL-2.0-only
// Tests relaxed arithmetic on a GPU. Relaxed arithmetic uses the approximate roots and quotients of
// the hardware and fuses products with sums. For spheres it also omits terms of second order in the
// rotation of a contact per step. Only the last digits of results are allowed to change.

#include "support/on_device.h"
#include "support/small_packings.h"

#include "rve/engine/finite_strain.h"
#include "rve/engine/stability.h"

#include <gtest/gtest.h>

using namespace rve;
using namespace rve_test;

namespace {

/// Returns the stress after a shear of 1e-3 in 20 calls of 10 steps.
template <int D>
Tensor<double, D> sheared(const RveStateOf<D> &state, Format format, Arithmetic arithmetic)
{
  Options options = device_options(format);
  options.contacts = contacts_of(state.material);
  options.contacts.dimension = D;
  options.arithmetic = arithmetic;
  const auto engine = make_engine<D>(options);
  const int rve = engine->add(state);
  const double dt = 0.3 * stable_time_step(state);
  auto gradient = Tensor<double, D>::zero();
  gradient(0, 1) = 5e-6 / dt;
  std::vector<ResultOf<D>> results;
  for (int call = 0; call < 20; ++call)
    engine->advance({rve}, {DriveOf<D>::constant_velocity_gradient(gradient, dt, 10)}, results);
  EXPECT_EQ(results[0].status & status::Fatal, 0u);
  return results[0].stress;
}

/// Returns the stress after the same shear, from a batch of many copies whose calls return
/// responses (status, number of contacts and stress). For such a call, the kernels keep two spheres
/// per thread and compute only what a response contains.
Tensor<double, 3> sheared_among_many(const Spheres &state, Format format, Arithmetic arithmetic)
{
  constexpr int MANY = 1000;    // more than any GPU has multiprocessors
  Options options = device_options(format);
  options.contacts = contacts_of(state.material);
  options.contacts.dimension = 3;
  options.arithmetic = arithmetic;
  const auto engine = make_engine<3>(options);
  std::vector<int> rves;
  for (int k = 0; k < MANY; ++k) rves.push_back(engine->add(state));
  const double dt = 0.3 * stable_time_step(state);
  auto gradient = Tensor<double, 3>::zero();
  gradient(0, 1) = 5e-6 / dt;
  const std::vector<DriveOf<3>> drives(MANY,
                                       DriveOf<3>::constant_velocity_gradient(gradient, dt, 10));
  std::vector<ResponseOf<3>> responses;
  for (int call = 0; call < 20; ++call) engine->advance(rves, drives, responses);
  for (const ResponseOf<3> &response : responses) {
    EXPECT_EQ(response.status & status::Fatal, 0u);
    EXPECT_EQ(norm(response.stress - responses[0].stress), 0.0);
  }
  return responses[0].stress;
}

/// Expects a small error relative to `double`. On an H200, strict arithmetic has errors of up to
/// 1e-4 in `fast` and 2e-5 in `mixed`. Relaxed arithmetic has errors of up to 1.4e-4 in `fast` and
/// 1e-5 in `mixed`.
template <int D> void expect_little_change(const RveStateOf<D> &state)
{
  const Tensor<double, D> exact = sheared(state, Format::Double, Arithmetic::Strict);
  for (const Format format : {Format::Fast, Format::Mixed}) {
    const Tensor<double, D> strict = sheared(state, format, Arithmetic::Strict),
                            relaxed = sheared(state, format, Arithmetic::Relaxed);
    const double error = norm(relaxed - exact) / norm(exact);
    EXPECT_GT(norm(relaxed - strict), 0.0) << to_string(format);
    EXPECT_LT(error, format == Format::Fast ? 5e-4 : 1e-4)
        << to_string(format) << ", strict " << norm(strict - exact) / norm(exact);
  }
}

class RelaxedArithmetic : public OnDeviceOf<testing::Test> {};

}    // namespace

TEST_F(RelaxedArithmetic, ChangesTheStressOfDisksInTheLastDigits)
{
  expect_little_change(small_packing<2>());
}

TEST_F(RelaxedArithmetic, ChangesTheStressOfSpheresInTheLastDigits)
{
  expect_little_change(small_packing<3>());
}

TEST_F(RelaxedArithmetic, ChangesTheStressOfHertzianSpheresInTheLastDigits)
{
  Spheres state = small_packing<3>();
  const double kn = state.material.normal_stiffness, kt = state.material.tangential_stiffness;
  state.material.law = ContactLaw::Hertz;
  state.material.normal_stiffness = state.material.tangential_stiffness = 0.0;
  // At a contact radius of a tenth of a grain radius, the contacts are as stiff as the linear
  // springs.
  state.material.hertz_stiffness = kn / 4.5e-4;
  state.material.mindlin_stiffness = kt / 4.5e-4;
  expect_little_change(state);
}

TEST_F(RelaxedArithmetic, ChangesTheStressOfManySpheresAsLittle)
{
  const Spheres state = small_packing<3>();
  const Tensor<double, 3> exact = sheared(state, Format::Double, Arithmetic::Strict);
  for (const Format format : {Format::Fast, Format::Mixed}) {
    const Tensor<double, 3> relaxed = sheared_among_many(state, format, Arithmetic::Relaxed);
    EXPECT_LT(norm(relaxed - exact) / norm(exact), format == Format::Fast ? 5e-4 : 1e-4)
        << to_string(format);
  }
}

TEST_F(RelaxedArithmetic, OfDoubleIsNone)
{
  Options options = device_options(Format::Double);
  options.arithmetic = Arithmetic::Relaxed;
  EXPECT_THROW(make_engine(options), InputError);
}
