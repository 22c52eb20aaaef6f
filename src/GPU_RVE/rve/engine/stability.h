// SPDX-License-Identifier: GPL-2.0-only
// Bounds of the stable DEM time step. They are computed on the host from a state, without an
// engine.

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
/// All contacts are assumed to stick. The geometric stiffness -f_n/|b| of a rotating normal, with
/// the branch vector b, is neglected. This stiffness is of the order k_n overlap/diameter, and it
/// would lower the frequency. Without friction k_t is zero, and without rolling friction k_r is
/// zero.
template <int D> double largest_frequency(const RveStateOf<D> &state);

/// Returns the frequency of one contact between the two lightest grains [1/time], such as the first
/// contact that forms in a packing without contacts. If contacts resist rolling or twisting, the
/// frequencies of contacts of the smallest grain with every other grain are included, and the
/// highest frequency is returned. The overlap of the contact is the larger of `coming_overlap`
/// [length] and the largest present overlap. It matters if the stiffness grows with the overlap.
template <int D> double pair_frequency(const RveStateOf<D> &state, double coming_overlap = 0.0);

/// Returns the largest stable time step of the leapfrog update [time]. This step is stable for the
/// contact network and for a single contact as in pair_frequency(), which can form at any time. The
/// step is
///     dt = 4 / ((1+A) B + sqrt((1+A)^2 B^2 + 4 (1+A) w^2)),
/// w is the highest angular frequency [1/time]. B is the largest eigenvalue of M^-1 C with the
/// damping matrix C of the dashpots [1/time]. A is the coefficient of Cundall damping, which scales
/// a force by up to 1 + A [-]. Without dashpots the step is 2/(w sqrt(1+A)). With dashpots and A =
/// 0 it is 2/w (sqrt(1+xi^2) - xi), xi = B/(2w), since the dashpot uses the velocity of half a step
/// before. The result is exact if B is proportional to w^2; otherwise it is below the exact limit.
template <int D> double stable_time_step(const RveStateOf<D> &state);

/// Returns a cheap lower bound of stable_time_step for disks, by Gershgorin's circles in one pass
/// over contacts [time].
double gershgorin_time_step(const RveState &state, double coming_overlap = 0.0);

}    // namespace rve
