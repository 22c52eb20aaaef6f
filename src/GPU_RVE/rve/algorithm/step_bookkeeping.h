// SPDX-License-Identifier: GPL-2.0-only
// Energy and stress bookkeeping of steps: the servo, the work of the mean field and the losses of
// grains.

#pragma once

#include "rve/algorithm/call_progress.h"
#include "rve/algorithm/grain_motion.h"
#include "rve/algorithm/step_planning.h"
#include "rve/algorithm/stored_grain.h"
#include "rve/algorithm/stress_servo.h"
#include "rve/physics/grain_shape.h"

namespace rve {
inline namespace RVE_ISA {

  /// Returns the work of Cundall's damping on one velocity component in one step [force length].
  RVE_INLINE double damping_loss(double mass, double before, double after, double increment)
  {
    return -mass * ((after - before) - increment) * 0.5 * (before + after);
  }

  /// Bookkeeping of a call with a servo, with energies, or with both.
  template <class Block, class Config> struct StepBookkeeping {
    using Item = typename Block::Item;
    using Real = typename Config::Real;
    using Planning = StepPlanning<Block, Config>;
    using Stored = StoredGrains<Block, Config>;

    Block &block;
    CallState<Config> &call;
    bool tracks_energy, has_servo;

    RVE_INLINE StepBookkeeping(Block &block_in, CallState<Config> &call_in) :
        block(block_in), call(call_in),
        tracks_energy(Config::has_bookkeeping && call.tracks_energy()),
        has_servo(Config::steers && call.has_servo())
    {
    }
    RVE_INLINE bool is_wanted() const { return has_servo || tracks_energy; }

    /// Plans step k, whose cell is known. With energy bookkeeping it adds the first half of the
    /// work of the step.
    RVE_INLINE void begin_step(int k) const
    {
      if (has_servo) {
        Planning::plan_servo_step(block, call, k, [&] {
          if (tracks_energy) add_half_of_work(gradient_before(call.plan[0]));
        });
        return;
      }
      if (k > call.plan_last) Planning::make_plan(block, call, k);
      block.once([&] { add_half_of_work(gradient_before(call.planned(k))); });
    }

    /// Completes the bookkeeping after the forces of step k. One thread calls it.
    RVE_INLINE void end_step(int k) const
    {
      if (tracks_energy) add_half_of_work(call.planned(k).gradient.template as<double>());
      if (has_servo) steer();
    }

    /// Prepares the force evaluation of the configuration before the first step. The first half of
    /// the work of a step depends on the stress before the step. The evaluation writes its Love
    /// sums to call.totals. end_step_zero() restores all other data.
    RVE_INLINE void begin_step_zero() const
    {
      Stored::copy_history(block, call, call.pairs, call.work.fresh);
      block.once([&] {
        call.plan[0] = PlanOf<Config>();
        call.plan[0].to_length =
            fraction_to_length<typename Config::Numbers>(call.units.per_length * call.cell);
        call.plan_first = call.plan_last = 0;    // the steps are planned later
        call.list_inverse = inverse(call.list_cell);
        call.law.dt = Real(0);
      });
    }

    RVE_INLINE void end_step_zero(const SharedView<Config> &shared) const
    {
      Stored::copy_history(block, call, call.work.fresh, call.pairs);
      block.for_each(call.num_grains, [&](Item i) {
        clear_sums<Block>(shared, i);
        shared.largest_force[i] = Real(0);
        call.work.damping[i] = call.work.friction[i] = call.work.viscous[i] = 0.0;
      });
      block.once([&] { call.law.dt = static_cast<Real>(call.drive.dt); });
    }

    /// Sets the cell of the next step of a servo. One thread calls it.
    RVE_INLINE void grow_cell() const
    {
      const Tensor<double, Config::D> prescribed =
          load_tensor<Config::D>(call.steering.velocity_gradient);
      if (call.steering.modes)
        call.servo_gradient = gradient_of_modes(*call.steering.modes, prescribed,
                                                [&](const SteeredMode<Config::D> &mode) {
                                                  return amplitude_in(mode, call.servo_gradient);
                                                });
      else
        for (int c = 0; c < Config::components; ++c)
          call.servo_gradient.component[c] = call.steering.controlled[c]
              ? call.servo_gradient.component[c]
              : prescribed.component[c];
      const Tensor<double, Config::D> small = call.drive.dt * call.servo_gradient;
      // This is exp(small) with an error of third order.
      const Tensor<double, Config::D> growth =
          Tensor<double, Config::D>::identity() + small + 0.5 * (small * small);
      call.cell = growth * call.cell;
      call.deformation = growth * call.deformation;
    }

    /// Adds the work of local damping in the kick of grain i.
    static RVE_INLINE void
    add_damping_loss(CallState<Config> &call, Item i, const ViewOf<Config> &before,
                     const ViewOf<Config> &after,
                     const Kick<typename Config::Numbers, Config::D> &increment)
    {
      const double length = call.units.length;
      const double r = static_cast<double>(before.radius) * length, mass = call.mass_of(r);
      const Vec<Real, Config::D> &slow = before.motion.velocity, &fast = after.motion.velocity;
      double lost = damping_loss(mass, slow[0], fast[0], increment.velocity[0]);
      for (int a = 1; a < Config::D; ++a)
        lost += damping_loss(mass, slow[a], fast[a], increment.velocity[a]);
      lost = length * length * lost;
      const double inertia = GrainShape<Config::D>::inertia * mass * r * r;
      for (int k = 0; k < Config::spins; ++k)
        lost += damping_loss(inertia, spin_component(before.spin, k), spin_component(after.spin, k),
                             spin_component(increment.spin, k));
      call.work.damping[call.number_of(i)] += lost;
    }

    /// Returns the energy that the grains lost in this call, after its last kick.
    RVE_INLINE EnergyLoss losses() const
    {
      EnergyLoss lost;
      if (!tracks_energy) return lost;
      const double energy = call.units.force * call.units.length;
      lost.damping = block.sum_array(call.num_grains, call.work.damping);
      lost.friction = energy * block.sum_array(call.num_grains, call.work.friction);
      lost.viscous = energy * block.sum_array(call.num_grains, call.work.viscous);
      return lost;
    }

   private:
    /// Returns the velocity gradient of a planned step relative to the cell before the step, L (I -
    /// dt L)^-1 [1/time]. The plan has L relative to the cell after the step; a servo in the plane
    /// uses the same gradient for both.
    RVE_INLINE Tensor<double, Config::D> gradient_before(const PlanOf<Config> &plan) const
    {
      const auto after = plan.gradient.template as<double>();
      if (Config::D == 2 && has_servo) return after;
      return after *
          inverse(Tensor<double, Config::D>::identity() - static_cast<double>(call.law.dt) * after);
    }

    /// Adds half of the work of the mean field in a step: the sum of f . (L b) dt/2 over all
    /// contacts, with the last forces f, their branches b and L = `gradient`. One half of the work
    /// of a step is computed from the forces and branches before the step, the other half from the
    /// forces and branches after it. With this rule a rigid rotation does no work. One thread calls
    /// this function.
    RVE_INLINE void add_half_of_work(const Tensor<double, Config::D> &gradient) const
    {
      double power = 0.0;
      for (int c = 0; c < Config::components; ++c)
        power += static_cast<double>(call.totals.sum[c]) * gradient.component[c];
      call.supplied +=
          0.5 * (call.units.force * call.units.length) * power * static_cast<double>(call.law.dt);
    }

    /// Updates the velocity gradient of the servo by the stress. One thread calls it.
    RVE_INLINE void steer() const
    {
      const SteeringRecord<Config::D> &steering = call.steering;
      const auto stress = [&](int c) { return stress_component(call, call.end_per_volume, c); };
      if (steering.modes) {
        call.servo_gradient = gradient_of_modes(
            *steering.modes, load_tensor<Config::D>(steering.velocity_gradient),
            [&](const SteeredMode<Config::D> &mode) {
              double now = 0.0;
              for (int c = 0; c < Config::components; ++c) now += mode.stress[c] * stress(c);
              return steer_rate(amplitude_in(mode, call.servo_gradient), now, mode.goal, mode.gain,
                                call.drive.dt, mode.max_rate);
            });
        return;
      }
      // The loop has no branch, so that no component waits for another one.
      Tensor<double, Config::D> gradient = call.servo_gradient;
      for (int c = 0; c < Config::components; ++c) {
        // A shear uses the mean of both stress components.
        const int row = c / Config::D, column = c % Config::D;
        const double now = row == column ? stress(c)
                                         : 0.5 * (stress(c) + stress(column * Config::D + row));
        const double rate = gradient.component[c],
                     steered = steer_rate(rate, now, steering.stress_goal[c], steering.servo_gain,
                                          call.drive.dt, steering.servo_max_rate);
        gradient.component[c] = steering.controlled[c] ? steered : rate;
      }
      call.servo_gradient = gradient;
    }
  };

}    // namespace RVE_ISA
}    // namespace rve
