// What a call does once or now and then: begin, choose units, plan steps, renew the list. It works on arrays and on the state of
// the call, in functions of their own, so that it takes no registers from the steps.

#ifndef RVE_ALGORITHM_RARE_WORK_H
#define RVE_ALGORITHM_RARE_WORK_H

#include "rve/algorithm/contact_forces.h"
#include "rve/algorithm/verlet_list.h"

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

  /// Guess of the largest force in a packing without contacts, as an overlap over the mean radius. A wrong guess costs accuracy
  /// of the first contacts or a repeat of the call, never a wrong force.
  constexpr double kGasOverlapShare = 1e-3;

  /// Overlap over the mean radius that the force scale never goes below: stiffer than any packing that a format can hold.
  constexpr double kLeastOverlapShare = 1e-9;

  /// Component of the Love stress from the sums of a force phase, in a cell of volume 1 / per_volume [stress].
  template <class Scene>
  RVE_INLINE double stress_component(const CallState<Scene> &call, double per_volume, int k)
  {
    const double unit = call.units.force * call.units.length * per_volume;
    return static_cast<double>(call.survey.sum[k]) * unit;
  }

  /// Copies a plain struct by many threads, word by word.
  template <class Block, class T> RVE_INLINE void copy_words(Block &block, const T &from, T &to)
  {
    static_assert(sizeof(T) % 4 == 0, "a whole number of words");
    const auto *source = reinterpret_cast<const std::int32_t *>(&from);
    auto *target = reinterpret_cast<std::int32_t *>(&to);
    block.for_each(static_cast<int>(sizeof(T) / 4), [&](typename Block::Item w) {
      target[w] = source[w];
    });
  }

  template <class Block, class Scene> struct RareWork {
    using Item = typename Block::Item;
    using Real = typename Scene::Real;
    using Wide = typename Scene::Wide;
    using History = typename Scene::History;
    using Spring = typename Scene::Spring;
    using Law = typename Scene::Law;

    /// The state of a call as it begins, but for the plan; header, drive, steering and batch are there. By one thread.
    static RVE_INLINE void prepare(PreparedCall<Scene> &call, char *image, int pair_capacity)
    {
      const ImageHeader &header = call.header;
      const DriveRecord &drive = call.drive;
      const BatchConstants &batch = call.batch;
      call.image = carve_image<Scene>(image, header.num_grains, header.extra_capacity);
      call.num_grains = header.num_grains;
      call.status = status::Ok;
      call.num_extra = header.num_extra;
      call.needed_pairs = call.num_rebuilds = call.num_reductions = 0;
      call.cell = load_tensor(header.cell);
      call.list_cell = load_tensor(header.list_cell);
      call.deformation = load_tensor(header.deformation);
      call.servo_gradient = load_tensor(header.servo_velocity_gradient);
      CellIncrement increment;
      increment.deformation = load_tensor(drive.deformation);
      increment.segments = drive.segments;
      if (drive.segments > 1) {
        increment.rotation = load_tensor(call.steering.rotation);
        increment.stretch = load_tensor(call.steering.stretch);
      }
      if (!call.has_servo()) call.path = CellPath(call.cell, increment, drive.substeps, drive.dt);
      call.supplied = call.friction_loss = call.damping_loss = call.viscous_loss = 0.0;
      const int length_bits = CallUnits::length_bits(header.largest_radius);
      call.units.length = power_of_two(length_bits);
      call.units.per_length = power_of_two(-length_bits);
      call.mass_factor = header.density * 3.14159265358979323846 * header.mass_depth;
      call.skin = batch.skin > 0.0 ? batch.skin : kDefaultSkinShare * header.mean_radius;
      call.expected_force = header.largest_contact_force;
      call.plan_first = 1;
      call.plan_last = 0;
      note_progress(call, 0.0);
      if (call.num_extra > pair_capacity) {
        call.status = status::ListFull;
        call.needed_pairs = call.num_extra;
      } else if (call.is_continued()) {
        choose_units(call);
        call.plan_last = steps_to_plan(call);
      }
    }

    /// What a sound call will have changed, as far as that is known: with a servo the present cell. By one thread.
    static RVE_INLINE void note_progress(PreparedCall<Scene> &call, double damped)
    {
      const ImageHeader &before = call.header;
      const DriveRecord &drive = call.drive;
      ImageProgress &after = call.after;
      const bool on_path = drive.substeps > 0 && !call.has_servo();
      const Tensor2 cell = on_path ? call.path.end() : call.cell;
      store_tensor(cell, after.cell);
      store_tensor(on_path ? load_tensor(drive.deformation) * call.deformation : call.deformation,
                   after.deformation);
      store_tensor(call.list_cell, after.list_cell);
      store_tensor(call.servo_gradient, after.servo_velocity_gradient);
      after.num_extra = call.num_extra;
      after.list_valid = 1;
      after.steps = before.steps + drive.substeps;
      after.rebuilds = before.rebuilds + call.num_rebuilds;
      after.lattice_reductions = before.lattice_reductions + call.num_reductions;
      after.repeats = before.repeats;
      after.work = before.work + call.supplied;
      after.friction_loss = before.friction_loss + call.friction_loss;
      after.damping_loss = before.damping_loss + damped;
      after.viscous_loss = before.viscous_loss + call.viscous_loss;
      call.end_per_volume = per_volume(call, determinant(cell));
    }

    /// 1 / (area times thickness) [1/length^3]
    static RVE_INLINE double per_volume(const PreparedCall<Scene> &call, double area)
    {
      return 1.0 / (area * call.header.thickness);
    }

    /// Steps that are planned before the call begins: not before there is a list, nor with a servo, whose first cell is not known.
    static RVE_INLINE int steps_to_plan(const PreparedCall<Scene> &call)
    {
      return call.has_servo() ? 0 : steps_to_plan(call, 1);
    }

    /// Where the block works. By one thread.
    static RVE_INLINE void set_views(CallState<Scene> &call, int num_grains,
                                     const SharedView<Scene> &shared, char *workspace,
                                     int pair_capacity)
    {
      call.shared = shared;
      call.work = carve_workspace<Scene>(workspace, num_grains, pair_capacity);
      call.pairs = PairView<Scene>{shared.partner, shared.history, call.work.extra_first,
                                   call.work.extra_second, call.work.extra_history};
    }

    /// Whether the first steps may take the grains from the image themselves: nothing else wants to see them before.
    static RVE_INLINE bool is_direct(const CallState<Scene> &call)
    {
      return Block::kInRegisters && !call.fatal() && call.plan_last > 0 &&
          call.drive.substeps > 0 && !call.batch.track_energy;
    }

    /// From the image to internal units, for a call that is not direct. It is prepared, and has its views, of which `shared` is
    /// one.
    static RVE_INLINE void begin(Block &block, CallState<Scene> &call,
                                 const SharedView<Scene> &shared)
    {
      const int n = call.num_grains;
      const bool continued = call.is_continued();
      block.for_each(n, [&](Item i) {
        const StoredGrain stored = read_grain(call.image, i, n, continued);
        show_grain(call, shared, i, stored);
        shared.motion[i] = internal_motion(call, stored);
        shared.largest_force[i] = Real(0);
        if (continued)
          take_pairs(call, shared, i, stored);
        else
          shared.still[i].list_position = stored.list_position;
      });
      if (call.fatal()) return;
      if (call.batch.track_energy)
        block.for_each(n, [&](Item i) {
          call.work.damping[i] = 0.0;
        });
      if (!continued) {
        find_list_and_scale(block, call,
                            call.header.list_valid != 0 ? call.image_pairs() : call.pairs);
        if (call.fatal()) return;
      }
      fill_partner_radius(block, shared, n);
      take_extra_pairs(block, call);
    }

    /// Extra pairs with their histories in internal units.
    static RVE_INLINE void take_extra_pairs(Block &block, CallState<Scene> &call)
    {
      if (call.num_extra == 0) return;
      const PairView<Scene> from = call.header.list_valid != 0 ? call.image_pairs() : call.pairs;
      const PairView<Scene> to = call.pairs;
      const Spring history_to_internal = static_cast<Spring>(call.units.per_force);
      block.for_each(call.num_extra, [&](Item m) {
        to.extra_first[m] = from.extra_first[m];
        to.extra_second[m] = from.extra_second[m];
        to.extra_history[m] = history_to_internal * from.extra_history[m];
      });
    }

    /// A grain and its owned pairs as the image has them.
    struct StoredGrain {
      Vec<typename Scene::Coordinate, 2> position;
      Vec<Real, 2> velocity;
      Real spin;
      Vec<std::uint32_t, 2> list_position;
      Wide radius;
      std::int32_t partner[kOwnedPairs];
      History history[kOwnedPairs];
    };

    /// Everything is read before anything is written: a thread waits for memory once.
    static RVE_INLINE StoredGrain read_grain(const ImageView<Scene> &image, int i, int num_grains,
                                             bool with_pairs)
    {
      StoredGrain stored;
      stored.position = image.position[i];
      stored.velocity = image.velocity[i];
      stored.spin = image.spin[i];
      stored.list_position = image.list_position[i];
      stored.radius = image.radius[i];
      if (with_pairs) read_pairs(image.partner, image.history, i, num_grains, stored);
      return stored;
    }

    static RVE_INLINE void read_pairs(const std::int32_t *partner, const History *history, int i,
                                      int num_grains, StoredGrain &stored)
    {
      for (int k = 0; k < kOwnedPairs; ++k) {
        stored.partner[k] = partner[k * num_grains + i];
        stored.history[k] = history[k * num_grains + i];
      }
    }

    static RVE_INLINE Motion<typename Scene::Numbers>
    internal_motion(const PreparedCall<Scene> &call, const StoredGrain &stored)
    {
      return Motion<typename Scene::Numbers>{
          stored.position, static_cast<Real>(call.units.per_length) * stored.velocity};
    }

    /// What others see of a grain beside its motion, and room for the forces that they put on it. Returns its internal radius.
    static RVE_INLINE Wide show_grain(const PreparedCall<Scene> &call,
                                      const SharedView<Scene> &shared, int i,
                                      const StoredGrain &stored)
    {
      using Sum = typename Scene::Sum;
      const Wide radius = static_cast<Wide>(call.units.per_length) * stored.radius;
      shared.spin[i] = stored.spin;
      shared.radius[i] = radius;
      shared.force_x[i] = shared.force_y[i] = shared.torque[i] = Sum(0);
      return radius;
    }

    /// How a grain answers forces.
    static RVE_INLINE Still<typename Scene::Numbers>
    still_of(const PreparedCall<Scene> &call, Wide internal_radius,
             const Vec<std::uint32_t, 2> &list_position)
    {
      const Real r = static_cast<Real>(internal_radius), inverse = reciprocal(r * r);
      const Real velocity_unit = static_cast<Real>(call.velocity_factor) * inverse;
      // I = m r^2 / 2
      return Still<typename Scene::Numbers>{velocity_unit, Real(2) * velocity_unit * inverse,
                                            list_position};
    }

    static RVE_INLINE History internal_history(const PreparedCall<Scene> &call, History stored)
    {
      return static_cast<Spring>(call.units.per_force) * stored;
    }

    static RVE_INLINE void fill_partner_radius(Block &block, const SharedView<Scene> &shared,
                                               int num_grains)
    {
      if constexpr (!Block::kInRegisters)
        block.for_each(num_grains, [&](Item i) {
          for (int m = i; m < kOwnedPairs * num_grains; m += num_grains)
            shared.partner_radius[m] = radius_of_partner(shared, i, shared.partner[m]);
        });
    }

    /// What the call before has not left: a list, a scale of forces. `from`: the pairs, when there is a list.
    static RVE_COLD void find_list_and_scale(Block block, CallState<Scene> &call,
                                             PairView<Scene> from)
    {
      if (!call.header.list_valid) rebuild(block, call, call.image_pairs(), call.cell);
      if (call.fatal()) return;
      if (!(call.header.largest_contact_force > 0.0)) estimate_force(block, call, from);
      block.once([&] {
        choose_units(call);
      });
      const int n = call.num_grains;
      block.for_each(n, [&](Item i) {
        StoredGrain stored;
        read_pairs(from.partner, from.history, i, n, stored);
        stored.list_position = call.shared.still[i].list_position;
        take_pairs(call, call.shared, i, stored);
      });
    }

    /// Partners and histories of a grain, and how it answers forces.
    static RVE_INLINE void take_pairs(const CallState<Scene> &call, const SharedView<Scene> &shared,
                                      int i, const StoredGrain &stored)
    {
      const int n = call.num_grains;
      for (int k = 0; k < kOwnedPairs; ++k) {
        shared.partner[k * n + i] = stored.partner[k];
        shared.history[k * n + i] = internal_history(call, stored.history[k]);
      }
      shared.still[i] = still_of(call, shared.radius[i], stored.list_position);
    }

    /// Force unit and contact law in internal units. By one thread.
    static RVE_INLINE void choose_units(PreparedCall<Scene> &call)
    {
      const ImageHeader &header = call.header;
      // A last call may have ended in the first touch of a collision: a unit from that would not reach the collision within
      // the repeats of a call.
      const double least = Law::normal_force_at(header, kLeastOverlapShare * header.mean_radius);
      if (!(call.expected_force > least)) call.expected_force = least;
      call.units.choose_force(Scene::sum_bits, header.neighbor_bits, call.expected_force,
                              header.obliquity, header.inverse_obliquity);
      const double stiffness_unit = call.units.length * call.units.per_force;
      call.law.set(header, stiffness_unit, call.batch.velocity_arm);
      call.law.dt = static_cast<Real>(call.drive.substeps > 0 ? call.drive.dt : 0.0);
      call.alpha = static_cast<Real>(header.local_damping);
      const double crushing = crushing_force(call);
      const double least_trouble = crushing < call.units.force_limit ? crushing
                                                                     : call.units.force_limit;
      // a little less covers the rounding of forces to float
      call.sound_force = static_cast<float>((1.0 - 1e-6) * least_trouble);
      const double per_length = call.units.per_length;
      call.velocity_factor = call.drive.dt * (call.units.force * per_length) *
          (per_length * per_length) / call.mass_factor;
    }

    /// Largest contact force to expect where no call has left one: from the overlaps found, or a guess for a gas.
    static RVE_COLD void estimate_force(Block block, CallState<Scene> &call, PairView<Scene> pairs)
    {
      const ImageHeader &header = call.header;
      const Motion<typename Scene::Numbers> *motion = call.shared.motion;
      const int n = call.num_grains;
      const double length = call.units.length;
      const auto to_length =
          fraction_to_length<typename Scene::Numbers>(call.units.per_length * call.cell);
      block.for_each(n, [&](Item i) {
        double most = 0.0;
        for (int k = 0; k < kOwnedPairs; ++k) {
          const int j = pairs.partner[k * n + i];
          if (j == i) continue;
          const Vec<Wide, 2> branch = to_length *
              fractional_difference<typename Scene::Numbers>(motion[j].position,
                                                             motion[i].position);
          const double overlap =
              static_cast<double>(call.shared.radius[i] + call.shared.radius[j]) -
              std::sqrt(static_cast<double>(dot(branch, branch)));
          most = overlap > most ? overlap : most;
        }
        call.work.scratch[i] = most;
      });
      const double overlap = length * block.max_array(n, call.work.scratch);
      block.once([&] {
        call.expected_force = Law::normal_force_at(
            header, overlap > 0.0 ? overlap : kGasOverlapShare * header.mean_radius);
      });
    }

    // ---- the cell ---------------------------------------------------------------------------------------------------------------

    /// H after step k, which is planned or about to be.
    static RVE_INLINE Tensor2 cell_of_step(const PreparedCall<Scene> &call, int k)
    {
      if (call.has_servo()) return call.cell;
      CellPath path = call.path;
      return path.cell(k);
    }

    /// How many steps from `first` on can be planned.
    static RVE_INLINE int steps_to_plan(const PreparedCall<Scene> &call, int first)
    {
      const int left = call.drive.substeps - first + 1;
      if (call.has_servo() || left < 1) return 1;
      return left < kPlanSteps ? left : kPlanSteps;
    }

    /// Plans the steps from `first` on, as far as they can be known.
    static RVE_COLD void make_plan(Block block, CallState<Scene> &call, int first)
    {
      const int count = steps_to_plan(call, first);
      // threads may still be looking whether the step that they have just moved was special
      block.once([] {
      });
      block.for_each(count, [&](Item t) {
        plan_step(call, t, first);
      });
      block.once([&] {
        if (!call.has_servo() && call.drive.segments > 1) call.path.cell(first);
        call.plan_first = first;
        call.plan_last = first + count - 1;
      });
    }

    /// Entry t of a plan that starts with step `first`.
    static RVE_INLINE void plan_step(PreparedCall<Scene> &call, int t, int first)
    {
      StepPlan<typename Scene::Numbers> &plan = call.plan[t];
      Tensor2 cell = call.cell, rate = Tensor2::zero();
      const bool on_path = !call.has_servo() && call.drive.substeps > 0;
      if (on_path) {
        CellPath path = call.path;
        cell = path.cell(first + t);
        rate = path.cell_rate();
      }
      const Tensor2 inverse_cell = inverse(cell);
      const Tensor2 gradient = call.has_servo() ? call.servo_gradient : rate * inverse_cell;
      const double per_length = call.units.per_length;
      const Tensor2 internal = per_length * cell;
      plan.to_length = fraction_to_length<typename Scene::Numbers>(internal);
      plan.to_fraction = ((call.drive.dt * call.units.length / Scene::fraction_unit) * inverse_cell)
                             .template as<Wide>();
      plan.gradient = gradient.template as<Real>();
      plan.list_to_length = fraction_to_length<FastNumbers>(internal);
      // a little less than allowed covers the rounding of the displacements
      const double allowed = (1.0 - 1e-5) * per_length *
          allowed_displacement(cell, call.list_cell, call.header.largest_radius, call.skin);
      plan.allowed_squared = static_cast<float>(allowed * allowed);
      plan.special = !(allowed > 0.0) || is_lattice_step_due(cell);
      plan.area = determinant(cell);
    }

    // ---- the list ---------------------------------------------------------------------------------------------------------------

    /// Reduces the lattice if it is due, builds the list of step k from call.pairs into call.pairs, and plans anew.
    static RVE_COLD void renew(Block block, CallState<Scene> &call, int k)
    {
      Motion<typename Scene::Numbers> *motion = call.shared.motion;
      // a quarter of the cell in one step is no motion of a grain any more
      const Wide quarter_cell = static_cast<Wide>(0.25 / Scene::fraction_unit);
      const Tensor<Wide, 2> to_fraction = call.planned(k).to_fraction;
      const bool unstable = block.any(call.num_grains, [&](Item i) {
        const Vec<Wide, 2> move = to_fraction * motion[i].velocity.template as<Wide>();
        return !(std::fabs(move[0]) <= quarter_cell && std::fabs(move[1]) <= quarter_cell);
      });
      if (unstable) {
        block.once([&] {
          call.status |= status::Unstable;
        });
        return;
      }
      for (int guard = 0; guard < 8; ++guard) {
        const LatticeStep change = lattice_step(cell_of_step(call, k));
        if (change.axis < 0) break;
        block.for_each(call.num_grains, [&](Item i) {
          motion[i].position = apply_lattice_step(motion[i].position, change);
        });
        block.once([&] {
          if (call.has_servo())
            call.cell = apply_lattice_step(call.cell, change);
          else
            call.path.map_start([&](const Tensor2 &start) {
              return apply_lattice_step(start, change);
            });
          ++call.num_reductions;
        });
      }
      rebuild(block, call, call.pairs, cell_of_step(call, k));
      if (!call.fatal()) make_plan(block, call, k);
    }

    /// Builds the list of the present positions; call.pairs has it afterwards. Contact history comes from the `old` pairs.
    static RVE_COLD void rebuild(Block block, CallState<Scene> &call, PairView<Scene> old,
                                 Tensor2 cell)
    {
      const double largest_radius = call.header.largest_radius;
      // the wrapped difference is the nearest image only within half of the smallest width; a NaN fails the comparison too
      const bool wide_enough = 0.5 * smallest_width(cell) > 2.0 * largest_radius + call.skin;
      ListSizes sizes{0, 0};
      const double per_length = call.units.per_length;
      if (wide_enough)
        sizes = build_list(block, call.shared.motion, call.shared.radius, call.work,
                           call.num_grains, per_length * cell, per_length * largest_radius,
                           per_length * call.skin, old, call.num_extra);
      block.once([&] {
        if (!wide_enough) {
          call.status |= determinant(cell) == determinant(cell) ? status::CellTooNarrow
                                                                : status::NonFinite;
          return;
        }
        if (sizes.num_pairs > call.work.pair_capacity) call.status |= status::ListFull;
        call.needed_pairs = sizes.num_pairs;
        call.num_extra = sizes.num_extra;
        call.list_cell = cell;
        ++call.num_rebuilds;
        note_progress(call, 0.0);
      });
      if (call.fatal()) return;
      const int n = call.num_grains;
      block.for_each(n, [&](Item i) {
        for (int k = 0; k < kOwnedPairs; ++k) {
          call.pairs.partner[k * n + i] = call.work.fresh.partner[k * n + i];
          call.pairs.history[k * n + i] = call.work.fresh.history[k * n + i];
        }
        const Vec<typename Scene::Coordinate, 2> position = call.shared.motion[i].position;
        call.shared.still[i].list_position =
            Vec<std::uint32_t, 2>{{leading_bits(position[0]), leading_bits(position[1])}};
      });
      fill_partner_radius(block, call.shared, n);
      if (call.num_extra > 0)
        block.for_each(call.num_extra, [&](Item m) {
          call.pairs.extra_first[m] = call.work.fresh.extra_first[m];
          call.pairs.extra_second[m] = call.work.fresh.extra_second[m];
          call.pairs.extra_history[m] = call.work.fresh.extra_history[m];
        });
    }

    // ---- the end of a call ------------------------------------------------------------------------------------------------------

    static RVE_COLD void copy_history(Block block, CallState<Scene> &call, PairView<Scene> from,
                                      PairView<Scene> to)
    {
      // each by the thread that has the grain: it may have written it in the present phase
      const int n = call.num_grains;
      block.for_each(n, [&](Item i) {
        for (int m = i; m < kOwnedPairs * n; m += n) to.history[m] = from.history[m];
      });
      block.for_each(call.num_extra, [&](Item m) {
        to.extra_history[m] = from.extra_history[m];
      });
    }

    /// One number tells that all is well with the grains, as it nearly always is.
    static RVE_INLINE bool is_sound(const CallState<Scene> &call)
    {
      return call.survey.largest < call.sound_force;
    }

    /// Status of a call whose steps are done, but for troubles of grains.
    static RVE_INLINE std::uint32_t judge(const CallState<Scene> &call)
    {
      std::uint32_t word = call.status;
      if (call.survey.sum[kCrushedSum] > 0) word |= status::OverlapTooLarge;
      if (call.survey.sum[kContactSum] == 0) word |= status::NoContacts;
      if (call.num_extra > call.header.extra_capacity) word |= status::ListFull;
      if (!(call.end_per_volume > 0.0)) word |= status::NonFinite;
      return word;
    }

    /// An overlap that is beyond the limit even for two of the largest grains gives at least this force, with springs only; the
    /// others are looked at in the end [internal force].
    static RVE_INLINE double crushing_force(const PreparedCall<Scene> &call)
    {
      return Law::normal_force_at(call.header,
                                  call.batch.overlap_limit * call.header.largest_radius) *
          call.units.per_force;
    }

    /// Troubles of grains, exactly.
    static RVE_COLD std::uint32_t find_trouble(Block block, const CallState<Scene> &call)
    {
      const SharedView<Scene> &shared = call.shared;
      const Real limit = static_cast<Real>(call.units.force_limit),
                 crushing = static_cast<Real>(crushing_force(call));
      // the largest force is then that of a normal spring
      const bool springs_only =
          call.header.normal_viscosity == 0.0 && !(Scene::books && call.header.all_forces_count);
      std::uint32_t word = status::Ok;
      if (block.any(call.num_grains, [&](Item i) {
            return !(shared.largest_force[i] <= limit);
          }))
        word |= status::ForceSaturated;
      if (block.any(call.num_grains, [&](Item i) {
            return springs_only && shared.largest_force[i] > crushing;
          }))
        word |= status::OverlapTooLarge;
      if (block.any(call.num_grains, [&](Item i) {
            const Vec<Real, 2> velocity = shared.motion[i].velocity;
            const Real spin = shared.spin[i];
            return !(velocity[0] == velocity[0] && velocity[1] == velocity[1] && spin == spin);
          }))
        word |= status::NonFinite;
      return word;
    }

    /// What is to be written in the end beside the grains of a sound call: the words of its progress, the components of the
    /// stress, and the rest of the answer.
    static constexpr int kProgressWords = sizeof(ImageProgress) / sizeof(std::int64_t);
    static constexpr int kConclusions = kProgressWords + 4 + 1;

    /// One of these.
    static RVE_INLINE void conclude(const CallState<Scene> &call, std::uint32_t word, int part,
                                    AnswerRecord &answer)
    {
      if (part < kProgressWords) {
        constexpr int of_largest_force =
            offsetof(ImageProgress, largest_contact_force) / sizeof(std::int64_t);
        auto *to =
            reinterpret_cast<std::int64_t *>(static_cast<ImageProgress *>(call.image.header));
        // an evaluation sets the force scale only where there is none yet: it must not change what follows
        if (part != of_largest_force)
          to[part] = reinterpret_cast<const std::int64_t *>(&call.after)[part];
        else if (call.drive.substeps > 0 || call.header.largest_contact_force == 0.0)
          call.image.header->largest_contact_force =
              call.units.force * static_cast<double>(call.survey.largest);
      } else if (part < kProgressWords + 4) {
        const int k = part - kProgressWords;
        answer.stress[k] = stress_component(call, call.end_per_volume, k);
      } else {
        answer.status = word;
        answer.needed_extra = call.num_extra;
        answer.needed_pairs = call.needed_pairs;
        answer.expected_force = call.expected_force;
        answer.num_contacts = static_cast<std::int32_t>(call.survey.sum[kContactSum]);
      }
    }

    /// The answer of a call that failed. By one thread.
    static RVE_COLD void answer_failure(const CallState<Scene> &call, std::uint32_t word,
                                        AnswerRecord &answer)
    {
      answer.status = word;
      answer.needed_extra = call.num_extra;
      answer.needed_pairs = call.needed_pairs;
      answer.expected_force = call.expected_force;
      answer.num_contacts = 0;
      store_tensor(Tensor2::zero(), answer.stress);
    }
  };

}    // namespace RVE_ISA
}    // namespace rve

#endif
