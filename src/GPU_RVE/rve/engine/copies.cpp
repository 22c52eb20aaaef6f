// SPDX-License-Identifier: GPL-2.0-only
#include "rve/engine/copies.h"

#include "rve/core/error.h"
#include "rve/core/splitmix64.h"
#include "rve/physics/cell.h"
#include "rve/physics/solid_cell.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

namespace rve {

namespace {

  constexpr std::uint64_t HALF = std::uint64_t{1} << 63;

  // Largest number of reduction steps. A cell that is sheared far beyond the range of a call needs
  // some tens of them.
  constexpr int MOST_LATTICE_STEPS = 256;

  /// Applies Lagrange's (disks) or Minkowski's (spheres) lattice reduction, as the construction of
  /// a list does. Fractional coordinates are transformed exactly.
  template <int D> void reduce_lattice(RveStateOf<D> &state)
  {
    for (int k = 0; k < MOST_LATTICE_STEPS; ++k) {
      const auto step = lattice_step(state.cell);
      if (step.axis < 0) return;
      state.cell = apply_lattice_step(state.cell, step);
      for (int i = 0; i < state.num_grains(); ++i) {
        Vec<std::uint64_t, D> s;
        for (int a = 0; a < D; ++a) s[a] = state.fractional[D * i + a];
        s = apply_lattice_step(s, step);
        for (int a = 0; a < D; ++a) state.fractional[D * i + a] = s[a];
      }
      ++state.counters.lattice_reductions;
    }
  }

  template <int D> int narrowest_axis(const Tensor<double, D> &cell)
  {
    int narrowest = 0;
    for (int a = 1; a < D; ++a)
      if (perpendicular_width(cell, a) < perpendicular_width(cell, narrowest)) narrowest = a;
    return narrowest;
  }

  /// Returns true if the image of a grain at `to` that is nearest to `from` is in the previous or
  /// the next cell.
  bool leaves_the_cell(std::uint64_t from, std::uint64_t to)
  {
    const std::uint64_t forward = to - from;
    return forward < HALF ? to < from : to > from;
  }

  template <class T> void append_copy(std::vector<T> &values)
  {
    const std::size_t count = values.size();
    values.reserve(2 * count);
    for (std::size_t k = 0; k < count; ++k) values.push_back(values[k]);
  }

  /// Returns a difference of fractional coordinates as a signed share of the cell.
  double share_of(std::uint64_t difference)
  {
    return std::ldexp(static_cast<double>(static_cast<std::int64_t>(difference)), -64);
  }

  /// Returns the offset that more than half of the grains i have to their copies i + `stride`, in
  /// units of 1/`copies` of the cell vectors; nothing if no offset has a majority. Lattice
  /// reduction adds whole multiples of cell vectors to each other, so offsets stay multiples of
  /// that unit.
  template <int D>
  std::optional<std::array<int, D>> place_of_copies(const RveStateOf<D> &state, int copies,
                                                    int stride)
  {
    constexpr double STILL_THERE = 0.1;    // in units of the radius
    const int n = state.num_grains();
    std::map<std::array<int, D>, int> count;
    for (int i = 0; i < n; ++i) {
      if ((i / stride) % 2 != 0) continue;
      std::array<int, D> parts;
      Vec<double, D> off;
      for (int a = 0; a < D; ++a) {
        const double apart =
            share_of(state.fractional[D * (i + stride) + a] - state.fractional[D * i + a]);
        const double nearest = std::nearbyint(apart * copies);
        off[a] = apart - nearest / copies;
        parts[a] = (static_cast<int>(nearest) + copies) % copies;
      }
      const Vec<double, D> apart = state.cell * off;
      if (std::sqrt(dot(apart, apart)) <= STILL_THERE * state.radius[i]) ++count[parts];
    }
    for (const auto &[parts, number] : count)
      if (4 * number > n) return parts;    // more than half of the n/2 grains
    return std::nullopt;
  }

  /// Returns the length of the offset from a grain to the nearest periodic image of its copy
  /// [length].
  template <int D>
  double least_distance(const Tensor<double, D> &cell, const std::array<int, D> &parts, int copies)
  {
    constexpr int REACH = 2;    // one more than a reduced cell needs
    double least = std::numeric_limits<double>::infinity();
    std::array<int, D> whole;
    whole.fill(-REACH);
    for (bool more = true; more;) {
      Vec<double, D> s;
      for (int a = 0; a < D; ++a) s[a] = whole[a] + static_cast<double>(parts[a]) / copies;
      const Vec<double, D> x = cell * s;
      least = std::min(least, std::sqrt(dot(x, x)));
      more = false;
      for (int a = 0; a < D && !more; ++a) {
        more = ++whole[a] <= REACH;
        if (!more) whole[a] = -REACH;
      }
    }
    return least;
  }

}    // namespace

template <int D> RveStateOf<D> side_by_side(const RveStateOf<D> &state)
{
  constexpr int most = std::numeric_limits<std::int32_t>::max() / 2;
  require(state.num_grains() <= most, "an RVE with ", state.num_grains(),
          " grains cannot be doubled; it must have at most ", most, " grains");
  RveStateOf<D> wide = state;
  reduce_lattice(wide);
  const int n = state.num_grains(), axis = narrowest_axis(wide.cell);

  std::vector<PairOf<D>> pairs;
  pairs.reserve(2 * state.pairs.size());
  for (const bool copy : {false, true})
    for (PairOf<D> pair : state.pairs) {
      const bool crosses = leaves_the_cell(wide.fractional[D * pair.first + axis],
                                           wide.fractional[D * pair.second + axis]);
      pair.first += copy ? n : 0;
      pair.second += copy != crosses ? n : 0;
      pairs.push_back(pair);
    }
  wide.pairs = std::move(pairs);
  wide.forget_list();
  wide.order.clear();

  for (int a = 0; a < D; ++a) wide.cell(a, axis) *= 2.0;
  for (int i = 0; i < n; ++i) wide.fractional[D * i + axis] /= 2;
  append_copy(wide.fractional);
  for (int i = n; i < 2 * n; ++i) wide.fractional[D * i + axis] += HALF;
  append_copy(wide.radius);
  append_copy(wide.velocity);
  append_copy(wide.spin);
  for (int i = 0; i < n; ++i) {
    const double change = PARTING * share_of(splitmix64(i));    // at most PARTING/2 in size
    for (int a = 0; a < D; ++a) {
      wide.velocity[D * i + a] *= 1.0 - change;
      wide.velocity[D * (i + n) + a] *= 1.0 + change;
    }
  }

  wide.energy.work *= 2.0;
  wide.energy.friction *= 2.0;
  wide.energy.local_damping *= 2.0;
  wide.energy.viscous *= 2.0;
  return wide;
}

template <int D> bool is_one_grain_across(const RveStateOf<D> &state, int copies)
{
  RveStateOf<D> reduced = state;
  reduce_lattice(reduced);
  const double reach = 3.0 * *std::max_element(state.radius.begin(), state.radius.end());
  for (int stride = state.num_grains() / copies; stride < state.num_grains(); stride *= 2) {
    const auto parts = place_of_copies<D>(reduced, copies, stride);
    if (parts && least_distance<D>(reduced.cell, *parts, copies) <= reach) return true;
  }
  return false;
}

template RveStateOf<2> side_by_side(const RveStateOf<2> &);
template RveStateOf<3> side_by_side(const RveStateOf<3> &);
template bool is_one_grain_across(const RveStateOf<2> &, int);
template bool is_one_grain_across(const RveStateOf<3> &, int);

}    // namespace rve
