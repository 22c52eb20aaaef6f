// SPDX-License-Identifier: GPL-2.0-only
// Warnings about results that are computed correctly but may not be what the user wants. A warning
// is given if a quantity is outside a limit. The limits follow from number formats, quasi-static
// deformation, stability and the size of a representative volume.

#pragma once

#include "rve/engine/engine.h"

#include <string>
#include <vector>

namespace rve {

enum class AdviceKind {
  SmallOverlap,
  SlowStrain,
  FastStrain,
  LongTimeStep,
  SmallCell,
  LargeOverlap,
  NoContacts,
  LargeFriction,
  GoalOutOfReach,
  OpenBalance
};
constexpr int NUM_ADVICE_KINDS = 10;

struct Advice {
  AdviceKind kind;
  double value, limit;
  std::string message;    ///< text with the value, the limit and a remedy
  /// Returns value / limit if the limit is an upper one, and limit / value if it is a lower one.
  /// Both ratios exceed 1 if the limit is violated. The worst RVE of a batch is the one with the
  /// largest severity.
  double severity() const;
};

/// Quantities of the prescribed motion of an RVE. A quantity that is zero is unknown and is not
/// checked.
struct DriveRates {
  double strain_rate = 0.0;       ///< size of the strain rate in the time of the RVE [1/time]
  double dt = 0.0;                ///< DEM time step [time]
  double stable_dt = 0.0;         ///< stability bound of the DEM time step [time]
  double applied_strain = 0.0;    ///< |U - 1| since the packing was made [-]
};

/// Returns the smallest mean value of overlap / sum of radii at which the stress in a number format
/// is accurate to one in a thousand [-]. `grains_along_edge` is the ratio of the longest edge of
/// the cell to the grain size.
///
/// The gap between two grains is a difference of lengths, and the rounding errors of these lengths
/// set the limit. In `fast` they are the errors of the sum of radii, 2^-24, and of 32-bit
/// fractional coordinates. The limit is 2^-24 / 1e-3; the measured unbalanced force ratio of a
/// packing at rest is 6e-8 / overlap (doc/accuracy). In `single` the error of a position dominates.
/// It is proportional to the size of the cell, so the limit is grains_along_edge 2^-24 / 1e-3. In
/// `mixed` and `double` the gap has 53 bits, and the limit is 2^-53 / 1e-3.
double smallest_overlap(Format format, double grains_along_edge);

/// Largest inertial number of quasi-static deformation [-]. Da Cruz et al., Phys Rev E 72, 021309
/// (2005), find rate dependence above 1e-3.
constexpr double QUASI_STATIC_INERTIAL_NUMBER = 1e-3;

/// Share of the stability bound above which a time step causes a warning. The margin is needed
/// because the contact network can stiffen before the next check.
constexpr double TIME_STEP_SHARE = 0.95;

/// Smallest ratio of the width of the cell to the mean grain size without a warning. A shear band
/// is 8 to 16 grains wide (Roscoe, Geotechnique 20, 129 (1970); Muehlhaus and Vardoulakis,
/// Geotechnique 37, 271 (1987)) and overlaps its own periodic image in a narrower cell. RVEs of
/// spheres use the lower end of that range, since a cell of 16 grains width contains 4000 spheres.
template <int D> constexpr double SHEAR_BAND_GRAINS = D == 2 ? 16.0 : 8.0;

/// Shear strain below which no shear band forms [-]. The stress of dense packings peaks at a few
/// percent.
constexpr double SHEAR_BAND_STRAIN = 0.02;

/// Mean overlap / sum of radii above which disks or spheres no longer behave like touching grains
/// [-]. At such an overlap the stiffness of a contact has a relative error of about the same size.
/// So has the void ratio, since the sum of grain volumes counts overlaps twice.
constexpr double LARGEST_MEAN_OVERLAP = 0.03;

/// Largest usual friction coefficient [-]. Coefficients of materials are below 1. A value above 2
/// is probably an angle in degrees.
constexpr double LARGEST_USUAL_FRICTION = 2.0;

/// Largest allowed ratio of the error of the energy balance to the sum of supplied, lost and
/// kinetic energy [-]. Above it the losses of the energy bookkeeping are wrong.
constexpr double ENERGY_BALANCE_GAP = 0.05;

/// Terms of the energy balance of an RVE at one time [force length].
struct EnergyTerms {
  double stored = 0.0;      ///< kinetic and elastic energy
  double kinetic = 0.0;     ///< kinetic energy
  double supplied = 0.0;    ///< work since the packing was made
  double lost = 0.0;        ///< losses since then

  /// Returns the energy that exact time integration would keep constant: stored - supplied + lost.
  double constant() const { return stored - supplied + lost; }
};

template <int D> EnergyTerms energy_terms(const ResultOf<D> &result)
{
  const EnergyTotals &totals = result.energy;
  return {result.kinetic_energy + result.elastic_energy, result.kinetic_energy, totals.work,
          totals.friction + totals.local_damping + totals.viscous};
}

/// Warns if the error of the energy balance since `before` exceeds ENERGY_BALANCE_GAP. The
/// accumulated losses are then wrong. The cause is a collision that lasts only a few time steps, or
/// a dashpot that is too stiff for the time step.
std::vector<Advice> advice_on_energy(const EnergyTerms &before, const EnergyTerms &now);

/// Returns one Advice for each limit that a result violates. A packing without contacts gets the
/// advice NoContacts, and no other limit of contacts is checked.
template <int D>
std::vector<Advice> advice(Format format, const ResultOf<D> &result, const Material &material,
                           const DriveRates &motion);

/// Warns at the beginning of a run if a friction coefficient is so large that it may be an angle in
/// degrees.
std::vector<Advice> advice_on_friction(const Material &material);

/// Returns the largest difference between a controlled stress component and its goal after a call
/// [stress]. Only components that the servo strains at its largest rate count; without such
/// components the result is 0. With servo modes the result is `mode_error` if a component of the
/// servo's velocity gradient is at the largest rate, else 0.
template <int D>
double stress_out_of_reach(const ResultOf<D> &result, const DriveOf<D> &drive,
                           double mode_error = 0.0);

/// Warns if the servo strains at its largest rate but the stress does not come closer to its goal.
/// `before` is stress_out_of_reach() of an earlier call [stress].
template <int D>
std::vector<Advice> advice_on_servo(const ResultOf<D> &result, const DriveOf<D> &drive,
                                    double before, double mode_error = 0.0);

}    // namespace rve
