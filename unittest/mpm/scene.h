// SPDX-License-Identifier: GPL-2.0-only
// Material points for tests of the solver: arrays, blocks of points, and several ranks in one
// process.

#pragma once

#include "mpm/linear_elastic.h"
#include "mpm/mpm_solver.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

namespace mpm_test {

using mpm::Vec2;
using rve::Tensor2;

/// Owns the arrays that a PointView points to.
template <int D> struct SceneOf : mpm::PointArrays<D> {
  using Vec = mpm::Vec<D>;
  using Tensor = mpm::Tensor<D>;

  std::vector<std::int64_t> id;
  std::vector<double> position, velocity, body_force, memory;
  int memory_width = 0;
  std::vector<int> model, rigid_body;
  std::vector<double> water_volume, grain_volume;    ///< empty if no point has water

  int size() const { return static_cast<int>(id.size()); }

  /// Adds a point and returns its index; the thickness of the plane is one.
  int add(const Vec &place, const Vec &half, double density)
  {
    mpm::PointRecord<D> point = mpm::new_point<D>();
    double size_of_box = 1.0;
    for (int a = 0; a < D; ++a) size_of_box *= 2.0 * half[a];
    point.mass = density * size_of_box;
    point.volume = point.initial_volume = size_of_box;
    point.half_size = half;
    id.push_back(size() + 1);
    this->resize(size());
    this->set_record(size() - 1, point);
    for (int c = 0; c < 3; ++c) {
      position.push_back(c < D ? place[c] : 0.0);
      velocity.push_back(0.0);
      body_force.push_back(0.0);
    }
    memory.resize(memory.size() + memory_width, 0.0);
    model.push_back(0);
    rigid_body.push_back(-1);
    return size() - 1;
  }
  int add(double x, double y, const Vec &half, double density)
  {
    static_assert(D == 2);
    return add({{x, y}}, half, density);
  }

  /// Fills [lo, hi] with boxes of the given width whose centres `inside(x, y)` or inside(x, y, z)
  /// accepts.
  template <class Inside>
  void add_block(const Vec &lo, const Vec &hi, double width, double density, const Inside &inside)
  {
    mpm::NodeBox<D> boxes;
    for (int a = 0; a < D; ++a)
      boxes.end[a] = static_cast<int>(std::lround((hi[a] - lo[a]) / width));
    boxes.for_each([&](const mpm::NodeIndex<D> &box) {
      Vec place, half;
      for (int a = 0; a < D; ++a) {
        place[a] = lo[a] + (box[a] + 0.5) * width;
        half[a] = 0.5 * width;
      }
      bool takes;
      if constexpr (D == 2)
        takes = inside(place[0], place[1]);
      else
        takes = inside(place[0], place[1], place[2]);
      if (takes) add(place, half, density);
    });
  }
  void add_block(const Vec &lo, const Vec &hi, double width, double density)
  {
    add_block(lo, hi, width, density, [](auto...) { return true; });
  }

  /// Initialises the state variables of a law for all points at their present stress.
  void begin_memory(const mpm::Constitutive<D> &law)
  {
    memory_width = static_cast<int>(law.state_variables().size());
    memory.assign(static_cast<std::size_t>(memory_width) * size(), 0.0);
    for (int p = 0; p < size(); ++p) law.begin_memory(this->stress[p], row(p));
  }
  double *row(int p) { return memory.data() + p * memory_width; }

  /// Fills the pores of all deformable points with water of the pressure pressure(p) [stress]. The
  /// masses do not change.
  template <class Pressure>
  void fill_pores(const mpm::PoreWater &water, double porosity, const Pressure &pressure)
  {
    water_volume.assign(size(), 0.0);
    grain_volume.assign(size(), 0.0);
    for (int p = 0; p < size(); ++p) {
      if (rigid_body[p] >= 0) continue;
      grain_volume[p] = (1.0 - porosity) * this->initial_volume[p];
      water_volume[p] =
          mpm::water_volume_at(water, this->initial_volume[p] - grain_volume[p], pressure(p));
    }
  }
  double pore_pressure(const mpm::PoreWater &water, int p)
  {
    return mpm::pore_pressure(water, view().pore_volumes(p, this->volume[p]));
  }

  /// Returns the same points in the given order.
  SceneOf selected(const std::vector<int> &order) const
  {
    SceneOf scene;
    scene.memory_width = memory_width;
    scene.resize(order.size());
    for (const int p : order) {
      scene.set_record(scene.size(), this->record(p));
      scene.id.push_back(id[p]);
      for (int c = 0; c < 3; ++c) {
        scene.position.push_back(position[3 * p + c]);
        scene.velocity.push_back(velocity[3 * p + c]);
        scene.body_force.push_back(body_force[3 * p + c]);
      }
      const auto row = memory.begin() + p * memory_width;
      scene.memory.insert(scene.memory.end(), row, row + memory_width);
      scene.model.push_back(model[p]);
      scene.rigid_body.push_back(rigid_body[p]);
      if (water_volume.empty()) continue;
      scene.water_volume.push_back(water_volume[p]);
      scene.grain_volume.push_back(grain_volume[p]);
    }
    return scene;
  }

  mpm::PointView<D> view()
  {
    mpm::PointView<D> view;
    view.count = size();
    view.memory_width = memory_width;
    view.id = id.data();
    view.position = {position.data()};
    view.velocity = {velocity.data()};
    view.body_force = {body_force.data()};
    this->show(view);
    view.memory = memory.data();
    view.model = model.data();
    view.rigid_body = rigid_body.data();
    if (!water_volume.empty()) view.water = {water_volume.data(), grain_volume.data()};
    return view;
  }
};

using Scene = SceneOf<2>;

template <int D>
mpm::SolverOptions<D> grid_options_of(const mpm::Vec<D> &lo, const mpm::Vec<D> &hi,
                                      double cell_size)
{
  mpm::SolverOptions<D> options;
  options.lo = lo;
  options.hi = hi;
  options.cell_size = cell_size;
  return options;
}

inline mpm::SolverOptions<2> grid_options(Vec2 lo, Vec2 hi, double cell_size)
{
  return grid_options_of<2>(lo, hi, cell_size);
}

/// Returns rollers on all sides except the upper one, which is free.
inline std::array<mpm::SideKind, 4> box_open_above()
{
  return {mpm::SideKind::Roller, mpm::SideKind::Roller, mpm::SideKind::Roller, mpm::SideKind::Free};
}

/// Calls work(rank, communication) on `ranks` threads whose collective calls synchronise. If one
/// thread throws an exception, the others end in their next call, as with MPI_Abort, and run()
/// throws the exception.
class RankTeam {
 public:
  explicit RankTeam(int ranks) : ranks_(ranks), values_(ranks), sizes_(ranks), messages_(ranks) {}

