// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/servo_modes.h"

#include "rve/core/error.h"

#include <algorithm>
#include <cmath>

namespace rve {

namespace {

  template <int D> using Rows = std::vector<ComponentSum<D>>;

  template <int D> double dot(const ComponentSum<D> &a, const ComponentSum<D> &b)
  {
    double sum = 0.0;
    for (std::size_t c = 0; c < a.size(); ++c) sum += a[c] * b[c];
    return sum;
  }

  /// A row counts as linearly dependent on other rows if its part orthogonal to them is shorter
  /// than this share of the row [-].
  constexpr double DEPENDENT = 1e-6;

  /// Finds the transposed pseudo-inverse A^+T = (A A^T)^-1 A of linearly independent rows. Returns
  /// false if they are dependent.
  template <int D> bool pseudo_inverse(const Rows<D> &rows, Rows<D> &result)
  {
    const int n = static_cast<int>(rows.size());
    result = rows;
    std::vector<std::vector<double>> gram(n, std::vector<double>(n));
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) gram[i][j] = dot<D>(rows[i], rows[j]);
    std::vector<double> size(n);
    for (int i = 0; i < n; ++i) size[i] = gram[i][i];
    // Gauss-Jordan elimination. The matrix is positive definite, so its diagonal elements can serve
    // as pivots in order.
    for (int p = 0; p < n; ++p) {
      if (!(gram[p][p] > DEPENDENT * DEPENDENT * size[p])) return false;
      for (int i = 0; i < n; ++i) {
        if (i == p || gram[i][p] == 0.0) continue;
        const double factor = gram[i][p] / gram[p][p];
        for (int j = 0; j < n; ++j) gram[i][j] -= factor * gram[p][j];
        for (std::size_t c = 0; c < result[i].size(); ++c) result[i][c] -= factor * result[p][c];
      }
    }
    for (int p = 0; p < n; ++p)
      for (double &x : result[p]) x /= gram[p][p];
    return true;
  }

  /// Returns the velocity gradient with these components on and above the diagonal, since the servo
  /// shears along x.
  template <int D> Tensor<double, D> upper(const ComponentSum<D> &sum)
  {
    auto tensor = Tensor<double, D>::zero();
    for (int c = 0; c < Space<D>::strains; ++c)
      tensor(strain_row<D>(c), strain_column<D>(c)) = sum[c];
    return tensor;
  }

  /// Returns the symmetric tensor with these components. Both entries of an off-diagonal component
  /// are `share` times its value.
  template <int D> Tensor<double, D> symmetric(const ComponentSum<D> &sum, double share)
  {
    auto tensor = Tensor<double, D>::zero();
    for (int c = 0; c < Space<D>::strains; ++c) {
      const int a = strain_row<D>(c), b = strain_column<D>(c);
      tensor(a, b) = tensor(b, a) = a == b ? sum[c] : share * sum[c];
    }
    return tensor;
  }

}    // namespace

template <int D>
ServoModesOf<D>::ServoModesOf(const std::vector<ComponentSum<D>> &rates,
                              const std::vector<ComponentSum<D>> &stresses)
{
  require(rates.size() + stresses.size() == Space<D>::strains, "there are ", rates.size(),
          " conditions on rates and ", stresses.size(), " on stresses; together there must be ",
          Space<D>::strains);
  Rows<D> of_rates, of_stresses;
  require(pseudo_inverse<D>(rates, of_rates),
          "the conditions on rates depend on each other: one follows from the others or "
          "contradicts them");
  require(pseudo_inverse<D>(stresses, of_stresses),
          "the conditions on stresses depend on each other: one follows from the others or "
          "contradicts them");
  Rows<D> modes = of_stresses, duals;
  for (ComponentSum<D> &mode : modes) {
    const ComponentSum<D> whole = mode;
    for (std::size_t j = 0; j < rates.size(); ++j) {
      const double rate = dot<D>(rates[j], whole);
      for (std::size_t c = 0; c < mode.size(); ++c) mode[c] -= rate * of_rates[j][c];
    }
  }
  bool free = pseudo_inverse<D>(modes, duals);
  for (std::size_t k = 0; k < modes.size(); ++k)
    free = free && dot<D>(modes[k], modes[k]) > DEPENDENT * dot<D>(of_stresses[k], of_stresses[k]);
  require(free,
          "a stress goal cannot be reached: the conditions on rates prescribe the strain rate "
          "that is its work conjugate");

  for (const ComponentSum<D> &rate : of_rates) unit_rates.push_back(upper<D>(rate));
  for (std::size_t k = 0; k < modes.size(); ++k) {
    double largest = 0.0;
    for (const double x : modes[k]) largest = std::max(largest, std::fabs(x));
    ComponentSum<D> mode = modes[k], dual = duals[k];
    for (double &x : mode) x /= largest;
    for (double &x : dual) x *= largest;
    ServoModeOf<D> one;
    one.rate = upper<D>(mode);
    one.dual = upper<D>(dual);
    one.stress = symmetric<D>(stresses[k], 0.5);
    one.weight = largest;
    this->modes.push_back(one);
    unit_stresses.push_back(symmetric<D>(of_stresses[k], 1.0));
  }
}

template struct ServoModesOf<2>;
template struct ServoModesOf<3>;

}    // namespace rve
