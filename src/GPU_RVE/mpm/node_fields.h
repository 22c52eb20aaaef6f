// SPDX-License-Identifier: GPL-2.0-only
// List of the fields on the nodes of the grid, and the integer sums from which they are computed.
// The pointers of a StepView and the arrays of both machines follow from the list. A new field
// needs a member of NodeFields and a row in each().

#pragma once

#include "mpm/grid.h"

#include <cstdint>

namespace mpm {

/// Kinds of integer sums on nodes. All points add to them, and ranks exchange the sums of shared
/// nodes. Successive passes use VectorSums for forces, for momenta, and for the volumes and means
/// of cells.
enum SumKind { InertiaSums, VectorSums, NUM_SUM_KINDS };

/// Number of integers of a kind on a node: mass and momentum, or a vector.
template <int D> RVE_HD constexpr int width_of(SumKind kind)
{
  return kind == InertiaSums ? 1 + rve::Space<D>::axes : rve::Space<D>::axes;
}
template <int D> constexpr int SUMS_OF_NODE = width_of<D>(InertiaSums) + width_of<D>(VectorSums);

/// Destinations of a pass for the sums of each kind.
template <class Sums> struct SumsByKind {
  Sums of[NUM_SUM_KINDS];
  RVE_HD const Sums &operator[](SumKind kind) const { return of[kind]; }
};

/// Fields on the nodes of the grid. `Array<T>` holds one field of all nodes: a pointer or a buffer.
template <int D, template <class> class Array> struct NodeFields {
  Array<std::int64_t> all_sums{};     ///< sums of all kinds, one kind after the other
  Array<double> mass{};               ///< [mass]
  Array<Vec<D>> momentum{};           ///< at the start of the step [mass length/time]
  Array<Vec<D>> momentum_end{};       ///< [mass length/time]
  Array<Vec<D>> damping_impulse{};    ///< momentum added by damping [mass length/time]
  Array<Vec<D>> force{};              ///< [force]
  Array<Vec<D>> velocity{};           ///< velocity for the next motion or strains [length/time]
  Array<Vec<D>> velocity_change{};    ///< [length/time]
  Array<Vec<D>> water_flux{};         ///< volume of water per area and time [length/time]
  Array<double> cell_mean{};          ///< mean over the cell whose lowest node this is (CellMean)
  // impulses for reactions [mass length/time]; body_impulse has the opposite sign of the others
  Array<Vec<D>> side_impulse{};        ///< per axis: of the material on the side across the axis
  Array<Vec<D>> absorbed_impulse{};    ///< per axis: of the material on the dashpots of the side
  Array<Vec<D>> body_impulse{};        ///< per body: of the body on the node
  // contacts with bodies
  Array<std::uint8_t> on_body{};              ///< bit a: a body has a condition on component a
  Array<std::uint8_t> closed{};               ///< per body and column: the face is in contact
  Array<std::uint16_t> contact_states{};      ///< per turning body: two bits per contact (Touch)
  Array<std::uint16_t> contacts_of_body{};    ///< per body: contact weight, 4 bits per component
  // fields for several bodies
  Array<std::uint32_t> parts{};    ///< sum of contact weights, 8 bits per component; 0: not divided
  Array<Vec<D>> gathered_end{};    ///< impulses that are added to momentum_end later
  Array<Vec<D>> gathered{};        ///< impulses that are added to momentum later

  /// Calls visit(width, field of each set...) for all fields. `width` is the number of values per
  /// node; it depends on the options in `step` (StepView).
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
    visit(step.water.flows(), sets.water_flux...);
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
