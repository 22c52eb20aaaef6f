// SPDX-License-Identifier: GPL-2.0-only
// Passes for nodes that several rigid bodies touch.
//
// A node that contacts of more than one body hold is divided among these contacts. Each contact
// acts on a part of the mass and momentum in proportion to its weight, the number of sectors around
// the node that the face of the body covers. All contacts start from the same momenta, and the
// node receives the sum of their impulses. This conserves momentum, does not depend on the order of
// the bodies, and gives two halves of a plate together the reaction of the plate.
//
// The map of momenta is A P S, with the division S, a projection P in the metric of the mass, and
// the sum A = S^T. It is self-adjoint with eigenvalues from 0 to 1, so that it cannot add energy.
// Imposing one body after the other is a product of projections P2 P1, which is not self-adjoint:
// with the stiffness of the material it has complex eigenvalues, and the motion of nodes with
// little mass grows from step to step.
//
// If the conditions of the contacts differ, a sweep with divided nodes does not satisfy them fully,
// so sweeps are repeated. Components of a node are divided separately. Components that only one
// body touches are not divided, and their momenta change immediately.

#pragma once

#include "mpm/step_view.h"

namespace mpm {

/// Number of sweeps over contacts on divided nodes. Each sweep halves the deviation from a
/// condition that only one of two equal contacts imposes, so that 2^-4 of it remains.
constexpr int SHARED_SWEEPS = 4;

/// The work of a pass over the contacts of a body.
struct ContactWork {
  Contact how;
  bool finds;    ///< marks the components that contacts hold
  bool imposes;
  bool balances;    ///< also changes the momenta before the forces, and sums impulses on the body
  bool again;       ///< skips nodes that bodies do not share, in sweeps after the first one

  RVE_HD bool skips(bool is_shared) const { return again && !is_shared; }
};

/// Divides nodes among the contacts that have been found.
template <int D> struct DivideNodes : NodePass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    std::uint32_t parts = 0;
    for (int a = 0; a < D; ++a) {
      int bodies = 0, weights = 0;
      for (int b = 0; b < step.num_bodies; ++b) {
        const int of_body = step.contacts(b, n, a);
        bodies += of_body > 0;
        weights += of_body;
      }
      if (bodies > 1) parts |= static_cast<std::uint32_t>(weights < 255 ? weights : 255) << 8 * a;
    }
    step.parts[n] = parts;
  }
};

/// Adds the gathered impulses to the momenta of divided nodes.
template <int D> struct JoinNodes : NodePass<D> {
  using Pass<D>::step;
  bool balances;

  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    if (step.parts[n] == 0) return;
    join(step.with_forces(), n);
    if (balances) join(step.before_forces(), n);
  }

 private:
  static RVE_HD void join(const ContactMomenta<D> &momenta, int n)
  {
    momenta.momentum[n] = momenta.momentum[n] + momenta.gathered[n];
    momenta.gathered[n] = Vec<D>::zero();
  }
};

}    // namespace mpm
