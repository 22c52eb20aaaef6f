// SPDX-License-Identifier: GPL-2.0-only
// State of one RVE between calls: a header and arrays in one block of memory, with the same bytes
// on CPU and GPU. The structs are plain data, outside of the instruction-set namespaces, since all
// builds use them.

#pragma once

#include "rve/core/space.h"
#include "rve/physics/material.h"

#include <cstdint>

namespace rve {

/// Capacities for the pairs of a grain or an RVE, by dimension.
template <int D> struct PairCounts;
template <> struct PairCounts<2> {
  /// Largest number of pairs that one grain owns. The owner of a pair computes it. A planar contact
  /// graph has at most three pairs per grain on average. Further pairs of a grain are in the list
  /// of extra pairs.
  static constexpr int owned = 3;
  /// Initial capacities: listed pairs per grain in the memory of a block, and grains per extra pair
  /// in the state of an RVE. The capacities grow when needed.
  static constexpr int listed_at_first = 4, grains_per_extra_at_first = 16;
};

template <> struct PairCounts<3> {
  /// With 1000 spheres and a skin of at most a tenth of their radius, nearly all pairs fit into
  /// four slots per grain. Five slots would cost a tenth of the speed.
  static constexpr int owned = 4;
  static constexpr int listed_at_first = 8, grains_per_extra_at_first = 8;
};

/// Default skin of the list, divided by the mean radius [-]. With this skin a quasi-static packing
/// uses one list for hundreds of steps, and few of the listed pairs do not touch. With equal skins,
/// spheres have more listed pairs that do not touch than disks, and their lists last longer.
template <int D> constexpr double kDefaultSkinShare = D == 2 ? 0.1 : 0.05;

/// Largest number of steps of a call that are planned before it begins.
constexpr int kStepsAhead = 32;

/// Part of the stored state that a call changes, except the grains.
template <int D> struct alignas(16) StateProgress {
  double cell[Space<D>::components];           ///< H [length]
  double deformation[Space<D>::components];    ///< F since the packing was made [-]
  double list_cell[Space<D>::components];      ///< H when the list was built
  double servo_velocity_gradient[Space<D>::components];
  /// Largest force in the last call among the forces that count (all_forces_count). It sets the
  /// force scale [force].
  double largest_contact_force;
  std::int32_t num_extra;     ///< number of extra pairs
  std::int32_t list_valid;    ///< 0: build the list before the first step
  std::int64_t steps, rebuilds, lattice_reductions, repeats;
  double work, friction_loss, damping_loss, viscous_loss;
};

template <int D> struct StateHeader : StateProgress<D> {
  std::int32_t num_grains;
  std::int32_t extra_capacity;
  MaterialNumbers material;
  double largest_radius, mean_radius, solid_volume;
  /// A contact adds at most `obliquity` times the force that counts to a sum
  /// (CallUnits::choose_force()). The other number is the reciprocal.
  double obliquity, inverse_obliquity;
  std::int32_t neighbor_bits;    ///< at most 2^neighbor_bits grains fit around the largest one
  /// 0: only the normal force of a contact counts, since friction bounds the other forces.
  /// Otherwise all forces count.
  std::int32_t all_forces_count;
};

/// Prescribed motion of one RVE in one call, for the device.
template <int D> struct alignas(16) DriveRecord {
  double dt;
  std::int32_t substeps;
  std::int32_t segments;
  double deformation[Space<D>::components];
};

/// Mode of a servo: a direction in the space of velocity gradients. The servo changes the amplitude
/// of the mode until a weighted sum of stress components reaches its goal. a : b is the sum of a_ij
/// b_ij over all components.
template <int D> struct alignas(16) SteeredMode {
  double rate[Space<D>::components];    ///< velocity gradient of amplitude one [-]
  /// Weights such that dual : L is the amplitude of this mode in the velocity gradient L [-]. The
  /// amplitude is zero if L is another mode or the prescribed gradient.
  double dual[Space<D>::components];
  double stress[Space<D>::components];    ///< stress : sigma is the controlled sum [-]
  double goal;                            ///< [stress]
  double gain, max_rate;    ///< gain and limit of the amplitude [1/(stress time^2)], [1/time]
};

template <int D> struct alignas(16) SteeredModes {
  std::int32_t count;
  /// If not zero, the call begins with amplitudes of zero instead of those of the last call.
  std::int32_t begin;
  SteeredMode<D> mode[Space<D>::strains];
};

/// Additional data of a prescribed motion: of a path with several segments, or of a stress servo. A
/// call with neither has no such record.
template <int D> struct alignas(16) SteeringRecord {
  double rotation[Space<D>::components], stretch[Space<D>::components];
  std::int32_t controlled[Space<D>::components];
  double stress_goal[Space<D>::components], velocity_gradient[Space<D>::components];
  double servo_gain, servo_max_rate;
  /// Modes of the servo, at an address that the kernel can read. They replace the controlled
  /// components. Null if the servo has no modes.
  const SteeredModes<D> *modes;
};

/// Results of a call. After a fatal status only `status`, `expected_force` and the `needed_` sizes
/// are valid, and the stored state is unchanged.
template <int D> struct AnswerRecord {
  std::uint32_t status;
  std::int32_t num_contacts;
  std::int32_t needed_extra;    ///< extra pairs that a rebuild found
  std::int32_t needed_pairs;    ///< pairs that a rebuild found
  double expected_force;        ///< force for which the force scale of this call was chosen [force]
  double peak_force;    ///< largest contact force of the call, which sets the force scale [force]
  double stress[Space<D>::components];    ///< Love stress, tension positive [stress]
};

/// Number of components of an AffineStiffness (engine/affine_stiffness.h).
template <int D> constexpr int kStiffness = Space<D>::components *Space<D>::strains;

/// Values of BatchConstants::extra_detail. kStiffnessDetail adds the affine stiffness.
/// kTimeStepDetail, in kernels with all bookkeeping, replaces the usual details by a lower bound of
/// the stable time step [time], which is the first number of `stiffness`.
constexpr std::int32_t kStiffnessDetail = 1, kTimeStepDetail = 2;

/// Results on demand: details of the configuration of the last forces.
template <int D> struct DetailRecord {
  StateProgress<D> progress;    ///< after the call
  std::int32_t num_grains, num_contacts, num_sliding, num_pairs;
  /// Numbers of grains with fewer than two contacts, and with exactly one.
  std::int32_t num_rattlers, num_single;
  double fabric[Space<D>::components];
  double grain_force_sum, contact_force_sum;
  double largest_overlap, overlap_sum;
  double kinetic_energy, elastic_energy, largest_contact_force;
  double solid_volume;
  double stiffness[kStiffness<D>];    ///< if requested [stress]
};

/// Constants that are the same for all RVEs of a call.
struct BatchConstants {
  double skin;                  ///< [length]; 0: kDefaultSkinShare times mean radius
  double overlap_limit;         ///< overlap / smaller radius
  double velocity_arm;          ///< 1/2: contact point, 0: as LAMMPS
  std::int32_t track_energy;    ///< not 0: sum the energies of the header
  std::int32_t extra_detail;    ///< kStiffnessDetail, kTimeStepDetail or 0
};

}    // namespace rve
