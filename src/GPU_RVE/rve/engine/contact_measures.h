// SPDX-License-Identifier: GPL-2.0-only
// Statistics of the contacts of a state: distributions of normals, branch vectors and forces over
// directions, the elastic energy of each kind of spring, and shares of sliding contacts. They are
// computed on the host in double precision from the contacts that contact_network.h finds, without
// dashpots.

#pragma once

#include "rve/engine/state.h"

namespace rve {

/// Directional distributions. The density of contacts with the normal n, divided by that of an
/// isotropic packing, is 1 + C_ij n_i n_j. The averages over contacts of normal n are
///     branch l (1 + B_ij n_i n_j),  normal force f (1 + N_ij n_i n_j),
///     tangential force f (T_ij n_j - T_kl n_k n_l n_i),
/// to second order in n. Here l is the mean branch length [length] and f the mean normal force
/// [force]. The tensors C, B, N and T [-] are traceless (Ouadfel and Rothenburg 2001, Mech. Mater.
/// 33, 201; in the plane Rothenburg and Bathurst 1989, Geotechnique 39, 601). Normal forces are
/// positive in repulsion.
///
/// As in LAMMPS' compute fabric, T is computed from |f_t| n_i n_j and not from f_t,i n_j. So T
/// describes how the magnitude of tangential forces depends on the contact direction. T does not
/// describe the direction of the forces. All measures are zero without contacts.
template <int D> struct ContactMeasuresOf {
  using Matrix = Tensor<double, D>;

  Matrix contact = Matrix::zero();             ///< C [-]
  Matrix branch = Matrix::zero();              ///< B [-]
  Matrix normal_force = Matrix::zero();        ///< N [-]
  Matrix tangential_force = Matrix::zero();    ///< T [-]
  double mean_branch = 0.0;                    ///< l, mean over directions [length]
  double mean_normal_force = 0.0;              ///< f, mean over directions [force]

  /// A strong contact bears more than the mean normal force of all contacts (Radjai, Wolf, Jean and
  /// Moreau 1998, Phys. Rev. Lett. 80, 61). `strong` is the share of strong contacts among all
  /// contacts. `sliding_strong` and `sliding_weak` are the shares of sliding contacts (SLIDING in
  /// contact_network.h) among the strong contacts and among the weak contacts [-].
  double strong = 0.0, sliding_strong = 0.0, sliding_weak = 0.0;

  /// Energy of each kind of spring [force length]. The normal part includes the energy of the
  /// adhesion.
  double elastic_normal = 0.0, elastic_tangential = 0.0, elastic_rolling = 0.0,
         elastic_twisting = 0.0;
};

template <int D> ContactMeasuresOf<D> contact_measures(const RveStateOf<D> &state);

}    // namespace rve
