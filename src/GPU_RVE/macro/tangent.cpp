// SPDX-License-Identifier: GPL-2.0-only
#include "macro/tangent.h"

#include "macro/largest_eigenvalue.h"

#include "rve/core/pi.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace macro {

namespace {

  /// f(a, b, place) for the components of a symmetric tensor.
  template <int D, class F> void for_places(const F &f)
  {
    for (int a = 0; a < D; ++a)
      for (int b = a; b < D; ++b) f(a, b, TangentOf<D>::place(a, b));
  }

  /// What a component of the matrix stands for, in C_ijkl C_ijkl: sqrt(2) a row and a column off the diagonal (Mandel).
  template <int D> double weight(int place)
  {
    return place < D ? 1.0 : std::sqrt(2.0);
  }

  template <int N> using Square = std::array<std::array<double, N>, N>;

  /// Jacobi's rotations (Golub and Van Loan, Matrix Computations, 8.5): for a matrix this small nothing is simpler, or more accurate.
  template <int N> double least_eigenvalue(Square<N> a)
  {
    constexpr int MOST_SWEEPS = 50;    // about six are needed, since they converge quadratically
    for (int sweep = 0; sweep < MOST_SWEEPS; ++sweep) {
      double rest = 0.0;
      for (int p = 0; p < N; ++p)
        for (int q = p + 1; q < N; ++q) {
          rest += std::fabs(a[p][q]);
          if (a[p][q] == 0.0) continue;
          const double half = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
          const double t = std::copysign(1.0, half) / (std::fabs(half) + std::hypot(1.0, half));
          const double c = 1.0 / std::hypot(1.0, t), s = t * c;
          for (int k = 0; k < N; ++k) {
            const double x = a[k][p], y = a[k][q];
            a[k][p] = c * x - s * y;
            a[k][q] = s * x + c * y;
          }
          for (int k = 0; k < N; ++k) {
            const double x = a[p][k], y = a[q][k];
            a[p][k] = c * x - s * y;
            a[q][k] = s * x + c * y;
          }
        }
      if (rest == 0.0) break;
    }
    double least = a[0][0];
    for (int p = 1; p < N; ++p) least = std::min(least, a[p][p]);
    return least;
  }

  template <int D> rve::Vec<double, D> unit(const rve::Vec<double, D> &x)
  {
    return (1.0 / std::sqrt(rve::dot(x, x))) * x;
  }

  /// Both signs are the same direction.
  template <int D> rve::Vec<double, D> with_positive_lead(const rve::Vec<double, D> &n)
  {
    for (int a = 0; a < D; ++a)
      if (n[a] != 0.0) return n[a] > 0.0 ? n : -1.0 * n;
    return n;
  }

  /// Directions of which none is the negative of another one, closer than a minimum of the determinant is wide: that is a polynomial of
  /// degree 2 D in n.
  template <int D> std::vector<rve::Vec<double, D>> directions();

  template <> std::vector<rve::Vec<double, 2>> directions<2>()
  {
    constexpr int COUNT = 72;
    std::vector<rve::Vec<double, 2>> all;
    for (int k = 0; k < COUNT; ++k)
      all.push_back({{std::cos(rve::kPi * k / COUNT), std::sin(rve::kPi * k / COUNT)}});
    return all;
  }

  /// On three faces of a cube: 3 to 6 degrees apart, with the axes and diagonals among them.
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

