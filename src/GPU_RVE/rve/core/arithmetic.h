// SPDX-License-Identifier: GPL-2.0-only
// The few operations whose form decides about speed and about bits: roots, quotients, minima. Strict: IEEE, the same bits on CPU
// and GPU. Relaxed (RVE_RELAXED, CUDA only): the hardware's approximations; doc/src/accuracy.rst has their gain and their error.

#pragma once

#include "rve/core/config.h"

#include <cmath>

namespace rve {
inline namespace RVE_ISA {

  // Formulas call these without std::, and select instead of ?:, so that they serve packs of numbers too (core/pack.h).
  using std::copysign;
  using std::fabs;
  using std::fma;
  using std::sqrt;

  template <class T> RVE_INLINE T select(bool condition, T yes, T no)
  {
    return condition ? yes : no;
  }

  /// Whether sums of products may be fused in another order, where that makes less of them. Of spheres: disks take no other form.
#if defined(RVE_RELAXED)
  constexpr bool kIsRelaxed = true;
#else
  constexpr bool kIsRelaxed = false;
#endif

  /// From 1 to the next number.
  template <class T> constexpr double kEpsilon = 0x1p-52;
  template <> constexpr double kEpsilon<float> = 0x1p-23;

  /// What a comparison of two T gives: bool, or a truth for each number of a pack.
  template <class T> using Truth = decltype(T() < T());

  /// x where the condition holds, zero elsewhere. x may be a record of numbers.
  template <class T> RVE_INLINE T where(bool condition, const T &x)
  {
    return condition ? x : T();
  }

  /// Whether the condition holds for any number.
  RVE_INLINE bool any(bool condition)
  {
    return condition;
  }
  /// For how many it holds; and the other one does not.
  RVE_INLINE int count(bool condition)
  {
    return condition ? 1 : 0;
  }
  RVE_INLINE int count_without(bool condition, bool other)
  {
    return condition && !other ? 1 : 0;
  }

  /// The same truth for numbers of another width.
  RVE_INLINE void convert_truth(bool x, bool &y)
  {
    y = x;
  }

#if defined(__CUDA_ARCH__)
  /// 1/y of y > 0, IEEE rounded, from what is nearly it. An iteration rounds all of them but one in each binade (P. W. Markstein, IBM J. Res.
  /// Dev. 34 (1990) 111): where all digits of y are ones, 1/y is a little more than the middle of two numbers.
  RVE_INLINE double rounded_inverse(double y, double nearly)
  {
    const double inverse = ::fma(nearly, ::fma(-y, nearly, 1.0), nearly);
    const int high = __double2hiint(y), all = __double2loint(y) & (high | 0xfff00000);
    // 2^-n (2 - 2^-52) has 2^(n - 1) (1 + 2^-52)
    return all == -1 ? __hiloint2double(0x7fdfffff - high, 1) : inverse;
  }
#endif

  /// A length and its reciprocal from the squared length.
  template <class Real> struct RootAndInverse {
    Real root, inverse;
  };

  /// sqrt(x) and 1/sqrt(x), each IEEE rounded. x must be a normal number, far from the ends of the range, not zero: in
  /// internal units lengths are about one.
  RVE_INLINE RootAndInverse<float> root_and_inverse(float x)
  {
#if defined(__CUDA_ARCH__) && defined(RVE_RELAXED)
    float inverse;
    asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(inverse) : "f"(x));
    return {x * inverse, inverse};
#elif defined(__CUDA_ARCH__)
    // __fsqrt_rn and __frcp_rn without their paths for denormal numbers
    float guess;
    asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(guess) : "f"(x));
    const float first = x * guess;
    const float root = fmaf(fmaf(-first, first, x), 0.5f * guess, first);
    asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(guess) : "f"(root));
    return {root, fmaf(guess, -fmaf(root, guess, -1.0f), guess)};
#else
    const float root = std::sqrt(x);
    return {root, 1.0f / root};
