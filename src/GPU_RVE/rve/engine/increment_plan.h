// SPDX-License-Identifier: GPL-2.0-only
// Plan of the DEM steps of an RVE for a deformation increment. The same code runs on the host and
// on a device, with the same bits.

#pragma once

#include "rve/engine/finite_strain.h"
#include "rve/engine/quiescence.h"
#include "rve/engine/stiffening.h"
#include "rve/engine/substeps.h"

#include <cmath>
#include <cstdint>

namespace rve {

/// Largest allowed ratio of the slip angle of contacts in a rotation [rad] to the mean overlap /
/// sum of radii [-]. If a cell rotates within a few DEM steps, contacts slip by the angle of the
/// rotation, since the grains do not spin yet. Above the limit the RVE is turned rigidly instead.
/// At the limit, the tangential force is a hundredth of the normal force for k_t = k_n.
constexpr double TURN_OF_OVERLAP = 1e-2;

/// Largest rotation of one segment of a macro increment [rad]. Larger rotations have several
/// segments. Within a segment the cell moves along the chord of the rotation. On the chord the area
/// of the cell is smaller by at most a share of 2.5e-5.
constexpr double LARGEST_TURN = 0.01;

RVE_HD inline bool turns_little(const Tensor2 &f)
{
  const double twice_cosine = f(0, 0) + f(1, 1), twice_sine = f(1, 0) - f(0, 1);
  return std::fabs(twice_sine) < LARGEST_TURN * twice_cosine;
}

RVE_HD inline bool turns_little(const Tensor3 &f)
{
  const Vec<double, 3> twice_sine = axial_vector(f);
  // The trace of a rotation is 1 + 2 cos of the angle.
  return std::sqrt(dot(twice_sine, twice_sine)) < LARGEST_TURN * (trace(f) - 1.0);
}

/// Returns true for a finite deformation with a positive determinant that takes one segment.
template <int D> RVE_HD bool is_simple(const Tensor<double, D> &f)
{
  return finite(f) && determinant(f) > 0.0 && turns_little(f);
}

/// Data of an RVE whose contacts have constant moduli, for estimates of overlaps and of slip in
/// rotations.
struct LinearContacts {
  double depth = 0.0;        ///< factor from a pressure to a force per length [length]
  double stiffness = 0.0;    ///< stiffness of the normal springs [force/length]
  double frequency = 0.0;    ///< frequency of uniformly spinning grains in a fixed cell [1/time]

  /// Returns overlap / diameter at a pressure [-], like rve::contact_strain().
  RVE_HD double strain(double pressure) const { return pressure * depth / stiffness; }
};

/// Returns the largest slip angle of contacts if the cell rotates by `angle` in `substeps` steps of
/// dt [rad]. If grains do not follow the rotation, contacts slip by the whole angle. At a constant
/// rate of rotation the grains lag behind the cell by the angle (rate of rotation) / `frequency`.
/// The lag is at least the angle of one step, since grains do not spin before the first step.
RVE_HD inline double slip_of_rotation(double angle, int substeps, double dt, double frequency)
{
  const double steps_of_lag = std::fmax(1.0, 1.0 / (frequency * dt));
  return std::fabs(angle) * std::fmin(1.0, steps_of_lag / substeps);
}

/// Returns true if an RVE must be turned rigidly before DEM steps with its deferred deformation.
template <int D> RVE_HD bool is_turned(double mean_overlap, const Tensor<double, D> &deformation)
{
  return !(angle_of_rotation(rotation_of(deformation)) <= TURN_OF_OVERLAP * mean_overlap);
}

/// Returns true if contacts of this mean overlap would slip too far in the DEM steps because of the
/// rotation in the increment. The RVE must then be turned rigidly. frequency() returns the argument
/// `frequency` of slip_of_rotation().
template <int D, class Frequency>
RVE_HD bool slips(const Tensor<double, D> &increment, int substeps, double dt, double mean_overlap,
                  const Frequency &frequency)
{
  const double limit = TURN_OF_OVERLAP * mean_overlap;    // the slip is at most the angle
  if (bound_of_rotation(increment) <= limit) return false;
  const double angle = angle_of_rotation(rotation_of(increment));
  return !(angle <= limit || slip_of_rotation(angle, substeps, dt, frequency()) <= limit);
}

/// State of an RVE that a plan depends on.
struct PlannedRve {
  double pressure = 0.0;      ///< pressure after the last DEM steps [stress]
  double grain_size = 0.0;    ///< rve::grain_size() [length]
  double density = 0.0;       ///< rve::inertial_density() [mass/length^3]
  LinearContacts contacts;
  StiffeningLimit limit;
  std::uint32_t status = 0;    ///< status after the last DEM steps
};

/// Cost of a diagnostic evaluation with the affine stiffness, and overhead of a call. Both are
/// given as a number of DEM steps. Measured with 19,200 RVEs of 400 disks on an H200.
constexpr double EVALUATION_IN_STEPS = 30.0, CALL_IN_STEPS = 3.0;

/// Returns true if an evaluation is worth its cost. After an evaluation the RVE could be quiescent
/// for limit / strain macro steps, where `strain` is the strain_size() of one macro step. Each
/// skipped macro step saves `substeps` DEM steps and the overhead of a call.
RVE_HD inline bool is_worth_an_evaluation(double strain, int substeps, double limit)
{
  return (substeps + CALL_IN_STEPS) * limit > EVALUATION_IN_STEPS * strain;
}

/// Effect of the keyword *quiescent* on a macro step of an RVE.
enum class Skipping {
  None,
  Evaluation,    ///< the DEM steps end with a diagnostic evaluation
  Defer          ///< no DEM steps
};

/// Decides if a macro step of an RVE with status Ok is skipped or ends with an evaluation. `strain`
/// is the strain of the macro step, `of_all` the strain since the last DEM steps of the RVE,
/// `limit` the strain below which the RVE may be quiescent. `substeps()` returns the number of DEM
/// steps of the macro step.
template <class Substeps>
RVE_HD Skipping skipping_of(Rest rest, double strain, double of_all, double limit,
                            const Substeps &substeps)
{
  if (!(strain < limit)) return Skipping::None;
  if (may_stay_quiescent(rest) && of_all < limit) return Skipping::Defer;
  return may_be_evaluated(rest) && is_worth_an_evaluation(strain, substeps(), limit)
      ? Skipping::Evaluation
      : Skipping::None;
}

enum class PlanKind {
  Simple,       ///< DEM steps
  Turned,       ///< DEM steps after a rigid rotation
  Quiescent,    ///< no DEM steps
  Refused       ///< the RVE needs a DriveOf
};

/// Options of a plan, equal for all RVEs of a step.
struct PlanOptions {
  double dt = 0.0;              ///< DEM time step [time]
  std::int32_t substeps = 0;    ///< number of DEM steps unless adaptive
  std::int32_t is_adaptive = 0;
  AdaptiveSubsteps adaptive;
  double quiescent_strain = 0.0;    ///< strain below which an RVE may be quiescent [-]; 0: never

