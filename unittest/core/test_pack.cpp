// SPDX-License-Identifier: GPL-2.0-only
// Packs of numbers: an operation on a pack gives the same bits as the operation on each of its
// numbers.

#include "core/pack_probe.h"
#include "rve/core/arithmetic.h"
#include "rve/core/fixed_point.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

using namespace rve;
using namespace rve_test;

namespace {

template <class T> bool same_bits(T x, T y)
{
  // Any NaN is equal to any other. The compiler may exchange the operands of a product, so that the
  // bits of a resulting NaN are not fixed.
  return std::memcmp(&x, &y, sizeof(T)) == 0 || (x != x && y != y);
}

template <class T> void round_one(T x, std::int32_t &q)
{
  round_to(x, q);
}
inline void round_one(double x, std::int64_t &q)
{
  round_to(x, q);
}

/// Returns numbers that are difficult for conversions and comparisons, followed by random numbers.
template <class T> std::vector<T> awkward_numbers(std::uint64_t seed)
{
  const double two_31 = 2147483648.0, two_51 = two_31 * 1048576.0, two_63 = two_31 * two_31 * 2.0;
  std::vector<T> numbers;
  for (double x : {0.0,
                   0.5,
                   1.0,
                   1.5,
                   2.5,
                   0.49999999999999994,
                   two_31 - 1.0,
                   two_31 - 0.5,
                   two_31,
                   two_51 - 0.5,
                   two_51 - 1.5,
                   two_51,
                   two_51 + 0.5,
                   2.0 * two_51 - 0.5,
                   2.0 * two_51,
                   2.0 * two_51 + 1.0,
                   4.0 * two_51 + 2.0,
                   0.5 * two_63,
                   two_63,
                   1e30,
                   std::numeric_limits<double>::infinity(),
                   std::numeric_limits<double>::quiet_NaN()}) {
    numbers.push_back(static_cast<T>(x));
    numbers.push_back(static_cast<T>(-x));
  }
  numbers.push_back(std::numeric_limits<T>::denorm_min());
  Random random(seed);
  while (numbers.size() < 40000) {
    numbers.push_back(
        static_cast<T>(std::ldexp(random.uniform(-1.0, 1.0), random.integer(-3, 62))));
  }
  return numbers;
}

template <class T> class Packs : public ::testing::Test {
 protected:
  void SetUp() override
  {
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
      GTEST_SKIP() << "this CPU has no x86-64-v3";
  }
};
using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Packs, Reals);

template <class T> struct IntegerOf;
template <> struct IntegerOf<float> {
  using type = std::int32_t;
};
template <> struct IntegerOf<double> {
  using type = std::int64_t;
};

}    // namespace

TYPED_TEST(Packs, RoundAsOneNumber)
{
  using Integer = typename IntegerOf<TypeParam>::type;
  const auto x = awkward_numbers<TypeParam>(1);
  for (std::size_t first = 0; first + 8 <= x.size(); first += 8) {
    Integer packed[8];

    pack_round(&x[first], packed);

    for (int lane = 0; lane < 8; ++lane) {
      Integer one;
      round_one(x[first + lane], one);
      ASSERT_EQ(packed[lane], one) << x[first + lane];
    }
  }
}

TYPED_TEST(Packs, ConvertIntegersAsOneNumber)
{
  using Integer = typename IntegerOf<TypeParam>::type;
  Random random(2);
  std::vector<Integer> x = {0, 1, -1, std::numeric_limits<Integer>::max(),
                            std::numeric_limits<Integer>::min()};
  while (x.size() < 40000)
    x.push_back(
        static_cast<Integer>(static_cast<std::int64_t>(random.bits()) >> random.integer(0, 63)));
  for (std::size_t first = 0; first + 8 <= x.size(); first += 8) {
    TypeParam packed[8];

    pack_convert(&x[first], packed);

    for (int lane = 0; lane < 8; ++lane)
      ASSERT_EQ(packed[lane], static_cast<TypeParam>(x[first + lane])) << x[first + lane];
  }
}

TYPED_TEST(Packs, ConvertRealsAsOneNumber)
{
  using Other = std::conditional_t<sizeof(TypeParam) == 4, double, float>;
  const auto x = awkward_numbers<TypeParam>(3);
  for (std::size_t first = 0; first + 8 <= x.size(); first += 8) {
    Other packed[8];

    pack_convert(&x[first], packed);

    for (int lane = 0; lane < 8; ++lane)
      ASSERT_TRUE(same_bits(packed[lane], static_cast<Other>(x[first + lane]))) << x[first + lane];
  }
}

TYPED_TEST(Packs, ComputeAsOneNumber)
{
  using T = TypeParam;
  std::vector<T> x = awkward_numbers<T>(4), y = awkward_numbers<T>(5), z = awkward_numbers<T>(6);
  // Every awkward number in x is combined with every awkward number in y, by shifting y.
  for (std::size_t shift = 0; shift < 45; ++shift)
    for (std::size_t k = 0; k < 45; ++k) {
      x[100 + 45 * shift + k] = x[k];
      y[100 + 45 * shift + k] = y[(k + shift) % 45];
    }
  for (std::size_t first = 0; first + 8 <= x.size(); first += 8) {
    T packed[PACK_OPERATIONS][8];

    pack_apply(&x[first], &y[first], &z[first], packed);

    for (int lane = 0; lane < 8; ++lane) {
      const T a = x[first + lane], b = y[first + lane], c = z[first + lane];
      const auto root = root_and_inverse(a);
      const T one[PACK_OPERATIONS] = {a + b,
                                      a - b,
                                      a * b,
                                      -a,
                                      std::fma(a, b, c),
                                      std::fabs(a),
                                      std::copysign(a, b),
                                      smaller(a, b),
                                      larger(a, b),
                                      root.root,
                                      root.inverse,
                                      reciprocal(a),
                                      a < b ? a : c,
                                      a > b ? a : c,
                                      a >= b ? a : c,
                                      a <= b ? a : c,
                                      a != b ? a : c,
                                      a < b ? c : T(0)};
      for (int k = 0; k < PACK_OPERATIONS; ++k)
        ASSERT_TRUE(same_bits(packed[k][lane], one[k]))
            << "operation " << k << " of " << a << ", " << b << ", " << c;
    }
  }
}

/// Expects that masking sets all numbers of record k to zero if x[k] is negative, and changes no
/// other record.
template <class T, class Number, int K> void expect_masked_records()
{
  const T x[8] = {1, -1, -2, 0, 3, -4, 5, 6};
  PackRecord<Number, K> records[9];
  const auto number = [](int lane, int k) { return Number(10 * k - 0.25 * lane + 1); };
  for (int lane = 0; lane < 9; ++lane)
    for (int k = 0; k < K; ++k) records[lane].number[k] = number(lane, k);

  pack_mask_records(x, records);

  for (int lane = 0; lane < 9; ++lane) {
    const bool kept = lane == 8 || x[lane] >= T(0);    // lane 8 belongs to the next pack
    for (int k = 0; k < K; ++k)
      EXPECT_EQ(records[lane].number[k], kept ? number(lane, k) : Number(0)) << lane << ' ' << k;
  }
}

template <class T, class Number> void expect_masked_records_of_every_size()
{
  expect_masked_records<T, Number, 2>();
  expect_masked_records<T, Number, 3>();
  expect_masked_records<T, Number, 4>();
  expect_masked_records<T, Number, 5>();
}

TYPED_TEST(Packs, RecordsOfNumbersAreMaskedLaneByLane)
{
  expect_masked_records_of_every_size<TypeParam, double>();
  expect_masked_records_of_every_size<float, float>();
}
