// SPDX-License-Identifier: GPL-2.0-only
// Numbers that are the same for all grains of an RVE during a call. On a GPU they are on chip, and
// one thread writes them.
//
// Inside a call the units of length and force are powers of two times the units of the script, so
// that the conversion does not round. The length unit is so large that lever arms are at most 1/2.
// The force unit is the resolution of the integer sums.

#pragma once

#include "rve/algorithm/kernel_config.h"
#include "rve/algorithm/search_grid.h"
#include "rve/algorithm/system_view.h"
#include "rve/core/integer_sums.h"
#include "rve/core/status.h"
#include "rve/physics/cell_path.h"
#include "rve/physics/grain_shape.h"

#include <cstddef>

namespace rve {
inline namespace RVE_ISA {

  /// Internal units and numbers that depend on them.
  struct CallUnits {
    double length, per_length;    ///< unit of length [length] and its reciprocal
    /// Unit of force [force] and its reciprocal. One unit of force is 1 in the integer sums.
    double force, per_force;
    double force_limit;      ///< forces above it can make sums overflow [internal force]
    double contact_force;    ///< factor from internal |f| or energy to 64-bit sums

    /// Returns n such that the length 2^n is above the branch of any contact. Lever arms are then
    /// below 2^n / 2.
    static RVE_INLINE int length_bits(double contact_range)
    {
      return floor_log2(contact_range) + 1;
    }

    /// Chooses the force unit and the force limit so that sums of contact forces up to the limit do
    /// not wrap: a sum has at most 2^neighbor_bits contacts, since no more grains fit around the
    /// largest one. The limit is 2 to 8 times the largest expected force. A contact adds at most
    /// `obliquity` times the force that counts to a sum. The force that counts is the normal force,
    /// or the largest of all forces of the contact (StateHeader::all_forces_count).
    RVE_INLINE void choose_force(int sum_bits, int neighbor_bits, double largest_contact_force,
                                 double obliquity, double inverse_obliquity)
    {
      const int limit_bits = sum_bits - neighbor_bits;
      const double expected = largest_contact_force * (obliquity > 1.5 ? obliquity : 1.0);
      const int expected_bits = limit_bits - 3 < 52 ? limit_bits - 3 : 52;
      const int force_bits = floor_log2(expected) - expected_bits;
      force = power_of_two(force_bits);
      per_force = power_of_two(-force_bits);
      force_limit = power_of_two(limit_bits) * inverse_obliquity;
      // Sums over 2^17 contacts at the limit must stay within 62 bits.
      const int spare_bits = 62 - 17 - limit_bits - 1;
      contact_force = power_of_two(spare_bits);
    }
  };

  /// Returns the largest distance of the centres of two grains that act on each other [length].
  template <class Config> RVE_INLINE double contact_range(const StateHeader<Config::D> &header)
  {
    return 2.0 * header.largest_radius + Config::Law::reach(header.material);
  }

  /// Matrices of the cell in a step.
  template <class Numbers, int D> struct CellOfStep {
    Tensor<typename Numbers::Wide, D> to_length;      ///< fraction units to internal lengths
    Tensor<typename Numbers::Wide, D> to_fraction;    ///< velocity to fraction units in a step
    Tensor<typename Numbers::Real, D> gradient;       ///< L [1/time]
  };

  /// Matrices of the cell in a step, with an additional matrix from 32-bit fraction units to
  /// internal lengths. Formats whose fractions have more bits need it.
  template <class Numbers, int D> struct LeadingCell : CellOfStep<Numbers, D> {
    Tensor<float, D> leading_to_length;

    RVE_INLINE const Tensor<float, D> &list_to_length() const { return leading_to_length; }
    RVE_INLINE void set_list_to_length(const Tensor<float, D> &x) { leading_to_length = x; }
  };
  /// For 32-bit fractions both matrices are equal and one is stored: plans of spheres have little
  /// space on chip.
  template <> struct LeadingCell<FastNumbers, 3> : CellOfStep<FastNumbers, 3> {
    RVE_INLINE const Tensor<float, 3> &list_to_length() const { return to_length; }
    RVE_INLINE void set_list_to_length(const Tensor<float, 3> &) {}
  };

  /// Plan of one DEM step: the cell, and the limits of displacements beyond which a new list is
  /// needed.
  template <class Numbers, int D> struct alignas(16) StepPlan : LeadingCell<Numbers, D> {
    /// Square of the allowed displacement since the list was built [internal length^2]. If the
    /// strain alone requires a new list, or if the lattice must be reduced, it is negative, so that
    /// every displacement exceeds it.
    float allowed_squared;
    /// Half width of a box in fractional coordinates [32-bit fraction units]. A grain whose
    /// displacement along each axis is smaller has not moved farther than the list allows.
    std::uint32_t safe_box;
    double volume;    ///< det H [length^D]
  };
  template <class Config> using PlanOf = StepPlan<typename Config::Numbers, Config::D>;

  /// Number of steps that are planned at a time. The threads of a GPU store their grains between
  /// two plans, so that longer plans are faster: with 128 instead of 32 steps `mixed` gains 5 % on
  /// an H200. For spheres in `fast`, four small RVEs have space on chip for 64 steps each. If fewer
  /// RVEs share the chip, or if the chip is larger, plans are longer (plan_steps_beside).
  template <class Config>
  constexpr int kPlanSteps = Config::plan_steps > 0
      ? Config::plan_steps
      : (sizeof(typename Config::Wide) > 4 ? 128 : (Config::D == 3 ? 64 : 32));

  /// Energy that an RVE lost in a call [force length].
  struct EnergyLoss {
    double damping = 0.0, friction = 0.0, viscous = 0.0;
  };

  /// State of a call at its beginning, and its progress. Views of the memory of a block are in
  /// CallState. A GPU prepares this struct for all RVEs of a call in a separate kernel. The block
  /// that advances an RVE copies the struct, except for unused plan entries.
  template <class Config> struct PreparedCall {
    StateHeader<Config::D> header;    ///< a copy
    DriveRecord<Config::D> drive;
    SteeringRecord<Config::D> steering;
    BatchConstants batch;
    DeviceStateView<Config> device_state;
    std::int32_t num_grains;

    // The progress of the call follows.
    std::uint32_t status;
    std::int32_t num_extra, needed_pairs, num_rebuilds, num_reductions;
    /// With a servo, H of the current step. Otherwise H at the start of the call.
    Tensor<double, Config::D> cell;
    Tensor<double, Config::D> list_cell, deformation, servo_gradient;
    CellPath<Config::D> path;
    /// 1 / (det H times thickness) at the end of the call, or in the current step with a servo
    /// [1/length^3].
    double end_per_volume;
    /// Stored progress after a successful call, except its largest force. With a servo or energy
    /// bookkeeping it is complete only after the last step.
    StateProgress<Config::D> after;
    double supplied;    ///< work of the mean field in this call [force length]

    // The constants of the call follow.
    CallUnits units;
    double mass_factor;    ///< mass / radius^D [mass/length^D]
    /// dt/m of a grain of radius one, in internal units of force, length and velocity.
    double velocity_factor;
    double skin, expected_force;
    /// If the largest force on any grain is below this limit, no grain has an error [internal
    /// force].
    float sound_force;
    typename Config::Law::Constants law;
    /// Coefficient of local damping; below zero for objective damping
    typename Config::Real alpha;

    static_assert(kStepsAhead <= kPlanSteps<Config>,
                  "the plan has space for the steps planned ahead");
    std::int32_t plan_first, plan_last;         ///< steps that are planned
    PlanOf<Config> plan[kPlanSteps<Config>];    ///< last member: its unused end is not copied

    /// Returns the number of bytes up to the end of `planned` plan entries.
    static RVE_INLINE constexpr std::size_t size_with(int planned)
    {
      return sizeof(PreparedCall) - (kPlanSteps<Config> - planned) * sizeof(PlanOf<Config>);
    }
    /// Returns the mass of a grain of this radius [mass].
    RVE_INLINE double mass_of(double radius) const
    {
      return times_power<Config::D>(mass_factor, radius);
    }
    RVE_INLINE bool fatal() const { return (status & status::Fatal) != 0; }
    RVE_INLINE bool has_servo() const
    {
      bool has = false;
      for (int k = 0; k < Config::components; ++k) has = has || steering.controlled[k];
      return has || steering.modes;
    }
    /// Returns whether the steps sum work and losses.
    RVE_INLINE bool tracks_energy() const { return batch.track_energy && drive.substeps > 0; }
    RVE_INLINE const PlanOf<Config> &planned(int step) const { return plan[step - plan_first]; }
    /// Returns whether list and force scale of the last call remain valid.
    RVE_INLINE bool is_continued() const
    {
      return header.list_valid && header.largest_contact_force > 0.0;
    }
  };

  /// Indices of the sums of forces: Love sums, row by row, in internal units, then the number of
  /// contacts, then the number of contacts beyond the overlap limit.
  template <int D> struct StressSums {
    static constexpr int contacts = Space<D>::components, over_limit = contacts + 1,
                         count = over_limit + 1;
  };

  template <class Config> struct CallState : PreparedCall<Config> {
    /// Results of the last force evaluation that requested sums: the Love sums, and the largest
    /// force in the call among the forces that count (CallUnits::choose_force()) [internal force].
    /// The largest force is infinite if a number of a grain is NaN.
    Reduction<StressSums<Config::D>::count> totals;
    Tensor<double, Config::D> list_inverse;    ///< inverse of list_cell, for a servo
    SharedView<Config> shared;
    WorkspaceView<Config> work;
    /// Pairs of this call: owned pairs are in `shared`, extra pairs in `work`. The alignment is
    /// fixed: with an offset of 8 bytes the steps of disks in `fast` had two more spilled numbers
    /// (nvcc 13.0) and took 4 % longer.
    alignas(16) PairView<Config> pairs;
    SearchGrid<Config::D> list_grid;    ///< search grid of the list that is built
    bool list_fits;                     ///< true if the cell is wide enough for the list

    /// Returns the number of grain i in the RveState. A new list changes the order of the grains.
    RVE_INLINE std::int32_t number_of(int i) const
    {
      return this->num_rebuilds > 0 ? work.number[i] : this->device_state.number[i];
    }

    /// Returns the stored pairs as arrays.
    RVE_INLINE PairView<Config> image_pairs() const { return this->device_state; }
  };

}    // namespace RVE_ISA
}    // namespace rve
