// SPDX-License-Identifier: GPL-2.0-only
#include "macro/tangent.h"

#include "rve/core/eigenvalues.h"
#include "rve/core/pi.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace macro {

namespace {

  /// Calls f(a, b, TangentOf::index(a, b)) for the components of a symmetric tensor.
  template <int D, class F> void for_places(const F &f)
  {
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b) f(a, b, TangentOf<D>::index(a, b));
  }

  /// Factor of a row or column that gives Mandel's components. C_ijkl C_ijkl is the sum of the
  /// squares of these components.
  template <int D> double weight(int index)
  {
    return index < D ? 1.0 : std::sqrt(2.0);
  }

  template <int D> rve::Vec<double, D> unit(const rve::Vec<double, D> &x)
  {
    return (1.0 / std::sqrt(rve::dot(x, x))) * x;
  }

  /// Returns n or -n, so that the first nonzero component is positive.
  template <int D> rve::Vec<double, D> with_positive_lead(const rve::Vec<double, D> &n)
  {
    for (int a = 0; a < D; ++a)
      if (n[a] != 0.0) return n[a] > 0.0 ? n : -1.0 * n;
    return n;
  }

  /// Directions n of a half circle or half sphere. The acoustic determinant is a polynomial of
  /// degree 2 D in n. Its minima are wider than the distance between neighbouring directions.
  template <int D> std::vector<rve::Vec<double, D>> directions();

  template <> std::vector<rve::Vec<double, 2>> directions<2>()
  {
    constexpr int COUNT = 72;
    std::vector<rve::Vec<double, 2>> all;
    for (int k = 0; k < COUNT; ++k)
      all.push_back({{std::cos(rve::kPi * k / COUNT), std::sin(rve::kPi * k / COUNT)}});
    return all;
  }

  /// Directions from the centre of a cube to points on three of its faces, 3 to 6 degrees apart.
  /// Axes and diagonals are among these directions.
  template <> std::vector<rve::Vec<double, 3>> directions<3>()
  {
    constexpr int COUNT = 10;    // along half an edge
    std::vector<rve::Vec<double, 3>> all;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = -COUNT; i <= COUNT; ++i)
        for (int j = -COUNT; j <= COUNT; ++j) {
          rve::Vec<double, 3> n;
          n[axis] = 1.0;
          n[(axis + 1) % 3] = static_cast<double>(i) / COUNT;
          n[(axis + 2) % 3] = static_cast<double>(j) / COUNT;
          all.push_back(unit(n));
        }
    return all;
  }

  /// Unit vectors normal to n.
  std::vector<rve::Vec<double, 2>> tangents(const rve::Vec<double, 2> &n)
  {
    return {{{-n[1], n[0]}}};
  }

  std::vector<rve::Vec<double, 3>> tangents(const rve::Vec<double, 3> &n)
  {
    rve::Vec<double, 3> axis = rve::Vec<double, 3>::zero();
    int least = 0;
    for (int a = 1; a < 3; ++a)
      if (std::fabs(n[a]) < std::fabs(n[least])) least = a;
    axis[least] = 1.0;
    const rve::Vec<double, 3> t = unit(rve::cross(n, axis));
    return {t, rve::cross(n, t)};
  }

}    // namespace

template <int D> rve::Tensor<double, D> TangentOf<D>::operator()(const Matrix &strain) const
{
  Matrix stress;
  for_places<D>([&](int a, int b, int row) {
    double sum = 0.0;
    for_places<D>([&](int c, int d, int column) {
      sum += component[row][column] * (c == d ? strain(c, d) : strain(c, d) + strain(d, c));
    });
    stress(a, b) = stress(b, a) = sum;
  });
  return stress;
}

template <int D> TangentOf<D> TangentOf<D>::isotropic(double lambda, double mu)
{
  TangentOf tangent;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) tangent.component[a][b] = lambda + (a == b ? 2.0 * mu : 0.0);
  for (int k = D; k < size; ++k) tangent.component[k][k] = mu;
  return tangent;
}

template <int D> double TangentOf<D>::norm() const
{
  double sum = 0.0;
  for (int r = 0; r < size; ++r)
    for (int c = 0; c < size; ++c) {
      const double x = weight<D>(r) * weight<D>(c) * component[r][c];
      sum += x * x;
    }
  return std::sqrt(sum);
}

template <int D> double TangentOf<D>::least_second_order_work() const
{
  rve::Tensor<double, size> symmetric;
  for (int r = 0; r < size; ++r)
    for (int c = 0; c < size; ++c)
      symmetric(r, c) = 0.5 * weight<D>(r) * weight<D>(c) * (component[r][c] + component[c][r]);
  return rve::PrincipalAxes<size>(symmetric).value[size - 1];
}