  /// Downhill from a direction: steps along tangents, halved where none leads down. The determinant is smooth, so the value is
  /// right to rounding before the direction is.
  template <int D>
  LeastAcousticOf<D> refined(const NominalTangentOf<D> &tangent, LeastAcousticOf<D> best,
                             double step)
  {
    constexpr double SMALLEST = 1e-9;    // of a step [rad]: the value has changed by its square
    while (step > SMALLEST) {
      bool is_better = false;
      for (const rve::Vec<double, D> &t : tangents(best.normal))
        for (const double sign : {1.0, -1.0}) {
          const rve::Vec<double, D> n = unit(best.normal + (sign * step) * t);
          const double determinant = acoustic_determinant(tangent, n);
          if (!(determinant < best.determinant)) continue;
          best = {determinant, n};
          is_better = true;
        }
      if (!is_better) step *= 0.5;
    }
    return best;
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

template <int D> TangentOf<D> operator+(const TangentOf<D> &x, const TangentOf<D> &y)
{
  TangentOf<D> sum;
  for (int r = 0; r < TangentOf<D>::size; ++r)
    for (int c = 0; c < TangentOf<D>::size; ++c)
      sum.component[r][c] = x.component[r][c] + y.component[r][c];
  return sum;
}

template <int D> TangentOf<D> operator*(double factor, const TangentOf<D> &x)
{
  TangentOf<D> product;
  for (int r = 0; r < TangentOf<D>::size; ++r)
    for (int c = 0; c < TangentOf<D>::size; ++c)
      product.component[r][c] = factor * x.component[r][c];
  return product;
}

template <int D> TangentOf<D> dyad(const rve::Tensor<double, D> &x, const rve::Tensor<double, D> &y)
{
  TangentOf<D> product;
  for_places<D>([&](int i, int j, int row) {
    for_places<D>(
        [&](int k, int l, int column) { product.component[row][column] = x(i, j) * y(k, l); });
  });
  return product;
}

template <int D>
TangentOf<D> turned(const TangentOf<D> &tangent, const rve::Tensor<double, D> &rotation)
{
  // column kl is the answer to the strain e_k e_l + e_l e_k over 2, seen from the axes that turn with the material
  TangentOf<D> result;
  const rve::Tensor<double, D> back = rve::transpose(rotation);
  for_places<D>([&](int k, int l, int column) {
    auto strain = rve::Tensor<double, D>::zero();
    strain(k, l) += 0.5;
    strain(l, k) += 0.5;
    const rve::Tensor<double, D> stress = rotation * tangent(back * strain * rotation) * back;
    for_places<D>([&](int i, int j, int row) { result.component[row][column] = stress(i, j); });
  });
  return result;
}

template <int D> double norm(const TangentOf<D> &tangent)
{
  double sum = 0.0;
  for (int r = 0; r < TangentOf<D>::size; ++r)
    for (int c = 0; c < TangentOf<D>::size; ++c) {
      const double x = weight<D>(r) * weight<D>(c) * tangent.component[r][c];
      sum += x * x;
    }
  return std::sqrt(sum);
}

template <int D>
double second_order_work(const TangentOf<D> &tangent, const rve::Tensor<double, D> &strain)
{
  const rve::Tensor<double, D> stress = tangent(strain);
  double work = 0.0, squares = 0.0;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) {
      work += stress(a, b) * strain(a, b);
      squares += strain(a, b) * strain(a, b);
    }
  return squares > 0.0 ? work / squares : 0.0;
}

template <int D> double least_second_order_work(const TangentOf<D> &tangent)
{
  constexpr int N = TangentOf<D>::size;
  Square<N> symmetric;
  for (int r = 0; r < N; ++r)
    for (int c = 0; c < N; ++c)
      symmetric[r][c] =
          0.5 * weight<D>(r) * weight<D>(c) * (tangent.component[r][c] + tangent.component[c][r]);
  return least_eigenvalue<N>(symmetric);
}

template <int D> IsotropicPart isotropic_part(const TangentOf<D> &tangent)
{
  // C_iijj = D^2 lambda + 2 D mu, C_ijij = D lambda + D (D + 1) mu
  double traces = 0.0, squares = 0.0;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      traces += tangent(i, i, j, j);
      squares += tangent(i, j, i, j);
    }
  const double mu = (squares - traces / D) / (D * (D + 1) - 2);
  const double lambda = (traces - 2.0 * D * mu) / (D * D);
  const auto isotropic = TangentOf<D>::isotropic(lambda, mu);
  const double size = norm(isotropic);
  return {lambda, mu, size > 0.0 ? norm(tangent + (-1.0) * isotropic) / size : 0.0};
}

template <int D>
NominalTangentOf<D>::NominalTangentOf(const TangentOf<D> &tangent,
                                      const rve::Tensor<double, D> &stress)
{
  // of L = e_k e_l: W sigma - sigma W = (L - L^T)/2 sigma - sigma (L - L^T)/2
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
double acoustic_determinant(const NominalTangentOf<D> &tangent, const rve::Vec<double, D> &n)
{
  rve::Tensor<double, D> acoustic;
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < D; ++k) {
      double sum = 0.0;
      for (int j = 0; j < D; ++j)
        for (int l = 0; l < D; ++l) sum += n[j] * tangent.component[i][j][k][l] * n[l];
      acoustic(i, k) = sum;
    }
  return rve::determinant(acoustic);
}

template <int D> double wave_modulus(const TangentOf<D> &tangent)
{
  double largest = 0.0;
  for (const rve::Vec<double, D> &n : directions<D>()) {
    auto acoustic = rve::Tensor<double, D>::zero();
    for (int i = 0; i < D; ++i)
      for (int k = 0; k < D; ++k)
        for (int j = 0; j < D; ++j)
          for (int l = 0; l < D; ++l)
            acoustic(i, k) += 0.5 * n[j] * (tangent(i, j, k, l) + tangent(k, l, i, j)) * n[l];
    largest = std::max(largest, largest_eigenvalue(acoustic));
  }
  return largest;
}

template <int D> LeastAcousticOf<D> least_acoustic_determinant(const NominalTangentOf<D> &tangent)
{
  constexpr int MOST_STARTS = 8;    // more minima than such a polynomial has in a half sphere
  constexpr double APART = 0.3;     // between minima [rad]
  std::vector<LeastAcousticOf<D>> all;
  for (const rve::Vec<double, D> &n : directions<D>())
    all.push_back({acoustic_determinant(tangent, n), n});
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
    const LeastAcousticOf<D> found = refined(tangent, start, 0.1);
    if (found.determinant < best.determinant) best = found;
  }
  best.normal = with_positive_lead(best.normal);
  return best;
}

#define MACRO_TANGENT_OF(D)                                                                       \
  template struct TangentOf<D>;                                                                   \
  template struct NominalTangentOf<D>;                                                            \
  template TangentOf<D> operator+(const TangentOf<D> &, const TangentOf<D> &);                    \
  template TangentOf<D> operator*(double, const TangentOf<D> &);                                  \
  template TangentOf<D> dyad(const rve::Tensor<double, D> &, const rve::Tensor<double, D> &);     \
  template TangentOf<D> turned(const TangentOf<D> &, const rve::Tensor<double, D> &);             \
  template double norm(const TangentOf<D> &);                                                     \
  template double second_order_work(const TangentOf<D> &, const rve::Tensor<double, D> &);        \
  template double least_second_order_work(const TangentOf<D> &);                                  \
  template IsotropicPart isotropic_part(const TangentOf<D> &);                                    \
  template double wave_modulus(const TangentOf<D> &);                                             \
  template double acoustic_determinant(const NominalTangentOf<D> &, const rve::Vec<double, D> &); \
  template LeastAcousticOf<D> least_acoustic_determinant(const NominalTangentOf<D> &);
MACRO_TANGENT_OF(2)
MACRO_TANGENT_OF(3)
#undef MACRO_TANGENT_OF

}    // namespace macro
