// SPDX-License-Identifier: GPL-2.0-only
// Roots, quotients, minima, maxima and conversions of integers are rounded as IEEE 754 requires.
// Every backend therefore gives the same bits.

#include "rve/core/arithmetic.h"
#include "rve/core/fixed_point.h"
#include "support/block_runner.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

template <class Real> struct Numbers {
  Real root, inverse, reciprocal;
};

/// Results of Divide for a pair of numbers: the quotient x/y and the root of x.
template <class Real> struct Quotient {
  Real quotient, root;
};
template <class Real> struct Divide {
  int count;
  const Real *x, *y;
  Quotient<Real> *answers;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.for_each(count, [&](typename Block::Item i) {
      answers[i] = {quotient(x[i], y[i]), root(x[i])};
    });
  }
};

template <class Real>
std::vector<Quotient<Real>> divide(const std::vector<Real> &x, const std::vector<Real> &y)
{
  const int count = static_cast<int>(x.size());
  BlockArray<Real> numerator(x), denominator(y);
  BlockArray<Quotient<Real>> answers{std::vector<Quotient<Real>>(count)};
  run_block(1024, Divide<Real>{count, numerator.data(), denominator.data(), answers.data()});
  return answers.values();
}

/// Computes the root of each x, the inverse of the root, and the reciprocal of x.
template <class Real> struct Evaluate {
  int count;
  const Real *x;
  Numbers<Real> *answers;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.for_each(count, [&](typename Block::Item i) {
      const auto both = root_and_inverse(x[i]);
      answers[i] = {both.root, both.inverse, reciprocal(x[i])};
    });
  }
};

struct ToDouble {
  int count;
  const std::int64_t *integers;
  double *answers;
  template <class Block> RVE_HD void operator()(Block &block, char *) const
  {
    block.for_each(count,
                   [&](typename Block::Item i) { answers[i] = to_real<double>(integers[i]); });
  }
};

template <class Real> std::vector<Numbers<Real>> evaluate(const std::vector<Real> &x)
{
  const int count = static_cast<int>(x.size());
  BlockArray<Real> array(x);
  BlockArray<Numbers<Real>> answers{std::vector<Numbers<Real>>(count)};
  run_block(1024, Evaluate<Real>{count, array.data(), answers.data()});
  return answers.values();
}

template <class Real> bool same_bits(const Numbers<Real> &x, const Numbers<Real> &y)
{
  return std::memcmp(&x, &y, sizeof(x)) == 0;
}

/// Returns the correctly rounded results. They are computed in fp64 and then rounded to fp32. fp64
/// has 53 binary digits, more than 2 * 24 + 2 with the 24 digits of fp32. Rounding twice therefore
/// gives the same number as rounding the exact result once.
Numbers<float> rounded(float x)
{
  const float root = static_cast<float>(std::sqrt(static_cast<double>(x)));
  return {root, static_cast<float>(1.0 / static_cast<double>(root)),
          static_cast<float>(1.0 / static_cast<double>(x))};
}

void expect_rounded(const std::vector<float> &x)
{
  const auto answers = evaluate(x);

  int wrong = 0;
  for (std::size_t k = 0; k < x.size(); ++k)
    if (!same_bits(answers[k], rounded(x[k])) && wrong++ == 0) {
      const Numbers<float> expected = rounded(x[k]);
      ADD_FAILURE() << std::hexfloat << "x " << x[k] << ": root " << answers[k].root << " for "
                    << expected.root << ", its inverse " << answers[k].inverse << " for "
                    << expected.inverse << ", reciprocal " << answers[k].reciprocal << " for "
                    << expected.reciprocal;
    }
  EXPECT_EQ(wrong, 0) << "of " << x.size() << " numbers from " << x.front();
}

using Arithmetic = BlockTest;

}    // namespace

TEST_F(Arithmetic, RootAndQuotientsInFp32AreRoundedForEveryMantissa)
{
  // The loop covers all 2^24 numbers in [1, 4). Any other positive normal number is one of them
  // times a power of four.
  constexpr int CHUNK = 1 << 20;
  const float one = 1.0f;
  std::uint32_t bits;
  std::memcpy(&bits, &one, sizeof(bits));
  std::vector<float> x(CHUNK);
  for (int chunk = 0; chunk < 16; ++chunk) {
    for (int k = 0; k < CHUNK; ++k) {
      const std::uint32_t word = bits + static_cast<std::uint32_t>(chunk * CHUNK + k);
      std::memcpy(&x[k], &word, sizeof(word));
    }

    expect_rounded(x);
  }
  EXPECT_EQ(x.back(), std::nextafter(4.0f, 0.0f));
}

TEST_F(Arithmetic, RootAndQuotientsInFp32AreRoundedFarFromOne)
{
  // The numbers cover squared distances from 1e-18 to 1e18.
  Random random(1);
  std::vector<float> x(100000);
  for (float &value : x)
    value = static_cast<float>(std::ldexp(random.uniform(1.0, 2.0), random.integer(-60, 60)));

  expect_rounded(x);
}

