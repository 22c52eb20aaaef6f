// SPDX-License-Identifier: GPL-2.0-only
// Preparation of packings of disks or spheres: a seeded loose cloud is compressed by the stress
// servo of the engine.

#pragma once

#include "rve/engine/engine.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace rve {

/// Recipe of a packing. Time step, servo gain and compression rate follow from it.
struct PackingRecipe {
  /// Material of the packing. Its friction and rolling resistance are set at the end.
  Material material;
  double pressure = 0.0;    ///< goal of -sigma of each axis [stress], > 0
  /// Lateral over vertical stress [-]. The vertical axis is the last one. The stress along it has
  /// the goal `pressure`, and the lateral stresses have the goal k0 * `pressure`. Grains must bear
  /// these stresses with the final friction.
  double k0 = 1.0;
  /// Earth pressure at rest: the vertical stress grows from START_AT_REST of the pressure to the
  /// pressure at zero lateral strain. The lateral stresses result from it, and `k0` is not used.
  bool at_rest = false;
  std::uint64_t seed = 1;    ///< seed of positions and radii

  /// Radii are uniform in [radius_min, radius_max] [length], or one per grain as given in `radii`.
  int num_grains = 400;
  double radius_min = 0.0;
  double radius_max = 0.0;
  std::vector<double> radii;

  double preparation_friction = 0.0;      ///< mu during compression [-]; unused with void_ratio
  double preparation_damping = 0.3;       ///< Cundall's damping during compression [-]
  std::optional<double> void_ratio;       ///< required void ratio at the pressure [-]
  double void_ratio_tolerance = 0.002;    ///< [-]

  double stress_tolerance = 1e-3;        ///< |sigma_aa + p| / p of each axis at the end [-]
  double unbalanced_tolerance = 1e-3;    ///< mean |grain force| / mean |contact force| [-]
  /// Solid fraction of the cloud [-]. Disks: default 0.4, at most 0.5, since random addition jams
  /// at 0.55. Spheres: default 0.25, at most 0.33, since it jams at 0.38.
  std::optional<double> initial_solid_fraction;
  /// Largest number of DEM steps of one compression; it is an error if they do not suffice.
  std::int64_t max_steps = 2000000;
};

/// Isotropic pressure at the beginning of the compression without lateral strain, over the final
/// vertical stress [-]. Soil is deposited without stress. This initial pressure changes the final
/// lateral stress by about (1 - K0) times the share.
constexpr double START_AT_REST = 0.05;

/// Returns the overlap over diameter of two grains of the mean radius at the pressure, as
/// contact_strain() of engine/contact_laws.h.
template <int D = 2> double contact_strain(const PackingRecipe &recipe);
/// Limits of contact_strain(). Above the first one stiffness and void ratio differ from those of
/// grains with point contacts. Above the second one disks fill the plane, and a recipe is refused.
constexpr double SMALL_CONTACT_STRAIN = 0.01;
constexpr double LARGEST_CONTACT_STRAIN = 0.05;

/// Progress of a preparation, reported every few hundred steps.
struct PackingReport {
  std::int64_t step;    ///< DEM steps since the cloud was made, over all attempts
  /// Phase: "compression", "settling", "overconsolidation", "unloading", "anisotropic load" or
  /// "load at rest".
  const char *phase;
  double preparation_friction;    ///< [-]
  double pressure;                ///< mean stress, compression positive [stress]
  double void_ratio;              ///< [-]
  double coordination_number;     ///< [-]
  double unbalanced_ratio;        ///< [-]
  double k0;                      ///< mean lateral over vertical stress [-]; 0 without stress
};
using PackingProgress = std::function<void(const PackingReport &)>;

