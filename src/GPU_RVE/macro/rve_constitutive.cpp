#include "macro/rve_constitutive.h"

#include "rve/core/pi.h"
#include "rve/core/threads.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/substeps.h"

#include <algorithm>
#include <cmath>

namespace macro {

namespace {

  // Voigt's bound: grains that move with the mean field give C = (1/V) sum l^2 (k_n nnnn + k_t nttn), and along any direction
  // k_n n^4 + k_t n^2 (1 - n^2) <= max(k_n, k_t) n^2, whose mean is the fabric. l^2 is taken as 4 <r^2>, V = area * thickness, the overlap
  // as its mean.
  double p_wave_modulus_of(const rve::ResultOf<2> &result, const rve::Material &material)
  {
    const double half_difference = 0.5 * (result.fabric(0, 0) - result.fabric(1, 1));
    const double largest_fabric =
        0.5 * rve::trace(result.fabric) + std::hypot(half_difference, result.fabric(0, 1));
    const double radius = 0.5 * rve::grain_size(result);
    const rve::ContactModuli moduli = rve::moduli_at_strain(result.mean_overlap, material, radius);
    const double stiffness = std::max(moduli.normal, moduli.tangential);
    const double contacts_per_grain = 0.5 * result.coordination_number;
    const double solid_fraction = 1.0 / (1.0 + result.void_ratio);
    // sum l^2 / area = contacts * 4 <r^2> / area, and grains * pi <r^2> = solid fraction * area
    return stiffness / material.thickness * contacts_per_grain * 4.0 / rve::kPi * solid_fraction *
        largest_fabric;
  }

}    // namespace

template <int D, int DimensionOfRves>
void RveConstitutive<D, DimensionOfRves>::update(
    int count, const int *point_index, const rve::Tensor<double, D> *deformation_increment,
    double dt, rve::Tensor<double, D> *stress, mpm::MemoryRows /*memory*/)
{
  const RveClock clock = owner.clock(dt);
  atoms.resize(count);
  drives.resize(count);
  {
    const rve::LightWork work(count, owner.threads());
#pragma omp parallel for num_threads(work.team)
    for (int k = 0; k < count; ++k) {
      atoms[k] = point_index[k];
      drives[k].dt = clock.dt;
      drives[k].substeps = clock.substeps;
      drives[k].deformation =
          rve::in_plane_strain<DimensionOfRves>(deformation_increment[atoms[k]]);
    }
  }
  owner.advance(atoms, drives);
  const rve::LightWork work(count, owner.threads());
#pragma omp parallel for num_threads(work.team)
  for (int k = 0; k < count; ++k)
    stress[atoms[k]] = rve::leading_components<D>(owner.stress(atoms[k]));
}

template <int D, int DimensionOfRves>
double RveConstitutive<D, DimensionOfRves>::p_wave_modulus(int point_index) const
{
  const auto &point = owner.point(point_index);
  return p_wave_modulus_of(point.result, point.material);
}

template class RveConstitutive<2>;

}    // namespace macro