TEST_F(Arithmetic, RootAndQuotientsInFp64AreThoseOfTheHost)
{
  Random random(2);
  std::vector<double> x(1000000);
  for (double &value : x) value = std::ldexp(random.uniform(1.0, 2.0), random.integer(-60, 60));
  // Numbers next to powers of two: if all bits of a root are ones, an iteration for its reciprocal
  // easily rounds in the wrong direction.
  for (int n = -60; n <= 60; ++n) {
    double below = std::ldexp(1.0, n), above = below;
    for (int ulp = 0; ulp < 32; ++ulp) {
      x.push_back(below = std::nextafter(below, 0.0));
      x.push_back(above);
      above = std::nextafter(above, 2.0 * above);
    }
  }
  // Squares, whose roots have few digits, and their neighbours.
  for (int k = 1; k <= 4096; ++k) {
    const double square = static_cast<double>(k) * k;
    for (const double value : {std::nextafter(square, 0.0), square, std::nextafter(square, 1e9)})
      x.push_back(value);
  }

  const auto answers = evaluate(x);

  for (std::size_t k = 0; k < x.size(); ++k) {
    const double root = std::sqrt(x[k]);
    ASSERT_TRUE(same_bits(answers[k], Numbers<double>{root, 1.0 / root, 1.0 / x[k]}))
        << std::hexfloat << x[k];
  }
}

template <class Real> void expect_quotients_of_the_host(int most)
{
  Random random(3);
  std::vector<Real> x(1000000), y(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    x[k] = static_cast<Real>(std::ldexp(random.uniform(1.0, 2.0), random.integer(-most, most)));
    // In half of the pairs, x and y are close to each other, like a quantity in two consecutive
    // steps.
    const double factor = k % 2 ? random.uniform(0.999, 1.001)
                                : std::ldexp(random.uniform(1.0, 2.0), random.integer(-30, 30));
    y[k] = static_cast<Real>(factor) * x[k];
  }
  x[0] = Real(0);
  // divisors next to powers of two
  Real below = Real(1), above = Real(1);
  for (std::size_t k = 1; k < 1000; k += 2) {
    y[k] = below = std::nextafter(below, Real(0));
    y[k + 1] = above = std::nextafter(above, Real(2));
    if (k % 4 == 1) x[k] = x[k + 1] = Real(1);
  }

  const auto answers = divide(x, y);

  for (std::size_t k = 0; k < x.size(); ++k) {
    ASSERT_EQ(answers[k].quotient, x[k] / y[k]) << std::hexfloat << x[k] << " / " << y[k];
    ASSERT_EQ(answers[k].root, std::sqrt(x[k])) << std::hexfloat << x[k];
  }
}

TEST_F(Arithmetic, QuotientsInFp32AreThoseOfTheHost)
{
  expect_quotients_of_the_host<float>(60);
}

TEST_F(Arithmetic, QuotientsInFp64AreThoseOfTheHost)
{
  expect_quotients_of_the_host<double>(300);
}

TEST_F(Arithmetic, MinimumAndMaximumReturnOneOfTheOperands)
{
  for (const float x : {-2.0f, 0.0f, 1e-30f, 3.0f})
    for (const float y : {-2.0f, 0.0f, 1e-30f, 3.0f}) {
      EXPECT_EQ(smaller(x, y), std::fmin(x, y));
      EXPECT_EQ(larger(x, y), std::fmax(x, y));
    }
  EXPECT_EQ(smaller(-1.5, 2.0), -1.5);
  EXPECT_EQ(larger(-1.5, 2.0), 2.0);
}

TEST_F(Arithmetic, IntegersOf64BitsAreRoundedAsOnTheHost)
{
  Random random(4);
  std::vector<std::int64_t> integers = {0, std::numeric_limits<std::int64_t>::max(),
                                        std::numeric_limits<std::int64_t>::min()};
  // Integers of all lengths, and integers next to powers of two. Most integers of more than 53 bits
  // lie between two fp64 numbers, and many of them lie half-way.
  for (int n = 0; n < 63; ++n) {
    const std::uint64_t power = std::uint64_t(1) << n;
    for (int sample = 0; sample < 10000; ++sample) {
      const std::uint64_t digits = (random.bits() & (power - 1)) | power;
      const std::uint64_t half = n > 53 ? std::uint64_t(1) << (n - 53) : 0;
      integers.push_back(static_cast<std::int64_t>(digits));
      integers.push_back(
          static_cast<std::int64_t>(half > 0 ? (digits & ~(2 * half - 1)) | half : power));
    }
    for (std::int64_t beside = -2; beside <= 2; ++beside)
      integers.push_back(static_cast<std::int64_t>(power + static_cast<std::uint64_t>(beside)));
  }
  const std::size_t positive = integers.size();
  for (std::size_t k = 0; k < positive; ++k)
    integers.push_back(static_cast<std::int64_t>(-static_cast<std::uint64_t>(integers[k])));
  const int count = static_cast<int>(integers.size());
  BlockArray<std::int64_t> array(integers);
  BlockArray<double> answers{std::vector<double>(count)};

  run_block(1024, ToDouble{count, array.data(), answers.data()});

  const std::vector<double> rounded = answers.values();
  for (int k = 0; k < count; ++k)
    ASSERT_EQ(rounded[k], static_cast<double>(integers[k])) << integers[k];
}
