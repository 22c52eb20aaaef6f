// SPDX-License-Identifier: GPL-2.0-only
// How large a DEM time step may be. Host only; looks at a state, never at an engine.

#pragma once

#include "rve/engine/state.h"

namespace rve {

/// Highest angular frequency of the undamped contact network [1/time]; 0 without contacts.
/// Lanczos on M^-1/2 K M^-1/2, per disk two translations and a rotation, per sphere three of each, k_n along the normal and k_t along the
/// tangent with arms r - overlap/2, k_r with the reduced radius against rolling, that of twisting about the normal, I = m r^2/2 or
/// 2 m r^2/5. All contacts stick; the geometric stiffness -f_n/|b| of a rotating normal, of the order overlap/diameter relative to k_n, is
/// neglected (it lowers the frequency). Without friction k_t does not act, without rolling friction k_r does not.
template <int D> double largest_frequency(const RveStateOf<D> &state);

/// Upper bound of largest_frequency of disks by Gershgorin's circles [1/time]. One pass over contacts.
double gershgorin_frequency(const RveState &state);

/// Frequency of one contact between the two lightest grains [1/time]: what a gas of these grains will meet first. With resistance to
/// rolling or twisting also of the lightest grain with any other. It is as deep as the deepest contact that is there, and as
/// `coming_overlap` [length]: where the stiffness grows with the overlap, that decides.
template <int D> double pair_frequency(const RveStateOf<D> &state, double coming_overlap = 0.0);

/// Largest stable time step of the leapfrog update [time]: the network's, and never longer than that of one contact as in
/// pair_frequency(), which may come at any time. With frequency w, dashpot rate B (largest eigenvalue of M^-1 C) and
/// Cundall damping A, which scales a force by up to 1 + A,
///     dt = 4 / ((1+A) B + sqrt((1+A)^2 B^2 + 4 (1+A) w^2)),
/// that is 2/(w sqrt(1+A)) without dashpots and 2/w (sqrt(1+xi^2) - xi), xi = B/(2w), with them: the dashpot sees the velocity
/// of half a step before. Exact for B proportional to w^2, otherwise on the safe side.
template <int D> double stable_time_step(const RveStateOf<D> &state);

/// The same of disks with Gershgorin's frequency: a cheap lower bound of stable_time_step [time].
double gershgorin_time_step(const RveState &state, double coming_overlap = 0.0);

}    // namespace rve
