// SPDX-License-Identifier: GPL-2.0-only
// Constitutive laws of all points of a rank, and the update of stresses in a time step.

#pragma once

#include "mpm/constitutive.h"
#include "mpm/points.h"
#include "rve/core/request.h"

#include <cstdint>
#include <vector>

namespace mpm {

/// Updates the stresses of the points of this rank by their constitutive laws. A step calls these
/// functions in this order:
///   begin_step()                 once
///   plan(), launch(), begin()    once (Musl) or twice (Usavg); launch() only if plan() returned
///                                true, begin() only if plan() or launch() returned false
///   finish()                     before stresses are used, possibly in the next step
template <int D> class StressUpdate {
 public:
  /// Sets the laws to which PointView::model refers. A law may appear several times. The laws are
  /// not owned.
  void set_laws(std::vector<Constitutive<D> *> laws);
  int num_laws() const { return static_cast<int>(laws_.size()); }
  Constitutive<D> &law(int model) const { return *laws_.at(model); }
  /// Least number of doubles in a row of MemoryRows.
  int memory_width() const { return memory_width_; }

  /// Lists the points of each law. `points` is used until the end of the step.
  void begin_step(const PointView<D> &points, int threads);

  /// Plans an update over `dt` [time] by the increments in `arrays` on a device. Returns false if
  /// there is no device or a law needs the host; begin() is then needed.
  bool plan(const DeviceArrays<D> &arrays, double dt);
  /// Launches a planned update before the host has read the plan (rve::Request::launch_early). Does
  /// nothing if points have several laws.
  void launch_early();
  /// Launches a planned update after the device has been synchronised. Returns false if some laws
  /// need begin().
  bool launch();
  /// Begins an update over `dt` [time] by increments on the host, for laws that launch() has not
  /// launched. `hoop_increment` has the hoop components in axisymmetry and is null otherwise.
  /// Returns true if finish() must wait for stresses.
  bool begin(const Tensor<D> *increment, double dt, const double *hoop_increment = nullptr);
  /// Returns rve::Request::needs_host() of the update on the device. Returns null if no update runs
  /// on a device or if points have several laws.
  const std::int32_t *needs_host() const;
  /// Waits for all stresses and returns where they are; OnDevice if no update was under way.
  rve::StressesAre finish();
  /// Constitutive::synchronise_ranks() of all laws; collective.
  void synchronise_ranks();

  /// Announces that p_wave_modulus() of the laws will be called for many points.
  void expect_questions();
  /// Total wall time of the law of a model [seconds], or 0 if an earlier model has the same law.
  double time(int model) const { return seconds_.at(model); }

 private:
  void list_points();
  /// Returns the index of the only law with points, or -1 if there is none or there are several.
  int only_law() const;
  /// Calls work(k) for all laws with points.
  template <class Work> void for_laws(const Work &work);
  /// Hoop components on the host with these increments.
  HoopArrays hoop_with(const double *increment) const;
  void update_in_parts(int k, const Tensor<D> *increment, double dt);

  std::vector<Constitutive<D> *> laws_;
  std::vector<double> seconds_;
  std::vector<rve::Request *> requests_;    ///< pending requests or null, per law
  int memory_width_ = 0;
  PointView<D> points_ = {};    ///< points of this step
  int threads_ = 1;

  std::vector<std::vector<int>> points_of_;        ///< local indices by law, ascending
  std::vector<int> listed_model_, listed_body_;    ///< data for which the lists were made
};

}    // namespace mpm
