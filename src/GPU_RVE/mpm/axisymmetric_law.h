// SPDX-License-Identifier: GPL-2.0-only
// Constitutive laws in space as laws of axisymmetric points in the plane.

#pragma once

#include "mpm/constitutive.h"

#include <memory>
#include <string>
#include <vector>

namespace mpm {

/// Law of axisymmetric points that uses a law in space. The axes of the latter are the radial, the
/// axial and the hoop direction. Its state variables are those of the point.
class AxisymmetricLaw final : public Constitutive<2> {
 public:
  explicit AxisymmetricLaw(std::shared_ptr<Constitutive<3>> law) : law_(std::move(law)) {}

  StateVariables state_variables() const override { return law_->state_variables(); }
  /// The initial hoop stress is that of equal lateral stresses, σ_θθ = σ_rr.
  void begin_memory(const rve::Tensor2 &stress, double *memory) const override
  {
    law_->begin_memory(in_space(stress, stress(0, 0)), memory);
  }
  std::string doubt_about(const rve::Tensor2 &stress) const override
  {
    return law_->doubt_about(in_space(stress, stress(0, 0)));
  }

  void update(int count, const int *point_index, const rve::Tensor2 *deformation_increment,
              double dt, rve::Tensor2 *stress, MemoryRows memory) override;

  bool takes_hoop() const override { return true; }
  void set_hoop(const HoopArrays &hoop) override { hoop_ = hoop; }
  bool takes_parts() const override { return law_->takes_parts(); }
  double p_wave_modulus(int point_index) const override
  {
    return law_->p_wave_modulus(point_index);
  }
  double shear_modulus(int point_index) const override { return law_->shear_modulus(point_index); }

 private:
  /// Returns a tensor with these components in the plane and this hoop component.
  static rve::Tensor3 in_space(const rve::Tensor2 &plane, double hoop)
  {
    return {{plane(0, 0), plane(0, 1), 0.0, plane(1, 0), plane(1, 1), 0.0, 0.0, 0.0, hoop}};
  }

  std::shared_ptr<Constitutive<3>> law_;
  HoopArrays hoop_;
};

}    // namespace mpm
