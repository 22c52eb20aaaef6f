// SPDX-License-Identifier: GPL-2.0-only
// The machine that runs the passes of a time step, and its implementation by CPU threads.
//
// A time step is a sequence of passes (step_sequence.h). A pass defines the work for one point,
// node, column of nodes or load (*_passes.h, *_contact.h). Passes run on CPU threads (HostMachine)
// or on a CUDA device (CudaMachine in cuda_machine.cu). A machine owns the arrays of its part of
// the grid. Every machine has the public members of HostMachine, and their comments define the
// interface. Passes report findings: maxima, and the lowest PointErrorKey of the points with
// errors.
//
// All machines give the same bits because of these rules:
//   1. a pass changes only data of its item;
//   2. results that combine several items do not depend on their order: integer sums, maxima, and
//      the lowest key of points with errors;
//   3. passes take effect in the order of the calls.

#pragma once

#include "mpm/exchange_passes.h"
#include "mpm/grid_arrays.h"
#include "mpm/rank_devices.h"
#include "mpm/shared_nodes.h"
#include "mpm/solver_options.h"
#include "mpm/step_runner.h"
#include "rve/core/threads.h"

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

namespace mpm {

/// Sums of one thread on a range of nodes. Additions need no lock.
struct PartialSums {
  std::int64_t *first;
  std::size_t offset;    ///< index of the first sum among the sums of all nodes
};

inline void add_to(PartialSums sums, std::size_t k, std::int64_t part)
{
  sums.first[k - sums.offset] += part;
}

/// An array of the grid in host memory.
template <class T> class HostArray {
 public:
  T *upload(const std::vector<T> &values)
  {
    values_ = values;
    return values_.data();
  }
  /// Returns `count` zeros. The memory of the former array is freed, also if it is larger.
  T *reserve_zeros(std::size_t count)
  {
    std::vector<T>().swap(values_);
    values_.resize(count);
    return values_.data();
  }

 private:
  std::vector<T> values_;
};

/// Machine that runs passes on CPU threads. It works on the caller's arrays of points.
template <int D> class HostMachine {
 public:
  HostMachine(const SolverOptions<D> &options, const Grid<D> &grid,
              const Communication &communication) :
      threads_(rve::usable_threads(options.threads)),
      view_(grid.part({}), options, communication.ranks > 1), tallies_(threads_), partial_(threads_)
  {
  }

  /// Chooses how ranks exchange sums. Collective; called after all ranks have made their machines.
  void join_ranks(const Communication &communication)
  {
    // collective: ranks with devices call it, too
    each_rank_has_its_device(communication, DeviceName{});
  }

  /// Begins a step.
  void begin(const StepInput<D> &input)
  {
    const int count = input.points.count;
    support_.resize(count);
    increment_.resize(count);
    if (view_.is_axisymmetric()) {
      hoop_increment_.resize(count);
      hoop_weights_.resize(count);
    }
    view_.dt = input.dt;
    view_.points = input.points;
    view_.num_models = input.num_models;
    view_.num_loads = input.num_loads;
    view_.loads = input.loads.data();
    view_.num_point_loads = static_cast<int>(input.loads.size());
    view_.body_velocity = input.body_velocity.data();
    view_.body_velocity_before = input.body_velocity_before.data();
    view_.rigid = input.rigid.data();
    if (view_.has_boxes()) box_.resize(input.points.count);
    view_.box = box_.data();
    view_.support = support_.data();
    view_.increment = increment_.data();
    if (view_.is_axisymmetric()) {
      view_.hoop_increment = hoop_increment_.data();
      view_.hoop_weights = hoop_weights_.data();
    }
    maxima_.assign(view_.body_maximum(0), 0.0);
    maxima_.resize(view_.num_maxima(), -std::numeric_limits<double>::infinity());
    view_.maximum = maxima_.data();
    first_error_ = PointErrorKey::NO_ERROR;
  }

  /// Data of the passes.
  const StepView<D> &view() const { return view_; }
  /// Points on the host, with all changes by the machine.
  const PointView<D> &host_points() const { return view_.points; }

  /// Sets the nodes that this rank holds in this step and those that it shares with other ranks.
  void set_part(const SharedNodes<D> &shared, const Boundary<D> &boundary)
  {
    if (shared.part_edition() != part_edition_) grid_arrays_.wire(view_, shared.part(), boundary);
    part_edition_ = shared.part_edition();
    view_.point_total = shared.point_total();
    view_.touched = shared.touched();
    view_.lower_touched = shared.lower_touched();
    view_.num_lower = shared.num_lower();
    shared_ = &shared;
  }

  /// Sets whether nodes are divided among contacts of several bodies.
  void divide_nodes(bool divides) { view_.divides_nodes = divides; }

  /// True if findings are complete when a pass returns. Otherwise wait_for_findings() completes
  /// them.
  static constexpr bool is_synchronous() { return true; }
  /// Starts all passes on the device that have not been started.
  void submit() {}
  /// Waits until all passes have finished.
  void wait() {}
  /// Makes later passes conditional: they change nothing if the flag, in device memory, is above
  /// zero when they run. Null removes the condition. Asynchronous machines only.
  void halt_if(const std::int32_t *) {}
  /// Requests a copy of findings and rigid bodies. Other work may be submitted to the device before
  /// wait_for_findings().
  void request_findings() {}
  /// Waits until findings, increments and rigid bodies are available to the host.
  void wait_for_findings() {}
  /// Copies positions and velocities to the host after wait_for_findings(). Other work of the
  /// device continues.
  void download_motion() {}
  /// Arrays for laws that run on the device, if there is one.
  static DeviceArrays<D> device_arrays() { return {}; }
  /// Announces that laws have begun to write stresses on the device.
  void expect_device_stresses() {}
  /// ΔF of the points for laws that run on the host.
  const Tensor<D> *increments() const { return increment_.data(); }
  /// Hoop components of ΔF for laws that run on the host; null without axisymmetry.
  const double *hoop_increments() const { return view_.hoop_increment; }
  /// Announces that laws have changed the stresses on the host.
  void stresses_changed() {}
  /// Lowest PointErrorKey that passes have found, or NO_ERROR.
  std::uint64_t first_error() const { return first_error_; }
  /// Maxima that passes have found, indexed by Maximum.
  const double *maxima() const { return maxima_.data(); }
  /// Replaces `count` maxima from index `first` on by the maxima over all ranks. Collective.
  void share_maxima(const Communication &communication, int first, int count)
  {
    communication.max_over_ranks(maxima_.data() + first, count);
  }
  /// True if the devices of the ranks exchange maxima and sums directly in this step, without their
  /// hosts.
  static constexpr bool devices_exchange() { return false; }
  /// Exchanges the sums of shared nodes between devices.
  void exchange_sums(const MoveSums<D> &, const SharedNodes<D> &) {}
  /// After an error of this rank, makes the devices of all ranks stop waiting for each other.
  void leave_ranks() {}

  /// Copies to the host the fields that the machine has changed.
  void fetch(const PointView<D> &) {}
  /// Announces that the host has changed fields of points other than positions, velocities, forces,
  /// models and bodies.
  void points_changed() {}

  /// SharedNodes::given() and taken() in memory that passes can read.
  const int *given_nodes() const { return shared_->given().data(); }
  const int *taken_nodes() const { return shared_->taken().data(); }
  /// Returns a buffer of `count` integers for exchanges between ranks, valid until the next call.
  std::int64_t *exchange_buffer(std::size_t count)
  {
    exchange_.resize(count);
    return exchange_.data();
  }

  /// Returns a row of a node field of view() on the host, one value per node of the part. Valid
  /// until the next call.
  template <class T> const T *of_nodes(const T *field, int row = 0) const
  {
    return field + view_.in_row(row, 0);
  }
  /// Largest unbalanced force of the last step [force].
  double unbalanced() const { return maxima_.empty() ? 0.0 : maxima_[Unbalanced]; }

  static constexpr double transfer_time() { return 0.0; }
  std::string description() const
  {
    return std::to_string(threads_) + (threads_ == 1 ? " CPU thread" : " CPU threads");
  }

  /// Calls pass(load, sums) for all loads. The pass adds to the sums of the last scatter().
  template <class P> void scatter_loads(const P &pass)
  {
    const SumsByKind<std::int64_t *> sums = {{view_.sums[InertiaSums], view_.sums[VectorSums]}};
    P own = pass;
    own.begin();
    for (int k = 0; k < pass.items(); ++k) own(k, sums);
  }

  /// Calls pass(item, tally) for all items. tally.raise(k, value) raises the k-th maximum,
  /// tally.error(p, code) reports the error of a point, and tally.add(sum, part) adds to an integer
  /// that other items also add to.
  template <class P> void over(const P &pass)
  {
    const int count = pass.items();
    int team = 1;
    const rve::LightWork work(count, threads_);
#pragma omp parallel num_threads(work.team)
    {
      const rve::ThreadShare mine(count);
      Tally &tally = tallies_[rve::this_thread()];
      tally.best = maxima_;
      tally.first = PointErrorKey::NO_ERROR;
      if (rve::this_thread() == 0) team = rve::team_size();
      P own = pass;
      own.begin();
      for (int i = mine.begin; i < mine.end; ++i) own(i, tally);
    }
    for (int t = 0; t < team; ++t) {
      for (std::size_t k = 0; k < maxima_.size(); ++k)
        maxima_[k] = std::max(maxima_[k], tallies_[t].best[k]);
      first_error_ = std::min(first_error_, tallies_[t].first);
    }
  }

  /// Calls pass(point, sums) for all points. First sets the sums on nodes to zero, for the kinds to
  /// which the pass adds.
  template <class P> void scatter(const P &pass)
  {
    const int count = pass.items();
    // the team can have fewer threads than partial_ has elements
    for (Partial &part : partial_) part.first_layer = part.end_layer = 0;
    const rve::LightWork work(count, threads_);
#pragma omp parallel num_threads(work.team)
    {
      const rve::ThreadShare mine(count);
      Partial &part = partial_[rve::this_thread()];
      find_layers(part, mine);
      SumsByKind<PartialSums> sums = {};
      for (const SumKind kind : {InertiaSums, VectorSums})
        if (P::adds_to(kind)) sums.of[kind] = part.begin_sums(kind, view_.grid);
      P own = pass;
      own.begin();
      for (int p = mine.begin; p < mine.end; ++p) own(p, sums);
#pragma omp barrier
      const rve::ThreadShare layers(view_.grid.layers());
      for (const SumKind kind : {InertiaSums, VectorSums})
        for (int layer = layers.begin; P::adds_to(kind) && layer < layers.end; ++layer)
          merge(layer, kind);
    }
  }

 private:
  /// Findings of one thread, aligned to avoid false sharing.
  struct alignas(128) Tally {
    std::vector<double> best;
    std::uint64_t first;

    void raise(int k, double value)
    {
      if (value > best[k]) best[k] = value;
    }
    void error(int p, ErrorCode code) { first = std::min(first, PointErrorKey::key(p, code)); }
    void add(std::int64_t *sum, std::int64_t part)
    {
#pragma omp atomic
      *sum += part;
    }
  };

  /// Sums of one thread on the layers of nodes that its points reach.
  struct alignas(128) Partial {
    int first_layer, end_layer;
    std::vector<std::int64_t> sums[NUM_SUM_KINDS];

    PartialSums begin_sums(SumKind kind, const Grid<D> &grid)
    {
      const std::size_t layer = static_cast<std::size_t>(width_of<D>(kind)) * grid.layer_size();
      sums[kind].assign((end_layer - first_layer) * layer, 0);
      return {sums[kind].data(), first_layer * layer};
    }
  };

  void find_layers(Partial &part, const rve::ThreadShare &mine) const
  {
    part.first_layer = view_.grid.layers();
    part.end_layer = 0;
    for (int p = mine.begin; p < mine.end; ++p) {
      if (view_.points.rigid_body[p] >= 0) continue;
      const int first = view_.grid.first(D - 1);    // layers of the part count from 0
      int layer = support_[p].axis[D - 1].first - first, end = layer + 3;
      if (view_.has_boxes()) {
        const PointBox<D> &box = box_[p];
        const double place = box.place[D - 1], half = box.half[D - 1];
        layer =
            std::max(0, std::min(layer, static_cast<int>(std::floor(place - half)) - 1 - first));
        end = std::min(view_.grid.layers(),
                       std::max(end, static_cast<int>(std::floor(place + half)) + 3 - first));
      }
      part.first_layer = std::min(part.first_layer, layer);
      part.end_layer = std::max(part.end_layer, end);
    }
    part.first_layer = std::min(part.first_layer, part.end_layer);
  }

  /// Adds the partial sums of all threads on a layer.
  void merge(int layer, SumKind kind) const
  {
    const std::size_t size = static_cast<std::size_t>(width_of<D>(kind)) * view_.grid.layer_size();
    std::int64_t *into = view_.sums[kind] + layer * size;
    std::fill_n(into, size, 0);
    for (const Partial &part : partial_) {
      if (layer < part.first_layer || layer >= part.end_layer) continue;
      const std::int64_t *from = part.sums[kind].data() + (layer - part.first_layer) * size;
      for (std::size_t k = 0; k < size; ++k) into[k] += from[k];
    }
  }

  int threads_;
  StepView<D> view_;
  GridArrays<D, HostArray> grid_arrays_;
  std::vector<Support<D>> support_;
  std::vector<PointBox<D>> box_;
  std::vector<Tensor<D>> increment_;
  std::vector<double> hoop_increment_;
  std::vector<HoopWeights> hoop_weights_;
  std::vector<double> maxima_;
  std::uint64_t first_error_ = PointErrorKey::NO_ERROR;
  std::vector<Tally> tallies_;
  std::vector<Partial> partial_;
  const SharedNodes<D> *shared_ = nullptr;
  int part_edition_ = 0;
  std::vector<std::int64_t> exchange_;
};

}    // namespace mpm
