// SPDX-License-Identifier: GPL-2.0-only
// How a deformation increment becomes DEM steps of an RVE: one text for the host and for a device, to the same bits on both.

#pragma once

#include "rve/engine/finite_strain.h"
#include "rve/engine/sleep.h"
#include "rve/engine/stiffening.h"
#include "rve/engine/substeps.h"

#include <cmath>
#include <cstdint>

namespace rve {

/// Slip of contacts by a rotation that grains do not follow, over the mean overlap over sum of radii, above which an RVE is turned
/// rigidly [-]. A cell that turns by an angle in a few DEM steps lets contacts slip by it, since grains do not spin yet: a hundredth
/// of the normal force at k_t = k_n.
constexpr double TURN_OF_OVERLAP = 1e-2;

/// Segments of a macro increment that rotates by more than this turn one after the other [rad]: the chord through the rotation
/// loses at most 2.5e-5 of the area on its way.
constexpr double LARGEST_TURN = 0.01;

RVE_HD inline bool turns_little(const Tensor2 &f)
{
  const double twice_cosine = f(0, 0) + f(1, 1), twice_sine = f(1, 0) - f(0, 1);
  return std::fabs(twice_sine) < LARGEST_TURN * twice_cosine;
}

RVE_HD inline bool turns_little(const Tensor3 &f)
{
  const Vec<double, 3> twice_sine = axial_vector(f);
  // 1 + 2 cos of the angle is the trace of a rotation
  return std::sqrt(dot(twice_sine, twice_sine)) < LARGEST_TURN * (trace(f) - 1.0);
}

/// Whether it is a deformation that takes one segment.
template <int D> RVE_HD bool is_simple(const Tensor<double, D> &f)
{
  return finite(f) && determinant(f) > 0.0 && turns_little(f);
}

/// How the mean grain of an RVE gives way whose contacts have constant moduli.
struct LinearContacts {
  double depth = 0.0;        ///< that a pressure acts on, per diameter of a grain [length]
  double stiffness = 0.0;    ///< of the normal springs [force/length]
  double frequency =
      0.0;    ///< of grains that all spin alike in a cell that does not turn [1/time]

  /// rve::contact_strain()
  RVE_HD double strain(double pressure) const { return pressure * depth / stiffness; }
};

/// Largest slip by a rotation by `angle` in `substeps` steps of dt, as an angle [rad]: the whole rotation, if the grains do not follow
/// at all. Grains lag behind a rotation at a constant rate by that rate over their frequency; the first step finds them at rest.
RVE_HD inline double slip_of_rotation(double angle, int substeps, double dt, double frequency)
{
  const double steps_of_lag = std::fmax(1.0, 1.0 / (frequency * dt));
  return std::fabs(angle) * std::fmin(1.0, steps_of_lag / substeps);
}

/// Whether an RVE that wakes with this deformation must be turned rigidly.
template <int D> RVE_HD bool is_turned(double mean_overlap, const Tensor<double, D> &deformation)
{
  return !(angle_of_rotation(rotation_of(deformation)) <= TURN_OF_OVERLAP * mean_overlap);
}

/// Whether a rotation lets contacts of this mean overlap slip too far, in as few DEM steps as the strain asks for: the RVE is turned rigidly then, too.
/// frequency(): as in slip_of_rotation().
template <int D, class Frequency>
RVE_HD bool slips(const Tensor<double, D> &increment, int substeps, double dt, double mean_overlap,
                  const Frequency &frequency)
{
  const double limit = TURN_OF_OVERLAP * mean_overlap;    // the slip is no larger than the angle
  if (bound_of_rotation(increment) <= limit) return false;
  const double angle = angle_of_rotation(rotation_of(increment));
  return !(angle <= limit || slip_of_rotation(angle, substeps, dt, frequency()) <= limit);
}

/// What a plan asks of an RVE.
struct PlannedRve {
  double pressure = 0.0;      ///< mean stress of its last DEM steps [stress]
  double grain_size = 0.0;    ///< rve::grain_size() [length]
  double density = 0.0;       ///< rve::inertial_density() [mass/length^3]
  LinearContacts contacts;
  StiffeningLimit limit;
  std::uint32_t status = 0;    ///< of its last DEM steps
};

/// What a look at an RVE costs at the end of its DEM steps, with its affine stiffness, and what a call costs beside its steps, in DEM steps: measured
/// with 19,200 RVEs of 400 disks on an H200.
constexpr double LOOK_IN_STEPS = 30.0, CALL_IN_STEPS = 3.0;

/// Whether what an RVE would sleep through at the rate of this strain_size() in so many DEM steps, up to a limit, costs more than the look that
/// lets it sleep: each macro step that it sleeps saves its own steps and a call.
RVE_HD inline bool is_worth_a_look(double strain, int substeps, double limit)
{
  return (substeps + CALL_IN_STEPS) * limit > LOOK_IN_STEPS * strain;
}

/// What *quiescent* makes of a macro step of an RVE.
enum class Skipping {
  None,
  Look,    ///< its DEM steps end with a look
  Sleep    ///< it makes none
};

/// From the strain of the step and of all since its last DEM steps, for an RVE that has answered without trouble. `substeps()`: those of the step.
template <class Substeps>
RVE_HD Skipping skipping_of(Rest rest, double strain, double of_all, double limit,
                            const Substeps &substeps)
{
  if (!(strain < limit)) return Skipping::None;
  if (may_sleep_on(rest) && of_all < limit) return Skipping::Sleep;
  return may_be_looked_at(rest) && is_worth_a_look(strain, substeps(), limit) ? Skipping::Look
                                                                              : Skipping::None;
}

enum class PlanKind {
  Simple,    ///< so many DEM steps
  Turned,    ///< the same when it has been turned rigidly
  Sleeps,    ///< no DEM steps
  Refused    ///< it takes more than an increment
};

/// What is the same for all RVEs of a step.
struct PlanOptions {
  double dt = 0.0;              ///< of DEM steps [time]
  std::int32_t substeps = 0;    ///< unless they are adaptive
  std::int32_t is_adaptive = 0;
  AdaptiveSubsteps adaptive;
  double quiescent_strain = 0.0;    ///< below it an RVE may sleep; 0: none does