#endif
  }

  RVE_INLINE RootAndInverse<double> root_and_inverse(double x)
  {
#if defined(__CUDA_ARCH__)
    // as above: the paths for other numbers would be calls
    double inverse;
    asm("rsqrt.approx.ftz.f64 %0, %1;" : "=d"(inverse) : "d"(x));
    const double error = ::fma(x, -(inverse * inverse), 1.0);
    inverse = ::fma(::fma(error, 0.375, 0.5), error * inverse, inverse);
    const double first = x * inverse;
    const double root = ::fma(::fma(-first, first, x), 0.5 * inverse, first);
    return {root, rounded_inverse(root, inverse)};
#else
    const double root = std::sqrt(x);
    return {root, 1.0 / root};
#endif
  }

  /// 1/x, IEEE rounded; x as above.
  RVE_INLINE float reciprocal(float x)
  {
#if defined(__CUDA_ARCH__)
    float guess;
    asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(guess) : "f"(x));
#if defined(RVE_RELAXED)
    return guess;
#else
    return fmaf(guess, -fmaf(x, guess, -1.0f), guess);
#endif
#else
    return 1.0f / x;
#endif
  }

  RVE_INLINE double reciprocal(double x)
  {
    return 1.0 / x;
  }

  /// x/y of y > 0, IEEE rounded; y as above, and the quotient, too, or zero. On a GPU without the path for other numbers, which would be a call: all
  /// registers of a kernel stand back for it.
  RVE_INLINE float quotient(float x, float y)
  {
#if defined(__CUDA_ARCH__)
    const float inverse = reciprocal(y);
    float result = x * inverse;
#if !defined(RVE_RELAXED)
    result = fmaf(inverse, fmaf(-y, result, x), result);
#endif
    return fmaf(inverse, fmaf(-y, result, x), result);
#else
    return x / y;
#endif
  }

  RVE_INLINE double quotient(double x, double y)
  {
#if defined(__CUDA_ARCH__)
    double inverse;
    asm("rcp.approx.ftz.f64 %0, %1;" : "=d"(inverse) : "d"(y));
    const double error = ::fma(-y, inverse, 1.0);
    inverse = ::fma(inverse, ::fma(error, error, error), inverse);
    inverse = rounded_inverse(y, inverse);
    const double result = x * inverse;
    return ::fma(inverse, ::fma(-y, result, x), result);
#else
    return x / y;
#endif
  }

  /// sqrt(x), IEEE rounded; x as above, or zero.
  RVE_INLINE float root(float x)
  {
#if defined(__CUDA_ARCH__) && defined(RVE_RELAXED)
    float result;
    asm("sqrt.approx.ftz.f32 %0, %1;" : "=f"(result) : "f"(x));
    return result;
#elif defined(__CUDA_ARCH__)
    float guess;
    asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(guess) : "f"(fmaxf(x, 0x1p-126f)));
    const float first = x * guess;
    return fmaf(fmaf(-first, first, x), 0.5f * guess, first);
#else
    return std::sqrt(x);
#endif
  }

  RVE_INLINE double root(double x)
  {
    return std::sqrt(x);
  }

  /// The smaller and the larger of two numbers that are not NaN and not zeros of different sign. A GPU has an instruction for `float`; of
  /// doubles fmin and fmax would look for NaN as well, and with y a NaN they would hide it.
  template <class Real> RVE_INLINE Real smaller(Real x, Real y)
  {
#if defined(__CUDA_ARCH__)
    if constexpr (sizeof(Real) == 4) return fmin(x, y);
#endif
    return x < y ? x : y;
  }

  template <class Real> RVE_INLINE Real larger(Real x, Real y)
  {
#if defined(__CUDA_ARCH__)
    if constexpr (sizeof(Real) == 4) return fmax(x, y);
#endif
    return x > y ? x : y;
  }

  /// x - y where the condition holds, x elsewhere.
  template <class Condition, class Real>
  RVE_INLINE Real difference_where(const Condition &condition, const Real &x, const Real &y)
  {
#if defined(__CUDA_ARCH__)
    return select(condition, x - y, x);    // one instruction, under the condition
#else
    return x - where(condition, y);
#endif
  }

  /// x, or what has its sign and the magnitude `limit` where that is smaller than |x|.
  template <class Real> RVE_INLINE Real within(const Real &limit, const Real &x)
  {
#if defined(__CUDA_ARCH__)
    // of doubles: the magnitude itself would cost a sum
    if constexpr (sizeof(Real) == 8) return select(fabs(x) < limit, x, copysign(limit, x));
#endif
    return copysign(smaller(fabs(x), limit), x);
  }

}    // namespace RVE_ISA
}    // namespace rve
