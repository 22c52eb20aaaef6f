// SPDX-License-Identifier: GPL-2.0-only
// Preparation of packings of disks or spheres. The stress servo of the engine compresses a loose
// random cloud of grains.

#pragma once

#include "rve/engine/engine.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace rve {

/// Input of the preparation of a packing. Time step, servo gain and compression rate follow from
/// it.
struct PackingRecipe {
  /// Final material of the packing. During the compression, friction and rolling resistance have
  /// other values.
  Material material;
  double pressure = 0.0;    ///< goal of the pressure -sigma_aa along each axis [stress], > 0
  /// Ratio of lateral to vertical stress [-]. The vertical axis is the last one. The goal of the
  /// vertical stress is `pressure`, that of the lateral stresses k0 * `pressure`. Grains must bear
  /// these stresses with the final friction.
  double k0 = 1.0;
  /// True for earth pressure at rest. The vertical stress then grows from START_AT_REST *
  /// `pressure` to `pressure` at zero lateral strain. The lateral stresses are a result, and `k0`
  /// is not used.
  bool at_rest = false;
  std::uint64_t seed = 1;    ///< seed of positions and radii

  /// Radii are uniformly distributed in [radius_min, radius_max] [length]. If `radii` is not empty,
  /// it contains the radius of each grain instead.
  int num_grains = 400;
  double radius_min = 0.0;
  double radius_max = 0.0;
  std::vector<double> radii;

  double preparation_friction = 0.0;      ///< mu during compression [-]; unused with void_ratio
  double preparation_damping = 0.3;       ///< Cundall's damping during compression [-]
  std::optional<double> void_ratio;       ///< required void ratio at the pressure [-]
  double void_ratio_tolerance = 0.002;    ///< [-]

  double stress_tolerance = 1e-3;        ///< largest |sigma_aa + p| / p at the end, p: goal [-]
  double unbalanced_tolerance = 1e-3;    ///< largest unbalanced ratio (ResultOf) at the end [-]
  /// Solid fraction of the cloud [-]. For disks the default is 0.4 and the largest value 0.5, since
  /// random addition jams at 0.55. For spheres the default is 0.25 and the largest value 0.33,
  /// since it jams at 0.38.
  std::optional<double> initial_solid_fraction;
  /// Largest number of DEM steps to reach rest at one pressure. The preparation fails if they do
  /// not suffice.
  std::int64_t max_steps = 2000000;
};

/// Ratio of the isotropic pressure before the compression without lateral strain to the final
/// vertical stress [-]. Natural soil is deposited without stress. The initial pressure changes the
/// final ratio of lateral to vertical stress by about (1 - K0) START_AT_REST.
constexpr double START_AT_REST = 0.05;

/// Returns overlap / diameter of two grains of the mean radius at the pressure of the recipe [-]
/// (contact_strain() of engine/contact_laws.h). Throws InputError on a recipe out of range.
template <int D = 2> double contact_strain(const PackingRecipe &recipe);
/// Limits of contact_strain(). Above SMALL_CONTACT_STRAIN the stiffness and the void ratio differ
/// from those of grains with point contacts. Above LARGEST_CONTACT_STRAIN disks fill the plane, and
/// a recipe is refused.
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

/// Prepared packing with data of its preparation, or the reason why the preparation failed.
template <int D> struct PreparedPackingOf {
  RveStateOf<D> state;                  ///< no grains if the preparation failed or is not finished
  double preparation_friction = 0.0;    ///< mu during compression [-]
  double overconsolidation_ratio = 1.0;    ///< highest pressure / pressure [-]
  double k0 = 1.0;                         ///< mean lateral over vertical stress reached [-]
  std::string failure;                     ///< empty if there was none
  bool ready() const { return state.num_grains() > 0; }

  /// Function that is called for each unfinished packing after each call of the engine. The last
  /// call for a packing comes when it is ready.
  using Progress = std::function<void(std::size_t recipe, const PackingReport &report,
                                      const PreparedPackingOf &packing)>;
};
using PreparedPacking = PreparedPackingOf<2>;

/// Returns the default servo gain 10 h/M [1/(stress time^2)] with the mass M and the thickness h of
/// the RVE; for spheres h is the cube root of the volume of the cell. A stress error changes the
/// velocity gradient at the rate gain * error. With the modulus E of the packing the servo then
/// oscillates at the angular frequency sqrt(gain E). The slowest wave across the cell has the
/// squared angular frequency (2 pi)^2 E h/M in any units and at any stiffness. With the factor 10
/// the servo has half of the frequency of that wave. So it is fast, but too slow to excite waves.
/// (SudoDEM and YADE use the number 1/M, which is 13.3 h/M at h = 0.075.)
template <int D> double default_servo_gain(const RveStateOf<D> &state);

/// Returns the default strain rate of each axis during the compression of the cloud [1/time]. It is
/// the smaller of two rates. The first one, 0.01 sqrt(K/M), corresponds to 1 % of the wave speed of
/// the packing; K is the contact stiffness at the pressure p. At the second one, 0.2 sqrt(p h/M),
/// the momentum flux of the moving grains is 4 % of p. The mass M and the length h are defined as
/// in default_servo_gain(). For spheres K is multiplied by the ratio of h to the mean diameter.
template <int D> double default_compression_rate(const RveStateOf<D> &state, double pressure);

/// Resets the history of a packing: velocities, strain, servo, counters and energies become zero.
/// Grains, cell and contacts stay.
template <int D> void forget_past(RveStateOf<D> &state);

/// Returns a cloud of grains at rest without overlaps, in a periodic square or cube at
/// initial_solid_fraction. Grains are added one by one at random positions, the largest first. The
/// positions depend only on the recipe and are the same on every machine, since the generator
/// std::mt19937_64 is used with a fixed mapping to real numbers. Throws InputError on a recipe out
/// of range.
template <int D = 2> RveStateOf<D> loose_cloud(const PackingRecipe &recipe);

/// Prepares a packing. During the preparation the packing is an RVE of `engine`. Returns the
/// packing at the pressure, with the final friction, zero velocities and spins, and deformation 1.
/// Tangential forces are kept, since the packing is in equilibrium with them; after a frictionless
/// preparation they are zero. If the preparation friction exceeds the final friction, the packing
/// is equilibrated again with the final friction. The cell keeps its right angles, so a small
/// random shear stress remains. For N disks at pressure p it is about 0.9 p / sqrt(N), and up to 12
/// % of p for N = 400.
///
/// If the recipe has a `void_ratio`, the preparation is repeated, and bisection finds the required
/// preparation. For a packing looser than the frictionless one, bisection varies the preparation
/// friction in [0, 1]. For a denser packing it varies the highest pressure of an isotropic,
/// frictionless overconsolidation, up to the pressure at which overlap / diameter is 4 %. Throws
/// InputError with the reachable range if the void ratio cannot be reached, and also if a
/// compression does not come to rest.
template <int D>
RveStateOf<D> generate_packing(const PackingRecipe &recipe, EngineOf<D> &engine,
                               const PackingProgress &progress = {});

/// Prepares many packings and returns them in the order of the recipes. Each packing has the same
/// bits as if it were prepared alone. Each call of the engine advances all packings that are not
/// ready. Throws InputError before the first call if a recipe is out of range. If a preparation
/// fails, its packing contains the reason, and the other preparations continue.
template <int D>
std::vector<PreparedPackingOf<D>>
generate_packings(const std::vector<PackingRecipe> &recipes, EngineOf<D> &engine,
                  const typename PreparedPackingOf<D>::Progress &progress = {});

}    // namespace rve
