// SPDX-License-Identifier: GPL-2.0-only
// What an engine computes faithfully may still not be what its user wants: limits that belong to a number format, to quasi-static
// deformation, to stability and to the size of a representative volume. Each is told with its value, its limit and a remedy.

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
  std::string message;    ///< value, limit and remedy, in words
  /// How far beyond the limit, > 1: the worst of a batch is the one with the most.
  double severity() const;
};

/// What is known of how an RVE is driven. What is zero is not known, and is not judged.
struct DriveRates {
  double strain_rate = 0.0;       ///< |D| of the RVE's own time [1/time]
  double dt = 0.0;                ///< DEM time step [time]
  double stable_dt = 0.0;         ///< its stability bound [time]
  double applied_strain = 0.0;    ///< |U - 1| since the packing was made [-]
};

/// Mean overlap over sum of radii below which the stress of a format is off by more than one in a thousand [-].
///
/// A gap is a difference of lengths. In `fast` it carries the rounding of the sum of radii, 2^-24, and of a 32-bit fraction of the
/// cell: measured, the unbalanced force of a packing at rest is 6e-8/overlap (doc/accuracy). In `single` that is of a position, a fraction
/// of a cell so many diameters long. In `mixed` and `double` the gap has 53 bits, and the limit is where the force of a contact would be
/// lost: 2^-53 / 1e-3.
double smallest_overlap(Format format, double grains_along_edge);

/// Largest inertial number of quasi-static deformation [-]: da Cruz et al., Phys Rev E 72, 021309 (2005), find rate dependence above
/// 1e-3.
constexpr double QUASI_STATIC_INERTIAL_NUMBER = 1e-3;

/// Share of the stability bound above which a time step is warned of: the network may stiffen before the next check.
constexpr double TIME_STEP_SHARE = 0.95;

/// Widths of the cell over the mean grain size: a shear band is 8 to 16 grains wide (Roscoe, Geotechnique 20, 129 (1970); Muehlhaus
/// and Vardoulakis, Geotechnique 37, 271 (1987)) and meets its own image in a narrower cell.
/// RVEs of spheres 16 grains wide have 4000 of them; they are judged by the lower end of that range.
template <int D> constexpr double SHEAR_BAND_GRAINS = D == 2 ? 16.0 : 8.0;

/// Shear strain below which no band forms [-]: the peak of dense packings is at a few percent.
constexpr double SHEAR_BAND_STRAIN = 0.02;

/// Mean overlap over sum of radii above which disks or spheres are no grains that touch any more [-]: a contact's stiffness, and the area or volume that
/// the void ratio counts twice, are then off by as much.
constexpr double LARGEST_MEAN_OVERLAP = 0.03;

/// Friction coefficients of what grains are made of are below 1 [-]; an angle in degrees is above 2.
constexpr double LARGEST_USUAL_FRICTION = 2.0;

/// Gap of the energy balance, over the energy that was supplied, the energy that was lost and the
/// kinetic energy, above which the losses of the ledger are wrong [-].
constexpr double ENERGY_BALANCE_GAP = 0.05;

/// Terms of the energy balance of an RVE at a moment [force length].
struct EnergyTerms {
  double stored = 0.0;      ///< kinetic and elastic energy
  double kinetic = 0.0;     ///< kinetic energy
  double supplied = 0.0;    ///< work since the packing was made
  double lost = 0.0;        ///< losses since then

  /// Constant in time but for the error of the time step.
  double constant() const { return stored - supplied + lost; }
};

template <int D> EnergyTerms energy_terms(const ResultOf<D> &result)
{
  const EnergyLedger &ledger = result.energy;
  return {result.kinetic_energy + result.elastic_energy, result.kinetic_energy, ledger.work,
          ledger.friction + ledger.local_damping + ledger.viscous};
}

/// Reports an energy balance that has opened since `before`: collisions are then shorter than a few
/// time steps, or dashpots too stiff for them, and the losses that the ledger adds up are wrong.
std::vector<Advice> advice_on_energy(const EnergyTerms &before, const EnergyTerms &now);

/// All limits that this answer is beyond. No contacts, no overlap to judge.
template <int D>
std::vector<Advice> advice(Format format, const ResultOf<D> &result, const Material &material,
                           const DriveRates &motion);

/// Tells a friction coefficient that looks like an angle, at the start.
std::vector<Advice> advice_on_friction(const Material &material);

/// What the stress is away from the goals of components that the servo strains at its largest rate, at the end of a drive [stress]; 0 if
/// there are none. Of modes the largest `mode_error`.
template <int D>
double stress_out_of_reach(const ResultOf<D> &result, const DriveOf<D> &drive,
                           double mode_error = 0.0);

/// Tells a servo that strains at its largest rate and comes no nearer to its goal than it was some steps `before`.
template <int D>
std::vector<Advice> advice_on_servo(const ResultOf<D> &result, const DriveOf<D> &drive,
                                    double before, double mode_error = 0.0);

}    // namespace rve
