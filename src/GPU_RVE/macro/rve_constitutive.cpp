// SPDX-License-Identifier: GPL-2.0-only
#include "macro/rve_constitutive.h"

#include "rve/core/eigenvalues.h"
#include "rve/engine/contact_laws.h"
#include "rve/engine/substeps.h"

#include <algorithm>

namespace macro {

namespace {

  // Voigt's bound of the P-wave modulus. If the grains move with the mean field, the stiffness is
  //   C = (1/V) sum l^2 (k_n nnnn + k_t n (1 - nn) n)
  // with the sum over the contacts in a cell of volume V. A contact has the branch length l, the
  // normal n and the stiffnesses k_n and k_t. Along a direction a with a.n = c, a contact adds
  //   k_n c^4 + k_t c^2 (1 - c^2) <= max(k_n, k_t) c^2.
  // The mean of this bound over contacts is max(k_n, k_t) (a.fabric a). Waves run along the first D
  // axes, so only these components of the fabric matter. l is approximated by grain_size(), and the
  // overlap by its mean. V of disks is area * thickness.
  template <int D, int DimensionOfRves>
  double p_wave_modulus_of(const rve::ResultOf<DimensionOfRves> &result,
                           const rve::Material &material)
  {
    using Shape = rve::GrainShape<DimensionOfRves>;
    const double largest_fabric =
        rve::largest_eigenvalue(rve::leading_components<D>(result.fabric));
    const double radius = 0.5 * rve::grain_size(result);
    const rve::ContactModuli moduli =
        rve::moduli_at_strain<DimensionOfRves>(result.mean_overlap, material, radius);
    const double stiffness = std::max(moduli.normal, moduli.tangential);
    const double contacts_per_grain = 0.5 * result.coordination_number;
    const double solid_fraction = 1.0 / (1.0 + result.void_ratio);
    // sum l^2 = contacts * 4 r^2, and grains * r^D = solid fraction * V / V_1 with the volume V_1
    // of a grain of radius 1
    const double depth = DimensionOfRves == 2 ? material.thickness : radius;
    return stiffness / depth * contacts_per_grain * 4.0 / Shape::volume * solid_fraction *
        largest_fabric;
  }

}    // namespace

/// Increments and stresses of points of D dimensions.
template <int D, int DimensionOfRves>
class RveConstitutive<D, DimensionOfRves>::Increments final :
    public MacroIncrementsOf<DimensionOfRves> {
  using Matrix = rve::Tensor<double, DimensionOfRves>;

 public:
  Increments(const std::vector<int> &atoms, const rve::Tensor<double, D> *increment_of,
             rve::Tensor<double, D> *stress_of, const mpm::HoopArrays &hoop) :
      atoms_(atoms),
      increment_of_(increment_of), stress_of_(stress_of), hoop_(hoop)
  {
  }

  Matrix increment(int index) const override
  {
    const int atom = atoms_[index];
    Matrix increment = rve::in_plane_strain<DimensionOfRves>(increment_of_[atom]);
    if constexpr (DimensionOfRves > D)
      if (hoop_.increment) increment(D, D) = hoop_.increment[atom];
    return increment;
  }
  void take_stress(int index, const Matrix &stress) override
  {
    const int atom = atoms_[index];
    stress_of_[atom] = rve::leading_components<D>(stress);
    if constexpr (DimensionOfRves > D)
      if (hoop_.stress) hoop_.stress[atom] = stress(D, D);
  }

 private:
  const std::vector<int> &atoms_;
  const rve::Tensor<double, D> *increment_of_;
  rve::Tensor<double, D> *stress_of_;
  mpm::HoopArrays hoop_;
};

template <int D, int DimensionOfRves>
void RveConstitutive<D, DimensionOfRves>::update(
    int count, const int *point_index, const rve::Tensor<double, D> *deformation_increment,
    double dt, rve::Tensor<double, D> *stress, mpm::MemoryRows memory)
{
  if (rve::Request *request = begin(count, point_index, deformation_increment, dt, stress, memory))
    finish(*request);
}

template <int D, int DimensionOfRves>
rve::Request *RveConstitutive<D, DimensionOfRves>::begin(
    int count, const int *point_index, const rve::Tensor<double, D> *deformation_increment,
    double dt, rve::Tensor<double, D> *stress, mpm::MemoryRows /*memory*/)
{
  is_as_before = false;
  set_increments(count, point_index, deformation_increment, dt, stress);
  return owner.begin(atoms, *increments);
}

template <int D, int DimensionOfRves>
rve::StressesAre RveConstitutive<D, DimensionOfRves>::finish(rve::Request &request)
{
  owner.finish();
  return request.fetch();
}

template <int D, int DimensionOfRves>
void RveConstitutive<D, DimensionOfRves>::set_increments(int count, const int *point_index,
                                                         const rve::Tensor<double, D> *increment_of,
                                                         double dt,
                                                         rve::Tensor<double, D> *stress_of)
{
  owner.finish();    // RVEs of the other dimension may be under way
  const RveClock clock = owner.clock(dt);
  if (!is_as_before) atoms.assign(point_index, point_index + count);
  increments = std::make_shared<Increments>(atoms, increment_of, stress_of, hoop);
  increments->dt = clock.dt;
  increments->substeps = clock.substeps;
}

template <int D, int DimensionOfRves>
rve::Request *RveConstitutive<D, DimensionOfRves>::plan(int count, const int *point_index,
                                                        const mpm::DeviceArrays<D> &arrays,
                                                        double dt, rve::Tensor<double, D> *stress)
{
  if (arrays.device < 0) return nullptr;
  set_increments(count, point_index, nullptr, dt, stress);
  rve::PointsOnDevice there;
  there.device = arrays.device;
  there.dimension = D;
  // a tensor is an array of its components
  there.increment = reinterpret_cast<const double *>(arrays.deformation_increment);
  there.stress = reinterpret_cast<double *>(arrays.stress);
  there.hoop_increment = arrays.hoop.increment;
  there.hoop_stress = arrays.hoop.stress;
  return owner.plan(atoms, is_as_before, there, *increments);
}

template <int D, int DimensionOfRves>
void RveConstitutive<D, DimensionOfRves>::expect_update(int count, const int *point_index)
{
  is_as_before = count == static_cast<int>(atoms.size()) &&
      std::equal(atoms.begin(), atoms.end(), point_index) && owner.is_as_before(atoms);
}

template <int D, int DimensionOfRves>
void RveConstitutive<D, DimensionOfRves>::copy_stresses_to_host()
{
  const int count = static_cast<int>(atoms.size());
  for (int k = 0; k < count; ++k) increments->take_stress(k, owner.stress(atoms[k]));
}

template <int D, int DimensionOfRves>
double RveConstitutive<D, DimensionOfRves>::p_wave_modulus(int point_index) const
{
  const auto &point = owner.point(point_index);
  return wave_share * p_wave_modulus_of<D, DimensionOfRves>(point.result, point.material);
}

template <int D, int DimensionOfRves>
double
RveConstitutive<D, DimensionOfRves>::measured_wave_share(const std::vector<int> &points,
                                                         TangentProbesOf<DimensionOfRves> &probes,
                                                         const State &state) const
{
  const auto answers = probes.probe(
      static_cast<int>(points.size()), [&](int k) { return state(points[k]); },
      [](int) { return rve::Tensor<double, DimensionOfRves>::zero(); });
  double largest = 0.0;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (answers[k].is_measured)
      largest = std::max(
          largest, answers[k].tangent.wave_modulus() / (p_wave_modulus(points[k]) / wave_share));
  return largest;
}

template class RveConstitutive<2>;
template class RveConstitutive<2, 3>;
template class RveConstitutive<3>;

}    // namespace macro
