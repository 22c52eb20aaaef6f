// SPDX-License-Identifier: GPL-2.0-only
// The points behind RVEs, by slot, in two parts: all of a point, and its cached, what every macro step asks of it and tells it. Thousands of whole
// points are more than caches hold, and fronts are not.
//
// What DEM steps answer is written into fronts alone. A point hears of it when somebody looks at it.

#pragma once

#include "macro/contact_response.h"
#include "rve/engine/engine.h"
#include "rve/engine/sleep.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <iterator>
#include <vector>

namespace macro {

/// Of a slot: what its RVE did in the last macro step.
enum class PointState : char {
  Empty,    ///< there is no RVE
  Awake,    ///< made DEM steps
  /// Was skipped: `result` is that of the affine RVE, `rested` that of its last DEM step.
  Asleep,
  Frozen    ///< failed once and is not advanced any more
};

/// What a point has not heard of, of which its cached is ahead.
enum class PointUpdate : char {
  Drive,        ///< drove the last DEM steps
  Increment,    ///< did: CachedPoint::increment
  Deferral      ///< it sleeps on
};

template <int D> bool is_identity(const rve::Tensor<double, D> &f)
{
  const auto one = rve::Tensor<double, D>::identity();
  return std::equal(std::begin(f.component), std::end(f.component), one.component);
}

template <int D> struct CachedPoint {
  PointState state = PointState::Empty;
  bool is_valid = false;                      ///< it says what the point says
  bool is_dirty = false;                      ///< the point has not heard of the last answer
  bool has_deferred = false;                  ///< a deformation is pending
  PointUpdate update = PointUpdate::Drive;    ///< while ahead
  std::int32_t substeps = 0;                  ///< of the last DEM steps; 0: none so far
  rve::StiffeningLimit limit;                 ///< beyond which the time-step bound is checked again
  rve::ResponseOf<D> response;                ///< of the last advance
  double pressure = 0.0;                      ///< mean stress of the last DEM steps [stress]
  ContactResponse<D> of_contacts;             ///< of its material and grains
  rve::IncrementOf<D> increment;

  rve::StiffnessMeasures stiffness() const
  {
    return {response.num_contacts, response.peak_force, pressure};
  }
};

/// That any thread may set.
class SharedFlag {
 public:
  explicit SharedFlag(bool value) : is_set_(value) {}
  SharedFlag(SharedFlag &&other) noexcept : is_set_(other.is_set()) {}

  bool is_set() const { return is_set_.load(std::memory_order_relaxed); }
  /// Threads that find it as it shall be do not take it from each other's caches.
  void set(bool value)
  {
    if (is_set() != value) is_set_.store(value, std::memory_order_relaxed);
  }

