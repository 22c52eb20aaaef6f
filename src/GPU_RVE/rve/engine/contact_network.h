// SPDX-License-Identifier: GPL-2.0-only
// Search of the contacts of a state, on the host in double precision. File output and the stability
// bound use it. The code is simple and slow; the engine has its own lists.

#pragma once

#include "rve/engine/state.h"
#include "rve/physics/laws/law.h"

#include <type_traits>
#include <vector>

namespace rve {

/// Two grains that overlap or act on each other at a distance; first < second.
template <int D> struct TouchingPairOf {
  int first;
  int second;
  Vec<double, D> branch;    ///< x_second - x_first, nearest image [length]
  Vec<double, D> normal;    ///< unit vector from first to second
  /// r_first + r_second - |branch| [length]; negative for pairs within reach that do not touch.
  double overlap;
};
using TouchingPair = TouchingPairOf<2>;

template <int D> ContactSite site_of(const RveStateOf<D> &state, const TouchingPairOf<D> &contact);

/// Returns all pairs of the state that act on each other, ordered by first, then second. The cost
/// is O(N) if the cell is at least three contact distances wide, otherwise O(N^2). Grains with
/// coinciding centres have no normal and are skipped.
template <int D> std::vector<TouchingPairOf<D>> find_contacts(const RveStateOf<D> &state);

/// Resets state.largest_contact_force if it is far above the forces of the present contacts. A file
/// can contain such a value. The force scale of the engine would then be too coarse for the present
/// forces. After the reset the engine starts from its own estimate.
template <int D> void forget_absurd_force(RveStateOf<D> &state);

/// Returns the pair of the state for each contact. The forces and moments are those on the first
/// grain of the contact. A contact without a pair in the state gets a pair of zeros.
template <int D>
std::vector<PairOf<D>> remembered_pairs(const RveStateOf<D> &state,
                                        const std::vector<TouchingPairOf<D>> &contacts);

/// Spring forces that a pair stores. They act on the first grain.
template <int D> struct SpringForcesOf {
  using Force = std::conditional_t<D == 2, double, Vec<double, D>>;
  /// Force on the first grain across the normal [force]; for disks along t = (-n_y, n_x) with n
  /// from first to second.
  Force tangential;
  /// Disks: moment on the first grain over the reduced radius [force]. For spheres this quotient is
  /// the cross product of n and the vector `rolling`.
  Force rolling;
  double twisting = 0.0;    ///< moment on the first grain along n, spheres only [force length]
};

/// Returns the spring forces of these contacts; zero for contacts without a pair in the state. If
/// friction resists twisting, `twisting` is scaled to an overlap as large as the reduced radius, as
/// in PairOf<3>.
template <int D>
std::vector<SpringForcesOf<D>> spring_forces(const RveStateOf<D> &state,
                                             const std::vector<TouchingPairOf<D>> &contacts);

/// Contact with the forces of its springs, without dashpots.
template <int D> struct SpringContactOf {
  TouchingPairOf<D> geometry;
  int image[D];           ///< the branch vector ends at x_second + H image
  double normal_force;    ///< force of the springs, repulsion positive [force]
  SpringForcesOf<D> springs;
  Vec<double, D> force_on_first;    ///< sum of -f_n n and the tangential force [force]
  /// |f_t| over the limit by friction [-]; 1 for a sliding contact and without friction.
  double mobilized_friction;
};
using SpringContact = SpringContactOf<2>;

/// Returns all contacts of the state in the order of find_contacts().
template <int D> std::vector<SpringContactOf<D>> find_spring_contacts(const RveStateOf<D> &state);

/// Mobilized friction above which a contact counts as sliding [-]. The threshold is below 1, since
/// the normal force is recomputed here from positions in double precision. It differs from the
/// normal force of a run in format fast by less than 1e-3 of its value.
constexpr double SLIDING = 0.999;

/// Returns Love's stress of the springs, without dashpots, tension positive [stress].
template <int D> Tensor<double, D> spring_stress(const RveStateOf<D> &state);

/// Returns the branch vector from grain i to the nearest image of grain j, from the wrapping
/// difference of fractional coordinates [length].
template <int D> Vec<double, D> branch_vector(const RveStateOf<D> &state, int i, int j);

}    // namespace rve
