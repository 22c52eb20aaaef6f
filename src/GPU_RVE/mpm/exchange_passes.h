// SPDX-License-Identifier: GPL-2.0-only
// Pass that copies the sums of the nodes that ranks share to and from an exchange buffer.

#pragma once

#include "mpm/step_view.h"

namespace mpm {

/// Copies the sums of a list of nodes to a buffer, node after node, or adds them from the buffer.
/// The additions are atomic, since a node can be listed for several ranks. The stage is 0 because
/// all ranks must run the pass, even if one of them has found an error.
template <int D> struct MoveSums : Pass<D> {
  using Pass<D>::step;
  static constexpr int STAGE = 0;
  const int *nodes;
  int count;
  bool takes[NUM_SUM_KINDS];
  std::int64_t *buffer;
  bool packs;

  int items() const { return count; }
  /// Number of integers of a node in the buffer.
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
