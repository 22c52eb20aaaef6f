#include "mpm/mohr_coulomb.h"

#include "mpm/midpoint_increment.h"
#include "rve/core/error.h"
#include "rve/core/pi.h"

#include <cmath>

namespace mpm {

using rve::number;
using rve::require;
using rve::Tensor2;

namespace {

  /// A plane stress state with its stress out of the plane in principal axes: values in descending order, and the way back.
  struct PrincipalAxes {
    MohrCoulombReturn::Principal principal;
    int upper, lower, out;     ///< places of the two in the plane and of σ_zz
    double half_difference;    ///< (σ_xx - σ_yy)/2
    double shear;
    double radius;    ///< of Mohr's circle in the plane

    PrincipalAxes(const Tensor2 &stress, double out_of_plane)
    {
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

    /// In the plane, with the directions of before: isotropy keeps them.
    Tensor2 in_plane(const MohrCoulombReturn::Principal &values) const
    {
      const double mean = 0.5 * (values.value[upper] + values.value[lower]);
      const double scale = radius > 0.0 ? 0.5 * (values.value[upper] - values.value[lower]) / radius
                                        : 0.0;
      const double difference = scale * half_difference;
      const double tangential = scale * shear;
      return {{mean + difference, tangential, tangential, mean - difference}};
    }
  };

}    // namespace

MohrCoulomb::MohrCoulomb(double young_modulus, double poisson_ratio, double cohesion,
                         double friction_degrees, double dilation_degrees)
{
  require(young_modulus > 0.0,
          "Young's modulus must be positive, got " + number(young_modulus) + " [stress]");
  require(poisson_ratio >= 0.0 && poisson_ratio < 0.5,
          "Poisson's ratio must be in [0, 0.5), got " + number(poisson_ratio));
  require(cohesion >= 0.0, "cohesion must be at least 0, got " + number(cohesion) + " [stress]");
  require(friction_degrees >= 0.0 && friction_degrees < 90.0,
          "friction angle must be in [0, 90), got " + number(friction_degrees) + " [degrees]");
  require(dilation_degrees >= 0.0 && dilation_degrees <= friction_degrees,
          "dilation angle must be in [0, friction angle], got " + number(dilation_degrees) +
              " with friction angle " + number(friction_degrees) + " [degrees]");
  require(cohesion > 0.0 || friction_degrees > 0.0,
          "cohesion and friction angle must not both be 0: the material would have no strength");
  const auto ratio = [](double degrees) {
    const double sine = std::sin(degrees * rve::kPi / 180.0);
    return (1.0 + sine) / (1.0 - sine);
  };
  return_.shear_modulus = young_modulus / (2.0 * (1.0 + poisson_ratio));
  return_.lame_first = 2.0 * return_.shear_modulus * poisson_ratio / (1.0 - 2.0 * poisson_ratio);
  return_.friction_ratio = ratio(friction_degrees);
  return_.dilatancy_ratio = ratio(dilation_degrees);
  return_.uniaxial_strength = 2.0 * cohesion * std::sqrt(return_.friction_ratio);
}

StateVariables MohrCoulomb::state_variables() const
{
  // tension positive; accumulated, sqrt(2/3 dε^p:dε^p) of the deviator
  return {{"out_of_plane_stress", "stress"}, {"plastic_strain", ""}};
}

void MohrCoulomb::begin_memory(const Tensor2 &stress, double *memory) const
{
  memory[OutOfPlaneStress] = 0.5 * (stress(0, 0) + stress(1, 1));
  memory[PlasticStrain] = 0.0;
}

std::string MohrCoulomb::doubt_about(const Tensor2 &stress) const
{
  if (!(trace(stress) > 0.0)) return "";
  return "is a tension, which a Mohr-Coulomb material bears by its cohesion only; stresses are "
         "negative in compression";
}

void MohrCoulomb::update(int count, const int *point_index, const Tensor2 *deformation_increment,
                         double /*dt*/, Tensor2 *stress, MemoryRows memory)
{
  for (int k = 0; k < count; ++k) {
    const int p = point_index[k];
    double *state = memory[p];
    const MidpointIncrement<2> increment = midpoint_increment(deformation_increment[p]);
    const PrincipalAxes trial(
        elastic_stress(stress[p], increment, return_.lame_first, return_.shear_modulus),
        state[OutOfPlaneStress] + return_.lame_first * trace(increment.strain));
    const MohrCoulombReturn::Principal after = return_(trial.principal);
    stress[p] = trial.in_plane(after);
    state[OutOfPlaneStress] = after.value[trial.out];

    // deviator of the plastic strain: that of the relaxed stress over 2 μ
    double relaxed[3];
    for (int i = 0; i < 3; ++i) relaxed[i] = trial.principal.value[i] - after.value[i];
    const double mean = (relaxed[0] + relaxed[1] + relaxed[2]) / 3.0;
    double square = 0.0;
    for (const double r : relaxed) square += (r - mean) * (r - mean);
    state[PlasticStrain] += std::sqrt(2.0 / 3.0 * square) / (2.0 * return_.shear_modulus);
  }
}

double MohrCoulomb::p_wave_modulus(int /*point_index*/) const
{
  return return_.lame_first + 2.0 * return_.shear_modulus;
}

double MohrCoulomb::yield(const Tensor2 &stress, const double *memory) const
{
  return return_.yield(PrincipalAxes(stress, memory[OutOfPlaneStress]).principal);
}

}    // namespace mpm
