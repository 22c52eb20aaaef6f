// SPDX-License-Identifier: GPL-2.0-only
// Increments of a macro step for tests.

#pragma once

#include "macro/rve_points.h"

#include <utility>
#include <vector>

namespace rve_test {

/// Increments of a macro step from a list of drives. The first drive gives the time step and the
/// number of steps. The object also receives the resulting stresses.
template <int D> class IncrementsOf final : public macro::MacroIncrementsOf<D> {
  using Matrix = rve::Tensor<double, D>;

 public:
  explicit IncrementsOf(std::vector<rve::DriveOf<D>> drives) :
      stresses(drives.size(), Matrix::zero()), drives_(std::move(drives))
  {
    this->dt = drives_.front().dt;
    this->substeps = drives_.front().substeps;
  }
  Matrix increment(int place) const override { return drives_[place].deformation; }
  void take_stress(int place, const Matrix &stress) override { stresses[place] = stress; }

  std::vector<Matrix> stresses;

 private:
  const std::vector<rve::DriveOf<D>> drives_;
};

/// Advances RVEs by increments and waits for the results. Returns false if the points cannot be
/// advanced by increments and need drives.
template <int D>
bool advance(macro::RvePointsOf<D> &points, const std::vector<int> &slots,
             IncrementsOf<D> &increments, bool with_details, std::vector<int> &failed)
{
  if (!points.begin(slots, increments)) return false;
  failed = points.finish();
  if (with_details) points.complete();
  return true;
}

}    // namespace rve_test
