// SPDX-License-Identifier: GPL-2.0-only
// A pass over the nodes that ranks share: their sums to and from a buffer.

#pragma once

#include "mpm/step_view.h"

namespace mpm {

/// Sums of the nodes of a list, one node after the other in the buffer. From there they are added,
/// since a node may be in the list for several ranks. The ranks do this together, whatever one of them
/// has found.
template <int D> struct MoveSums : Pass<D> {
  using Pass<D>::step;
  static constexpr int STAGE = 0;
  const int *nodes;
  int count;
  bool takes[NUM_SUM_KINDS];
  std::int64_t *buffer;
  bool packs;

  int items() const { return count; }
  /// Integers of a node.
  RVE_HD int width() const
  {
    int sum = 0;
    RVE_UNROLL
    for (int kind = 0; kind < NUM_SUM_KINDS; ++kind)
      if (takes[kind]) sum += width_of<D>(static_cast<SumKind>(kind));
    return sum;
  }
  template <class Tally> RVE_HD void operator()(int k, Tally &tally) const
  {
    std::int64_t *place = buffer + static_cast<std::size_t>(k) * width();
    const auto n = static_cast<std::size_t>(nodes[k]);
    RVE_UNROLL
    for (int kind = 0; kind < NUM_SUM_KINDS; ++kind) {
      const int of_kind = width_of<D>(static_cast<SumKind>(kind));
      for (int c = 0; takes[kind] && c < of_kind; ++c, ++place) {
        std::int64_t *sum = step.sums[kind] + of_kind * n + c;
        if (packs)
          *place = *sum;
        else
          tally.add(sum, *place);
      }
    }
  }
};

}    // namespace mpm
