#include "macro/rve_constitutive.h"

#include "rve/core/threads.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/substeps.h"

#include <algorithm>
#include <cmath>

namespace macro {

namespace {

  double largest_eigenvalue(const rve::Tensor2 &symmetric)
  {
    const double half_difference = 0.5 * (symmetric(0, 0) - symmetric(1, 1));
    return 0.5 * rve::trace(symmetric) + std::hypot(half_difference, symmetric(0, 1));
  }

  // Smith 1961, "Eigenvalues of a symmetric 3 x 3 matrix", Comm. ACM 4, 168: m + 2 sqrt(p) cos(acos(q/p^1.5)/3) with the mean m of the
  // diagonal, 6 p = |A - m|^2 and 2 q = det(A - m)
  double largest_eigenvalue(const rve::Tensor3 &symmetric)
  {
    const double mean = rve::trace(symmetric) / 3.0;
    const rve::Tensor3 deviator = symmetric - mean * rve::Tensor3::identity();
    double squares = 0.0;
    for (const double x : deviator.component) squares += x * x;
    const double p = squares / 6.0, root = std::sqrt(p);
    if (root == 0.0) return mean;
    const double cosine = 0.5 * rve::determinant(deviator) / (p * root);
    return mean + 2.0 * root * std::cos(std::acos(std::clamp(cosine, -1.0, 1.0)) / 3.0);
  }

  // Voigt's bound: grains that move with the mean field give C = (1/V) sum l^2 (k_n nnnn + k_t n (1 - nn) n), and along any direction a
  // with a.n = c k_n c^4 + k_t c^2 (1 - c^2) <= max(k_n, k_t) c^2, whose mean is a.fabric a. Points move along the first D axes: so do
  // waves, and of the fabric what it is there counts. l is taken as grain_size(), the overlap as its mean, V = area * thickness of disks.
  template <int D, int DimensionOfRves>
  double p_wave_modulus_of(const rve::ResultOf<DimensionOfRves> &result,
                           const rve::Material &material)
  {
    using Shape = rve::GrainShape<DimensionOfRves>;
    const double largest_fabric = largest_eigenvalue(rve::leading_components<D>(result.fabric));
    const double radius = 0.5 * rve::grain_size(result);
    const rve::ContactModuli moduli =
        rve::moduli_at_strain<DimensionOfRves>(result.mean_overlap, material, radius);
    const double stiffness = std::max(moduli.normal, moduli.tangential);
    const double contacts_per_grain = 0.5 * result.coordination_number;
    const double solid_fraction = 1.0 / (1.0 + result.void_ratio);
    // sum l^2 = contacts * 4 r^2, and grains * r^D = solid fraction * (area or volume) / that of a grain of radius 1
    const double depth = DimensionOfRves == 2 ? material.thickness : radius;
    return stiffness / depth * contacts_per_grain * 4.0 / Shape::volume * solid_fraction *
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
  return p_wave_modulus_of<D, DimensionOfRves>(point.result, point.material);
}

template class RveConstitutive<2>;
template class RveConstitutive<2, 3>;
template class RveConstitutive<3>;

}    // namespace macro
