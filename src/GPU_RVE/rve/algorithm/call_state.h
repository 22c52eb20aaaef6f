// SPDX-License-Identifier: GPL-2.0-only
// What is the same for all grains of an RVE while it is advanced: on chip on the GPU, written by one thread.
//
// Inside a call lengths and forces are measured in powers of two, so that changing to them and back costs no bit: the length
// unit makes lever arms at most 1/2, the force unit is the resolution of the integer sums.

#pragma once

#include "rve/algorithm/scene.h"
#include "rve/algorithm/search_grid.h"
#include "rve/algorithm/system_view.h"
#include "rve/core/integer_sums.h"
#include "rve/core/status.h"
#include "rve/physics/cell_path.h"
#include "rve/physics/grain_shape.h"

#include <cstddef>

namespace rve {
inline namespace RVE_ISA {

  /// Internal units, and what follows from the choice of the force unit.
  struct CallUnits {
    double length, per_length;    ///< one internal length [length], and its reciprocal
    /// One internal force: 1 of the integer sums [force], and its reciprocal.
    double force, per_force;
    double force_limit;      ///< forces that count above it may make sums overflow [internal force]
    double contact_force;    ///< 64-bit units in |f| or an energy of one [1/internal unit]

    /// Longer than the branch of any contact, so that arms are below half of it.
    static RVE_INLINE int length_bits(double contact_range)
    {
      return floor_log2(contact_range) + 1;
    }

    /// 2^neighbor_bits grains and more find room around the largest one, so that many contacts at the limit still fit
    /// into the sum: it never wraps. The largest force to expect lies 2 to 8 times lower.
    /// `obliquity` bounds what a contact adds to a sum, over its force that counts: the normal one, or the largest of all.
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
      // sums over 2^17 contacts, each at the limit, shall stay within 62 bits
      const int room = 62 - 17 - limit_bits - 1;
      contact_force = power_of_two(room);
    }
  };

  /// From centre to centre of the farthest grains that may act on each other [length].
  template <class Scene> RVE_INLINE double contact_range(const ImageHeader<Scene::D> &header)
  {
    return 2.0 * header.largest_radius + Scene::Law::reach(header.material);
  }

  /// The cell in a step.
  template <class Numbers, int D> struct CellOfStep {
    Tensor<typename Numbers::Wide, D> to_length;      ///< fraction units to internal lengths
    Tensor<typename Numbers::Wide, D> to_fraction;    ///< velocity to fraction units in a step
    Tensor<typename Numbers::Real, D> gradient;       ///< L [1/time]
  };

  /// With 32-bit fraction units to internal lengths, also where fractions have more bits.
  template <class Numbers, int D> struct LeadingCell : CellOfStep<Numbers, D> {
    Tensor<float, D> leading_to_length;

    RVE_INLINE const Tensor<float, D> &list_to_length() const { return leading_to_length; }
    RVE_INLINE void set_list_to_length(const Tensor<float, D> &x) { leading_to_length = x; }
  };
  /// They are the same. Spheres have little room on chip for their plans.
  template <> struct LeadingCell<FastNumbers, 3> : CellOfStep<FastNumbers, 3> {
    RVE_INLINE const Tensor<float, 3> &list_to_length() const { return to_length; }
    RVE_INLINE void set_list_to_length(const Tensor<float, 3> &) {}
  };

  /// What a DEM step needs to know of the cell.
  template <class Numbers, int D> struct alignas(16) StepPlan : LeadingCell<Numbers, D> {
    /// Displacement since the list was built [internal length^2]. Below zero, so that no grain is within it: the strain alone demands a new
    /// list, or the lattice a reduction.
    float allowed_squared;
    /// Less far than this along each axis no grain has left the list, whatever the direction [32-bit fraction units].
    std::uint32_t safe_box;
    double volume;    ///< det H [length^D]
  };
  template <class Scene> using PlanOf = StepPlan<typename Scene::Numbers, Scene::D>;

  /// Steps that are planned at a time. The threads of a GPU put their grains down between two plans: with 128 in place of 32 steps `mixed` gains
  /// 5 % on an H200. Of spheres in `fast` four small RVEs have room on chip for 64 each; where fewer share it, or the chip has more room, plans
  /// are longer (plan_steps_beside).
  template <class Scene>
  constexpr int kPlanSteps = Scene::plan_steps > 0
      ? Scene::plan_steps
      : (sizeof(typename Scene::Wide) > 4 ? 128 : (Scene::D == 3 ? 64 : 32));

  /// What an RVE has lost in a call [force length].
  struct EnergyLoss {
    double damping = 0.0, friction = 0.0, viscous = 0.0;
  };