  /// Number of integers that each rank has contributed to sums, number of integers in the messages
  /// of all ranks, and number of calls of all kinds.
  std::size_t words_summed() const { return words_summed_; }
  std::size_t words_sent() const { return words_sent_; }
  std::size_t calls() const { return calls_; }

  template <class Work> void run(const Work &work)
  {
    std::vector<std::thread> team;
    for (int rank = 0; rank < ranks_; ++rank)
      team.emplace_back([this, rank, &work] {
        mpm::Communication communication;
        communication.ranks = ranks_;
        communication.rank = rank;
        communication.sum_over_ranks = [this, rank](std::int64_t *data, std::size_t n) {
          if (rank == 0) words_summed_ += n;
          reduce(rank, data, n, [](std::int64_t a, std::int64_t b) { return a + b; });
        };
        communication.max_over_ranks = [this, rank](double *data, std::size_t n) {
          reduce(rank, data, n, [](double a, double b) { return a > b ? a : b; });
        };
        communication.exchange = [this, rank](const std::vector<mpm::Message> &messages) {
          exchange(rank, messages);
        };
        try {
          work(rank, communication);
        } catch (const Abandoned &) {
        } catch (...) {
          const std::lock_guard<std::mutex> lock(mutex_);
          if (!problem_) problem_ = std::current_exception();
          all_here_.notify_all();
        }
      });
    for (std::thread &member : team) member.join();
    if (problem_) std::rethrow_exception(problem_);
  }

 private:
  struct Abandoned {};

  template <class T, class Operation>
  void reduce(int rank, T *data, std::size_t n, const Operation &operation)
  {
    if (rank == 0) ++calls_;
    values_[rank] = data;
    sizes_[rank] = n;
    barrier();
    if (sizes_[rank] != sizes_[0]) throw std::logic_error("ranks exchange different numbers");
    std::vector<T> result(data, data + n);
    for (int other = 0; other < ranks_; ++other)
      if (other != rank)
        for (std::size_t k = 0; k < n; ++k)
          result[k] = operation(result[k], static_cast<T *>(values_[other])[k]);
    barrier();
    std::copy(result.begin(), result.end(), data);
  }

  void exchange(int rank, const std::vector<mpm::Message> &messages)
  {
    if (rank == 0) ++calls_;
    messages_[rank] = &messages;
    barrier();
    for (const mpm::Message &mine : messages) {
      const mpm::Message *theirs = nullptr;
      for (const mpm::Message &message : *messages_.at(mine.rank))
        if (message.rank == rank) theirs = &message;
      if (!theirs || theirs->sent_count != mine.received_count ||
          theirs->received_count != mine.sent_count)
        throw std::logic_error("ranks expect other messages than are sent");
      std::copy_n(theirs->sent, theirs->sent_count, mine.received);
      words_sent_ += mine.sent_count;
    }
    barrier();
  }

  void barrier()
  {
    std::unique_lock<std::mutex> lock(mutex_);
    if (problem_) throw Abandoned();
    const int round = round_;
    if (++arrived_ == ranks_) {
      arrived_ = 0;
      ++round_;
      all_here_.notify_all();
    } else {
      all_here_.wait(lock, [&] { return round_ != round || problem_; });
      if (round_ == round) throw Abandoned();
    }
  }

  int ranks_;
  std::vector<void *> values_;
  std::vector<std::size_t> sizes_;
  std::vector<const std::vector<mpm::Message> *> messages_;
  std::size_t words_summed_ = 0, calls_ = 0;
  std::atomic<std::size_t> words_sent_{0};
  std::exception_ptr problem_;
  std::mutex mutex_;
  std::condition_variable all_here_;
  int arrived_ = 0;
  int round_ = 0;
};

}    // namespace mpm_test
