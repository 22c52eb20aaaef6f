// SPDX-License-Identifier: GPL-2.0-only
// Second-order tensors of a fixed dimension: velocity gradient, cell matrix, deformation gradient,
// stress.

#pragma once

#include "rve/core/space.h"
#include "rve/core/vec.h"

#include <cstddef>
#include <utility>

namespace rve {
inline namespace RVE_ISA {

  /// Tensor with components t(row, column). The cell matrix has the cell vectors as columns.
  template <class T, int D> struct Tensor {
    T component[Space<D>::components];

    RVE_INLINE T &operator()(int a, int b) { return component[a * D + b]; }
    RVE_INLINE const T &operator()(int a, int b) const { return component[a * D + b]; }

    static RVE_INLINE Tensor zero()
    {
      Tensor t;
      for (int k = 0; k < Space<D>::components; ++k) t.component[k] = T(0);
      return t;
    }

    static RVE_INLINE Tensor identity()
    {
      Tensor t = zero();
      for (int a = 0; a < D; ++a) t(a, a) = T(1);
      return t;
    }

    template <class U> RVE_INLINE Tensor<U, D> as() const
    {
      Tensor<U, D> t;
      for (int k = 0; k < Space<D>::components; ++k) t.component[k] = static_cast<U>(component[k]);
      return t;
    }
  };

  using Tensor2 = Tensor<double, 2>;
  using Tensor3 = Tensor<double, 3>;

  /// Loads a tensor from an array of components, row by row.
  template <int D = 2> RVE_INLINE Tensor<double, D> load_tensor(const double *component)
  {
    Tensor<double, D> t;
    for (int k = 0; k < Space<D>::components; ++k) t.component[k] = component[k];
    return t;
  }

  template <int D> RVE_INLINE void store_tensor(const Tensor<double, D> &t, double *component)
  {
    for (int k = 0; k < Space<D>::components; ++k) component[k] = t.component[k];
  }

  template <class T, int D>
  RVE_INLINE Tensor<T, D> operator+(const Tensor<T, D> &x, const Tensor<T, D> &y)
  {
    Tensor<T, D> t;
    for (int k = 0; k < Space<D>::components; ++k) t.component[k] = x.component[k] + y.component[k];
    return t;
  }

  template <class T, int D>
  RVE_INLINE Tensor<T, D> operator-(const Tensor<T, D> &x, const Tensor<T, D> &y)
  {
    Tensor<T, D> t;
    for (int k = 0; k < Space<D>::components; ++k) t.component[k] = x.component[k] - y.component[k];
    return t;
  }

  template <class T, int D> RVE_INLINE Tensor<T, D> operator*(T factor, const Tensor<T, D> &x)
  {
    Tensor<T, D> t;
    for (int k = 0; k < Space<D>::components; ++k) t.component[k] = factor * x.component[k];
    return t;
  }

  template <class T, int D>
  RVE_INLINE Tensor<T, D> operator*(const Tensor<T, D> &x, const Tensor<T, D> &y)
  {
    Tensor<T, D> t;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) {
        T sum = x(a, 0) * y(0, b);
        for (int k = 1; k < D; ++k) sum = fma(x(a, k), y(k, b), sum);
        t(a, b) = sum;
      }
    return t;
  }

  template <class T, int D>
  RVE_INLINE Vec<T, D> operator*(const Tensor<T, D> &x, const Vec<T, D> &y)
  {
    Vec<T, D> v;
    for (int a = 0; a < D; ++a) {
      T sum = x(a, 0) * y[0];
      for (int k = 1; k < D; ++k) sum = fma(x(a, k), y[k], sum);
      v[a] = sum;
    }
    return v;
  }

  /// Returns x y + z.
  template <class T, int D>
  RVE_INLINE Vec<T, D> fma(const Tensor<T, D> &x, const Vec<T, D> &y, Vec<T, D> z)
  {
    for (int a = 0; a < D; ++a)
      for (int k = 0; k < D; ++k) z[a] = fma(x(a, k), y[k], z[a]);
    return z;
  }

  template <class T, int D> RVE_INLINE Tensor<T, D> transpose(const Tensor<T, D> &x)
  {
    Tensor<T, D> t;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) t(a, b) = x(b, a);
    return t;
  }

  /// Extends a deformation gradient to more dimensions, with unit stretch along the added axes.
  template <int Space, class T, int D>
  RVE_INLINE Tensor<T, Space> in_plane_strain(const Tensor<T, D> &f)
  {
    Tensor<T, Space> t = Tensor<T, Space>::identity();
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) t(a, b) = f(a, b);
    return t;
  }

  /// Returns the components along the first D axes.
  template <int D, class T, int Space>
  RVE_INLINE Tensor<T, D> leading_components(const Tensor<T, Space> &x)
  {
    Tensor<T, D> t;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) t(a, b) = x(a, b);
    return t;
  }

  template <class T, int D> RVE_INLINE T trace(const Tensor<T, D> &x)
  {
    T sum = x(0, 0);
    for (int a = 1; a < D; ++a) sum = sum + x(a, a);
    return sum;
  }

  template <class T> RVE_INLINE T determinant(const Tensor<T, 2> &x)
  {
    return x(0, 0) * x(1, 1) - x(0, 1) * x(1, 0);
  }

  template <class T> RVE_INLINE Tensor<T, 2> inverse(const Tensor<T, 2> &x)
  {
    const T factor = T(1) / determinant(x);
    Tensor<T, 2> t;
    t(0, 0) = factor * x(1, 1);
    t(0, 1) = -factor * x(0, 1);
    t(1, 0) = -factor * x(1, 0);
    t(1, 1) = factor * x(0, 0);
    return t;
  }

  /// Returns column b: the columns of a cell matrix are the cell vectors.
  template <class T, int D> RVE_INLINE Vec<T, D> column(const Tensor<T, D> &x, int b)
  {
    Vec<T, D> v;
    for (int a = 0; a < D; ++a) v[a] = x(a, b);
    return v;
  }

  template <class T> RVE_INLINE T determinant(const Tensor<T, 3> &x)
  {
    return dot(column(x, 0), cross(column(x, 1), column(x, 2)));
  }

  template <class T> RVE_INLINE Tensor<T, 3> inverse(const Tensor<T, 3> &x)
  {
    const T factor = T(1) / determinant(x);
    Tensor<T, 3> t;
    for (int a = 0; a < 3; ++a) {
      const Vec<T, 3> row = cross(column(x, (a + 1) % 3), column(x, (a + 2) % 3));
      for (int b = 0; b < 3; ++b) t(a, b) = factor * row[b];
    }
    return t;
  }

  template <class T, int D, std::size_t... K>
  RVE_INLINE bool all_finite(const Tensor<T, D> &x, std::index_sequence<K...>)
  {
    return (std::isfinite(x.component[K]) && ...);
  }

  /// Returns true if all components are finite.
  template <class T, int D> RVE_INLINE bool finite(const Tensor<T, D> &x)
  {
    return all_finite(x, std::make_index_sequence<Space<D>::components>());
  }

  /// Returns the dyad x_a y_b.
  template <class T, int D> RVE_INLINE Tensor<T, D> dyad(const Vec<T, D> &x, const Vec<T, D> &y)
  {
    Tensor<T, D> t;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) t(a, b) = x[a] * y[b];
    return t;
  }

}    // namespace RVE_ISA
}    // namespace rve