  RVE_HD int substeps_of(double strain, const PlannedRve &rve) const
  {
    return is_adaptive ? adaptive.of(strain, dt, rve.pressure, rve.grain_size, rve.density)
                       : substeps;
  }
};

template <int D> struct IncrementPlan {
  PlanKind kind = PlanKind::Refused;
  int substeps = 0;
  bool is_evaluated = false;    ///< diagnostic evaluation at the end of the steps
  /// Deformation of the DEM steps, including a deferred increment. If the RVE is turned rigidly
  /// first, `rotation` is the rigid rotation, and `deformation` does not include it.
  Tensor<double, D> deformation, rotation;
};

/// Returns the plan of a macro step of an RVE with the deformation increment `f`. `quiescent` is
/// read only if the RVE has a deferred increment. Adaptive substeps require contacts with constant
/// moduli.
template <int D>
RVE_HD IncrementPlan<D> plan_increment(const Tensor<double, D> &f, const PlannedRve &rve, Rest rest,
                                       const QuiescentStateOf<D> *quiescent,
                                       const PlanOptions &options)
{
  IncrementPlan<D> plan;
  plan.deformation = f;
  plan.substeps = options.substeps;
  if (!is_simple(f)) return plan;
  const bool owing = has_deferred(rest), may_be_quiescent = options.quiescent_strain > 0.0;
  double strain = 0.0, of_all = 0.0;
  if (options.is_adaptive || may_be_quiescent) {
    if (!find_strain_size(f, strain)) return plan;
    of_all = strain;
  }
  if (owing) {
    plan.deformation = f * quiescent->pending;
    if (!find_strain_size(plan.deformation, of_all)) return plan;
  }
  if (may_be_quiescent && rve.status == 0) {
    const Skipping skipping = skipping_of(rest, strain, of_all, options.quiescent_strain,
                                          [&] { return options.substeps_of(strain, rve); });
    if (skipping == Skipping::Defer) {
      plan.kind = PlanKind::Quiescent;
      plan.substeps = 0;
      return plan;
    }
    plan.is_evaluated = skipping == Skipping::Evaluation;
  }
  // The deferred increment can contain a rotation of any size. The rotation is removed below.
  if (owing && !(finite(plan.deformation) && determinant(plan.deformation) > 0.0)) return plan;
  if (options.is_adaptive) plan.substeps = options.substeps_of(of_all, rve);
  plan.kind = PlanKind::Simple;
  if (!owing && !options.is_adaptive) return plan;
  const double pressure = std::fmax(rve.pressure, 0.0);
  const auto frequency = [&rve] { return rve.contacts.frequency; };
  if (!(owing && is_turned(quiescent->mean_overlap, plan.deformation)) &&
      !(options.is_adaptive &&
        slips(plan.deformation, plan.substeps, options.dt, rve.contacts.strain(pressure),
              frequency)))
    return plan;
  plan.kind = PlanKind::Turned;
  plan.rotation = take_rotation(plan.deformation);
  if (!options.is_adaptive) return plan;
  // The number of steps is computed from the strain of the remaining stretch. This strain can
  // differ in the last digits from the strain before the removal of the rotation.
  if (find_strain_size(plan.deformation, of_all))
    plan.substeps = options.substeps_of(of_all, rve);
  else
    plan.kind = PlanKind::Refused;
  return plan;
}

}    // namespace rve
