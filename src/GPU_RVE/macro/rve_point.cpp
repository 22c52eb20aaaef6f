// SPDX-License-Identifier: GPL-2.0-only
#include "macro/rve_point.h"

#include "rve/engine/finite_strain.h"
#include "rve/engine/servo_modes.h"

#include <algorithm>

namespace macro {

template <int D> double PointOf<D>::strain_rate() const
{
  if (drive.substeps == 0) return 0.0;
  if (drive.has_servo())
    return std::max(rve::norm(last_steps().servo_velocity_gradient),
                    rve::norm(drive.velocity_gradient));
  return rve::strain_size(drive.deformation) / (drive.substeps * drive.dt);
}

template <int D> void PointOf<D>::begin_with(const rve::ResultOf<D> &first)
{
  result = first;
  grain_size = rve::grain_size(result);
  contacts = result.num_contacts;
  peak_force = result.peak_force;
}

template <int D>
void PointOf<D>::store(const rve::ResponseOf<D> &response, const rve::DriveOf<D> &last)
{
  state = State::Awake;
  result.status = response.status;
  result.stress = response.stress;
  stale = true;
  contacts = response.num_contacts;
  peak_force = response.peak_force;
  evaluation.reset();
  if (last.substeps == 0) return;
  pending = Matrix::identity();
  drive = last;
  drive.modes = nullptr;    // the load path owns them
  servo_error = last.has_servo() ? rve::servo_error(last, result.stress) : 0.0;
}

template <int D> rve::QuiescentStateOf<D> PointOf<D>::quiescence() const
{
  return {pending, last_steps().stress,
          evaluation && evaluation->stiffness ? *evaluation->stiffness
                                              : rve::AffineStiffnessOf<D>(),
          mean_overlap()};
}

template <int D> rve::Rest PointOf<D>::rest() const
{
  const bool is_at_rest = evaluation && evaluation->is_at_rest;
  if (is_quiescent()) return is_at_rest ? rve::Rest::Quiescent : rve::Rest::Wakes;
  return is_at_rest ? rve::Rest::Rests : evaluation ? rve::Rest::Moves : rve::Rest::Unknown;
}

template <int D> void PointOf<D>::defer(const rve::QuiescentStateOf<D> &quiescence)
{
  if (!is_quiescent()) rested = result;
  state = State::Quiescent;
  pending = quiescence.pending;
  result.stress = quiescence.stress_after(pending);
  follow_pending();
}

template <int D> void PointOf<D>::follow_pending()
{
  const Matrix stress = result.stress, rotation = rve::rotation_of(pending);
  result = rested;
  result.stress = stress;
  result.fabric = rotation * rested.fabric * rve::transpose(rotation);
  result.cell = pending * rested.cell;
  result.deformation = pending * rested.deformation;
  result.void_ratio = (1.0 + rested.void_ratio) * rve::determinant(pending) - 1.0;
}

template <int D> CachedPoint<D> PointOf<D>::cached_copy() const
{
  CachedPoint<D> cached;
  cached.is_valid = true;
  if (state == State::Empty) return cached;
  cached.state = state;
  cached.has_deferred = !is_identity(pending);
  cached.limit = limit;
  cached.response = {result.status, contacts, peak_force, result.stress};
  cached.pressure = last_steps().mean_stress();
  cached.of_contacts = ContactResponse<D>(material, grain_size);
  cached.substeps = drive.substeps;
  return cached;
}

template <int D> void PointOf<D>::take_details(const rve::ResultOf<D> &details)
{
  rve::ResultOf<D> &last = is_quiescent() ? rested : result;
  const Matrix stress = last.stress;
  const std::uint32_t status = last.status;
  last = details;
  last.stress = stress;
  last.status = status;
  stale = false;
  if (is_quiescent()) follow_pending();
}

template <int D> rve::Tensor<double, D> PointOf<D>::rate_of_deformation() const
{
  if (drive.substeps == 0) return Matrix::zero();
  if (!drive.has_servo()) {
    const rve::PolarDecomposition polar(drive.deformation);
    return (1.0 / (drive.substeps * drive.dt)) *
        (polar.rotation * polar.strain * rve::transpose(polar.rotation));
  }
  // servo modes steer sums of components, so the servo determines all components of L
  Matrix rate = drive.num_modes > 0 ? last_steps().servo_velocity_gradient
                                    : drive.velocity_gradient;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
      if (drive.controlled[a][b]) rate(a, b) = last_steps().servo_velocity_gradient(a, b);
  return 0.5 * (rate + rve::transpose(rate));
}

template <int D> double PointOf<D>::shadow_deviation() const
{
  const double difference = rve::norm(result.stress - shadow_stress);
  // the deviation is relative to the larger stress, so it is 1 and not infinite if the shadow has
  // no contacts
  const double size = std::max(rve::norm(result.stress), rve::norm(shadow_stress));
  return size > 0.0 ? difference / size : 0.0;
}

template struct PointOf<2>;
template struct PointOf<3>;

}    // namespace macro
