// The block program: advances one RVE by one call, on one CPU thread or one CUDA thread block.
//
// Order within a step: cell, drift, (list), force, kick; the stress of a call belongs to its end configuration, and the kick
// of a step stands at the beginning of the next one, which saves a barrier.

#ifndef RVE_ALGORITHM_STEP_LOOP_H
#define RVE_ALGORITHM_STEP_LOOP_H

#include "rve/algorithm/homogenization.h"
#include "rve/algorithm/stress_servo.h"
#include "rve/algorithm/verlet_list.h"
#include "rve/core/status.h"
#include "rve/physics/cell_path.h"
#include "rve/physics/integrator.h"

namespace rve {
inline namespace RVE_ISA {

  RVE_INLINE Tensor2 load_tensor(const double *component)
  {
    Tensor2 t;
    for (int k = 0; k < 4; ++k) t.component[k] = component[k];
    return t;
  }

  RVE_INLINE void store_tensor(const Tensor2 &t, double *component)
  {
    for (int k = 0; k < 4; ++k) component[k] = t.component[k];
  }

  /// Skin of the list that the user left open, as a share of the mean radius: wide enough that a quasi-static packing lives
  /// on one list for hundreds of steps, narrow enough that few of the listed pairs do not touch.
  constexpr double kDefaultSkinShare = 0.1;

  /// Guess of the largest force in a packing without contacts, as an overlap over the mean radius. A wrong guess costs accuracy
  /// of the first contacts or a repeat of the call, never a wrong force.
  constexpr double kGasOverlapShare = 1e-3;

  /// Overlap over the mean radius that the force scale never goes below: stiffer than any packing that a format can hold.
  constexpr double kLeastOverlapShare = 1e-9;

  /// Work of Cundall's damping on one velocity component in one step [force length].
  RVE_INLINE double damping_loss(double mass, double before, double after, double increment)
  {
    return -mass * ((after - before) - increment) * 0.5 * (before + after);
  }

  /// What a scene asks for; the rest is not compiled in.
  template <bool WithViscosity, bool WithEnergyLedger> struct SceneFeatures {
    static constexpr bool viscous = WithViscosity;    ///< dashpots in the contacts
    static constexpr bool energy = WithEnergyLedger;
  };

  template <class Block, class Format, class Features> class RveProgram {
    static constexpr bool WithEnergy = Features::energy;
    using Item = typename Block::Item;
    using Real = typename Format::Real;
    using Wide = typename Format::Wide;
    using Sum = typename Format::Sum;
    using Coordinate = typename Format::Coordinate;
    using State = GrainState<Format>;

   public:
    RVE_HD RveProgram(Block &block_in, const ImageView<Format> &image_in,
                      const SharedView<Format> &shared_in, const WorkspaceView<Format> &work_in,
                      const DriveRecord &drive_in, const BatchConstants &batch_in) :
        block(block_in),
        image(image_in), shared(shared_in), work(work_in), drive(drive_in), batch(batch_in),
        header(*image_in.header), num_grains(header.num_grains),
        state(block.template per_item<State>(num_grains)), cell(load_tensor(header.cell)),
        list_cell(load_tensor(header.list_cell)), deformation(load_tensor(header.deformation)),
        servo_gradient(load_tensor(header.servo_velocity_gradient)), num_extra(header.num_extra),
        skin(batch.skin > 0.0 ? batch.skin : kDefaultSkinShare * header.mean_radius),
        scale(1.0, 1.0, 0)
    {
    }

    /// Runs the call. The image is written only when nothing fatal happened; `result` always.
    RVE_HD void run(ResultRecord &answer)
    {
      ResultRecord result = ResultRecord();
      load();
      if (!header.list_valid) rebuild();
      step.dt = static_cast<Real>(drive.dt);
      if (!fatal()) {
        result.expected_force = expected_force();
        scale =
            ForceScale<Format>(result.expected_force, header.largest_radius, header.neighbor_bits);
        prepare_kicks();
        if (drive.substeps == 0)
          evaluate();
        else if (has_servo())
          run_with_servo();
        else
          run_along_path();
      }
      gather_trouble();
      if (!fatal()) {
        step.dt = Real(0);
        homogenize(block, state, shared, work, num_grains, num_extra, step, scale,
                   determinant(cell) * header.thickness, header.density, header.mass_depth, result);
        if (result.smallest_radius_overlap > batch.overlap_limit)
          status_word |= status::OverlapTooLarge;
        if (result.num_contacts == 0) status_word |= status::NoContacts;
      }
      if (!fatal() && num_extra > header.extra_capacity) status_word |= status::ListFull;
      result.status = status_word;
      result.needed_extra = num_extra;
      result.needed_pairs = needed_pairs;
      if (!fatal() && drive.substeps > 0) {
        const Real alpha = static_cast<Real>(header.local_damping);
        block.for_each(num_grains, [&](Item i) {
          kick_grain(i, alpha);
        });
      }
      if (!fatal()) store(result);
      block.once([&] {
        copy_header(result);
        answer = result;
      });
    }

   private:
    RVE_HD bool fatal() const { return (status_word & status::Fatal) != 0; }

    /// Largest contact force to expect: that of the last call, or of the overlaps found, or a guess for a gas [force].
    RVE_HD double expected_force()
    {
      // A last call may have ended in the first touch of a collision: a scale from that would not reach the collision within
      // the repeats of a call.
      const double least = header.normal_stiffness * kLeastOverlapShare * header.mean_radius;
      if (header.largest_contact_force > 0.0)
        return header.largest_contact_force > least ? header.largest_contact_force : least;
      block.for_each(num_grains, [&](Item i) {
        double most = 0.0;
        const auto look = [&](int j) {
          const Wide sum_of_radii = shared.radius[i] + shared.radius[j];
          const Vec<Wide, 2> branch = step.to_length *
              fractional_difference<Format>(shared.position[j], shared.position[i]);
          const double overlap = static_cast<double>(sum_of_radii) -
              static_cast<double>(std::sqrt(dot(branch, branch)));
          most = j != i && overlap > most ? overlap : most;
        };
        for (int k = 0; k < kOwnedPairs; ++k) look(state[i].partner[k]);
        work.scratch[i] = most;
      });
      const double overlap = block.max_array(num_grains, work.scratch);
      const double found = header.normal_stiffness *
          (overlap > 0.0 ? overlap : kGasOverlapShare * header.mean_radius);
      return found > least ? found : least;
    }

    RVE_HD bool has_servo() const
    {
      return drive.controlled[0] || drive.controlled[1] || drive.controlled[3];
    }

    RVE_HD void load()
    {
      step.law.normal.stiffness = static_cast<Real>(header.normal_stiffness);
      step.law.normal_damping.viscosity = static_cast<Real>(header.normal_viscosity);
      step.law.tangential.stiffness =
          static_cast<typename Format::History>(header.tangential_stiffness);
      step.law.tangential.friction = static_cast<Real>(header.friction);
      step.law.tangential.viscosity = static_cast<Real>(header.tangential_viscosity);
      step.law.velocity_arm = static_cast<Real>(batch.velocity_arm);
      step.velocity_gradient = Tensor<Real, 2>::zero();
      step.to_length = fraction_to_length<Format>(cell);
      block.for_each(num_grains, [&](Item i) {
        shared.position[i] = image.position[i];
        shared.velocity[i] = image.velocity[i];
        shared.spin[i] = image.spin[i];
        shared.radius[i] = image.radius[i];
        shared.force[i] = Vec<Sum, 2>::zero();
        shared.torque[i] = Sum(0);
        work.list_position[i] = image.list_position[i];
        work.damping[i] = 0.0;
        auto &grain = state[i];
        grain.trouble = 0;
        grain.force = Vec<Sum, 2>::zero();
        grain.torque = Sum(0);
        for (int k = 0; k < kOwnedPairs; ++k) {
          grain.partner[k] = image.partner[k * num_grains + i];
          grain.history[k] = image.history[k * num_grains + i];
        }
      });
      if (num_extra > work.pair_capacity) {
        status_word |= status::ListFull;
        needed_pairs = num_extra;
        return;
      }
      block.for_each(num_extra, [&](Item m) {
        work.extra_first[m] = image.extra_first[m];
        work.extra_second[m] = image.extra_second[m];
        work.extra_history[m] = image.extra_history[m];
      });
    }

    /// Forces of the present configuration; nothing moves and no history advances.
    RVE_HD void evaluate()
    {
      step.dt = Real(0);
      // with dashpots the Coulomb limit depends on velocities, which are not those of the last forces: the history is put back
      block.for_each(num_grains, [&](Item i) {
        for (int k = 0; k < kOwnedPairs; ++k)
          work.old_history[k * num_grains + i] = state[i].history[k];
      });
      block.for_each(num_extra, [&](Item m) {
        work.old_extra_history[m] = work.extra_history[m];
      });
      forces<false>();
      block.for_each(num_grains, [&](Item i) {
        for (int k = 0; k < kOwnedPairs; ++k)
          state[i].history[k] = work.old_history[k * num_grains + i];
      });
      block.for_each(num_extra, [&](Item m) {
        work.extra_history[m] = work.old_extra_history[m];
      });
    }

    RVE_HD void run_along_path()
    {
      const CellIncrement increment{load_tensor(drive.deformation), load_tensor(drive.rotation),
                                    load_tensor(drive.stretch), drive.segments};
      CellPath path(cell, increment, drive.substeps, drive.dt);
      for (int k = 1; k <= drive.substeps && !fatal(); ++k) {
        cell = path.cell(k);
        const Tensor2 gradient = path.cell_rate() * inverse(cell);
        move(gradient, k > 1);
        reduce_lattice([&](const LatticeStep &change) {
          path.map_start([&](const Tensor2 &start) {
            return apply_lattice_step(start, change);
          });
        });
        update_list();
        if (fatal()) return;
        forces<WithEnergy>();
      }
      deformation = increment.deformation * deformation;
    }

    RVE_HD void run_with_servo()
    {
      const Tensor2 prescribed = load_tensor(drive.velocity_gradient);
      Tensor2 gradient;
      for (int k = 0; k < 4; ++k)
        gradient.component[k] = drive.controlled[k] ? servo_gradient.component[k]
                                                    : prescribed.component[k];
      for (int k = 1; k <= drive.substeps && !fatal(); ++k) {
        const Tensor2 small = drive.dt * gradient;
        const Tensor2 growth =
            Tensor2::identity() + small + 0.5 * (small * small);    // exp to third order
        cell = growth * cell;
        deformation = growth * deformation;
        move(gradient, k > 1);
        reduce_lattice([](const LatticeStep &) {
        });
        update_list();
        if (fatal()) return;
        const Tensor2 stress = forces<true>();
        for (int c = 0; c < 4; ++c)
          if (drive.controlled[c]) {
            const double now = c == 1 ? 0.5 * (stress.component[1] + stress.component[2])
                                      : stress.component[c];
            gradient.component[c] = steer_rate(gradient.component[c], now, drive.stress_goal[c],
                                               drive.servo_gain, drive.dt, drive.servo_max_rate);
          }
      }
      servo_gradient = gradient;
    }

    /// Turns force units into velocity increments of a step of this call.
    RVE_HD void prepare_kicks()
    {
      block.for_each(num_grains, [&](Item i) {
        const double r = static_cast<double>(shared.radius[i]), mass = mass_of(r);
        state[i].velocity_unit =
            static_cast<Real>(drive.dt * static_cast<double>(scale.inverse_force) / mass);
        state[i].spin_unit = static_cast<Real>(
            drive.dt * static_cast<double>(scale.inverse_torque) / (0.5 * mass * r * r));
      });
    }

    /// Mass of a disk of this radius [mass].
    RVE_INLINE double mass_of(double radius) const
    {
      return header.density * 3.14159265358979323846 * header.mass_depth * radius * radius;
    }

    /// Leapfrog velocity update of one grain from the forces that the last phase left.
    RVE_INLINE void kick_grain(Item i, Real alpha)
    {
      auto &grain = state[i];
      const Vec<Real, 2> before = shared.velocity[i];
      Vec<Real, 2> increment, velocity;
      for (int a = 0; a < 2; ++a) {
        increment[a] = static_cast<Real>(static_cast<Sum>(grain.force[a] + shared.force[i][a])) *
            grain.velocity_unit;
        velocity[a] = kick(before[a], increment[a], alpha);
      }
      const Real turn =
          static_cast<Real>(static_cast<Sum>(grain.torque + shared.torque[i])) * grain.spin_unit;
      const Real spin = shared.spin[i];
      const Real turned = kick(spin, turn, alpha);
      if constexpr (WithEnergy) {
        const double r = static_cast<double>(shared.radius[i]), mass = mass_of(r);
        work.damping[i] += damping_loss(mass, before[0], velocity[0], increment[0]) +
            damping_loss(mass, before[1], velocity[1], increment[1]) +
            damping_loss(0.5 * mass * r * r, spin, turned, turn);
      }
      shared.velocity[i] = velocity;
      shared.spin[i] = turned;
      shared.force[i] = Vec<Sum, 2>::zero();
      shared.torque[i] = Sum(0);
    }

    /// Kick of the step before, then drift in the present cell. Notes grains that have left the safety of the list.
    RVE_HD void move(const Tensor2 &gradient, bool kick_first)
    {
      step.velocity_gradient = gradient.template as<Real>();
      step.to_length = fraction_to_length<Format>(cell);
      const Tensor<Wide, 2> to_fraction =
          ((drive.dt / Format::fraction_unit) * inverse(cell)).template as<Wide>();
      const double allowed = allowed_displacement(cell, list_cell, header.largest_radius, skin);
      const Wide allowed_squared = static_cast<Wide>(allowed * allowed);
      const Wide quarter_cell = static_cast<Wide>(0.25 / Format::fraction_unit);
      const Real alpha = static_cast<Real>(header.local_damping);
      list_expired = block.any(num_grains, [&](Item i) {
        if (kick_first) kick_grain(i, alpha);
        const Vec<Wide, 2> displacement = to_fraction * shared.velocity[i].template as<Wide>();
        // a quarter of the cell in one step is no motion of a grain any more; a NaN fails the comparison too
        if (!(std::fabs(displacement[0]) <= quarter_cell &&
              std::fabs(displacement[1]) <= quarter_cell)) {
          const bool number =
              displacement[0] == displacement[0] && displacement[1] == displacement[1];
          state[i].trouble |=
              static_cast<std::int32_t>(number ? status::Unstable : status::NonFinite);
          return false;
        }
        Vec<Coordinate, 2> position = shared.position[i];
        for (int a = 0; a < 2; ++a) {
          typename Format::SignedCoordinate units;
          round_to(displacement[a], units);
          position[a] += static_cast<Coordinate>(units);
        }
        shared.position[i] = position;
        const Vec<Wide, 2> moved =
            step.to_length * fractional_difference<Format>(position, work.list_position[i]);
        return dot(moved, moved) > allowed_squared;
      });
      if (allowed <= 0.0) list_expired = true;
    }

    template <class MapPath> RVE_HD void reduce_lattice(MapPath map_path)
    {
      for (int guard = 0; guard < 8; ++guard) {
        const LatticeStep change = lattice_step(cell);
        if (change.axis < 0) return;
        cell = apply_lattice_step(cell, change);
        list_cell = apply_lattice_step(list_cell, change);
        map_path(change);
        block.for_each(num_grains, [&](Item i) {
          shared.position[i] = apply_lattice_step(shared.position[i], change);
          work.list_position[i] = apply_lattice_step(work.list_position[i], change);
        });
        ++num_reductions;
        step.to_length = fraction_to_length<Format>(cell);
      }
    }

    RVE_HD void update_list()
    {
      if (list_expired) rebuild();
    }

    RVE_HD void rebuild()
    {
      // the wrapped difference is the nearest image only within half of the smallest width
      if (!(0.5 * smallest_width(cell) > 2.0 * header.largest_radius + skin)) {
        status_word |= determinant(cell) == determinant(cell) ? status::CellTooNarrow
                                                              : status::NonFinite;
        return;
      }
      needed_pairs = build_list(block, state, shared, work, num_grains, cell, header.largest_radius,
                                skin, num_extra);
      if (needed_pairs > work.pair_capacity) {
        status_word |= status::ListFull;
        return;
      }
      list_cell = cell;
      ++num_rebuilds;
    }

    /// Contact forces of the present configuration; returns the Love stress when it was asked for.
    template <bool WithStress> RVE_HD Tensor2 forces()
    {
      const IntegerSums<4> sums = contact_forces<WithStress, WithEnergy>(
          block, state, shared, work, num_grains, num_extra, step, scale, heat);
      const double volume = determinant(cell) * header.thickness;
      Tensor2 stress;
      for (int k = 0; k < 4; ++k)
        stress.component[k] = static_cast<double>(sums[k]) / scale.stress / volume;
      if (WithEnergy) {
        const Tensor2 gradient = step.velocity_gradient.template as<double>();
        double power = 0.0;
        for (int k = 0; k < 4; ++k) power += stress.component[k] * gradient.component[k];
        supplied += volume * power * static_cast<double>(step.dt);
      }
      return stress;
    }

    RVE_HD void gather_trouble()
    {
      gather_bit(status::ForceSaturated);
      gather_bit(status::Unstable);
      gather_bit(status::NonFinite);
      const double area = determinant(cell);
      if (!(area > 0.0)) status_word |= status::NonFinite;
    }

    RVE_HD void gather_bit(std::uint32_t bit)
    {
      if (block.any(num_grains, [&](Item i) {
            return (static_cast<std::uint32_t>(state[i].trouble) & bit) != 0;
          }))
        status_word |= bit;
    }

    RVE_HD void store(const ResultRecord &result)
    {
      block.for_each(num_grains, [&](Item i) {
        image.position[i] = shared.position[i];
        image.velocity[i] = shared.velocity[i];
        image.spin[i] = shared.spin[i];
        image.list_position[i] = work.list_position[i];
        for (int k = 0; k < kOwnedPairs; ++k) {
          image.partner[k * num_grains + i] = state[i].partner[k];
          image.history[k * num_grains + i] = state[i].history[k];
        }
      });
      block.for_each(num_extra, [&](Item m) {
        image.extra_first[m] = work.extra_first[m];
        image.extra_second[m] = work.extra_second[m];
        image.extra_history[m] = work.extra_history[m];
      });
      const double damped = WithEnergy ? block.sum_array(num_grains, work.damping) : 0.0;
      block.once([&] {
        ImageHeader &h = *image.header;
        store_tensor(cell, h.cell);
        store_tensor(deformation, h.deformation);
        store_tensor(list_cell, h.list_cell);
        store_tensor(servo_gradient, h.servo_velocity_gradient);
        h.num_extra = num_extra;
        h.list_valid = 1;
        // an evaluation sets the force scale only where there is none yet: it must not change what follows
        if (drive.substeps > 0 || h.largest_contact_force == 0.0)
          h.largest_contact_force = result.largest_contact_force;
        h.steps += drive.substeps;
        h.rebuilds += num_rebuilds;
        h.lattice_reductions += num_reductions;
        h.work += supplied;
        h.friction_loss += heat.friction;
        h.damping_loss += damped;
        h.viscous_loss += heat.viscous;
      });
    }

    RVE_HD void copy_header(ResultRecord &result) const
    {
      const ImageHeader &h = *image.header;
      result.num_grains = num_grains;
      result.solid_area = h.solid_area;
      for (int k = 0; k < 4; ++k) {
        result.cell[k] = h.cell[k];
        result.deformation[k] = h.deformation[k];
        result.servo_velocity_gradient[k] = h.servo_velocity_gradient[k];
      }
      result.steps = h.steps;
      result.rebuilds = h.rebuilds;
      result.lattice_reductions = h.lattice_reductions;
      result.repeats = h.repeats;
      result.work = h.work;
      result.friction_loss = h.friction_loss;
      result.damping_loss = h.damping_loss;
      result.viscous_loss = h.viscous_loss;
    }

    Block &block;
    const ImageView<Format> image;
    const SharedView<Format> shared;
    const WorkspaceView<Format> work;
    const DriveRecord &drive;
    const BatchConstants &batch;
    const ImageHeader &header;
    const int num_grains;
    typename Block::template PerItem<State> state;
    Tensor2 cell, list_cell, deformation, servo_gradient;
    int num_extra;
    const double skin;
    ForceScale<Format> scale;
    StepConstants<Format, Features::viscous> step;
    Dissipation heat = {0.0, 0.0};
    double supplied = 0.0;
    int num_rebuilds = 0, num_reductions = 0, needed_pairs = 0;
    bool list_expired = false;
    std::uint32_t status_word = 0;
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
