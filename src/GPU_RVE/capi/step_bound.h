// SPDX-License-Identifier: GPL-2.0-only
// The largest DEM time step that an RVE of a batch is known to bear, and when it must be determined
// again.

#pragma once

#include "rve/engine/engine.h"
#include "rve/engine/stiffening.h"

namespace capi {

/// Result of the last check of an RVE's time step. A default one allows no step.
class StepBound {
 public:
  /// True if a step of dt was found stable, and the RVE has not stiffened since then.
  template <int D> bool allows(double dt, const rve::ResultOf<D> &now) const
  {
    return dt <= largest_dt_ && !limit_.is_exceeded(measures(now));
  }

  /// Records that dt is stable for an RVE with this result.
  template <int D> void note(double dt, const rve::ResultOf<D> &now, bool has_constant_moduli)
  {
    largest_dt_ = dt;
    limit_ = rve::stiffening_limit(measures(now), now.num_grains, has_constant_moduli);
  }

 private:
  double largest_dt_ = 0.0;    ///< [time]
  rve::StiffeningLimit limit_;

  template <int D> static rve::StiffnessMeasures measures(const rve::ResultOf<D> &now)
  {
    return {now.num_contacts, now.peak_force, now.mean_stress()};
  }
};

}    // namespace capi