 private:
  std::atomic<bool> is_set_;
};

/// Different slots may be asked for by different threads. A reference to a point that may change is kept no longer than until fronts are asked
/// for.
template <int D, class Point> class PointTable {
 public:
  using Cached = CachedPoint<D>;

  int size() const { return static_cast<int>(points_.size()); }
  /// Keeps those that are there.
  void grow_to(int size)
  {
    if (size <= this->size()) return;
    points_.resize(size);
    cached_.resize(size);
    drives_.resize(size);
    quiescences_.resize(size);
  }

  /// To be changed.
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

  /// Whether the last thing that happened to it is that it sleeps, as sleep() has it.
  bool was_deferred(int slot) const
  {
    return cached_[slot].is_dirty && cached_[slot].update == PointUpdate::Deferral;
  }
  /// Whether it has not heard of the last answer, or sleep.
  bool is_dirty(int slot) const { return cached_[slot].is_dirty; }
  /// Of one that has not heard of its last answer nothing is known: a look would have told it.
  rve::Rest rest(int slot) const
  {
    if (!cached_[slot].is_dirty) return points_[slot].rest();
    return was_deferred(slot) ? rve::Rest::Sleeps : rve::Rest::Unknown;
  }
  /// Of one that sleeps, or has been looked at and shall.
  const rve::SleepOf<D> &quiescence(int slot)
  {
    if (!was_deferred(slot)) {
      synchronise(slot);
      quiescences_[slot] = points_[slot].quiescence();
    }
    return quiescences_[slot];
  }
  /// Deformation since its last DEM step.
  const rve::Tensor<double, D> &pending(int slot) const
  {
    return was_deferred(slot) ? quiescences_[slot].pending : at(slot).pending;
  }
  /// It sleeps on with this deformation, behind sleep().
  void defer(int slot, const rve::Tensor<double, D> &pending, const rve::Tensor<double, D> &stress)
  {
    Cached &cached = cached_[slot];
    cached.state = PointState::Asleep;
    cached.has_deferred = true;
    cached.is_dirty = true;
    cached.update = PointUpdate::Deferral;
    cached.response.stress = stress;
    quiescences_[slot].pending = pending;
  }

  /// For what no cached has of the last answer.
  Point &synchronised(int slot)
  {
    synchronise(slot);
    return points_[slot];
  }

  const Cached &cached(int slot) const
  {
    Cached &cached = cached_[slot];
    if (!cached.is_valid) cached = points_[slot].cached_copy();
    return cached;
  }
  /// Sets the limit beyond which the time-step bound is checked again. Results do not change it.
  void set_limit(int slot, const rve::StiffeningLimit &limit)
  {
    points_[slot].limit = limit;
    if (cached_[slot].is_valid) cached_[slot].limit = limit;
  }

  /// For what no answer changes.
  const Point &unsynchronised(int slot) const { return points_[slot]; }
  /// To change what neither answers nor fronts have.
  Point &unsynchronised(int slot) { return points_[slot]; }
  /// Whether its result is not whole.
  bool is_stale(int slot) const
  {
    return (cached_[slot].is_dirty && !was_deferred(slot)) || points_[slot].stale;
  }
  /// Whether there may be one like that, since this was denied.
  bool any_stale() const { return any_stale_.is_set(); }
  void clear_any_stale() const { any_stale_.set(false); }
  /// Whether more may have changed than answers say, since this was denied.
  bool is_changed() const { return is_changed_.is_set(); }
  void clear_changed() { is_changed_.set(false); }

  /// After a sound answer to this drive.
  void store(int slot, const rve::ResponseOf<D> &response, const rve::DriveOf<D> &drive)
  {
    Cached &cached = cached_[slot];
    if (!cached.is_valid || drive.substeps == 0) {
      modify(slot).store(response, drive);
      return;
    }
    any_stale_.set(true);
    store_response(cached, response, drive.substeps);
    cached.update = PointUpdate::Drive;
    drives_[slot] = drive;
  }
  void store(int slot, const rve::ResponseOf<D> &response, const rve::IncrementOf<D> &increment)
  {
    Cached &cached = cached_[slot];
    if (!cached.is_valid || increment.substeps == 0) {
      modify(slot).store(response, increment.drive());
      return;
    }
    any_stale_.set(true);
    store_response(cached, response, increment.substeps);
    cached.update = PointUpdate::Increment;
    cached.increment = increment;
  }

 private:
  mutable std::vector<Point> points_;
  mutable std::vector<Cached> cached_;
  /// While fronts are ahead: of the last DEM steps, unless they were by an increment.
  mutable std::vector<rve::DriveOf<D>> drives_;
  std::vector<rve::SleepOf<D>> quiescences_;    ///< of those that sleep

  mutable SharedFlag any_stale_{true};
  SharedFlag is_changed_{true};

  static void store_response(Cached &cached, const rve::ResponseOf<D> &response,
                             std::int32_t substeps)
  {
    cached.state = PointState::Awake;
    cached.has_deferred = false;
    cached.is_dirty = true;
    cached.substeps = substeps;
    cached.response = response;
    cached.pressure = rve::mean_stress(response.stress);
  }

  void synchronise(int slot) const
  {
    Cached &cached = cached_[slot];
    if (!cached.is_dirty) return;
    cached.is_dirty = false;
    if (cached.update == PointUpdate::Deferral)
      points_[slot].defer(quiescences_[slot]);
    else
      points_[slot].store(cached.response,
                          cached.update == PointUpdate::Increment ? cached.increment.drive()
                                                                  : drives_[slot]);
  }
};

}    // namespace macro
