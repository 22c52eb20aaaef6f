// SPDX-License-Identifier: GPL-2.0-only
// Algebra of tangents: the product of two tensors as a tangent, rotated tangents, and the
// second-order work of a strain.

#pragma once

#include "macro/tangent.h"

namespace rve_test {

template <int D> using StrainOf = rve::Tensor<double, D>;

/// Calls f(a, b, place) for the components (a, b) of a symmetric tensor. `place` is the row or
/// column of a tangent that belongs to (a, b).
template <int D, class F> void for_places(const F &f)
{
  for (int a = 0; a < D; ++a)
    for (int b = a; b < D; ++b) f(a, b, macro::TangentOf<D>::index(a, b));
}

/// Returns the tangent x_ij y_kl of two symmetric tensors.
template <int D> macro::TangentOf<D> dyad(const StrainOf<D> &x, const StrainOf<D> &y)
{
  macro::TangentOf<D> product;
  for_places<D>([&](int i, int j, int row) {
    for_places<D>(
        [&](int k, int l, int column) { product.component[row][column] = x(i, j) * y(k, l); });
  });
  return product;
}

/// Returns R_ia R_jb R_kc R_ld C_abcd, the tangent of a material rotated by R.
template <int D>
macro::TangentOf<D> turned(const macro::TangentOf<D> &tangent, const StrainOf<D> &rotation)
{
  // Column kl of the result is the stress under the strain (e_k e_l + e_l e_k)/2. To find it, the
  // strain is rotated into the axes of the material, and the stress is rotated back.
  macro::TangentOf<D> result;
  const StrainOf<D> back = rve::transpose(rotation);
  for_places<D>([&](int k, int l, int column) {
    auto strain = StrainOf<D>::zero();
    strain(k, l) += 0.5;
    strain(l, k) += 0.5;
    const StrainOf<D> stress = rotation * tangent(back * strain * rotation) * back;
    for_places<D>([&](int i, int j, int row) { result.component[row][column] = stress(i, j); });
  });
  return result;
}

/// Returns the second-order work eps : C : eps / (eps : eps) of the strain eps and the tangent C.
template <int D>
double second_order_work(const macro::TangentOf<D> &tangent, const StrainOf<D> &strain)
{
  const StrainOf<D> stress = tangent(strain);
  double work = 0.0, squares = 0.0;
  for (int k = 0; k < D * D; ++k) {
    work += stress.component[k] * strain.component[k];
    squares += strain.component[k] * strain.component[k];
  }
  return work / squares;
}

}    // namespace rve_test
