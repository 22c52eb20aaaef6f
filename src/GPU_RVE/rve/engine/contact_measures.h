// SPDX-License-Identifier: GPL-2.0-only
// What the contacts of a state say on average: how normals, branches and forces are spread over directions, and which springs hold the elastic
// energy, which contacts slide. Found on the host in double precision, from what contact_network.h sees: springs, dashpots excluded.

#pragma once

#include "rve/engine/state.h"

namespace rve {

/// Over directions n contacts are spread as 1 + C_ij n_i n_j, and what they have on average there is
///     branch l (1 + B_ij n_i n_j),  normal force f (1 + N_ij n_i n_j),  tangential force f (T_ij n_j - T_kl n_k n_l n_i),
/// to second order, with tensors that have no trace (Ouadfel and Rothenburg 2001, Mech. Mater. 33, 201; in the plane Rothenburg and Bathurst 1989,
/// Geotechnique 39, 601). Normal forces are repulsion positive.
///
/// As in LAMMPS' compute fabric T takes |f_t| n_i n_j for f_t,i n_j: it says how large tangential forces are in which direction of contacts, not where
/// they point. Without contacts everything is zero.
template <int D> struct ContactMeasuresOf {
  using Matrix = Tensor<double, D>;

  Matrix contact = Matrix::zero();             ///< C [-]
  Matrix branch = Matrix::zero();              ///< B [-]
  Matrix normal_force = Matrix::zero();        ///< N [-]
  Matrix tangential_force = Matrix::zero();    ///< T [-]
  double mean_branch = 0.0;                    ///< l, mean over directions [length]
  double mean_normal_force = 0.0;              ///< f, mean over directions [force]

  /// Strong contacts bear more than the mean normal force of all contacts, weak ones do not (Radjai, Wolf, Jean and Moreau 1998, Phys. Rev. Lett. 80, 61). Their
  /// share of all contacts, and the shares of each kind that slide (SLIDING of contact_network.h) [-]
  double strong = 0.0, sliding_strong = 0.0, sliding_weak = 0.0;

  /// Energy of the springs by what they resist; a spring along the normal has that of the adhesion, too [force length]
  double elastic_normal = 0.0, elastic_tangential = 0.0, elastic_rolling = 0.0,
         elastic_twisting = 0.0;
};

template <int D> ContactMeasuresOf<D> contact_measures(const RveStateOf<D> &state);

}    // namespace rve
