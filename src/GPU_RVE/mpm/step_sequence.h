// SPDX-License-Identifier: GPL-2.0-only
// One time step as a sequence of passes, for any machine that runs passes (host_machine.h).

#pragma once

#include "mpm/exchange_passes.h"
#include "mpm/face_contact.h"
#include "mpm/load_passes.h"
#include "mpm/node_passes.h"
#include "mpm/point_passes.h"
#include "mpm/rigid_contact.h"
#include "mpm/shared_nodes.h"
#include "mpm/step_runner.h"
#include "mpm/sum_passes.h"
#include "rve/core/error.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace mpm {

template <int D, template <int> class Machine> class StepSequence final : public StepRunner<D> {
 public:
  StepSequence(const SolverOptions<D> &options, Communication communication, const Grid<D> &grid) :
      options_(options), communication_(std::move(communication)), whole_(grid),
      boundary_(grid, options.sides, options.dashpots, options.rigid_bodies),
      shared_(grid, communication_, options.rigid_bodies, options.threads),
      machine_(options, grid, communication_)
  {
    const auto &bodies = options.rigid_bodies;
    int turning = 0;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const bool can_turn = bodies[b].form != BodyForm::Face;
      order_.push_back({static_cast<int>(b), can_turn ? turning++ : -1});
      if (b < 64 && !can_turn && !(D == 3 && bodies[b].round)) plates_ |= std::uint64_t(1) << b;
    }
    // the bits of a sum of three impulses on a node depend on their order, so the order of bodies
    // in a script must not determine it
    std::stable_sort(order_.begin(), order_.end(), [&](const Ordered &one, const Ordered &other) {
      return options.name_of_body(one.body) < options.name_of_body(other.body);
    });
    forget_positions();
  }

  void join_ranks() override { machine_.join_ranks(communication_); }

  void set_body_friction(int body, double friction) override
  {
    options_.rigid_bodies.at(body).friction = friction;
  }

  void step(const StepInput<D> &input, StressUpdate<D> &update) override
  {
    const bool usavg = options_.scheme == Scheme::Usavg;
    const double part = usavg ? 0.5 * input.dt : input.dt;
    begin(input, update);
    if (usavg) {
      finish_stress(update);
      prepare(false);
      sum<InertiaForStrains>(false);
      impose_bodies(Contact::Find, false);
      find_strains(part);
      begin_stress(part, update);
      finish_stress(update);
      over<BoundForces>();
      over<PrepareLoad>(true);
      static_assert(ForceBound + 1 == NUM_MAXIMA && ForceBound == VolumeBound + 2,
                    "the bounds of loads follow");
      share_maxima(VolumeBound, 3 + machine_.view().num_loads);
      if (machine_.is_synchronous()) check_sums();
      find_cell_means<MeanPressure>();
      sum<Force>(true);
      balance();
      move(part);
    } else {
      after_stress(update, [&] {
        prepare(true);
        find_forces();
        move(part);
      });
    }
    begin_stress(part, update);
  }

  void evaluate(const StepInput<D> &input, StressUpdate<D> &update) override
  {
    begin(input, update);
    finish_stress(update);
    prepare(true);
    find_forces();
    share_maxima(Unbalanced, 2);
    machine_.request_findings();
    machine_.wait_for_findings();
    check_all();
  }

  void stresses_changed() override { machine_.stresses_changed(); }

  void fetch(const PointView<D> &points) override
  {
    machine_.fetch(points);
    forget_positions();
  }
  void points_changed() override
  {
    machine_.points_changed();
    forget_positions();
  }

  Vec<D> body_reaction(int body) override
  {
    return cached(body_reactions_, body, [&] {
      return per_time(boundary_.body_impulse(
          body, everywhere(machine_.view().body_impulse, body, whole_.all())));
    });
  }
  Vec<D> side_reaction(Face side) override
  {
    return cached(side_reactions_, static_cast<int>(side),
                  [&] { return find_side_reaction(side); });
  }
  Vec<D> damping_force() override
  {
    Vec<D> sum = Vec<D>::zero();
    if (!(options_.damping > 0.0)) return sum;
    const Vec<D> *impulse = machine_.of_nodes(machine_.view().damping_impulse);
    shared_.each_layer([&](const NodeBox<D> &layer) {
      for (const auto &at : shared_.everywhere(impulse, layer)) sum = sum + at.value;
    });
    return per_time(sum);
  }
  double max_unbalanced_force() override { return machine_.unbalanced(); }
  Vec<D> node_force(const NodeIndex<D> &place) override
  {
    return shared_.at(machine_.of_nodes(machine_.view().force), place);
  }
  double node_mass(const NodeIndex<D> &place) override
  {
    return shared_.at(machine_.of_nodes(machine_.view().mass), place);
  }
  int held_nodes() const override { return shared_.part().node_count(); }
  double transfer_time() const override { return machine_.transfer_time(); }
  std::string description() const override { return machine_.description(); }

 private:
  template <template <int> class P, class... Arguments> void over(const Arguments &...arguments)
  {
    machine_.over(P<D>{{machine_.view()}, arguments...});
  }
  /// Returns the values of a row of a node field on all ranks, after a step. Collective.
  template <class T>
  std::vector<NodeValue<D, T>> everywhere(const T *field, int row, const NodeBox<D> &where)
  {
    return shared_.everywhere(machine_.of_nodes(field, row), where);
  }

  /// Returns known[which]. The first call after a step computes it by find(). The value is kept
  /// because callers call the function once for each component.
  template <class Find>
  static Vec<D> cached(std::map<int, Vec<D>> &known, int which, const Find &find)
  {
    const auto at = known.find(which);
    return at != known.end() ? at->second : known[which] = find();
  }

  Vec<D> find_side_reaction(Face side)
  {
    const int axis = axis_of(side);
    const NodeBox<D> nodes = boundary_.nodes_of(side);
    const StepView<D> &view = machine_.view();
    Vec<D> impulse = boundary_.side_impulse(side, everywhere(view.side_impulse, axis, nodes));
    if (options_.dashpots[static_cast<int>(side)].exist())
      impulse =
          impulse + boundary_.side_impulse(side, everywhere(view.absorbed_impulse, axis, nodes));
    return per_time(impulse);
  }

  void begin(const StepInput<D> &input, StressUpdate<D> &update)
  {
    body_reactions_.clear();
    side_reactions_.clear();
    machine_.begin(input);
    if (input.points.count != point_count_) forget_positions();
    point_count_ = input.points.count;
    body_velocity_ = input.body_velocity;
    shared_.find(input.points, options_.shape, half_boxes_);
    machine_.set_part(shared_, boundary_);
    machine_.divide_nodes(divides_nodes_);
    update.begin_step(input.points, options_.threads);
  }

  /// Discards bounds of boxes and positions, since the host may have changed the points.
  void forget_positions()
  {
    half_boxes_ = SharedNodes<D>::FROM_POINTS;
    divides_nodes_ = machine_.view().has_several_bodies();
  }

  /// True if two bodies can hold the same node after a time `dt` [time] of motion from the
  /// positions that this step has found. Contacts of a plate reach less than a cell beyond its box.
  /// If any body can turn, positions are ignored: the result is true if there are several bodies.
  bool bodies_can_touch(double dt)
  {
    const StepView<D> &view = machine_.view();
    if (view.num_rigid > 0) return view.has_several_bodies();
    for (int b = 0; b < view.num_bodies; ++b)
      for (int other = 0; other < b; ++other)
        if (!are_apart(b, other, dt)) return true;
    return false;
  }
  /// True if two bodies are more than two cells apart along one axis after `dt` [time].
  bool are_apart(int one, int other, double dt)
  {
    const StepView<D> &view = machine_.view();
    const double *low_and_high[2] = {machine_.maxima() + view.body_maximum(one),
                                     machine_.maxima() + view.body_maximum(other)};
    for (int a = 0; a < D; ++a) {
      const double moved = (body_velocity_[one][a] - body_velocity_[other][a]) * dt;
      const double one_above = -low_and_high[0][a] - low_and_high[1][D + a] + moved;
      const double other_above = -low_and_high[1][a] - low_and_high[0][D + a] - moved;
      if (larger(one_above, other_above) > 2.0 * view.grid.cell_size()) return true;
    }
    return false;
  }

  /// Runs the passes that need pending stresses. A device launches them speculatively, before the
  /// host has checked that the stresses are complete. If the host must finish some RVEs, the passes
  /// are cancelled and repeated. Passes are not launched speculatively if the hosts exchange sums
  /// between the passes, as they do for bodies that can turn.
  template <class Passes> void after_stress(StressUpdate<D> &update, const Passes &passes)
  {
    const bool needs_no_host = !machine_.is_synchronous() &&
        (communication_.ranks == 1 ||
         (machine_.devices_exchange() && machine_.view().num_rigid == 0));
    const std::int32_t *needs_host = needs_no_host ? update.needs_host() : nullptr;
    const auto launch = [&] {
      passes();
      machine_.submit();
    };
    if (needs_host) {
      machine_.halt_if(needs_host);
      launch();
      machine_.halt_if(nullptr);
    }
    try {
      if (fetch_stress(update) != rve::StressesAre::OnDevice || !needs_host) launch();
      // devices of other ranks can wait for these passes, so the hosts synchronise after them
      update.synchronise_ranks();
    } catch (...) {
      machine_.leave_ranks();
      throw;
    }
  }
  /// Finds errors, weights and bounds of all points and loads.
  void prepare(bool bounds_forces)
  {
    over<PreparePoint>(bounds_forces);
    over<PrepareLoad>(bounds_forces);
    if (machine_.is_synchronous()) throw_first_error();
    share_maxima(0, machine_.view().num_maxima());
    if (!machine_.is_synchronous()) return;
    check_all();
    machine_.divide_nodes(bodies_can_touch(0.0));
  }

  void find_forces()
  {
    find_cell_means<MeanPressure>();
    sum<Inertia, Force>(true);
    if (options_.water.flows()) sum<WaterFlow>(false);
    balance();
  }

  /// Moves the points with the grid, and finds the strains from the momenta at the end.
  void move(double dt)
  {
    over<AdvancePoint>();
    if (machine_.is_synchronous()) throw_first_error();
    static_assert(ContactBound == MomentumAgainBound + 2, "one exchange shares all three");
    share_maxima(MomentumAgainBound, 3);
    if (machine_.is_synchronous()) check_sums();
    sum<MomentumAgain>(false);
    impose_bodies(Contact::Keep, false);
    find_strains(dt);
  }

  /// Finds means over cells if the option mean_dilation is set.
  template <template <int> class Mean> void find_cell_means()
  {
    if (options_.mean_dilation) sum<Mean>(false);
  }

  /// Balances the momenta of the nodes under all conditions, and finds their velocities.
  void balance()
  {
    if (machine_.view().num_absorbing > 0) over<AbsorbAtNode>();
    impose_bodies(Contact::Find, true);
    finish_bodies();
    over<NodeBalance>();
    if (!(options_.damping > 0.0)) return;
    impose_bodies(Contact::Keep, false);
    over<NodeDamped>();
  }

  /// Finds strains over `dt` [time] from momenta on which bodies have been imposed.
  void find_strains(double dt)
  {
    over<NodeVelocity>();
    if (options_.mean_dilation) {
      over<GradientOfPoint>();
      share_maxima(DilationBound, 1);
      find_cell_means<MeanDilation>();
    }
    over<StrainPoint>(dt);
  }
  /// Begins the update of the stresses by strains over `dt` [time].
  void begin_stress(double dt, StressUpdate<D> &update)
  {
    const bool is_planned = update.plan(machine_.device_arrays(), dt);
    machine_.request_findings();
    if (is_planned) update.launch_early();
    machine_.wait_for_findings();
    check_all();
    if (!machine_.is_synchronous()) {
      half_boxes_ = machine_.maxima()[BoxBound];
      divides_nodes_ = bodies_can_touch(machine_.view().dt);
    }
    if (is_planned && update.launch()) {
      machine_.expect_device_stresses();
      machine_.download_motion();    // while the stresses are computed
      return;
    }
    const Tensor<D> *const increments = machine_.increments();
    const bool come_later = update.begin(increments, dt, machine_.hoop_increments());
    machine_.download_motion();
    if (!come_later) machine_.stresses_changed();
  }
  rve::StressesAre fetch_stress(StressUpdate<D> &update)
  {
    const rve::StressesAre they_are = update.finish();
    if (they_are == rve::StressesAre::OnHost) machine_.stresses_changed();
    return they_are;
  }
  void finish_stress(StressUpdate<D> &update)
  {
    fetch_stress(update);
    update.synchronise_ranks();
  }

  /// Imposes the contacts of all bodies. If several bodies can hold the same nodes, all contacts
  /// are found first, and the nodes are divided among them.
  void impose_bodies(Contact how, bool balances)
  {
    if (!machine_.view().divides_nodes) {
      impose_all({how, true, true, balances, false});
      return;
    }
    impose_all({how, true, false, balances, false});
    over<DivideNodes>();
    for (int sweep = 0; sweep < SHARED_SWEEPS; ++sweep) {
      impose_all({sweep == 0 ? how : Contact::Keep, false, true, balances, sweep > 0});
      over<JoinNodes>(balances);
    }
  }
  void impose_all(const ContactWork &work)
  {
    for (const Ordered &next : order_) {
      const RigidBodyOptions &options = options_.rigid_bodies[next.body];
      if (next.turning < 0)
        over<ImposeBody>(next.body, options, plates_, work);
      else
        impose_contacts(next.turning, options, work);
    }
  }
  void impose_contacts(int index, const RigidBodyOptions &options, const ContactWork &work)
  {
    const auto along = [&](int axis) {
      return ContactPass<D>{{machine_.view()}, index, axis, options};
    };
    if (work.finds && machine_.view().divides_nodes)
      for (int axis = 0; axis < D; ++axis) machine_.over(FindContacts<D>{along(axis)});
    if (!work.imposes) return;
    if (work.balances && options.free != 0 && !work.again) {
      for (int axis = 0; axis < D; ++axis) machine_.over(GatherContacts<D>{along(axis)});
      share_contacts(index, MoveContactSums<D>::OF_ONE);
      over<SolveContacts>(index);
    }
    for (int axis = 0; axis < D; ++axis) machine_.over(ImposeContacts<D>{along(axis), work});
  }
  void finish_bodies()
  {
    const int count = machine_.view().num_rigid;
    if (count == 0) return;
    share_contacts(-1, MoveContactSums<D>::FELT * count);
    over<FinishBodies>();
  }
  /// Sums `count` contact sums over all ranks. `index`: body whose sums are exchanged; -1: the
  /// impulses on all bodies.
  void share_contacts(int index, int count)
  {
    if (communication_.ranks == 1) return;
    MoveContactSums<D> sums{{machine_.view()}, index, true, machine_.exchange_buffer(count), count};
    machine_.over(sums);
    machine_.wait();
    communication_.sum_over_ranks(sums.buffer, count);
    sums.packs = false;
    machine_.over(sums);
  }

  /// Sums contributions of all points, and optionally the forces of loads, on the nodes.
  template <template <int> class... Sum> void sum(bool with_loads)
  {
    using Points = Scatter<D, Sum...>;
    machine_.scatter(Points{{machine_.view()}});
    if (with_loads) machine_.scatter_loads(ScatterLoad<D>{{machine_.view()}});
    share_sums<Points>();
    machine_.over(TakeSums<D, Sum...>{{machine_.view()}});
  }

  /// Adds the sums that a pass has formed on other ranks to the sums of this rank, on the nodes
  /// that ranks share.
  template <class P> void share_sums()
  {
    if (communication_.ranks == 1) return;
    MoveSums<D> sums{{machine_.view()},
                     machine_.given_nodes(),
                     static_cast<int>(shared_.given().size()),
                     {P::adds_to(InertiaSums), P::adds_to(VectorSums)},
                     nullptr,
                     true};
    if (machine_.devices_exchange()) {
      machine_.exchange_sums(sums, shared_);
      return;
    }
    const std::size_t width = sums.width();
    const std::size_t given = shared_.given().size(), taken = shared_.taken().size();
    std::int64_t *buffer = machine_.exchange_buffer(width * (given + taken));
    sums.buffer = buffer;
    machine_.over(sums);
    machine_.wait();
    messages_.clear();
    std::int64_t *sent = buffer, *received = buffer + width * given;
    for (const Neighbour &other : shared_.neighbours()) {
      messages_.push_back({other.rank, sent, width * other.given, received, width * other.taken});
      sent += width * other.given;
      received += width * other.taken;
    }
    communication_.exchange(messages_);
    sums.nodes = machine_.taken_nodes();
    sums.count = static_cast<int>(taken);
    sums.buffer = buffer + width * given;
    sums.packs = false;
    machine_.over(sums);
  }

  void share_maxima(int first, int count) { machine_.share_maxima(communication_, first, count); }

  void throw_first_error()
  {
    if (machine_.first_error() == PointErrorKey::NO_ERROR) return;
    const StepView<D> &view = machine_.view();
    throw_point_error(view.grid, machine_.host_points(), view.num_bodies, view.num_models,
                      machine_.first_error());
  }

  void check_sums()
  {
    StepView<D> view = machine_.view();
    view.maximum = machine_.maxima();
    check_bound(view.maximum[MassBound], view.point_total, "mass");
    check_bound(view.maximum[MomentumBound], view.point_total, "momentum");
    check_bound(view.force_bound(), view.point_total, "force");
    check_bound(view.maximum[MomentumAgainBound], view.point_total, "momentum");
    check_bound(view.maximum[VolumeBound] *
                    larger(view.maximum[PressureBound], view.maximum[DilationBound]),
                view.point_total, "volume times pressure or rate of dilation");
  }

  /// Throws if the findings of the machine so far contain an error.
  void check_all()
  {
    throw_first_error();
    check_sums();
    const StepView<D> &view = machine_.view();
    rve::require(
        !(machine_.maxima()[ContactBound] > 1.0),
        "the impulse of a contact with a rigid body is too large for the sums on the grid, ",
        machine_.maxima()[ContactBound], " times their largest value");
    for (int b = 0; b < view.num_bodies; ++b)
      rve::require(std::isfinite(machine_.maxima()[view.body_maximum(b)]),
                   [&] { return options_.name_of_body(b) + " has no points"; });
  }

  Vec<D> per_time(const Vec<D> &impulse) const
  {
    return machine_.view().dt > 0.0 ? (1.0 / machine_.view().dt) * impulse : Vec<D>::zero();
  }

  SolverOptions<D> options_;
  Communication communication_;
  Grid<D> whole_;
  Boundary<D> boundary_;
  SharedNodes<D> shared_;
  Machine<D> machine_;
  std::vector<Message> messages_;
  /// Reactions that were computed since the last step, by body or side.
  std::map<int, Vec<D>> body_reactions_, side_reactions_;
  /// Half size [cells] of the largest box of a point after the last strains, if only the machine
  /// has the present deformation; otherwise FROM_POINTS.
  double half_boxes_ = SharedNodes<D>::FROM_POINTS;
  bool divides_nodes_ = false;    ///< nodes are divided among bodies in the next step
  std::vector<Vec<D>> body_velocity_;
  int point_count_ = -1;    ///< number of points in the last step
  struct Ordered {
    int body, turning;    ///< index among all bodies; index among those that can turn, or -1
  };
  std::vector<Ordered> order_;    ///< order of the bodies in the passes
  std::uint64_t plates_ = 0;      ///< bit b: body b presses with one face and is not round
};

}    // namespace mpm
