// SPDX-License-Identifier: GPL-2.0-only Arithmetic functions whose implementation affects speed and
// the last bits: roots, quotients, minima. Strict arithmetic is IEEE and gives the same bits on CPU
// and GPU. Relaxed arithmetic (RVE_RELAXED, CUDA only) uses the hardware's approximations.
// doc/src/accuracy.rst lists how much speed the approximations gain, and their errors.

#pragma once

#include "rve/core/config.h"

#include <cmath>

namespace rve {
inline namespace RVE_ISA {

  // Formulas call these functions without std::, and select() instead of ?:, so that they also work
  // for packs of numbers (core/pack.h).
  using std::copysign;
  using std::fabs;
  using std::fma;
  using std::sqrt;

  template <class T> RVE_INLINE T select(bool condition, T yes, T no)
  {
    return condition ? yes : no;
  }

  /// True if formulas are allowed to reorder sums of products so that fewer operations are needed.
  /// Only formulas of spheres test this constant.
#if defined(RVE_RELAXED)
  constexpr bool kIsRelaxed = true;
#else
  constexpr bool kIsRelaxed = false;
#endif

  /// Difference between 1 and the next larger T.
  template <class T> constexpr double kEpsilon = 0x1p-52;
  template <> constexpr double kEpsilon<float> = 0x1p-23;

  /// Type of the result of a comparison of two T: bool for numbers, and one truth value per lane
  /// for packs.
  template <class T> using Truth = decltype(T() < T());

  /// Returns x if the condition holds, and zero otherwise. x may be a struct of numbers.
  template <class T> RVE_INLINE T where(bool condition, const T &x)
  {
    return condition ? x : T();
  }

  /// Returns true if the condition holds for any number of a pack.
  RVE_INLINE bool any(bool condition)
  {
    return condition;
  }
  /// count() returns the number of lanes where `condition` holds. count_without() returns the
  /// number of lanes where `condition` holds and `other` does not. A single number is one lane.
  RVE_INLINE int count(bool condition)
  {
    return condition ? 1 : 0;
  }
  RVE_INLINE int count_without(bool condition, bool other)
  {
    return condition && !other ? 1 : 0;
  }

  /// Converts a truth value to the truth type of numbers with another number of bits. For single
  /// numbers both types are bool.
  RVE_INLINE void convert_truth(bool x, bool &y)
  {
    y = x;
  }

#if defined(__CUDA_ARCH__)
  /// Returns 1/y for y > 0, IEEE rounded. `nearly` is an approximation of 1/y. One Newton iteration
  /// rounds correctly for all y except one in each binade (P. W. Markstein, IBM J. Res. Dev. 34
  /// (1990) 111). The exception is the y whose mantissa bits are all ones: its reciprocal is
  /// slightly above the midpoint between two neighbouring numbers.
  RVE_INLINE double rounded_inverse(double y, double nearly)
  {
    const double inverse = ::fma(nearly, ::fma(-y, nearly, 1.0), nearly);
    const int high = __double2hiint(y), all = __double2loint(y) & (high | 0xfff00000);
    // The rounded inverse of 2^-n (2 - 2^-52) is 2^(n - 1) (1 + 2^-52).
    return all == -1 ? __hiloint2double(0x7fdfffff - high, 1) : inverse;
  }
#endif

  /// Square root of a number and its reciprocal.
  template <class Real> struct RootAndInverse {
    Real root, inverse;
  };

  /// Returns root = sqrt(x) and inverse = 1/root, in strict arithmetic each IEEE rounded. x must be
  /// a positive normal number, far from the smallest and the largest number of its type. Lengths
  /// satisfy this condition, since they are about one in internal units.
  RVE_INLINE RootAndInverse<float> root_and_inverse(float x)
  {
#if defined(__CUDA_ARCH__) && defined(RVE_RELAXED)
    float inverse;
    asm("rsqrt.approx.ftz.f32 %0, %1;" : "=f"(inverse) : "f"(x));
    return {x * inverse, inverse};
#elif defined(__CUDA_ARCH__)
    // The operations are those of __fsqrt_rn and __frcp_rn without their code paths for denormal
    // numbers.
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
    // The code paths for numbers outside the range of x are omitted, since they would be function
    // calls.
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

  /// Returns 1/x, in strict arithmetic IEEE rounded. x must be in the range that root_and_inverse()
  /// allows.
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

  /// Returns x/y for y > 0, in strict arithmetic IEEE rounded. The magnitudes of y and of the
  /// quotient must be in the range that root_and_inverse() allows; a quotient of zero is allowed,
  /// too. GPU code omits the code path for other numbers, since it would be a function call that
  /// takes all registers of a kernel.
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

  /// Returns sqrt(x), in strict arithmetic IEEE rounded. x must be zero or in the range that
  /// root_and_inverse() allows.
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

  /// smaller() and larger() return the smaller and the larger of two numbers. The numbers must not
  /// be NaN, and not zeros of different sign. On a GPU, fmin() and fmax() of `float` are single
  /// instructions. fmin() and fmax() of `double` would need additional instructions that test for
  /// NaN.
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

  /// Returns x - y where the condition holds, and x elsewhere.
  template <class Condition, class Real>
  RVE_INLINE Real difference_where(const Condition &condition, const Real &x, const Real &y)
  {
#if defined(__CUDA_ARCH__)
    return select(condition, x - y, x);    // one conditional instruction
#else
    return x - where(condition, y);
#endif
  }

  /// Returns x, limited to the range from -limit to limit.
  template <class Real> RVE_INLINE Real within(const Real &limit, const Real &x)
  {
#if defined(__CUDA_ARCH__)
    // Selecting between fabs(x) and the limit would cost an additional instruction for doubles.
    if constexpr (sizeof(Real) == 8) return select(fabs(x) < limit, x, copysign(limit, x));
#endif
    return copysign(smaller(fabs(x), limit), x);
  }

}    // namespace RVE_ISA
}    // namespace rve
