// SPDX-License-Identifier: GPL-2.0-only
// Passes for nodes that several rigid bodies touch.
//
// If contacts of more than one body hold a node, the node is divided among these contacts. Each
// contact acts on a part of the mass and momentum of the node. The part is proportional to the
// weight of the contact. The axes along the face divide the surroundings of the node into two
// sectors in 2D and four in 3D. The weight is the number of these sectors that the face of the body
// covers. All contacts start from the same momenta, and the node receives the sum of their
// impulses. This conserves momentum and does not depend on the order of the bodies. The reactions
// of two halves of a plate add up to the reaction of the whole plate.
//
// A sweep over the contacts maps momenta by A P S. S divides the nodes, P imposes the contacts, and
// A = S^T sums the parts. P is a projection in the metric of the mass. The map is self-adjoint with
// eigenvalues from 0 to 1, so it cannot add energy. If one body were imposed after the other, the
// map would be a product of projections P2 P1, which is not self-adjoint. Together with the
// stiffness of the material, this product has complex eigenvalues, and the motion of nodes with
// little mass grows from step to step.
//
// If contacts impose different conditions on a node, one sweep does not satisfy them fully, so
// sweeps are repeated. Components of a node are divided separately. Components that only one body
// touches are not divided, and their momenta change immediately.

#pragma once

#include "mpm/step_view.h"

namespace mpm {

/// Number of sweeps over contacts on divided nodes. If only one of two equal contacts imposes a
/// condition, each sweep halves the deviation from this condition, and 2^-4 of the deviation
/// remains.
constexpr int SHARED_SWEEPS = 4;

/// The work of a pass over the contacts of a body.
struct ContactWork {
  Contact how;
  bool finds;    ///< marks the components that contacts hold
  bool imposes;
  bool balances;    ///< also changes the momenta before the forces, and sums impulses on the body
  bool again;       ///< skips nodes that are not divided; set in sweeps after the first

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
