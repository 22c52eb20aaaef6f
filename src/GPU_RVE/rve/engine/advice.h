// SPDX-License-Identifier: GPL-2.0-only
// Warnings about results that are computed correctly but may not be what the user wants. Their
// limits come from number formats, quasi-static deformation, stability and the size of a
// representative volume. A message gives the value, the limit and a remedy.

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
  /// Returns value / limit for an upper limit and limit / value for a lower one, in both cases > 1.
  /// The worst RVE of a batch has the largest severity.
  double severity() const;
};

/// Known quantities of the prescribed motion of an RVE. Zero means unknown, and the quantity is not
/// checked.
struct DriveRates {
  double strain_rate = 0.0;       ///< |D| in the time of the RVE [1/time]
  double dt = 0.0;                ///< DEM time step [time]
  double stable_dt = 0.0;         ///< stability bound of the DEM time step [time]
  double applied_strain = 0.0;    ///< |U - 1| since the packing was made [-]
};

/// Returns the smallest mean overlap / sum of radii at which the stress in a number format is
/// accurate to one in a thousand [-]. `grains_along_edge` is the longest edge of the cell over the
/// grain size.
///
/// The gap between two grains is a difference of lengths, and their rounding errors set the limit.
/// In `fast` these are the errors of the sum of radii, 2^-24, and of 32-bit fractional coordinates.
/// The measured unbalanced force of a packing at rest is 6e-8/overlap (doc/accuracy). In `single`
/// the error of a position counts, which is relative to the cell and not to a diameter. In `mixed`
/// and `double` the gap has 53 bits, and the limit is 2^-53 / 1e-3.
double smallest_overlap(Format format, double grains_along_edge);

/// Largest inertial number of quasi-static deformation [-]. Da Cruz et al., Phys Rev E 72, 021309
/// (2005), find rate dependence above 1e-3.
constexpr double QUASI_STATIC_INERTIAL_NUMBER = 1e-3;

/// Share of the stability bound above which a time step causes a warning, since the network may
/// stiffen before the next check.
constexpr double TIME_STEP_SHARE = 0.95;

/// Smallest width of the cell over the mean grain size. A shear band is 8 to 16 grains wide
/// (Roscoe, Geotechnique 20, 129 (1970); Muehlhaus and Vardoulakis, Geotechnique 37, 271 (1987))
/// and overlaps its own periodic image in a narrower cell. RVEs of spheres use the lower end of
/// that range, since a cell of 16 grains width contains 4000 spheres.
template <int D> constexpr double SHEAR_BAND_GRAINS = D == 2 ? 16.0 : 8.0;

/// Shear strain below which no shear band forms [-]. The stress of dense packings peaks at a few
/// percent.
constexpr double SHEAR_BAND_STRAIN = 0.02;

/// Mean overlap / sum of radii above which disks or spheres no longer behave like touching grains
/// [-]. Two errors have about this size there: that of the stiffness of a contact, and that of the
/// void ratio, which counts overlaps twice.
constexpr double LARGEST_MEAN_OVERLAP = 0.03;

/// Largest usual friction coefficient [-]. Coefficients of materials are below 1. A value above 2
/// is probably an angle in degrees.
constexpr double LARGEST_USUAL_FRICTION = 2.0;

/// Largest allowed error of the energy balance, over the sum of supplied, lost and kinetic energy
/// [-]. Above it the losses of the energy bookkeeping are wrong.
constexpr double ENERGY_BALANCE_GAP = 0.05;

/// Terms of the energy balance of an RVE at one time [force length].
struct EnergyTerms {
  double stored = 0.0;      ///< kinetic and elastic energy
  double kinetic = 0.0;     ///< kinetic energy
  double supplied = 0.0;    ///< work since the packing was made
  double lost = 0.0;        ///< losses since then

  /// Returns the sum that is constant in time except for the error of the time step.
  double constant() const { return stored - supplied + lost; }
};

template <int D> EnergyTerms energy_terms(const ResultOf<D> &result)
{
  const EnergyTotals &totals = result.energy;
  return {result.kinetic_energy + result.elastic_energy, result.kinetic_energy, totals.work,
          totals.friction + totals.local_damping + totals.viscous};
}

/// Warns if the error of the energy balance since `before` exceeds ENERGY_BALANCE_GAP. The
/// accumulated losses are then wrong: collisions last only a few time steps, or dashpots are too
/// stiff for the time step.
std::vector<Advice> advice_on_energy(const EnergyTerms &before, const EnergyTerms &now);

/// Returns one Advice for each limit that a result violates. Limits that concern contacts are not
/// checked in a packing without contacts.
template <int D>
std::vector<Advice> advice(Format format, const ResultOf<D> &result, const Material &material,
                           const DriveRates &motion);

/// Warns of a friction coefficient that may be an angle, at the beginning of a run.
std::vector<Advice> advice_on_friction(const Material &material);

/// Returns the largest difference between the stress and its goal after a call [stress]. Only
/// components that the servo strains at its largest rate count; without any the result is 0. With
/// servo modes the result is `mode_error` if a mode is at its largest rate, else 0.
template <int D>
double stress_out_of_reach(const ResultOf<D> &result, const DriveOf<D> &drive,
                           double mode_error = 0.0);

/// Warns of a servo that strains at its largest rate but does not come closer to its goal. `before`
/// is stress_out_of_reach() of an earlier call [stress].
template <int D>
std::vector<Advice> advice_on_servo(const ResultOf<D> &result, const DriveOf<D> &drive,
                                    double before, double mode_error = 0.0);

}    // namespace rve
