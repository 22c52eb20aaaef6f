// SPDX-License-Identifier: GPL-2.0-only
// Visits the contacts of the last force evaluation, for results on demand.

#pragma once

#include "rve/algorithm/pair_force.h"

namespace rve {
inline namespace RVE_ISA {

  template <class Contact, class Numbers, int D>
  RVE_INLINE ContactSite site_of(const Contact &contact, const GrainView<Numbers, D> &i,
                                 const GrainView<Numbers, D> &j)
  {
    return {static_cast<double>(contact.overlap), static_cast<double>(i.radius),
            static_cast<double>(j.radius)};
  }

  /// Calls visit(i, j, grain_i, grain_j, contact, history) for the contacts among the owned pairs
  /// of item i and its share of the extra pairs, with the cell of `step`. A phase that calls this
  /// function for all items visits every contact once.
  template <class Config, class Visit>
  RVE_INLINE void visit_contacts(const CallState<Config> &call, const StepConstants<Config> &step,
                                 int i, Visit visit)
  {
    const SharedView<Config> &shared = call.shared;
    const int n = call.num_grains;
    const auto visit_pair = [&](int first, int second, typename Config::History history) {
      const auto one = view_grain(shared, first), other = view_grain(shared, second);
      const auto contact = pair_geometry(step, one, other);
      if (step.law.acts(contact)) visit(first, second, one, other, contact, history);
    };
    for (int k = 0; k < Config::owned_pairs; ++k) {
      const int j = call.pairs.partner[k * n + i];
      if (j != i) visit_pair(i, j, call.pairs.history[k * n + i]);
    }
    for (int m = i; m < call.num_extra; m += n)
      visit_pair(call.pairs.extra_first[m], call.pairs.extra_second[m],
                 call.pairs.extra_history[m]);
  }

}    // namespace RVE_ISA
}    // namespace rve
