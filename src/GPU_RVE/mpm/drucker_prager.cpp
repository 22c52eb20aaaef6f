// SPDX-License-Identifier: GPL-2.0-only
#include "mpm/drucker_prager.h"

#include <cmath>

namespace mpm {

template <int D>
DruckerPrager<D>::DruckerPrager(double young_modulus, double poisson_ratio, double cohesion,
                                double friction_degrees, double dilation_degrees) :
    FrictionalLaw<D>("Drucker-Prager", young_modulus, poisson_ratio, cohesion, friction_degrees,
                     dilation_degrees)
{
  const auto slope = [](double degrees) {
    const double sine = sine_of(degrees);
    return 2.0 * sine / (std::sqrt(3.0) * (3.0 - sine));
  };
  friction_ = slope(friction_degrees);
  dilatancy_ = slope(dilation_degrees);
  const double sine = sine_of(friction_degrees);
  strength_ = 6.0 * cohesion * std::sqrt(1.0 - sine * sine) / (std::sqrt(3.0) * (3.0 - sine));
}

template <int D>
typename DruckerPrager<D>::Invariants DruckerPrager<D>::invariants_of(const Tensor &stress,
                                                                      double out_of_plane)
{
  const double sum = D == 2 ? trace(stress) + out_of_plane : trace(stress);
  const double mean = sum / 3.0;
  double squares = D == 2 ? (out_of_plane - mean) * (out_of_plane - mean) : 0.0;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b) {
      const double deviator = stress(a, b) - (a == b ? mean : 0.0);
      squares += deviator * deviator;
    }
  return {sum, std::sqrt(0.5 * squares)};
}

template <int D>
void DruckerPrager<D>::update(int count, const int *point_index,
                              const Tensor *deformation_increment, double /*dt*/, Tensor *stress,
                              MemoryRows memory)
{
  const double bulk_modulus = lame_first_ + 2.0 / 3.0 * shear_modulus_;
  for (int i = 0; i < count; ++i) {
    const int p = point_index[i];
    double *state = memory[p];
    const Tensor trial = this->elastic_trial(deformation_increment[p], stress[p], state);
    const double trial_out = D == 2 ? state[OutOfPlaneStress] : 0.0;
    stress[p] = trial;
    const Invariants before = invariants_of(trial, trial_out);
    const double beyond = before.root + friction_ * before.trace - strength_;
    if (!(beyond > 0.0)) continue;

    // σ = σ_t - Δλ C ∂g/∂σ: sqrt(J2) falls by μ Δλ and I1 by 9 K β Δλ
    const double step = beyond / (shear_modulus_ + 9.0 * bulk_modulus * friction_ * dilatancy_);
    double root = before.root - shear_modulus_ * step;
    double sum = before.trace - 9.0 * bulk_modulus * dilatancy_ * step;
    if (!(root > 0.0)) {    // beyond the apex; without friction the cone has no apex
      root = 0.0;
      sum = friction_ > 0.0 ? strength_ / friction_ : before.trace;
    }
    const double share = before.root > 0.0 ? root / before.root : 0.0;
    const double mean_before = before.trace / 3.0, mean = sum / 3.0;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b)
        stress[p](a, b) = a == b ? mean + share * (trial(a, a) - mean_before) : share * trial(a, b);
    if (D == 2) state[OutOfPlaneStress] = mean + share * (trial_out - mean_before);

    // the deviator of the plastic strain increment is (s_t - s)/(2 μ), where |s| = sqrt(2 J2); the
    // plastic strain grows by sqrt(2/3) times the norm of this deviator
    state[PlasticStrain] += (before.root - root) / (std::sqrt(3.0) * shear_modulus_);
  }
}

template <int D> double DruckerPrager<D>::yield(const Tensor &stress, const double *memory) const
{
  const Invariants of = invariants_of(stress, D == 2 ? memory[OutOfPlaneStress] : 0.0);
  return of.root + friction_ * of.trace - strength_;
}

template class DruckerPrager<2>;
template class DruckerPrager<3>;

}    // namespace mpm
