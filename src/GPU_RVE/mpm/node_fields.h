// SPDX-License-Identifier: GPL-2.0-only
// The fields on the nodes of the grid, in one list, and the integer sums of which they are made. The
// pointers of a StepView and the arrays of both machines follow from it. A new field is a member of
// NodeFields and its row in each().

#pragma once

#include "mpm/grid.h"

#include <cstdint>

namespace mpm {

/// Integer sums on the nodes, to which all points add. Ranks exchange the sums of nodes that they
/// share. VectorSums serve one pass after the other: forces, momenta, volume and mean of a cell.
enum SumKind { InertiaSums, VectorSums, NUM_SUM_KINDS };

/// Integers of a kind on a node: mass and momentum, or a vector.
template <int D> RVE_HD constexpr int width_of(SumKind kind)
{
  return kind == InertiaSums ? 1 + rve::Space<D>::axes : rve::Space<D>::axes;
}
template <int D> constexpr int SUMS_OF_NODE = width_of<D>(InertiaSums) + width_of<D>(VectorSums);

/// Where a pass adds to the sums of each kind.
template <class Sums> struct SumsByKind {
  Sums of[NUM_SUM_KINDS];
  RVE_HD const Sums &operator[](SumKind kind) const { return of[kind]; }
};

/// `Array<T>` holds a field of all nodes: a pointer or a buffer.
template <int D, template <class> class Array> struct NodeFields {
  Array<std::int64_t> all_sums{};     ///< of each kind, one kind after the other
  Array<double> mass{};               ///< [mass]
  Array<Vec<D>> momentum{};           ///< at the start of the step [mass length/time]
  Array<Vec<D>> momentum_end{};       ///< [mass length/time]
  Array<Vec<D>> damping_impulse{};    ///< what damping added [mass length/time]
  Array<Vec<D>> force{};              ///< [force]
  Array<Vec<D>> velocity{};           ///< that the points see next [length/time]
  Array<Vec<D>> velocity_change{};    ///< [length/time]
  Array<double> cell_mean{};          ///< of the cell above the node, with mean dilation
  // impulses that the material gave, for the reactions [mass length/time]
  Array<Vec<D>> side_impulse{};        ///< per axis: to the side across that axis
  Array<Vec<D>> absorbed_impulse{};    ///< per axis: to the dashpots of that side
  Array<Vec<D>> body_impulse{};        ///< per body
  // contacts with bodies
  Array<std::uint8_t> on_body{};            ///< bit a: a body has a condition on component a
  Array<std::uint8_t> closed{};             ///< per body and column: the face is in contact
  Array<std::uint16_t> contact_states{};    ///< per body that can turn: two bits a contact (Touch)
  Array<std::uint16_t>
      contacts_of_body{};    ///< per body: weight of its contacts, four bits a component
  // where there are several bodies
  Array<std::uint32_t>
      parts{};    ///< weights of contacts that divide it, eight bits a component; 0: none
  Array<Vec<D>> gathered_end{};    ///< impulses that are added to momentum_end later
  Array<Vec<D>> gathered{};        ///< the same for momentum

  /// visit(values per node, the field in each set...) for all fields of a step (StepView).
  template <class Step, class Visit, class... Sets>
  static void each(const Step &step, const Visit &visit, Sets &...sets)
  {
    const int several = step.has_several_bodies();
    visit(SUMS_OF_NODE<D>, sets.all_sums...);
    visit(1, sets.mass...);
    visit(1, sets.momentum...);
    visit(1, sets.momentum_end...);
    visit(1, sets.damping_impulse...);
    visit(1, sets.force...);
    visit(1, sets.velocity...);
    visit(1, sets.velocity_change...);
    visit(step.mean_dilation, sets.cell_mean...);
    visit(D, sets.side_impulse...);
    visit(step.absorbs ? D : 0, sets.absorbed_impulse...);
    visit(step.num_bodies, sets.body_impulse...);
    visit(1, sets.on_body...);
    visit(step.num_bodies, sets.closed...);
    visit(step.num_rigid, sets.contact_states...);
    visit(step.num_bodies, sets.contacts_of_body...);
    visit(several, sets.parts...);
    visit(several, sets.gathered_end...);
    visit(several, sets.gathered...);
  }
};

}    // namespace mpm
