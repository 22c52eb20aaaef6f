// SPDX-License-Identifier: GPL-2.0-only
// Complete state of one RVE, in numbers that every format of the engine can read and write without
// loss. Restart files, migration between ranks, packing files and tests use it.

#pragma once

#include "rve/core/tensor.h"
#include "rve/physics/grain_shape.h"
#include "rve/physics/material.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

namespace rve {

/// Returns true if contacts of spheres resist twisting: with a stiffness and a coefficient, or by
/// friction.
bool resists_twisting(const Material &material);
/// Returns true if contacts resist rolling or twisting.
bool resists_rolling(const Material &material);

/// Pair of grains in the Verlet list. The work item of grain `first` computes the contact.
template <int D> struct PairOf;

template <> struct PairOf<2> {
  std::int32_t first;
  std::int32_t second;
  /// History: force on `first` along t = (-n_y, n_x), n from first to second [force].
  double tangential_force;
  /// History: moment on `first` over the reduced radius r_1 r_2 / (r_1 + r_2) [force].
  double rolling_force = 0.0;
  double contact_radius = 0.0;    ///< history: contact radius of the tangential force [length]
};

using Pair = PairOf<2>;

template <> struct PairOf<3> {
  std::int32_t first;
  std::int32_t second;
  Vec<double, 3> tangential_force;    ///< history: force on `first`, across the normal [force]
  double contact_radius = 0.0;        ///< history: contact radius of the tangential force [length]
  /// History: vector g for which n x g is the moment on `first` over the reduced radius [force].
  /// The normal n points from first to second.
  Vec<double, 3> rolling_force = Vec<double, 3>::zero();
  /// History: moment on `first` along n [force length]. If friction resists twisting, the moment is
  /// scaled to an overlap as large as the reduced radius.
  double twisting_moment = 0.0;
};

/// Description of a number in the history of a pair.
template <int D> struct RememberedNumber {
  const char *name;    ///< name in packing files
  const char *what;    ///< name in messages
  const char *unit;
  double &(*get)(PairOf<D> &);
  bool is_mirrored;              ///< changes its sign in a mirror
  bool begins_vector = false;    ///< forms a vector with the next two numbers

  double &of(PairOf<D> &pair) const { return get(pair); }
  double of(const PairOf<D> &pair) const { return get(const_cast<PairOf<D> &>(pair)); }
};

/// History of pairs of disks, in the order of packing files and restart records. A packing file
/// contains the first number, and all others up to the last one that is nonzero in some pair.
constexpr RememberedNumber<2> PAIR_MEMORY[] = {
    {"tangential_force", "tangential force", "[force]",
     [](Pair &pair) -> double & { return pair.tangential_force; }, true},
    {"rolling_force", "rolling force", "[force]",
     [](Pair &pair) -> double & { return pair.rolling_force; }, true},
    {"contact_radius", "contact radius", "[length]",
     [](Pair &pair) -> double & { return pair.contact_radius; }, false}};

/// History of pairs of spheres, in the order of packing files and restart records. A packing file
/// contains at least the tangential force, and all numbers up to the last one that is nonzero in
/// some pair.
constexpr RememberedNumber<3> SPATIAL_PAIR_MEMORY[] = {
    {"tangential_force_x", "x component of the tangential force", "[force]",
     [](PairOf<3> &pair) -> double & { return pair.tangential_force[0]; }, false, true},
    {"tangential_force_y", "y component of the tangential force", "[force]",
     [](PairOf<3> &pair) -> double & { return pair.tangential_force[1]; }, false},
    {"tangential_force_z", "z component of the tangential force", "[force]",
     [](PairOf<3> &pair) -> double & { return pair.tangential_force[2]; }, false},
    {"contact_radius", "contact radius", "[length]",
     [](PairOf<3> &pair) -> double & { return pair.contact_radius; }, false},
    {"rolling_force_x", "x component of the rolling force", "[force]",
     [](PairOf<3> &pair) -> double & { return pair.rolling_force[0]; }, false, true},
    {"rolling_force_y", "y component of the rolling force", "[force]",
     [](PairOf<3> &pair) -> double & { return pair.rolling_force[1]; }, false},
    {"rolling_force_z", "z component of the rolling force", "[force]",
     [](PairOf<3> &pair) -> double & { return pair.rolling_force[2]; }, false},
    {"twisting_moment", "twisting moment", "[force length]",
     [](PairOf<3> &pair) -> double & { return pair.twisting_moment; }, true}};

template <int D> constexpr const auto &pair_memory()
{
  if constexpr (D == 2)
    return PAIR_MEMORY;
  else
    return SPATIAL_PAIR_MEMORY;
}

/// Returns how many of the first values of pair_memory() represent these pairs: all values up to
/// the last one that is nonzero in some pair, and at least one.
template <int D> int remembered_numbers(const std::vector<PairOf<D>> &pairs)
{
  int count = static_cast<int>(std::size(pair_memory<D>()));
  for (; count > 1; --count)
    if (std::any_of(pairs.begin(), pairs.end(), [&](const PairOf<D> &pair) {
          return pair_memory<D>()[count - 1].of(pair) != 0.0;
        }))
      break;
  return count;
}

/// Counters of the run so far, kept over restarts.
struct Counters {
  std::int64_t steps = 0;
  std::int64_t rebuilds = 0;
  std::int64_t lattice_reductions = 0;
  std::int64_t repeats = 0;    ///< repetitions with larger lists or a coarser force scale
};

/// Supplied and dissipated energy since the state was made (only with Options::track_energy).
struct EnergyTotals {
  double work = 0.0;             ///< work of the mean field, sum of V sigma : L dt [force length]
  double friction = 0.0;         ///< loss by sliding and rolling [force length]
  double local_damping = 0.0;    ///< loss by Cundall's damping [force length]
  double viscous = 0.0;          ///< loss by contact dashpots [force length]
};

/// State of one RVE. Positions x = H s are stored as fractional coordinates s in [0,1)^D, as
/// unsigned 64-bit fixed point (s * 2^64). A spin has one component for disks and three for
/// spheres.
template <int D> struct RveStateOf {
  Material material;
  /// Cell matrix H, whose columns are the cell vectors [length].
  Tensor<double, D> cell = Tensor<double, D>::identity();
  /// Deformation gradient F since the packing was made [-].
  Tensor<double, D> deformation = Tensor<double, D>::identity();

  std::vector<double> radius;               ///< (N) [length]
  std::vector<std::uint64_t> fractional;    ///< (N, D) s * 2^64
  std::vector<double> velocity;             ///< (N, D) peculiar velocity c = v - L x [length/time]
  std::vector<double> spin;    ///< (N, spins) angular velocity, counter-clockwise [1/time]

  /// Verlet list with contact history. If it is empty, the engine builds it.
  std::vector<PairOf<D>> pairs;
  /// Cell matrix H when the list was built; zero: no list yet.
  Tensor<double, D> list_cell = Tensor<double, D>::zero();
  std::vector<std::uint64_t> list_fractional;    ///< (N, D) s when the list was built, or empty
  /// Gap up to which the list contains pairs [length]. 0 stands for the gap that belongs to the
  /// default skin without an adhesion.
  double list_margin = 0.0;

  /// (N) Grain numbers in the storage order of the engine. If it is empty, the engine chooses an
  /// order with neighbours next to each other. The order is stored so that a restart continues bit
  /// for bit.
  std::vector<std::int32_t> order;

  /// Velocity gradient L of the stress servo at the end of the last call [1/time].
  Tensor<double, D> servo_velocity_gradient = Tensor<double, D>::zero();
  /// Largest contact force of the last call, which sets the scale of the force integers [force].
  double largest_contact_force = 0.0;
  Counters counters;
  EnergyTotals energy;

  int num_grains() const { return static_cast<int>(radius.size()); }
  double cell_volume() const { return determinant(cell); }    ///< [length^D]
  double solid_volume() const;    ///< of all grains, sum of pi r^2 for disks [length^D]
  double void_ratio() const { return cell_volume() / solid_volume() - 1.0; }    ///< [-]
  double mass() const;                                                          ///< [mass]

  /// Removes the list, so that the next call builds a new one. The pairs keep their history.
  void forget_list()
  {
    list_cell = Tensor<double, D>::zero();
    list_fractional.clear();
    list_margin = 0.0;
  }

  /// Returns true if a pair has a rolling force or a twisting moment.
  bool has_rolling_forces() const;

  /// Returns Cartesian positions (N, D) in the cell at the origin [length].
  std::vector<double> positions() const;
  void set_positions(const std::vector<double> &x);

  /// Throws InputError unless the arrays have the right sizes, every number is finite and in range,
  /// and the cell is wider than twice the largest contact distance.
  void check() const;
  /// Checks only material and radii, and the masses and frequencies that follow from them.
  void check_sizes() const;
};
using RveState = RveStateOf<2>;

/// serialize() returns a byte record of a state, without rounding, in host byte order.
/// deserialize() returns the state of a record. It throws InputError if the record is damaged.
template <int D> std::vector<char> serialize(const RveStateOf<D> &state);
template <int D = 2> RveStateOf<D> deserialize(const char *data, std::size_t size);

}    // namespace rve
