// SPDX-License-Identifier: GPL-2.0-only
#include "macro/step_planner.h"

#include "rve/engine/finite_strain.h"

#include <cmath>

namespace macro {

template <int D> Action StepPlanner<D>::action(int slot, const rve::DriveOf<D> &drive) const
{
  if (!(options_.quiescent_strain > 0.0) || drive.has_servo() || drive.substeps == 0)
    return Action::Advance;
  return action(slot, drive.deformation, drive.dt, drive.substeps);
}

template <int D>
Action StepPlanner<D>::action(int slot, const Matrix &increment, double dt, int substeps) const
{
  const CachedPoint<D> &cached = points_.cached(slot);
  const double limit = options_.quiescent_strain, strain = rve::strain_size(increment);
  // this test comes first because it decides for most RVEs
  if (cached.response.status != rve::status::Ok || !(strain < limit)) return Action::Advance;
  const double of_all = cached.has_deferred ? rve::strain_size(increment * points_.pending(slot))
                                            : strain;
  switch (rve::skipping_of(points_.rest(slot), strain, of_all, limit, [&] {
    return options_.adaptive ? this->substeps(slot, strain, dt) : substeps;
  })) {
    case rve::Skipping::Defer:
      return Action::Skip;
    case rve::Skipping::Evaluation:
      return Action::AdvanceAndEvaluate;
    default:
      return Action::Advance;
  }
}

template <int D> int StepPlanner<D>::substeps(int slot, const rve::DriveOf<D> &drive) const
{
  if (!options_.adaptive || drive.substeps == 0 || drive.has_servo()) return drive.substeps;
  return substeps(slot, rve::strain_size(drive.deformation), drive.dt);
}

template <int D> int StepPlanner<D>::substeps(int slot, double strain, double dt) const
{
  const CachedPoint<D> &cached = points_.cached(slot);
  return options_.adaptive->of(strain, dt, cached.pressure, cached.of_contacts.grain_size(),
                               cached.of_contacts.density());
}

template <int D>
bool StepPlanner<D>::slips(int slot, const Matrix &increment, double dt, int substeps) const
{
  const CachedPoint<D> &cached = points_.cached(slot);
  const rve::Material &material = points_.unsynchronised(slot).material;
  const double overlap =
      cached.of_contacts.contact_strain(std::fmax(cached.pressure, 0.0), material);
  return rve::slips(increment, substeps, dt, overlap,
                    [&] { return cached.of_contacts.frequency(overlap, material); });
}

template <int D>
bool StepPlanner<D>::needs_turn(int slot, const Matrix &increment, double dt, int substeps) const
{
  return (points_.cached(slot).has_deferred &&
          rve::is_turned(points_.at(slot).mean_overlap(), increment)) ||
      (options_.adaptive && slips(slot, increment, dt, substeps));
}

template class StepPlanner<2>;
template class StepPlanner<3>;

}    // namespace macro
