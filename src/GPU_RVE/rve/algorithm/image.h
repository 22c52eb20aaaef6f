// SPDX-License-Identifier: GPL-2.0-only
// The memory image of one RVE between calls: a header and arrays in one piece of memory, the same bytes on CPU and GPU.
// Plain data, outside of the instruction-set namespaces: it crosses their border.

#pragma once

#include "rve/core/space.h"
#include "rve/physics/material.h"

#include <cstdint>

namespace rve {

/// How many pairs there are, by the dimension.
template <int D> struct PairCounts;
template <> struct PairCounts<2> {
  /// That one grain owns at most; planar contact graphs have at most three pairs per grain. What does not fit goes to the list of extra
  /// pairs.
  static constexpr int owned = 3;
  /// Room for the list of a block, per grain, and for extra pairs of an RVE, at first: both grow when more is needed.
  static constexpr int listed_at_first = 4, grains_per_extra_at_first = 16;
};

template <> struct PairCounts<3> {
  /// Of 1000 spheres and a skin of a tenth of their radius, or less, nearly all pairs find a place; five of a grain would cost a tenth of the speed.
  static constexpr int owned = 4;
  static constexpr int listed_at_first = 8, grains_per_extra_at_first = 8;
};

/// Skin of the list that the user left open, as a share of the mean radius: wide enough that a quasi-static packing lives on one list for
/// hundreds of steps, narrow enough that few of the listed pairs do not touch. Spheres have more of these, and lists that live longer.
template <int D> constexpr double kDefaultSkinShare = D == 2 ? 0.1 : 0.05;

/// Steps of a call that are planned before it begins, at most.
constexpr int kStepsAhead = 32;

/// What a call changes of an RVE beside its grains.
template <int D> struct alignas(16) ImageProgress {
  double cell[Space<D>::components];           ///< H [length]
  double deformation[Space<D>::components];    ///< F since the packing was made
  double list_cell[Space<D>::components];      ///< H when the list was built
  double servo_velocity_gradient[Space<D>::components];
  double largest_contact_force;    ///< normal force, in the last call; sets the force scale
  std::int32_t num_extra;          ///< pairs beyond the owned ones
  std::int32_t list_valid;         ///< 0: build the list before the first step
  std::int64_t steps, rebuilds, lattice_reductions, repeats;
  double work, friction_loss, damping_loss, viscous_loss;
};

template <int D> struct ImageHeader : ImageProgress<D> {
  std::int32_t num_grains;
  std::int32_t extra_capacity;
  MaterialNumbers material;
  double largest_radius, mean_radius, solid_volume;
  /// Bounds what a contact adds to a sum, over its force that counts.
  double obliquity, inverse_obliquity;
  std::int32_t neighbor_bits;    ///< 2^neighbor_bits grains and more find room around the largest
  std::int32_t all_forces_count;    ///< 0: the normal one alone, the others are bounded by friction
};

/// What one RVE shall do in one call, as the device reads it.
template <int D> struct alignas(16) DriveRecord {
  double dt;
  std::int32_t substeps;
  std::int32_t segments;
  double deformation[Space<D>::components];
};

/// A direction in which a servo changes the velocity gradient by what a sum of stresses lacks. Sums run over all components.
template <int D> struct alignas(16) SteeredMode {
  double rate[Space<D>::components];    ///< velocity gradient of amplitude one [-]
  /// dual : L is the amplitude [-]; zero for all other modes, and for what is prescribed.
  double dual[Space<D>::components];
  double stress[Space<D>::components];    ///< stress : sigma is what has the goal [-]
  double goal;                            ///< [stress]
  double gain, max_rate;                  ///< of the amplitude [1/(stress time^2)], [1/time]
};

template <int D> struct alignas(16) SteeredModes {
  std::int32_t count;
  /// The call begins with amplitudes zero, not with those of the call before.
  std::int32_t begin;
  SteeredMode<D> mode[Space<D>::strains];
};

/// The rest of a drive: of a path with several segments, or of a stress servo. A call where no RVE has either goes without.
template <int D> struct alignas(16) SteeringRecord {
  double rotation[Space<D>::components], stretch[Space<D>::components];
  std::int32_t controlled[Space<D>::components];
  double stress_goal[Space<D>::components], velocity_gradient[Space<D>::components];
  double servo_gain, servo_max_rate;
  /// Where the kernel reads them, in place of controlled components; or null.
  const SteeredModes<D> *modes;
};

/// What every call answers. After a fatal status only `status`, `expected_force` and the `needed_` sizes hold, and the image is
/// as it was before the call.
template <int D> struct AnswerRecord {
  std::uint32_t status;
  std::int32_t num_contacts;
  std::int32_t needed_extra;    ///< extra pairs that a rebuild wanted to store
  std::int32_t needed_pairs;    ///< pairs that a rebuild found
  double expected_force;        ///< that the force scale of this call was made for [force]
  double peak_force;    ///< largest contact force of the call that sets the force scale [force]
  double stress[Space<D>::components];    ///< Love, tension positive [stress]
};

/// Components of an AffineStiffness (engine/affine_stiffness.h).
template <int D> constexpr int kStiffness = Space<D>::components *Space<D>::strains;

/// What details may have beyond the usual: the affine stiffness; or, of the general programs and instead of the usual, a lower bound of
/// the stable time step [time] as the first number of `stiffness`.
constexpr std::int32_t kStiffnessDetail = 1, kTimeStepDetail = 2;

/// What a call answers on demand: a second look at the configuration that the last forces belong to.
template <int D> struct DetailRecord {
  ImageProgress<D> progress;    ///< after the call
  std::int32_t num_grains, num_contacts, num_sliding, num_pairs;
  /// Grains with fewer than two contacts; with exactly one.
  std::int32_t num_rattlers, num_single;
  double fabric[Space<D>::components];
  double grain_force_sum, contact_force_sum;
  double largest_overlap, overlap_sum;
  double kinetic_energy, elastic_energy, largest_contact_force;
  double solid_volume;
  double stiffness[kStiffness<D>];    ///< if it is asked for [stress]
};

/// What is the same for all RVEs of a call.
struct BatchConstants {
  double skin;                  ///< [length]; 0: a share of the mean radius
  double overlap_limit;         ///< overlap / smaller radius
  double velocity_arm;          ///< 1/2 contact point, 0 LAMMPS
  std::int32_t track_energy;    ///< fill the energy ledger of the header
  std::int32_t extra_detail;    ///< kStiffnessDetail, kTimeStepDetail or 0
};

}    // namespace rve
