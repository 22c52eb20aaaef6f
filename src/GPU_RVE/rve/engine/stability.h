// SPDX-License-Identifier: GPL-2.0-only
// Bounds of the DEM time step. Host only; they need a state and no engine.

#pragma once

#include "rve/engine/state.h"

namespace rve {

/// Returns the highest angular frequency of the undamped contact network [1/time]; 0 without
/// contacts. The frequency is found by Lanczos' method for M^-1/2 K M^-1/2 with the mass matrix M
/// and the stiffness matrix K. A disk has two translations and a rotation, a sphere three of each.
/// A contact has the stiffness k_n along the normal, k_t along the tangent with lever arms r -
/// overlap/2, k_r against rolling with the reduced radius as lever arm, and the twisting stiffness
/// about the normal. The moment of inertia is m r^2/2 for disks and 2 m r^2/5 for spheres.
///
/// All contacts stick. The geometric stiffness -f_n/|b| of a rotating normal, with the branch
/// vector b, is neglected. It is of the order k_n overlap/diameter and lowers the frequency.
/// Without friction k_t does not act, and without rolling friction k_r does not.
template <int D> double largest_frequency(const RveStateOf<D> &state);

/// Returns the frequency of one contact between the two lightest grains [1/time], such as the first
/// contact that forms in a packing without contacts. With resistance to rolling or twisting it
/// includes contacts of the lightest grain with any other. The overlap is the larger of
/// `coming_overlap` [length] and that of the deepest present contact; it matters if the stiffness
/// grows with the overlap.
template <int D> double pair_frequency(const RveStateOf<D> &state, double coming_overlap = 0.0);

/// Returns the largest stable time step of the leapfrog update [time]. That step is stable for the
/// contact network and for one contact as in pair_frequency(), which may form at any time. The step
/// is
///     dt = 4 / ((1+A) B + sqrt((1+A)^2 B^2 + 4 (1+A) w^2)),
/// w is the highest angular frequency [1/time]. B is the largest eigenvalue of M^-1 C with the
/// damping matrix C of the dashpots [1/time]. A is the coefficient of Cundall damping, which scales
/// a force by up to 1 + A [-]. Without dashpots the step is 2/(w sqrt(1+A)). With dashpots and A =
/// 0 it is 2/w (sqrt(1+xi^2) - xi), xi = B/(2w), since the dashpot uses the velocity of half a step
/// before. The result is exact for B proportional to w^2, otherwise on the safe side.
template <int D> double stable_time_step(const RveStateOf<D> &state);

/// Returns a cheap lower bound of stable_time_step for disks, by Gershgorin's circles in one pass
/// over contacts [time].
double gershgorin_time_step(const RveState &state, double coming_overlap = 0.0);

}    // namespace rve
