// SPDX-License-Identifier: GPL-2.0-only
// Calls of an engine with increments and stresses in the memory of its CUDA device. The device
// plans and runs them and decides which RVEs are quiescent. The host reads results on demand.

#pragma once

#include "rve/engine/engine.h"
#include "rve/engine/increment_plan.h"
#include "rve/engine/quiescence.h"

#include <vector>

namespace rve {

/// Tensors of material points in the memory of a CUDA device, stored one after the other.
struct PointsOnDevice {
  int device = -1;    ///< number of the device in CUDA; -1: none
  /// Dimension of the tensors: that of the RVEs, or 2 for RVEs of spheres in plane strain or
  /// axisymmetry.
  int dimension = 0;
  const double *increment = nullptr;    ///< deformation increments [-]
  double *stress = nullptr;             ///< [stress]
  // axisymmetry: components along the third axis of the RVEs; null in plane strain
  const double *hoop_increment = nullptr;    ///< [-]
  double *hoop_stress = nullptr;             ///< [stress]
};

/// RVE whose state of rest is known at the beginning of a new call.
template <int D> struct RestingRve {
  int index = 0;    ///< index in the call
  Rest rest = Rest::Unknown;
  QuiescentStateOf<D> quiescent;    ///< without a stiffness if the RVE moves
};

/// Value of IncrementOf::substeps for an RVE that was quiescent already when the call was new. The
/// device does not have the result of the last DEM steps of this RVE.
constexpr std::int32_t BEFORE_THE_CALL = -1;

/// Input of a call. The object must exist until the results have been delivered or the next call is
/// planned.
template <int D> struct DeviceCallOf {
  PointsOnDevice points;
  std::vector<int> rves;
  std::vector<int> point_of;    ///< index of the point of each RVE among the tensors
  PlanOptions options;
  std::vector<PlannedRve> planned;       ///< data of each RVE, read if the call is new
  std::vector<RestingRve<D>> resting;    ///< RVEs whose rest is known, read if the call is new
  bool is_new = true;    ///< RVEs, points or plans differ from those of the last call
};

/// New value of PlannedRve::limit.
struct NewLimit {
  std::int32_t index;
  StiffeningLimit limit;
};

/// Calls with increments and stresses in the memory of the engine's CUDA device. The object is also
/// the request of the last planned call. After Request::fetch() the results stay on the device, and
/// deliver() copies them to the host on demand.
template <int D> class DeviceCallsOf : public Request {
 public:
  /// Launches the kernels that plan a call on the device. They run after all work that has been
  /// launched so far.
  virtual void plan(const DeviceCallOf<D> &call) = 0;
  /// Returns the indices, in the last fetched call, of RVEs that exceeded PlannedRve::limit in that
  /// call. At most MOST_STIFFENED of them are returned.
  virtual const std::vector<int> &stiffened() const = 0;
  static constexpr int MOST_STIFFENED = 64;
  /// Delivers the results of the last call to the host. The calls of unfinished RVEs are repeated
  /// first. A quiescent RVE delivers the result of its last DEM steps and, with
  /// IncrementCallOf::take_deferred(), its deferred increment.
  virtual void deliver(IncrementCallOf<D> &call) = 0;
  /// Delivers the result of one RVE. Its call must have finished without an error.
  virtual void deliver_one(int index, IncrementCallOf<D> &call) = 0;
  virtual void set_limits(const std::vector<NewLimit> &limits) = 0;
};

}    // namespace rve
