// SPDX-License-Identifier: GPL-2.0-only
// Makes packings of disks or of spheres: a seeded loose cloud, compressed by the engine's stress servo.

#pragma once

#include "rve/engine/engine.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace rve {

/// What to prepare and how. A zero time step, gain or rate is chosen by the recipe.
struct PackingRecipe {
  /// Final one; its friction and its rolling resistance are set when the packing is ready.
  Material material;
  double pressure = 0.0;    ///< goal of -sigma of each axis [stress], > 0
  /// Lateral over vertical stress [-]: unless it is 1, the pressure is that of the vertical axis, the last one, and the goal of the others is
  /// k0 times that. Grains must bear it with the final friction.
  double k0 = 1.0;
  /// The vertical stress becomes the pressure while the lateral strain is zero, from START_AT_REST of it: earth pressure at rest. The
  /// lateral stresses are what the grains make of it, and `k0` says nothing.
  bool at_rest = false;
  std::uint64_t seed = 1;    ///< of positions and radii

  /// Radii are uniform in [radius_min, radius_max] [length], or one per grain as given in `radii`.
  int num_grains = 400;
  double radius_min = 0.0;
  double radius_max = 0.0;
  std::vector<double> radii;

  double preparation_friction = 0.0;      ///< mu during compression [-]; unused with void_ratio
  double preparation_damping = 0.3;       ///< Cundall's damping during compression [-]
  std::optional<double> void_ratio;       ///< wanted at the pressure [-]
  double void_ratio_tolerance = 0.002;    ///< [-]

  double stress_tolerance = 1e-3;        ///< |sigma_aa + p| / p of each axis at the end [-]
  double unbalanced_tolerance = 1e-3;    ///< mean |grain force| / mean |contact force| [-]
  /// Of the cloud [-]. Of disks 0.4 where it is not given, at most 0.5: random addition jams at 0.55; of spheres 0.25, at most 0.33, and it
  /// jams at 0.38.
  std::optional<double> initial_solid_fraction;
  double dt = 0.0;    ///< [time]; 0: about 0.6 of the stable step, followed as contacts form
  double servo_gain = 0.0;             ///< [1/(stress time^2)]; 0: default_servo_gain()
  double max_rate = 0.0;               ///< of each axis [1/time]; 0: default_compression_rate()
  std::int64_t max_steps = 2000000;    ///< of one compression; beyond it is an error
};

/// Isotropic pressure over the vertical stress where the compression without lateral strain begins. Ground is laid down without stress;
/// what a packing bears before counts in the lateral stress by about (1 - K0) of this.
constexpr double START_AT_REST = 0.05;

/// Of two grains of the mean radius, pressed as by contact_strain() of engine/contact_laws.h.
template <int D = 2> double contact_strain(const PackingRecipe &recipe);
/// Beyond the first one the overlaps count: stiffness and void ratio are no longer those of grains that touch in points. Beyond the
/// second one disks fill the plane, and a recipe is refused.
constexpr double SMALL_CONTACT_STRAIN = 0.01;
constexpr double LARGEST_CONTACT_STRAIN = 0.05;

/// A line for the log, every few hundred steps.
struct PackingReport {
  std::int64_t step;    ///< since the cloud was made, over all attempts
  /// "compression", "settling", "overconsolidation", "unloading", "anisotropic load" or "load at rest".
  const char *phase;
  double preparation_friction;    ///< [-]
  double pressure;                ///< mean stress, compression positive [stress]
  double void_ratio;              ///< [-]
  double coordination_number;     ///< [-]
  double unbalanced_ratio;        ///< [-]
  double k0;                      ///< mean lateral over vertical stress [-]; 0 without stress
};
using PackingProgress = std::function<void(const PackingReport &)>;

/// A packing of a batch and how it was made, or why it could not be.
template <int D> struct PreparedPackingOf {
  RveStateOf<D> state;                  ///< without grains if the preparation failed or is not over
  double preparation_friction = 0.0;    ///< mu during compression [-]
  double overconsolidation_ratio = 1.0;    ///< highest pressure / pressure [-]
  double k0 = 1.0;                         ///< mean lateral over vertical stress reached [-]
  std::string failure;                     ///< empty if there was none
  bool ready() const { return state.num_grains() > 0; }

  /// Called for each packing of a batch after each call of the engine; the last time when it is ready.
  using Progress = std::function<void(std::size_t recipe, const PackingReport &report,
                                      const PreparedPackingOf &packing)>;
};
using PreparedPacking = PreparedPackingOf<2>;

/// Servo gain 10 h/M [1/(stress time^2)], M the mass and h the thickness of the RVE. A stress error accelerates the cell by
/// gain * error; with a modulus E the servo oscillates at sqrt(gain E). The slowest wave across the cell has (2 pi)^2 E h/M for
/// its frequency squared, whatever the units and the stiffness: 10 puts the servo at half of that frequency, fast, but
/// below the waves it must not excite. (SudoDEM and YADE use 1/M as a number, 13.3 h/M at h = 0.075.) Of spheres h is the cube root of the
/// volume of the cell.
template <int D> double default_servo_gain(const RveStateOf<D> &state);

/// Rate of each axis while the cloud is compressed [1/time]: the lesser of 0.01 sqrt(K/M), K the stiffness of contacts at the pressure, which crosses the cell at 1 % of
/// the wave speed of the packing, and 0.2 sqrt(p h/M), at which the momentum flux of the moving grains is 4 % of p. Of spheres h is as above, and K is
/// multiplied by h over the mean diameter.
template <int D> double default_compression_rate(const RveStateOf<D> &state, double pressure);

/// Forgets all that has happened to a packing: velocities, strain, servo, counters and energies are zero. Grains, cell and contacts stay.
template <int D> void forget_past(RveStateOf<D> &state);

/// Non-overlapping grains in a periodic square or cube at initial_solid_fraction, at rest: random sequential addition, largest first.
/// Depends on the recipe's radii and seed only, on every machine: std::mt19937_64 with its own mapping to numbers.
/// Throws InputError on a recipe out of range.
template <int D = 2> RveStateOf<D> loose_cloud(const PackingRecipe &recipe);

/// Runs the protocol on `engine` (a packing is added and removed) and returns the packing: at the pressure, with the final
/// friction, velocities and spins zero, deformation 1. Tangential forces are kept, they belong to the equilibrium; after
/// frictionless preparation they are zero. A packing prepared with more than the final friction settles with the final one.
/// The cell keeps its right angles, so a small shear stress remains, by chance: of disks about 0.9 p / sqrt(N), up to 12 % of p for 400.
///
/// With `void_ratio`: looser than the frictionless packing by bisection on the preparation friction in [0, 1]; denser by
/// bisection on an isotropic overconsolidation, frictionless, up to the pressure at which contacts are strained by 4 %.
/// Throws InputError with the reachable range when neither does, and when a compression does not come to rest.
template <int D>
RveStateOf<D> generate_packing(const PackingRecipe &recipe, EngineOf<D> &engine,
                               const PackingProgress &progress = {});

/// The same for many recipes, in their order and each with the same bits as alone: all that are not ready advance together, in one
/// call of the engine after another. A recipe out of range throws InputError before anything runs. A preparation that fails
/// leaves its reason and does not stop the others.
template <int D>
std::vector<PreparedPackingOf<D>>
generate_packings(const std::vector<PackingRecipe> &recipes, EngineOf<D> &engine,
                  const typename PreparedPackingOf<D>::Progress &progress = {});

}    // namespace rve
