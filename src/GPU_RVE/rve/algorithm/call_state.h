// What is the same for all grains of an RVE while it is advanced: on chip on the GPU, written by one thread.
//
// Inside a call lengths and forces are measured in powers of two, so that changing to them and back costs no bit: the length
// unit makes lever arms at most 1/2, the force unit is the resolution of the integer sums.

#ifndef RVE_ALGORITHM_CALL_STATE_H
#define RVE_ALGORITHM_CALL_STATE_H

#include "rve/algorithm/system_view.h"
#include "rve/core/status.h"
#include "rve/physics/cell_path.h"
#include "rve/physics/contact_law.h"

namespace rve {
inline namespace RVE_ISA {

  /// Internal units, and what follows from the choice of the force unit.
  struct CallUnits {
    double length, per_length;    ///< one internal length [length], and its reciprocal
    double force,
        per_force;    ///< one internal force: 1 of the integer sums [force], and its reciprocal
    double force_limit;      ///< normal forces above may make sums overflow [internal force]
    double contact_force;    ///< 64-bit units in |f| or an energy of one [1/internal unit]

    /// The largest arm is below half of it.
    static RVE_INLINE int length_bits(double largest_radius)
    {
      return floor_log2(largest_radius) + 2;
    }

    /// 2^neighbor_bits grains and more find room around the largest one, so that many contacts at the limit still fit
    /// into the sum: it never wraps. The largest force to expect lies 2 to 8 times lower.
    /// `obliquity` bounds |f| / f_n: sqrt(1 + mu^2).
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

  /// What a DEM step needs to know of the cell.
  template <class Format> struct alignas(16) StepPlan {
    Tensor<typename Format::Wide, 2> to_length;      ///< fraction units to internal lengths
    Tensor<typename Format::Wide, 2> to_fraction;    ///< velocity to fraction units in a step
    Tensor<typename Format::Real, 2> gradient;       ///< L [1/time]
    Tensor<float, 2> list_to_length;                 ///< 32-bit fraction units to internal lengths
    float allowed_squared;    ///< displacement since the list was built [internal length^2]
    std::int32_t special;     ///< the strain alone demands a new list, or the lattice a reduction
    double area;              ///< det H [length^2]
  };

  /// Steps that are planned at a time.
  constexpr int kPlanSteps = 32;

  /// The contact law in a number format; General as in SceneKind.
  template <class Format, bool General>
  using FormatLaw = LinearFrictionLaw<typename Format::Real, typename Format::History, General>;

  template <class Format> struct CallState {
    // what the call works on and with
    ImageHeader header;    ///< a copy, written back at the end of a sound call
    ImageView<Format> image;
    SharedView<Format> shared;
    WorkspaceView<Format> work;
    DriveRecord drive;
    SteeringRecord steering;
    BatchConstants batch;
    std::int32_t num_grains;

    // how far it has come
    std::uint32_t status;
    std::int32_t num_extra, needed_pairs, num_rebuilds, num_reductions;
    PairView<Format> pairs;    ///< of this call: owned ones in `shared`, extra ones in `work`
    Tensor2 cell;    ///< H: with a servo of the present step, else at start and end of the call
    Tensor2 list_cell, deformation, servo_gradient;
    CellPath path;
    double supplied, friction_loss, damping_loss, viscous_loss;    ///< in this call [force length]

    // constants of the call
    CallUnits units;
    double mass_factor;    ///< mass / radius^2 [mass/length^2]
    double
        velocity_factor;    ///< dt/m of a unit radius, in internal units of force, length and velocity
    double skin, expected_force;
    FormatLaw<Format, true> law;    ///< in internal units
    typename Format::Real dt, alpha;

    std::int32_t plan_first, plan_last;    ///< steps that are planned
    StepPlan<Format> plan[kPlanSteps];

    /// Mass of a disk of this radius [mass].
    RVE_INLINE double mass_of(double radius) const { return mass_factor * radius * radius; }
    RVE_INLINE bool fatal() const { return (status & status::Fatal) != 0; }
    RVE_INLINE bool has_servo() const
    {
      return steering.controlled[0] || steering.controlled[1] || steering.controlled[3];
    }
    RVE_INLINE const StepPlan<Format> &planned(int step) const { return plan[step - plan_first]; }
    /// The pairs that the image holds, as arrays.
    RVE_INLINE PairView<Format> image_pairs() const
    {
      return PairView<Format>{image.partner, image.history, image.extra_first, image.extra_second,
                              image.extra_history};
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
