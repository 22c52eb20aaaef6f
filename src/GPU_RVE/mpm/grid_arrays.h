// SPDX-License-Identifier: GPL-2.0-only
// The arrays on the nodes that a machine holds, in its own kind of memory, and where a StepView finds them.

#pragma once

#include "mpm/boundary.h"
#include "mpm/step_view.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mpm {

/// `Buffer<T>` has upload(std::vector<T>) and reserve_zeros(count), which return where the passes find its elements.
template <int D, template <class> class Buffer> class GridArrays {
 public:
  /// Makes them for a part of the grid and the bodies of a view, which then has them. Nothing of before is kept: no step needs it.
  void wire(StepView<D> &view, const Grid<D> &part, const Boundary<D> &boundary)
  {
    view.grid = view.boundary.grid = part;
    const std::size_t nodes = view.grid.node_count();
    const std::size_t bodies = view.num_bodies;
    view.boundary.sides = sides_.upload(boundary.sides(part));
    view.boundary.on_body = on_body_.reserve_zeros(nodes);
    // no array is empty
    view.boundary.closed = closed_.reserve_zeros(bodies * view.boundary.columns() + 1);
    view.boundary.contact_states = contact_states_.reserve_zeros(view.num_rigid * nodes + 1);
    view.boundary.side_impulse = side_impulse.reserve_zeros(D * nodes);
    view.boundary.body_impulse = body_impulse.reserve_zeros(bodies * nodes + 1);
    view.contacts_of_body = contacts_of_body_.reserve_zeros(bodies * nodes + 1);
    const std::size_t divided = view.has_several_bodies() ? nodes : 1;
    view.parts = parts_.reserve_zeros(divided);
    view.gathered_end = gathered_.reserve_zeros(2 * divided);
    view.gathered = view.gathered_end + divided;
    view.inertia_sums = sums_.reserve_zeros(INERTIA_SUMS<D> * nodes + VECTOR_SUMS<D> * nodes);
    view.vector_sums = view.inertia_sums + INERTIA_SUMS<D> * nodes;
    view.mass = mass.reserve_zeros(nodes);
    view.momentum = momentum_.reserve_zeros(nodes);
    view.momentum_end = momentum_end_.reserve_zeros(nodes);
    view.damping_impulse = damping_impulse.reserve_zeros(nodes);
    view.force = force.reserve_zeros(nodes);
    view.velocity = velocity_.reserve_zeros(nodes);
    view.cell_mean = cell_mean_.reserve_zeros(view.mean_dilation ? nodes : 1);
    view.velocity_change = velocity_change_.reserve_zeros(nodes);
    if (!boundary.absorbs()) return;
    const std::vector<AbsorbingNode<D>> absorbing = boundary.absorbing(part);
    absorbers.nodes = absorbing_.upload(absorbing);
    absorbers.count = static_cast<int>(absorbing.size());
    absorbers.impulse = absorbed_impulse.reserve_zeros(D * nodes);
  }

  Absorbers<D> absorbers;

  // what is asked for after a step, laid out as BoundaryView and StepView say
  Buffer<Vec<D>> side_impulse, body_impulse, damping_impulse, force;
  Buffer<Vec<D>> absorbed_impulse;    ///< where there are absorbers
  Buffer<double> mass;

 private:
  Buffer<std::uint8_t> sides_, on_body_, closed_;
  Buffer<std::uint16_t> contact_states_, contacts_of_body_;
  Buffer<std::uint32_t> parts_;
  Buffer<AbsorbingNode<D>> absorbing_;
  Buffer<std::int64_t> sums_;
  Buffer<double> cell_mean_;
  Buffer<Vec<D>> momentum_, momentum_end_, velocity_, velocity_change_, gathered_;
};

}    // namespace mpm
