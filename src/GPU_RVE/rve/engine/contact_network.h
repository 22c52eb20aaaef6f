// SPDX-License-Identifier: GPL-2.0-only
// The contacts of a state, found on the host in double precision: for file output, for the stability bound, and as a slow,
// plain reference. The engine has its own lists.

#pragma once

#include "rve/engine/state.h"
#include "rve/physics/laws/law.h"

#include <type_traits>
#include <vector>

namespace rve {

/// Two overlapping grains, first < second.
template <int D> struct TouchingPairOf {
  int first;
  int second;
  Vec<double, D> branch;    ///< x_second - x_first, nearest image [length]
  Vec<double, D> normal;    ///< unit, first to second
  /// r_first + r_second - |branch|; below zero of grains in reach that do not touch [length].
  double overlap;
};
using TouchingPair = TouchingPairOf<2>;

template <int D>
ContactPlace place_of(const RveStateOf<D> &state, const TouchingPairOf<D> &contact);

/// All contacts of the state, pairs whose grains act on each other, ordered by first, then second. O(N) where the cell is at least three contact distances wide,
/// O(N^2) below. Grains with coinciding centres are skipped: they have no normal.
template <int D> std::vector<TouchingPairOf<D>> find_contacts(const RveStateOf<D> &state);

/// Forgets a largest contact force far above the forces of the contacts that are there, which a file may have and no run leaves: the
/// scale of forces would hold none of them. The engine then begins with one of its own.
template <int D> void forget_absurd_force(RveStateOf<D> &state);

/// What the state remembers of these contacts, as their first grains see it; nothing where the state has none.
template <int D>
std::vector<PairOf<D>> remembered_pairs(const RveStateOf<D> &state,
                                        const std::vector<TouchingPairOf<D>> &contacts);

/// Forces of springs that pairs remember, as the first grain sees them.
template <int D> struct SpringForcesOf {
  using Force = std::conditional_t<D == 2, double, Vec<double, D>>;
  /// On the first grain, across the normal; of disks along t = (-n_y, n_x), n from first to second [force].
  Force tangential;
  /// Moment on the first grain over the reduced radius; of spheres n x this is that [force].
  Force rolling;
  double twisting = 0.0;    ///< of spheres; moment on the first grain along n [force length]
};

/// Those of these contacts; zero where the state has none. Where friction resists twisting, `twisting` is of a contact as deep as the reduced
/// radius, as pairs remember it.
template <int D>
std::vector<SpringForcesOf<D>> spring_forces(const RveStateOf<D> &state,
                                             const std::vector<TouchingPairOf<D>> &contacts);

/// A contact with what its springs say; dashpots are not in it.
template <int D> struct SpringContactOf {
  TouchingPairOf<D> geometry;
  int image[D];           ///< x_second + H image is the image that the branch reaches
  double normal_force;    ///< of the springs, repulsion positive [force]
  SpringForcesOf<D> springs;
  Vec<double, D> force_on_first;    ///< -f_n n and the tangential force [force]
  /// |f_t| over what friction allows, 1 where it slides; 1 without friction [-].
  double mobilized_friction;
};
using SpringContact = SpringContactOf<2>;

/// All contacts of the state, in the order of find_contacts().
template <int D> std::vector<SpringContactOf<D>> find_spring_contacts(const RveStateOf<D> &state);

/// Mobilized friction from which a contact is said to slide [-]. A run compares forces in the number format of its engine; here the
/// normal force follows in double precision from positions, and differs by less than 1e-3 of itself in format fast.
constexpr double SLIDING = 0.999;

/// Love's stress of the springs, dashpots excluded, tension positive [stress].
template <int D> Tensor<double, D> spring_stress(const RveStateOf<D> &state);

/// Branch vector from grain i to the nearest image of grain j, from the wrapping difference of fractional coordinates [length].
template <int D> Vec<double, D> branch_vector(const RveStateOf<D> &state, int i, int j);

}    // namespace rve