template <int D> IsotropicPart TangentOf<D>::isotropic_part() const
{
  // C_iijj = D^2 lambda + 2 D mu, C_ijij = D lambda + D (D + 1) mu
  double traces = 0.0, squares = 0.0;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      traces += (*this)(i, i, j, j);
      squares += (*this)(i, j, i, j);
    }
  const double mu = (squares - traces / D) / (D * (D + 1) - 2);
  const double lambda = (traces - 2.0 * D * mu) / (D * D);
  const TangentOf nearest = isotropic(lambda, mu);
  const double length = nearest.norm();
  return {lambda, mu, length > 0.0 ? (*this + (-1.0) * nearest).norm() / length : 0.0};
}

template <int D> double TangentOf<D>::wave_modulus() const
{
  double largest = 0.0;
  for (const rve::Vec<double, D> &n : directions<D>()) {
    auto acoustic = Matrix::zero();
    for (int i = 0; i < D; ++i)
      for (int k = 0; k < D; ++k)
        for (int j = 0; j < D; ++j)
          for (int l = 0; l < D; ++l)
            acoustic(i, k) += 0.5 * n[j] * ((*this)(i, j, k, l) + (*this)(k, l, i, j)) * n[l];
    largest = std::max(largest, rve::largest_eigenvalue(acoustic));
  }
  return largest;
}

template <int D>
NominalTangentOf<D>::NominalTangentOf(const TangentOf<D> &tangent,
                                      const rve::Tensor<double, D> &stress)
{
  // `turning` is W sigma - sigma W = (L - L^T)/2 sigma - sigma (L - L^T)/2 for L = e_k e_l
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      for (int k = 0; k < D; ++k)
        for (int l = 0; l < D; ++l) {
          const auto is = [](int a, int b) { return a == b ? 1.0 : 0.0; };
          const double turning = 0.5 *
              (is(i, k) * stress(l, j) - is(i, l) * stress(k, j) - stress(i, k) * is(j, l) +
               stress(i, l) * is(j, k));
          component[i][j][k][l] =
              tangent(i, j, k, l) + turning + stress(i, j) * is(k, l) - stress(i, l) * is(j, k);
        }
}

template <int D>
double NominalTangentOf<D>::acoustic_determinant(const rve::Vec<double, D> &n) const
{
  rve::Tensor<double, D> acoustic;
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < D; ++k) {
      double sum = 0.0;
      for (int j = 0; j < D; ++j)
        for (int l = 0; l < D; ++l) sum += n[j] * component[i][j][k][l] * n[l];
      acoustic(i, k) = sum;
    }
  return rve::determinant(acoustic);
}

/// Pattern search from `best`: takes steps along tangents, and halves the step if no step decreases
/// the determinant. The determinant is smooth, so its least value has only rounding errors even if
/// the direction has larger errors.
template <int D>
LeastAcousticOf<D> NominalTangentOf<D>::downhill_from(LeastAcousticOf<D> best, double step) const
{
  constexpr double SMALLEST = 1e-9;    // step [rad]; the value changes by its square
  while (step > SMALLEST) {
    bool is_better = false;
    for (const rve::Vec<double, D> &t : tangents(best.normal))
      for (const double sign : {1.0, -1.0}) {
        const rve::Vec<double, D> n = unit(best.normal + (sign * step) * t);
        const double determinant = acoustic_determinant(n);
        if (!(determinant < best.determinant)) continue;
        best = {determinant, n};
        is_better = true;
      }
    if (!is_better) step *= 0.5;
  }
  return best;
}

template <int D> LeastAcousticOf<D> NominalTangentOf<D>::least_acoustic_determinant() const
{
  constexpr int MOST_STARTS = 8;    // more than the minima of such a polynomial in a half sphere
  constexpr double APART = 0.3;     // least angle between starts [rad]
  std::vector<LeastAcousticOf<D>> all;
  for (const rve::Vec<double, D> &n : directions<D>()) all.push_back({acoustic_determinant(n), n});
  std::stable_sort(all.begin(), all.end(),
                   [](const auto &x, const auto &y) { return x.determinant < y.determinant; });

  std::vector<rve::Vec<double, D>> starts;
  LeastAcousticOf<D> best = all[0];
  for (const LeastAcousticOf<D> &start : all) {
    if (static_cast<int>(starts.size()) == MOST_STARTS) break;
    const bool is_near = std::any_of(starts.begin(), starts.end(), [&](const auto &other) {
      return std::fabs(rve::dot(other, start.normal)) > std::cos(APART);
    });
    if (is_near) continue;
    starts.push_back(start.normal);
    const LeastAcousticOf<D> found = downhill_from(start, 0.1);
    if (found.determinant < best.determinant) best = found;
  }
  best.normal = with_positive_lead(best.normal);
  return best;
}

template struct TangentOf<2>;
template struct TangentOf<3>;
template struct NominalTangentOf<2>;
template struct NominalTangentOf<3>;

}    // namespace macro
