// SPDX-License-Identifier: GPL-2.0-only
// Vectors of a fixed dimension.

#pragma once

#include "rve/core/arithmetic.h"
#include "rve/core/space.h"

#include <type_traits>

namespace rve {
inline namespace RVE_ISA {

  /// Cartesian vector with D components.
  template <class T, int D> struct Vec {
    T component[D];

    RVE_INLINE T &operator[](int a) { return component[a]; }
    RVE_INLINE const T &operator[](int a) const { return component[a]; }

    static RVE_INLINE Vec zero()
    {
      Vec v;
      for (int a = 0; a < D; ++a) v[a] = T(0);
      return v;
    }

    /// Converts to another number format.
    template <class U> RVE_INLINE Vec<U, D> as() const
    {
      Vec<U, D> v;
      for (int a = 0; a < D; ++a) v[a] = static_cast<U>(component[a]);
      return v;
    }
  };

  template <class T, int D> RVE_INLINE Vec<T, D> operator+(const Vec<T, D> &x, const Vec<T, D> &y)
  {
    Vec<T, D> v;
    for (int a = 0; a < D; ++a) v[a] = x[a] + y[a];
    return v;
  }

  template <class T, int D> RVE_INLINE Vec<T, D> operator-(const Vec<T, D> &x, const Vec<T, D> &y)
  {
    Vec<T, D> v;
    for (int a = 0; a < D; ++a) v[a] = x[a] - y[a];
    return v;
  }

  template <class T, int D> RVE_INLINE Vec<T, D> operator*(T factor, const Vec<T, D> &x)
  {
    Vec<T, D> v;
    for (int a = 0; a < D; ++a) v[a] = factor * x[a];
    return v;
  }

  /// Returns factor * x + y, each component rounded once.
  template <class T, int D>
  RVE_INLINE Vec<T, D> fma(T factor, const Vec<T, D> &x, const Vec<T, D> &y)
  {
    Vec<T, D> v;
    for (int a = 0; a < D; ++a) v[a] = fma(factor, x[a], y[a]);
    return v;
  }

  /// Spin of a body or torque on it, with one component for each plane of rotation. In two
  /// dimensions it is a single number.
  template <class T, int D> using Spin = std::conditional_t<D == 2, T, Vec<T, Space<D>::spins>>;

  template <class T> RVE_INLINE T &spin_component(T &spin, int)
  {
    return spin;
  }
  template <class T, int N> RVE_INLINE T &spin_component(Vec<T, N> &spin, int k)
  {
    return spin[k];
  }
  template <class T, int N> RVE_INLINE const T &spin_component(const Vec<T, N> &spin, int k)
  {
    return spin[k];
  }

  /// dot() and cross() fuse products and sums. This is allowed since no result of the engine relies
  /// on equal bits for another order of the terms. If both arguments change sign, the result keeps
  /// its bits. cross(x, y) and -cross(y, x) can differ in the last bit.
  template <class T, int D> RVE_INLINE T dot(const Vec<T, D> &x, const Vec<T, D> &y)
  {
    T sum = x[0] * y[0];
    for (int a = 1; a < D; ++a) sum = fma(x[a], y[a], sum);
    return sum;
  }

  /// Returns the out-of-plane component of the cross product of two plane vectors.
  template <class T> RVE_INLINE T cross(const Vec<T, 2> &x, const Vec<T, 2> &y)
  {
    return fma(x[0], y[1], -(x[1] * y[0]));
  }

  template <class T> RVE_INLINE Vec<T, 3> cross(const Vec<T, 3> &x, const Vec<T, 3> &y)
  {
    return {{fma(x[1], y[2], -(x[2] * y[1])), fma(x[2], y[0], -(x[0] * y[2])),
             fma(x[0], y[1], -(x[1] * y[0]))}};
  }

}    // namespace RVE_ISA
}    // namespace rve