/// Packing of a batch and data of its preparation, or the reason why it failed.
template <int D> struct PreparedPackingOf {
  RveStateOf<D> state;                  ///< no grains if the preparation failed or is not finished
  double preparation_friction = 0.0;    ///< mu during compression [-]
  double overconsolidation_ratio = 1.0;    ///< highest pressure / pressure [-]
  double k0 = 1.0;                         ///< mean lateral over vertical stress reached [-]
  std::string failure;                     ///< empty if there was none
  bool ready() const { return state.num_grains() > 0; }

  /// Function called for each packing of a batch after each call of the engine, for the last time
  /// when the packing is ready.
  using Progress = std::function<void(std::size_t recipe, const PackingReport &report,
                                      const PreparedPackingOf &packing)>;
};
using PreparedPacking = PreparedPackingOf<2>;

/// Returns the default servo gain 10 h/M [1/(stress time^2)] with the mass M and the thickness h of
/// the RVE; for spheres h is the cube root of the volume of the cell. A stress error accelerates
/// the cell by gain * error, so at a modulus E of the packing the servo oscillates at the angular
/// frequency sqrt(gain E). The slowest wave across the cell has the squared angular frequency (2
/// pi)^2 E h/M, whatever the units and the stiffness. With the factor 10 the servo has half of the
/// frequency of that wave: it is fast, but below the waves, which it must not excite. (SudoDEM and
/// YADE use 1/M as a number, 13.3 h/M at h = 0.075.)
template <int D> double default_servo_gain(const RveStateOf<D> &state);

/// Returns the default rate of each axis during the compression of the cloud [1/time]. It is the
/// smaller of two rates. The rate 0.01 sqrt(K/M) is 1 % of the wave speed of the packing, with the
/// contact stiffness K at the pressure p. At the rate 0.2 sqrt(p h/M) the momentum flux of the
/// moving grains is 4 % of p. M and h are those of default_servo_gain(); for spheres K is
/// multiplied by h over the mean diameter.
template <int D> double default_compression_rate(const RveStateOf<D> &state, double pressure);

/// Resets the history of a packing: velocities, strain, servo, counters and energies become zero.
/// Grains, cell and contacts stay.
template <int D> void forget_past(RveStateOf<D> &state);

/// Returns non-overlapping grains at rest in a periodic square or cube at initial_solid_fraction,
/// by random sequential addition, largest first. Positions depend only on the recipe and are the
/// same on every machine: the generator is std::mt19937_64 with a fixed mapping to real numbers.
/// Throws InputError on a recipe out of range.
template <int D = 2> RveStateOf<D> loose_cloud(const PackingRecipe &recipe);

/// Prepares a packing on `engine`, which holds it as an RVE during the preparation. Returns the
/// packing at the pressure, with the final friction, zero velocities and spins, and deformation 1.
/// Tangential forces are kept, since they belong to the equilibrium; after frictionless preparation
/// they are zero. A packing prepared with more than the final friction is equilibrated with the
/// final one. The cell keeps its right angles, so a small random shear stress remains: for N disks
/// at pressure p about 0.9 p / sqrt(N), up to 12 % of p for N = 400.
///
/// With `void_ratio` the preparation is repeated by bisection. For a packing looser than the
/// frictionless one the variable is the preparation friction in [0, 1]. For a denser one it is the
/// overconsolidation by an isotropic, frictionless compression, up to the pressure at which overlap
/// / diameter is 4 %. Throws InputError with the reachable range if the void ratio cannot be
/// reached. It also throws if a compression does not come to rest.
template <int D>
RveStateOf<D> generate_packing(const PackingRecipe &recipe, EngineOf<D> &engine,
                               const PackingProgress &progress = {});

/// Prepares many packings, in the order of their recipes and each with the same bits as if it were
/// prepared alone. All that are not ready advance together in each call of the engine. A recipe out
/// of range throws InputError before anything runs. A preparation that fails stores its reason and
/// does not stop the others.
template <int D>
std::vector<PreparedPackingOf<D>>
generate_packings(const std::vector<PackingRecipe> &recipes, EngineOf<D> &engine,
                  const typename PreparedPackingOf<D>::Progress &progress = {});

}    // namespace rve
