// SPDX-License-Identifier: GPL-2.0-only
// Passes over nodes: balance of momentum and velocities.

#pragma once

#include "mpm/step_view.h"

namespace mpm {

/// Imposes the conditions of the sides and finds the velocities of the nodes. With Cundall's local
/// damping it applies the damping force but finds no velocities. Conditions are then imposed again,
/// and NodeDamped finds the velocities.
template <int D> struct NodeBalance : NodePass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int n, Tally &tally) const
  {
    Vec<D> &begin = step.momentum[n];
    Vec<D> &end = step.momentum_end[n];
    step.balance_sides(n, end, begin);
    // outside the touched box a rank can have the force of a node without the contacts of the node
    if (!step.shares_grid || step.touched.contains(step.grid, n))
      for (int c = 0; c < D; ++c)
        if (!step.constrains(n, c)) tally.raise(Unbalanced, std::abs(step.force[n][c]));
    if (!(step.damping > 0.0)) {
      set_velocities(step, n);
      return;
    }
    // the damping force is -α |f| sign(v) with sign(0) = 0; the net force f includes reactions;
    // held components have no damping force, and reactions do not include damping forces
    step.damping_impulse[n] = (-1.0) * end;
    for (int c = 0; c < D; ++c) {
      const double net = end[c] - begin[c];
      const double direction = double(begin[c] > 0.0) - double(begin[c] < 0.0);
      end[c] -= step.damping * std::abs(net) * direction;
    }
  }

  static RVE_HD void set_velocities(const StepView<D> &step, int n)
  {
    const double mass = step.mass[n];
    const Vec<D> &end = step.momentum_end[n];
    step.velocity[n] = mass > 0.0 ? (1.0 / mass) * end : Vec<D>::zero();
    step.velocity_change[n] = mass > 0.0 ? (1.0 / mass) * (end - step.momentum[n]) : Vec<D>::zero();
  }
};

/// Imposes the sides again and finds the velocities after damping.
template <int D> struct NodeDamped : NodePass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    step.impose_sides(n, step.momentum_end[n]);
    step.damping_impulse[n] = step.damping_impulse[n] + step.momentum_end[n];
    NodeBalance<D>::set_velocities(step, n);
  }
};

/// Applies the dashpots of the sides. Their traction on the material is -ρ c v for each component
/// of the velocity v, with the density ρ and the wave speed c (Lysmer & Kuhlemeyer 1969, J. Eng.
/// Mech. Div. ASCE 95, 859). Dashpots change the momenta with the forces, before bodies and sides
/// are imposed. They do not act on components that a side holds.
///
/// Material whose face is on the side gives its nodes the mass m = ρ A h/2, with the area A of the
/// face and the cell size h. The force ρ A c v = (2 c/h) m v therefore needs no area or density
/// (doc/src/theory_mpm.rst). The force uses the velocity in the middle of the step, so it never
/// adds energy:
///   p_end = p + f dt - β (p + p_end),  β = c dt/h
/// with the momentum p and the other forces f of the node. For β > 1 the dashpot reverses the
/// velocity of a node, so cfl_number() includes these wave speeds.
template <int D> struct AbsorbAtNode : Pass<D> {
  using Pass<D>::step;

  int items() const { return step.num_absorbing; }
  template <class Tally> RVE_HD void operator()(int k, Tally &) const
  {
    const AbsorbingNode<D> &at = step.absorbing[k];
    const double per_speed = step.dt / step.grid.cell_size();
    const Vec<D> &begin = step.momentum[at.node];
    Vec<D> &end = step.momentum_end[at.node];
    Vec<D> felt[D] = {};
    for (int c = 0; c < D; ++c) {
      if (step.held_by_side(at.node, c)) continue;
      double beta = 0.0;
      for (int a = 0; a < D; ++a) beta += per_speed * at.speed[a][c];
      end[c] = (end[c] - beta * begin[c]) / (1.0 + beta);
      for (int a = 0; a < D; ++a) felt[a][c] = per_speed * at.speed[a][c] * (begin[c] + end[c]);
    }
    for (int a = 0; a < D; ++a) step.absorbed_impulse[step.in_row(a, at.node)] = felt[a];
  }
};

/// Finds the nodal velocities for the strains. The contacts of bodies have already been imposed on
/// the momenta.
template <int D> struct NodeVelocity : NodePass<D> {
  using Pass<D>::step;
  template <class Tally> RVE_HD void operator()(int n, Tally &) const
  {
    const double mass = step.mass[n];
    step.impose_sides(n, step.momentum_end[n]);
    step.velocity[n] = mass > 0.0 ? (1.0 / mass) * step.momentum_end[n] : Vec<D>::zero();
  }
};

}    // namespace mpm