  RVE_HD int substeps_of(double strain, const PlannedRve &rve) const
  {
    return is_adaptive ? adaptive.of(strain, dt, rve.pressure, rve.grain_size, rve.density)
                       : substeps;
  }
};

template <int D> struct IncrementPlan {
  PlanKind kind = PlanKind::Refused;
  int substeps = 0;
  bool is_looked_at = false;    ///< at the end of its steps
  /// With what it has slept through; where it is turned without `rotation`.
  Tensor<double, D> deformation, rotation;
};

/// The plan of a macro step of an RVE. `sleep` is read where the RVE owes a deformation. Adaptive substeps are for contacts with constant moduli.
template <int D>
RVE_HD IncrementPlan<D> plan_increment(const Tensor<double, D> &f, const PlannedRve &rve, Rest rest,
                                       const SleepOf<D> *sleep, const PlanOptions &options)
{
  IncrementPlan<D> plan;
  plan.deformation = f;
  plan.substeps = options.substeps;
  if (!is_simple(f)) return plan;
  const bool owing = owes(rest), may_sleep = options.quiescent_strain > 0.0;
  double strain = 0.0, of_all = 0.0;
  if (options.is_adaptive || may_sleep) {
    if (!find_strain_size(f, strain)) return plan;
    of_all = strain;
  }
  if (owing) {
    plan.deformation = f * sleep->pending;
    if (!find_strain_size(plan.deformation, of_all)) return plan;
  }
  if (may_sleep && rve.status == 0) {
    const Skipping skipping = skipping_of(rest, strain, of_all, options.quiescent_strain,
                                          [&] { return options.substeps_of(strain, rve); });
    if (skipping == Skipping::Sleep) {
      plan.kind = PlanKind::Sleeps;
      plan.substeps = 0;
      return plan;
    }
    plan.is_looked_at = skipping == Skipping::Look;
  }
  // it may have turned by any angle, which is taken from it
  if (owing && !(finite(plan.deformation) && determinant(plan.deformation) > 0.0)) return plan;
  if (options.is_adaptive) plan.substeps = options.substeps_of(of_all, rve);
  plan.kind = PlanKind::Simple;
  if (!owing && !options.is_adaptive) return plan;
  const double pressure = std::fmax(rve.pressure, 0.0);
  const auto frequency = [&rve] { return rve.contacts.frequency; };
  if (!(owing && is_turned(sleep->mean_overlap, plan.deformation)) &&
      !(options.is_adaptive &&
        slips(plan.deformation, plan.substeps, options.dt, rve.contacts.strain(pressure),
              frequency)))
    return plan;
  plan.kind = PlanKind::Turned;
  plan.rotation = take_rotation(plan.deformation);
  if (!options.is_adaptive) return plan;
  // the strain of what is left, to its last digit
  if (find_strain_size(plan.deformation, of_all))
    plan.substeps = options.substeps_of(of_all, rve);
  else
    plan.kind = PlanKind::Refused;
  return plan;
}

}    // namespace rve
