// SPDX-License-Identifier: GPL-2.0-only
// Table of the points that carry RVEs, with a write-back cache. Each slot has a point with all
// data, and a small cached copy of the data that every macro step reads and writes. Thousands of
// points do not fit into the caches of a CPU, but their cached copies do.
//
// Macro steps write their results into the cached copy only, which is then dirty. Access to the
// point synchronises it first.

#pragma once

#include "macro/contact_response.h"
#include "rve/engine/engine.h"
#include "rve/engine/quiescence.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <iterator>
#include <vector>

namespace macro {

/// State of a slot after the last macro step.
enum class PointState : char {
  Empty,    ///< the slot has no RVE
  Awake,    ///< the RVE made DEM steps
  /// The RVE was skipped. PointOf::result follows from its affine deformation; PointOf::rested is
  /// the result of its last DEM step.
  Quiescent,
  Frozen    ///< the RVE failed once and is not advanced any more
};

/// Update that a dirty cached copy has and the point lacks.
enum class PointUpdate : char {
  Drive,        ///< response to a drive (PointTable::drives_)
  Increment,    ///< response to an increment (CachedPoint::increment)
  Deferral      ///< deferred increment
};

template <int D> bool is_identity(const rve::Tensor<double, D> &f)
{
  const auto one = rve::Tensor<double, D>::identity();
  return std::equal(std::begin(f.component), std::end(f.component), one.component);
}

/// Cached copy of those data of a point that macro steps read and write.
template <int D> struct CachedPoint {
  PointState state = PointState::Empty;
  bool is_valid = false;        ///< false: the copy must be made again from the point
  bool is_dirty = false;        ///< true: the point lacks `update`
  bool has_deferred = false;    ///< a deformation is pending
  PointUpdate update = PointUpdate::Drive;
  std::int32_t substeps = 0;         ///< DEM steps of the last advance; 0: none so far
  rve::StiffeningLimit limit;        ///< the time-step bound is checked again beyond it
  rve::ResponseOf<D> response;       ///< response to the last advance
  double pressure = 0.0;             ///< mean stress after the last DEM steps [stress]
  ContactResponse<D> of_contacts;    ///< stiffness of the contacts of the mean grain
  rve::IncrementOf<D> increment;     ///< last increment, if `update` is Increment

  rve::StiffnessMeasures stiffness() const
  {
    return {response.num_contacts, response.peak_force, pressure};
  }
};

/// Flag that several threads may set.
class SharedFlag {
 public:
  explicit SharedFlag(bool value) : is_set_(value) {}
  SharedFlag(SharedFlag &&other) noexcept : is_set_(other.is_set()) {}

  bool is_set() const { return is_set_.load(std::memory_order_relaxed); }
  /// Writes only if the value changes, so that the cache line stays shared between cores.
  void set(bool value)
  {
    if (is_set() != value) is_set_.store(value, std::memory_order_relaxed);
  }

