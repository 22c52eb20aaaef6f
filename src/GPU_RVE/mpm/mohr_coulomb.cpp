// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/mohr_coulomb.h"

#include "rve/core/eigenvalues.h"

#include <cmath>

namespace mpm {

using rve::Tensor2;
using rve::Tensor3;

namespace {

  /// Principal stresses in descending order, and the transformation back.
  template <int D> struct PrincipalStress;

  /// The 2D version includes the out-of-plane stress.
  template <> struct PrincipalStress<2> {
    MohrCoulombReturn::Principal principal;
    int upper, lower, out;     ///< indices of the two in-plane principal stresses and of σ_zz
    double half_difference;    ///< (σ_xx - σ_yy)/2
    double shear;
    double radius;    ///< radius of Mohr's circle in the plane

    PrincipalStress(const Tensor2 &stress, const double *memory)
    {
      const double out_of_plane = memory[MohrCoulomb<2>::OutOfPlaneStress];
      const double mean = 0.5 * (stress(0, 0) + stress(1, 1));
      half_difference = 0.5 * (stress(0, 0) - stress(1, 1));
      shear = stress(0, 1);
      radius = std::sqrt(half_difference * half_difference + shear * shear);
      const double high = mean + radius;
      const double low = mean - radius;
      out = out_of_plane > high ? 0 : out_of_plane > low ? 1 : 2;
      upper = out == 0 ? 1 : 0;
      lower = out == 2 ? 1 : 2;
      principal.value[upper] = high;
      principal.value[lower] = low;
      principal.value[out] = out_of_plane;
    }

    /// Stores a stress with the principal stresses `values`. An isotropic law preserves the
    /// principal directions.
    void store(const MohrCoulombReturn::Principal &values, Tensor2 &stress, double *memory) const
    {
      const double mean = 0.5 * (values.value[upper] + values.value[lower]);
      const double scale = radius > 0.0 ? 0.5 * (values.value[upper] - values.value[lower]) / radius
                                        : 0.0;
      const double difference = scale * half_difference;
      const double tangential = scale * shear;
      stress = {{mean + difference, tangential, tangential, mean - difference}};
      memory[MohrCoulomb<2>::OutOfPlaneStress] = values.value[out];
    }
  };

  template <> struct PrincipalStress<3> {
    MohrCoulombReturn::Principal principal;

    PrincipalStress(const Tensor3 &stress, const double * /*memory*/) :
        stress_(stress), axes_(stress)
    {
      for (int i = 0; i < 3; ++i) principal.value[i] = axes_.value[i];
    }

    /// Subtracts the part of each principal stress that the return removes. A stress that the
    /// return does not change keeps its bits.
    void store(const MohrCoulombReturn::Principal &values, Tensor3 &stress, double *) const
    {
      stress = stress_;
      for (int i = 0; i < 3; ++i)
        stress =
            stress - (principal.value[i] - values.value[i]) * dyad(axes_.axis[i], axes_.axis[i]);
    }

   private:
    Tensor3 stress_;
    rve::PrincipalAxes<3> axes_;
  };

}    // namespace

template <int D>
MohrCoulomb<D>::MohrCoulomb(double young_modulus, double poisson_ratio, double cohesion,
                            double friction_degrees, double dilation_degrees) :
    FrictionalLaw<D>("Mohr-Coulomb", young_modulus, poisson_ratio, cohesion, friction_degrees,
                     dilation_degrees)
{
  const auto ratio = [](double degrees) {
    const double sine = sine_of(degrees);
    return (1.0 + sine) / (1.0 - sine);
  };
  return_.shear_modulus = this->shear_modulus_;
  return_.lame_first = this->lame_first_;
  return_.friction_ratio = ratio(friction_degrees);
  return_.dilatancy_ratio = ratio(dilation_degrees);
  return_.uniaxial_strength = 2.0 * cohesion * std::sqrt(return_.friction_ratio);
}

template <int D>
void MohrCoulomb<D>::update(int count, const int *point_index, const Tensor *deformation_increment,
                            double /*dt*/, Tensor *stress, MemoryRows memory)
{
  for (int k = 0; k < count; ++k) {
    const int p = point_index[k];
    double *state = memory[p];
    const PrincipalStress<D> trial(this->elastic_trial(deformation_increment[p], stress[p], state),
                                   state);
    const MohrCoulombReturn::Principal after = return_(trial.principal);
    trial.store(after, stress[p], state);

    // the deviator of the plastic strain is the deviator of the stress decrease, divided by 2 μ
    double relaxed[3];
    for (int i = 0; i < 3; ++i) relaxed[i] = trial.principal.value[i] - after.value[i];
    const double mean = (relaxed[0] + relaxed[1] + relaxed[2]) / 3.0;
    double square = 0.0;
    for (const double r : relaxed) square += (r - mean) * (r - mean);
    state[PlasticStrain] += std::sqrt(2.0 / 3.0 * square) / (2.0 * return_.shear_modulus);
  }
}

template <int D> double MohrCoulomb<D>::yield(const Tensor &stress, const double *memory) const
{
  return return_.yield(PrincipalStress<D>(stress, memory).principal);
}

template class MohrCoulomb<2>;
template class MohrCoulomb<3>;

}    // namespace mpm
