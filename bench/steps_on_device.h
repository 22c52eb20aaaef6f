// SPDX-License-Identifier: GPL-2.0-only
// Macro steps of a batch whose increments and stresses lie in the memory of a GPU. fix rve makes
// such steps when its RVEs are the material of a fix mpm on a GPU.

#pragma once

#include "macro/rve_points.h"

#if defined(GPU_RVE_WITH_CUDA)
#include "cuda/device_buffer.cuh"
#include "rve/core/space.h"
#endif

#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace bench {

#if defined(GPU_RVE_WITH_CUDA)

/// Advances the RVEs `slots` of `points`. The caller must keep both objects alive.
template <int D> class StepsOnDevice {
  using Matrix = rve::Tensor<double, D>;

 public:
  StepsOnDevice(macro::RvePointsOf<D> &points, const std::vector<int> &slots, int device) :
      points_(points), slots_(slots), places_(slots.size())
  {
    std::iota(places_.begin(), places_.end(), 0);
    there_.device = device;
    there_.dimension = D;
    there_.stress = stresses_.reserve(COMPONENTS * slots.size());
  }

  /// Sets the increment of the following steps, which is the same for all RVEs. fix rve sets `dt`
  /// and `substeps` in the same way.
  void set_increment(const Matrix &increment, double dt, int substeps)
  {
    increments_.all = increment;
    increments_.dt = dt;
    increments_.substeps = substeps;
    double *numbers = deformations_.host_array(COMPONENTS * slots_.size());
    for (std::size_t k = 0; k < slots_.size(); ++k)
      rve::store_tensor(increment, numbers + COMPONENTS * k);
    there_.increment = deformations_.send(COMPONENTS * slots_.size());
    rve::check_cuda(cudaDeviceSynchronize(), "upload of increments");
  }

  /// Advances the RVEs by one macro step, as RvePointsOf::advance() does. Returns false if it did
  /// nothing; the caller must then call RvePointsOf::advance().
  bool advance(bool with_details, std::vector<int> &failed)
  {
    const bool is_as_before = points_.is_as_before(slots_, places_);
    request_ = points_.plan(slots_, places_, is_as_before, there_, increments_);
    if (!request_) return false;
    request_->launch_early();
    rve::check_cuda(cudaStreamSynchronize(nullptr), "plan of a macro step");
    if (!request_->launch()) return false;
    failed.clear();
    for (const int place : points_.finish()) failed.push_back(slots_[place]);
    if (with_details) {
      points_.fetch_results();
      points_.complete();
    }
    return true;
  }

  /// Returns the stresses of the first `count` RVEs after advance().
  std::vector<Matrix> stresses(std::size_t count)
  {
    std::vector<Matrix> first;
    const bool are_there = request_->fetch() != rve::StressesAre::OnHost;
    const double *numbers = are_there ? stresses_.receive(COMPONENTS * count) : nullptr;
    for (std::size_t k = 0; k < count; ++k)
      first.push_back(are_there ? rve::load_tensor<D>(numbers + COMPONENTS * k)
                                : points_.stress(slots_[k]));
    return first;
  }

 private:
  static constexpr std::size_t COMPONENTS = rve::Space<D>::components;

  struct Increments final : macro::MacroIncrementsOf<D> {
    Matrix all = Matrix::identity();
    Matrix increment(int /*place*/) const override { return all; }
    void take_stress(int /*place*/, const Matrix & /*stress*/) override {}
  };

  macro::RvePointsOf<D> &points_;
  const std::vector<int> &slots_;
  std::vector<int> places_;
  rve::PointsOnDevice there_;
  rve::Request *request_ = nullptr;
  Increments increments_;
  rve::DeviceBuffer<double> deformations_, stresses_;
};

#else

/// Replaces StepsOnDevice in builds without CUDA; advance() always returns false.
template <int D> class StepsOnDevice {
 public:
  StepsOnDevice(macro::RvePointsOf<D> &, const std::vector<int> &, int) {}
  void set_increment(const rve::Tensor<double, D> &, double, int) {}
  bool advance(bool, std::vector<int> &) { return false; }
  std::vector<rve::Tensor<double, D>> stresses(std::size_t) { return {}; }
};

#endif

}    // namespace bench
