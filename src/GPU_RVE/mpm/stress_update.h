// SPDX-License-Identifier: GPL-2.0-only
// The constitutive laws of all points of a rank, and the update of their stresses in a time step.

#pragma once

#include "mpm/constitutive.h"
#include "mpm/points.h"
#include "rve/core/request.h"

#include <cstdint>
#include <vector>

namespace mpm {

/// In a step: begin_step(); then, once or twice, plan() and launch() where a device has the
/// increments or else begin(); and finish() before the stresses are used, which may be in the next
/// step.
template <int D> class StressUpdate {
 public:
  /// The laws that PointView::model refers to; a law may stand there several times. Not owned.
  void set_laws(std::vector<Constitutive<D> *> laws);
  int num_laws() const { return static_cast<int>(laws_.size()); }
  Constitutive<D> &law(int model) const { return *laws_.at(model); }
  /// Doubles that a row of MemoryRows must have.
  int memory_width() const { return memory_width_; }

  /// Lists the points of each law. `points` is used until the end of the step.
  void begin_step(const PointView<D> &points, int threads);

  /// Plans an update by increments that a device has; false if a law needs the host.
  bool plan(const DeviceArrays<D> &arrays, double dt);
  /// Launches a planned update before the host has read the plan (rve::Request::launch_early).
  void launch_early();
  /// Launches a planned update once the device has been synchronised; false: begin() is needed for
  /// some laws.
  bool launch();
  /// Begins an update over `dt` [time] by increments of the host, of laws that launch() has not
  /// launched. Returns true if finish() must wait for stresses.
  bool begin(const Tensor<D> *increment, double dt);
  /// rve::Request::needs_host() of an update on the device; null: none, or several laws.
  const std::int32_t *needs_host() const;
  /// Waits for all stresses and returns where they are; OnDevice if no update was under way.
  rve::StressesAre finish();
  /// Constitutive::synchronise_ranks() of all laws; collective.
  void synchronise_ranks();

  /// Announces that p_wave_modulus() of the laws will be called for many points.
  void expect_questions();
  /// Wall time that the law of this model has taken [seconds], 0 for the repetition of a law.
  double time(int model) const { return seconds_.at(model); }

 private:
  void list_points();
  /// Index of the only law with points; -1: none, or several.
  int only_law() const;
  /// Calls work(k) for all laws with points.
  template <class Work> void for_laws(const Work &work);
  void update_in_parts(int k, const Tensor<D> *increment, double dt);

  std::vector<Constitutive<D> *> laws_;
  std::vector<double> seconds_;
  std::vector<rve::Request *> requests_;    ///< null: none is under way
  int memory_width_ = 0;
  PointView<D> points_ = {};    ///< of this step
  int threads_ = 1;

  std::vector<std::vector<int>> points_of_;        ///< local indices by law, ascending
  std::vector<int> listed_model_, listed_body_;    ///< for which those lists were made
};

}    // namespace mpm
