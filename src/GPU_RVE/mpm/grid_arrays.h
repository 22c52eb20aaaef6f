// SPDX-License-Identifier: GPL-2.0-only
// Arrays of the node fields of a machine, in host or device memory. A StepView points to them.

#pragma once

#include "mpm/boundary.h"
#include "mpm/step_view.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mpm {

/// Node fields of a machine. `Buffer<T>` has upload(std::vector<T>) and reserve_zeros(count), which
/// return pointers for the passes.
template <int D, template <class> class Buffer> class GridArrays {
 public:
  /// Allocates the fields for a part of the grid and the bodies of a view, and sets the pointers of
  /// the view. Former values are not kept.
  void wire(StepView<D> &view, const Grid<D> &part, const Boundary<D> &boundary)
  {
    view.grid = part;
    const std::size_t nodes = part.node_count();
    NodeFields<D, Buffer>::each(
        view,
        [&](std::size_t per_node, auto &pointer, auto &buffer) {
          pointer = buffer.reserve_zeros(per_node * nodes + 1);    // no field is empty
        },
        view, fields_);
    std::int64_t *sums = view.all_sums;
    for (const SumKind kind : {InertiaSums, VectorSums}) {
      view.sums[kind] = sums;
      sums += width_of<D>(kind) * nodes;
    }
    view.sides = sides_.upload(boundary.sides(part));
    const std::vector<AbsorbingNode<D>> absorbing = boundary.absorbing(part);
    view.absorbing = absorbing_.upload(absorbing);
    view.num_absorbing = static_cast<int>(absorbing.size());
  }

 private:
  NodeFields<D, Buffer> fields_;
  Buffer<std::uint8_t> sides_;
  Buffer<AbsorbingNode<D>> absorbing_;
};

}    // namespace mpm
