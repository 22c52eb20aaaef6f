// SPDX-License-Identifier: GPL-2.0-only
// Base class of elastic, perfectly plastic laws with cohesion and friction: parameters and state
// variables.

#pragma once

#include "mpm/elastic_law.h"
#include "rve/core/error.h"
#include "rve/core/pi.h"

#include <cmath>
#include <string>

namespace mpm {

inline double sine_of(double degrees)
{
  return std::sin(degrees * rve::kPi / 180.0);
}

/// Divides the cohesion c and tan(phi) of the arguments E, nu, c, phi, psi by a positive factor.
/// The dilation angle psi is limited to the new phi.
inline void reduce_cohesion_and_friction(double *arguments, double factor)
{
  enum { COHESION = 2, FRICTION, DILATION };
  constexpr double DEGREE = rve::kPi / 180.0;
  double &friction = arguments[FRICTION];
  arguments[COHESION] /= factor;
  friction = std::atan(std::tan(friction * DEGREE) / factor) / DEGREE;
  arguments[DILATION] = std::fmin(arguments[DILATION], friction);
}

template <int D> class FrictionalLaw : public ElasticLaw<D> {
  using Tensor = rve::Tensor<double, D>;

 public:
  /// Indices of the state variables. The out-of-plane stress [stress], tension positive, exists in
  /// 2D only. The plastic strain is the accumulated sqrt(2/3 dε^p:dε^p) of the deviator.
  enum { OutOfPlaneStress = 0, PlasticStrain = D == 2 ? 1 : 0 };

  StateVariables state_variables() const override
  {
    if (D == 2) return {{"out_of_plane_stress", "stress"}, {"plastic_strain", ""}};
    return {{"plastic_strain", ""}};
  }
  /// The initial σ_zz is the mean of the in-plane principal stresses. With this σ_zz an isotropic
  /// law admits the stress if it admits the in-plane stresses.
  void begin_memory(const Tensor &stress, double *memory) const override
  {
    if (D == 2) memory[OutOfPlaneStress] = 0.5 * trace(stress);
    memory[PlasticStrain] = 0.0;
  }
  std::string doubt_about(const Tensor &stress) const override
  {
    if (!(trace(stress) > 0.0)) return "";
    return "is a tension, which a " + name_ +
        " material carries only by its cohesion; stresses are negative in compression";
  }

 protected:
  /// Requires young_modulus > 0 and cohesion >= 0 [stress], 0 <= poisson_ratio < 0.5,
  /// 0 <= dilation <= friction < 90 [degrees], and cohesion and friction not both 0; throws
  /// rve::InputError otherwise. `name` appears in messages.
  FrictionalLaw(const std::string &name, double young_modulus, double poisson_ratio,
                double cohesion, double friction_degrees, double dilation_degrees) :
      ElasticLaw<D>(young_modulus, poisson_ratio),
      name_(name)
  {
    using rve::require;
    require(young_modulus > 0.0, "Young's modulus must be positive, got ", young_modulus,
            " [stress]");
    require(poisson_ratio >= 0.0 && poisson_ratio < 0.5,
            "Poisson's ratio must be in [0, 0.5), got ", poisson_ratio);
    require(cohesion >= 0.0, "cohesion must be at least 0, got ", cohesion, " [stress]");
    require(friction_degrees >= 0.0 && friction_degrees < 90.0,
            "friction angle must be in [0, 90), got ", friction_degrees, " [degrees]");
    require(dilation_degrees >= 0.0 && dilation_degrees <= friction_degrees,
            "dilation angle must be in [0, friction angle], got ", dilation_degrees,
            " with friction angle ", friction_degrees, " [degrees]");
    require(cohesion > 0.0 || friction_degrees > 0.0,
            "cohesion and friction angle must not both be 0: the material would have no strength");
  }

  /// Returns the stress after an elastic increment. Updates the out-of-plane stress in
  /// `memory`.
  Tensor elastic_trial(const Tensor &deformation_increment, const Tensor &stress,
                       double *memory) const
  {
    const MidpointIncrement<D> increment = midpoint_increment(deformation_increment);
    if (D == 2) memory[OutOfPlaneStress] += this->lame_first_ * trace(increment.strain);
    return elastic_stress(stress, increment, this->lame_first_, this->shear_modulus_);
  }

 private:
  std::string name_;    ///< name in messages
};

}    // namespace mpm
