// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/stress_update.h"

#include "rve/core/first_error.h"
#include "rve/core/threads.h"
#include "rve/core/wall_time.h"

#include <algorithm>
#include <utility>

namespace mpm {

using rve::StressesAre;

template <int D> void StressUpdate<D>::set_laws(std::vector<Constitutive<D> *> laws)
{
  laws_ = std::move(laws);
  seconds_.assign(laws_.size(), 0.0);
  requests_.assign(laws_.size(), nullptr);
  points_of_.clear();
  memory_width_ = 0;
  for (const Constitutive<D> *law : laws_)
    memory_width_ = std::max(memory_width_, static_cast<int>(law->state_variables().size()));
}

template <int D> void StressUpdate<D>::begin_step(const PointView<D> &points, int threads)
{
  points_ = points;
  threads_ = threads;
  list_points();
  for_laws([&](int k) {
    laws_[k]->expect_update(static_cast<int>(points_of_[k].size()), points_of_[k].data());
  });
}

/// Lists the points of each law again if models or bodies of points have changed, which is rare. If
/// several models share a law, the law has one list, at the index of the first model.
template <int D> void StressUpdate<D>::list_points()
{
  const auto is_same = [&](const std::vector<int> &then, const int *now) {
    return static_cast<int>(then.size()) == points_.count &&
        std::equal(then.begin(), then.end(), now);
  };
  if (points_of_.size() == laws_.size() && is_same(listed_model_, points_.model) &&
      is_same(listed_body_, points_.rigid_body))
    return;
  listed_model_.assign(points_.model, points_.model + points_.count);
  listed_body_.assign(points_.rigid_body, points_.rigid_body + points_.count);
  std::vector<std::ptrdiff_t> first_of;
  for (const Constitutive<D> *law : laws_)
    first_of.push_back(std::find(laws_.begin(), laws_.end(), law) - laws_.begin());
  points_of_.assign(laws_.size(), {});
  for (int p = 0; p < points_.count; ++p) {
    const int model = points_.model[p];
    // a later pass over points reports any other model as an error
    if (points_.rigid_body[p] < 0 && model >= 0 && model < num_laws())
      points_of_[first_of[model]].push_back(p);
  }
}

template <int D> template <class Work> void StressUpdate<D>::for_laws(const Work &work)
{
  for (std::size_t k = 0; k < points_of_.size(); ++k) {
    if (points_of_[k].empty()) continue;
    const auto start = rve::WallClock::now();
    work(static_cast<int>(k));
    seconds_[k] += rve::seconds_since(start);
  }
}

template <int D> int StressUpdate<D>::only_law() const
{
  int only = -1;
  for (int k = 0; k < static_cast<int>(points_of_.size()); ++k) {
    if (points_of_[k].empty()) continue;
    if (only >= 0) return -1;
    only = k;
  }
  return only;
}

template <int D> bool StressUpdate<D>::plan(const DeviceArrays<D> &arrays, double dt)
{
  if (arrays.device < 0) return false;
  bool any = false, all = true;
  for_laws([&](int k) {
    any = true;
    const std::vector<int> &list = points_of_[k];
    laws_[k]->set_hoop(arrays.hoop.stress ? hoop_with(nullptr) : HoopArrays());
    if (all)
      requests_[k] =
          laws_[k]->plan(static_cast<int>(list.size()), list.data(), arrays, dt, points_.stress);
    all = all && requests_[k];
  });
  if (!all) std::fill(requests_.begin(), requests_.end(), nullptr);
  return any && all;
}

template <int D> void StressUpdate<D>::launch_early()
{
  const int only = only_law();
  if (only >= 0) requests_[only]->launch_early();
}

template <int D> bool StressUpdate<D>::launch()
{
  bool all = true;
  for_laws([&](int k) {
    if (!requests_[k]->launch()) requests_[k] = nullptr;
    all = all && requests_[k];
  });
  return all;
}

template <int D> HoopArrays StressUpdate<D>::hoop_with(const double *increment) const
{
  HoopArrays hoop;
  hoop.increment = increment;
  if constexpr (D == 2) hoop.stress = points_.hoop_stress;
  return hoop;
}

template <int D>
bool StressUpdate<D>::begin(const Tensor<D> *increment, double dt, const double *hoop_increment)
{
  bool any = false;
  for_laws([&](int k) {
    const std::vector<int> &list = points_of_[k];
    if (!requests_[k])
      laws_[k]->set_hoop(hoop_increment ? hoop_with(hoop_increment) : HoopArrays());
    if (laws_[k]->takes_parts())
      update_in_parts(k, increment, dt);
    else if (!requests_[k])    // otherwise a device has launched it
      requests_[k] = laws_[k]->begin(static_cast<int>(list.size()), list.data(), increment, dt,
                                     points_.stress, {points_.memory, points_.memory_width});
    any = any || requests_[k];
  });
  return any;
}

template <int D> void StressUpdate<D>::update_in_parts(int k, const Tensor<D> *increment, double dt)
{
  const std::vector<int> &list = points_of_[k];
  const int count = static_cast<int>(list.size());
  const rve::LightWork work(count, threads_);
  rve::FirstError failed;
#pragma omp parallel num_threads(work.team)
  {
    const rve::ThreadShare mine(count);
    failed.guard(mine.begin, [&] {
      laws_[k]->update(mine.end - mine.begin, list.data() + mine.begin, increment, dt,
                       points_.stress, {points_.memory, points_.memory_width});
    });
  }
  failed.rethrow();
}

template <int D> const std::int32_t *StressUpdate<D>::needs_host() const
{
  const int only = only_law();
  return only >= 0 && requests_[only] ? requests_[only]->needs_host() : nullptr;
}

template <int D> StressesAre StressUpdate<D>::finish()
{
  StressesAre all_are = StressesAre::OnDevice;
  std::vector<int> on_device;
  for_laws([&](int k) {
    rve::Request *const request = std::exchange(requests_[k], nullptr);
    if (!request) return;
    const StressesAre they_are = laws_[k]->finish(*request);
    all_are = std::max(all_are, they_are);
    if (they_are != StressesAre::OnHost) on_device.push_back(k);
  });
  if (all_are == StressesAre::OnHost)
    for (const int k : on_device) laws_[k]->copy_stresses_to_host();
  return all_are;
}

template <int D> void StressUpdate<D>::synchronise_ranks()
{
  for (Constitutive<D> *law : laws_) law->synchronise_ranks();
}

template <int D> void StressUpdate<D>::expect_questions()
{
  for (Constitutive<D> *law : laws_) law->expect_questions();
}

template class StressUpdate<2>;
template class StressUpdate<3>;

}    // namespace mpm