  /// What a call begins with, and how far it has come, without what belongs to the block. A GPU prepares it for all RVEs of a call
  /// in a kernel of its own; the block that advances an RVE takes a copy, up to the entries of the plan that are not made.
  template <class Scene> struct PreparedCall {
    ImageHeader<Scene::D> header;    ///< a copy
    DriveRecord<Scene::D> drive;
    SteeringRecord<Scene::D> steering;
    BatchConstants batch;
    ImageView<Scene> image;
    std::int32_t num_grains;

    // how far it has come
    std::uint32_t status;
    std::int32_t num_extra, needed_pairs, num_rebuilds, num_reductions;
    /// H: with a servo of the present step, else at start and end of the call.
    Tensor<double, Scene::D> cell;
    Tensor<double, Scene::D> list_cell, deformation, servo_gradient;
    CellPath<Scene::D> path;
    /// 1 / (det H times thickness) at the end, with a servo in the present step [1/length^3]
    double end_per_volume;
    /// As after a sound call, but for its largest force; with a servo or a ledger from the last step on.
    ImageProgress<Scene::D> after;
    double supplied;    ///< work of the mean field in this call [force length]

    // constants of the call
    CallUnits units;
    double mass_factor;    ///< mass / radius^D [mass/length^D]
    /// dt/m of a unit radius, in internal units of force, length and velocity.
    double velocity_factor;
    double skin, expected_force;
    /// Below it all is well with the largest force on any grain [internal force].
    float sound_force;
    typename Scene::Law::Constants law;
    typename Scene::Real alpha;    ///< of local damping, below zero for that which knows no axes

    static_assert(kStepsAhead <= kPlanSteps<Scene>, "there is room for those planned ahead");
    std::int32_t plan_first, plan_last;       ///< steps that are planned
    PlanOf<Scene> plan[kPlanSteps<Scene>];    ///< at the end

    /// Bytes up to the end of the plan of some steps.
    static RVE_INLINE constexpr std::size_t size_with(int planned)
    {
      return sizeof(PreparedCall) - (kPlanSteps<Scene> - planned) * sizeof(PlanOf<Scene>);
    }
    /// Mass of a grain of this radius [mass].
    RVE_INLINE double mass_of(double radius) const
    {
      return times_power<Scene::D>(mass_factor, radius);
    }
    RVE_INLINE bool fatal() const { return (status & status::Fatal) != 0; }
    RVE_INLINE bool has_servo() const
    {
      bool has = false;
      for (int k = 0; k < Scene::components; ++k) has = has || steering.controlled[k];
      return has || steering.modes;
    }
    /// Whether work and losses of the steps are added up.
    RVE_INLINE bool keeps_ledger() const { return batch.track_energy && drive.substeps > 0; }
    RVE_INLINE const PlanOf<Scene> &planned(int step) const { return plan[step - plan_first]; }
    /// Whether list and force scale of the call before serve on.
    RVE_INLINE bool is_continued() const
    {
      return header.list_valid && header.largest_contact_force > 0.0;
    }
  };

  /// Love sums, row by row, in internal units, the number of contacts, and of those whose overlap is beyond the limit.
  template <int D> struct StressSums {
    static constexpr int contacts = Space<D>::components, over_limit = contacts + 1,
                         count = over_limit + 1;
  };

  template <class Scene> struct CallState : PreparedCall<Scene> {
    /// Of the last forces for which it was wanted: Love sums, and the largest force that counted in the call [internal force], infinite
    /// where a number is not finite.
    Reduction<StressSums<Scene::D>::count> totals;
    Tensor<double, Scene::D> list_inverse;    ///< of list_cell, for a servo
    SharedView<Scene> shared;
    WorkspaceView<Scene> work;
    /// Of this call: owned ones in `shared`, extra ones in `work`. Aligned, whatever is before: 8 bytes further on the steps of disks in `fast`
    /// had two more spilled numbers (nvcc 13.0), and took 4 % longer.
    alignas(16) PairView<Scene> pairs;
    SearchGrid<Scene::D> list_grid;    ///< of the list that is built
    bool list_fits;                    ///< into the cell

    /// In the RveState, of grain i: a new list orders the grains anew.
    RVE_INLINE std::int32_t number_of(int i) const
    {
      return this->num_rebuilds > 0 ? work.number[i] : this->image.number[i];
    }

    /// The pairs that the image holds, as arrays.
    RVE_INLINE PairView<Scene> image_pairs() const
    {
      const ImageView<Scene> &image = this->image;
      return PairView<Scene>{image.partner, image.history, image.extra_first, image.extra_second,
                             image.extra_history};
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