 private:
  std::atomic<bool> is_set_;
};

/// Points with their cached copies, by slot. Several threads may access different slots. Do not use
/// a reference from modify() after the next call of cached() for the same slot.
template <int D, class Point> class PointTable {
 public:
  using Cached = CachedPoint<D>;

  int size() const { return static_cast<int>(points_.size()); }
  /// Adds empty slots until there are `size`.
  void grow_to(int size)
  {
    if (size <= this->size()) return;
    points_.resize(size);
    cached_.resize(size);
    drives_.resize(size);
    quiescences_.resize(size);
  }

  /// Synchronises the point, invalidates its cached copy and sets is_changed().
  Point &modify(int slot)
  {
    any_stale_.set(true);
    is_changed_.set(true);
    synchronise(slot);
    cached_[slot].is_valid = false;
    return points_[slot];
  }
  const Point &at(int slot) const
  {
    synchronise(slot);
    return points_[slot];
  }
  /// Synchronised point, for changes of members that the cached copy does not have.
  Point &synchronised(int slot)
  {
    synchronise(slot);
    return points_[slot];
  }
  /// Point without synchronisation, for reading members that no update changes.
  const Point &unsynchronised(int slot) const { return points_[slot]; }
  /// Point without synchronisation, for changes of members that are neither in an update nor in the
  /// cached copy.
  Point &unsynchronised(int slot) { return points_[slot]; }

  const Cached &cached(int slot) const
  {
    Cached &copy = cached_[slot];
    if (!copy.is_valid) copy = points_[slot].cached_copy();
    return copy;
  }
  /// Sets the limit beyond which the time-step bound is checked again. store() does not change this
  /// limit.
  void set_limit(int slot, const rve::StiffeningLimit &limit)
  {
    points_[slot].limit = limit;
    if (cached_[slot].is_valid) cached_[slot].limit = limit;
  }

  /// True if the cached copy has an update that the point lacks.
  bool is_dirty(int slot) const { return cached_[slot].is_dirty; }
  /// True if the cached copy has a deferred increment that the point lacks.
  bool was_deferred(int slot) const
  {
    return is_dirty(slot) && cached_[slot].update == PointUpdate::Deferral;
  }
  /// State of rest of the RVE. It is Unknown after DEM steps without a diagnostic evaluation. An
  /// evaluation synchronises the point.
  rve::Rest rest(int slot) const
  {
    if (!is_dirty(slot)) return points_[slot].rest();
    return was_deferred(slot) ? rve::Rest::Quiescent : rve::Rest::Unknown;
  }
  /// Data from which the stress follows while the RVE is quiescent. Precondition: the RVE is
  /// quiescent, or has been evaluated and may become quiescent.
  const rve::QuiescentStateOf<D> &quiescence(int slot)
  {
    if (!was_deferred(slot)) {
      synchronise(slot);
      quiescences_[slot] = points_[slot].quiescence();
    }
    return quiescences_[slot];
  }
  /// Deformation since the last DEM step.
  const rve::Tensor<double, D> &pending(int slot) const
  {
    return was_deferred(slot) ? quiescences_[slot].pending : at(slot).pending;
  }
  /// Defers an increment. `pending` is the deformation since the last DEM step, and `stress` is the
  /// stress after this deformation. Precondition: quiescence() has been called.
  void defer(int slot, const rve::Tensor<double, D> &pending, const rve::Tensor<double, D> &stress)
  {
    Cached &copy = cached_[slot];
    copy.state = PointState::Quiescent;
    copy.has_deferred = true;
    copy.is_dirty = true;
    copy.update = PointUpdate::Deferral;
    copy.response.stress = stress;
    quiescences_[slot].pending = pending;
  }

  /// True if the result of the point is incomplete.
  bool is_stale(int slot) const
  {
    return (is_dirty(slot) && !was_deferred(slot)) || points_[slot].stale;
  }
  /// False only if no point has become stale since clear_any_stale().
  bool any_stale() const { return any_stale_.is_set(); }
  void clear_any_stale() const { any_stale_.set(false); }
  /// True if a point was modified since clear_changed().
  bool is_changed() const { return is_changed_.is_set(); }
  void clear_changed() { is_changed_.set(false); }

  /// Stores the response of an RVE that has not failed.
  void store(int slot, const rve::ResponseOf<D> &response, const rve::DriveOf<D> &drive)
  {
    if (!cached_[slot].is_valid || drive.substeps == 0) {
      modify(slot).store(response, drive);
      return;
    }
    store_in_cache(slot, response, drive.substeps, PointUpdate::Drive);
    drives_[slot] = drive;
  }
  void store(int slot, const rve::ResponseOf<D> &response, const rve::IncrementOf<D> &increment)
  {
    if (!cached_[slot].is_valid || increment.substeps == 0) {
      modify(slot).store(response, increment.drive());
      return;
    }
    store_in_cache(slot, response, increment.substeps, PointUpdate::Increment);
    cached_[slot].increment = increment;
  }

 private:
  mutable std::vector<Point> points_;
  mutable std::vector<Cached> cached_;
  std::vector<rve::DriveOf<D>> drives_;    ///< last drives, where the update is a Drive
  std::vector<rve::QuiescentStateOf<D>> quiescences_;    ///< data of quiescent RVEs, by slot

  mutable SharedFlag any_stale_{true};
  SharedFlag is_changed_{true};

  void store_in_cache(int slot, const rve::ResponseOf<D> &response, std::int32_t substeps,
                      PointUpdate update)
  {
    any_stale_.set(true);
    Cached &copy = cached_[slot];
    copy.state = PointState::Awake;
    copy.has_deferred = false;
    copy.is_dirty = true;
    copy.update = update;
    copy.substeps = substeps;
    copy.response = response;
    copy.pressure = rve::mean_stress(response.stress);
  }

  /// Writes the update of a dirty cached copy into the point.
  void synchronise(int slot) const
  {
    Cached &copy = cached_[slot];
    if (!copy.is_dirty) return;
    copy.is_dirty = false;
    Point &point = points_[slot];
    if (copy.update == PointUpdate::Deferral)
      point.defer(quiescences_[slot]);
    else
      point.store(copy.response,
                  copy.update == PointUpdate::Increment ? copy.increment.drive() : drives_[slot]);
  }
};

}    // namespace macro
