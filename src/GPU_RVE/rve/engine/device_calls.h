// SPDX-License-Identifier: GPL-2.0-only
// Calls of an engine whose increments and stresses lie in the memory of its CUDA device: planned, made and answered there. What the host does not ask
// for it need not hear. RVEs that rest fall asleep there, sleep and wake.

#pragma once

#include "rve/engine/engine.h"
#include "rve/engine/increment_plan.h"
#include "rve/engine/sleep.h"

#include <vector>

namespace rve {

/// Tensors of points in the memory of a CUDA device, one after the other.
struct PointsOnDevice {
  int device = -1;    ///< as CUDA counts; -1: there are none
  /// Of the tensors: that of the RVEs, or 2 over spheres, which are in plane strain then.
  int dimension = 0;
  const double *increment = nullptr;    ///< deformation increments [-]
  double *stress = nullptr;             ///< [stress]
};

/// Of an RVE that has been looked at or sleeps, when a call is new.
template <int D> struct RestingRve {
  int place = 0;    ///< in the call
  Rest rest = Rest::Unknown;
  SleepOf<D> sleep;    ///< no stiffness where it moves
};

/// IncrementOf::substeps of one that has slept since before the call was new: what it answered then is not known here.
constexpr std::int32_t BEFORE_THE_CALL = -1;

/// What one call shall do. It lives until the call has been heard, or another one has begun.
template <int D> struct DeviceCallOf {
  PointsOnDevice points;
  std::vector<int> rves;
  std::vector<int> point_of;    ///< of each of them, among the tensors
  PlanOptions options;
  std::vector<PlannedRve> planned;       ///< of each of them; as it was when the call was new
  std::vector<RestingRve<D>> resting;    ///< the same; the others have not been looked at
  bool is_new = true;                    ///< RVEs, points or plans are not those of the call before
};

/// A new PlannedRve::limit.
struct NewLimit {
  std::int32_t place;
  StiffeningLimit limit;
};

template <int D> class DeviceCallsOf {
 public:
  virtual ~DeviceCallsOf() = default;

  /// Has the device plan a call behind all that it has been told before.
  virtual void plan(const DeviceCallOf<D> &call) = 0;
  /// Begins the call before anybody has looked at the plan, where it is expected to find nothing but RVEs that make steps. No RVE moves or turns if
  /// it refuses one, or if one sleeps or is looked at: then it has not begun. Returns whether it has; if the plan is as expected, begin() has
  /// nothing to do.
  virtual bool begin_ahead() = 0;
  /// When the device has planned: whether all RVEs can go so.
  virtual bool take_plan() = 0;
  /// Begins the call. The stresses are where those of the points are, in the order of what the device is told.
  virtual void begin() = 0;
  /// Waits for the call. Whether all RVEs have answered, so that nobody must hear of it. `stiffened` are the places of those that exceed the
  /// limits of their plans, or MOST_STIFFENED of them.
  virtual bool end(std::vector<int> &stiffened) = 0;
  static constexpr int MOST_STIFFENED = 64;
  /// In the memory of the device: above zero when the call has ended there and RVEs have not finished, which end() has to see to. What is told the
  /// device behind the call can ask for it.
  virtual const std::int32_t *unfinished_there() const = 0;
  /// Whether it was so in the last call that has ended.
  virtual bool were_unfinished() const = 0;
  /// The answers of the call that has ended last, as EngineOf::end_advance() gives them; some RVEs may repeat it before. Of one that sleeps it is
  /// the answer to its last DEM steps, and IncrementCallOf::take_sleep() says what is pending since.
  virtual void hear(IncrementCallOf<D> &call) = 0;
  /// The sound answer at one place alone.
  virtual void hear_of(int place, IncrementCallOf<D> &call) = 0;
  virtual void set_limits(const std::vector<NewLimit> &limits) = 0;
};

}    // namespace rve
