// The largest DEM time step that an RVE of a batch is known to bear, and when it must be determined again.

#ifndef CAPI_STEP_BOUND_H
#define CAPI_STEP_BOUND_H

#include "rve/engine/engine.h"

#include <cstdint>

namespace capi {

/// Result of the last check of an RVE's time step. A default one allows no step.
class StepBound {
 public:
  /// True if a step of dt was found stable, and the contacts have not stiffened since then.
  template <int D> bool allows(double dt, const rve::ResultOf<D> &now, rve::ContactLaw law) const
  {
    return dt <= largest_dt && !has_stiffened(now, law);
  }

  /// Records that dt is stable for an RVE with this result.
  template <int D> void note(double dt, const rve::ResultOf<D> &now)
  {
    largest_dt = dt;
    most_contacts = static_cast<std::int64_t>((1.0 + CONTACT_GROWTH) * now.num_contacts +
                                              CONTACT_GROWTH_PER_GRAIN * now.num_grains);
    most_largest_overlap = OVERLAP_GROWTH * now.largest_overlap;
    most_mean_overlap = OVERLAP_GROWTH * now.mean_overlap;
  }

 private:
  // Growth of the number of contacts that requires another check: that of fix rve.
  static constexpr double CONTACT_GROWTH = 0.1, CONTACT_GROWTH_PER_GRAIN = 0.02;
  // Growth of an overlap that requires another check. The frequency of a Hertz contact is proportional to its fourth root: 4.7 %.
  static constexpr double OVERLAP_GROWTH = 1.2;

  double largest_dt = 0.0;    // [time]
  std::int64_t most_contacts = 0;
  double most_largest_overlap = 0.0, most_mean_overlap = 0.0;    // over sum of radii [-]

  /// Linear springs stiffen the network by their number alone, other contacts also by their overlaps.
  template <int D> bool has_stiffened(const rve::ResultOf<D> &now, rve::ContactLaw law) const
  {
    if (now.num_contacts > most_contacts) return true;
    return law != rve::ContactLaw::Linear &&
        (now.largest_overlap > most_largest_overlap || now.mean_overlap > most_mean_overlap);
  }
};

}    // namespace capi

#endif
