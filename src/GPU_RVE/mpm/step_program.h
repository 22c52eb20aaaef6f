// One time step as a sequence of passes, for any machine that runs passes: host_machine.h says what a machine is.

#ifndef MPM_STEP_PROGRAM_H
#define MPM_STEP_PROGRAM_H

#include "mpm/shared_nodes.h"
#include "mpm/step_passes.h"
#include "mpm/step_runner.h"
#include "rve/core/error.h"

#include <string>
#include <utility>
#include <vector>

namespace mpm {

template <class Machine> class StepProgram final : public StepRunner {
 public:
  StepProgram(const SolverOptions &options, Communication communication, const Grid &grid) :
      options_(options), communication_(std::move(communication)),
      boundary_(grid, options.sides, options.rigid_bodies),
      shared_(grid, communication_, options.rigid_bodies, options.threads),
      machine_(options, grid, boundary_, communication_.ranks)
  {
  }

  void step(const StepInput &input, const StressUpdate &update) override
  {
    const bool usavg = options_.scheme == Scheme::Usavg;
    const double part = usavg ? 0.5 * input.dt : input.dt;
    prepare(input, !usavg);
    if (usavg) {
      scatter(ScatterInertia{machine_.view()});
      machine_.over_nodes(NodeInertia{machine_.view()});
      impose_bodies(Contact::Find, false);
      strain(part, update);
      machine_.over_points(BoundForces{machine_.view()});
      machine_.over_loads(PrepareLoad{machine_.view(), true});
      share_maxima(ForceBound, 1 + machine_.view().num_loads);
      if (machine_.knows_at_once()) check_sums();
      scatter_with_loads(ScatterForces{machine_.view()});
      machine_.over_nodes(NodeForce{machine_.view()});
      balance();
    } else {
      find_forces();
    }
    machine_.over_points(AdvancePoint{machine_.view()});
    if (machine_.knows_at_once()) fail_on_trouble();
    static_assert(Unbalanced == MomentumAgainBound + 1, "both at once");
    share_maxima(MomentumAgainBound, 2);
    if (machine_.knows_at_once()) check_sums();
    scatter(ScatterMomentumAgain{machine_.view()});
    machine_.over_nodes(NodeMomentumAgain{machine_.view()});
    impose_bodies(Contact::Keep, false);
    strain(part, update);
  }

  void evaluate(const StepInput &input) override
  {
    prepare(input, true);
    find_forces();
    share_maxima(Unbalanced, 1);
    machine_.settle();
    check_all();
  }

  void fetch(const PointView &points) override { machine_.fetch(points); }
  void points_changed() override { machine_.points_changed(); }

  Vec2 body_reaction(int body) override
  {
    return per_time(
        boundary_.body_impulse(body, shared_.everywhere(machine_.body_impulse(body), vectors_)));
  }
  Vec2 side_reaction(Face side) override
  {
    return per_time(boundary_.side_impulse(
        side, shared_.everywhere(machine_.side_impulse(axis_of(side)), vectors_)));
  }
  Vec2 damping_force() override
  {
    Vec2 sum = Vec2::zero();
    if (!(options_.damping > 0.0)) return sum;
    const Vec2 *impulse = shared_.everywhere(machine_.damping_impulse(), vectors_);
    for (int n = 0; n < machine_.view().grid.node_count(); ++n) sum = sum + impulse[n];
    return per_time(sum);
  }
  double max_unbalanced_force() override { return machine_.unbalanced(); }
  const Vec2 *node_force() override { return shared_.everywhere(machine_.node_force(), vectors_); }
  const double *node_mass() override { return shared_.everywhere(machine_.node_mass(), scalars_); }
  double transfer_time() const override { return machine_.transfer_time(); }
  std::string description() const override { return machine_.description(); }

 private:
  /// Checks, weights and bounds of all points.
  void prepare(const StepInput &input, bool bounds_forces)
  {
    machine_.begin(input);
    machine_.over_points(PreparePoint{machine_.view(), bounds_forces});
    machine_.over_loads(PrepareLoad{machine_.view(), bounds_forces});
    shared_.find(input.points);    // while a device prepares them
    machine_.take_shared(shared_);
    if (machine_.knows_at_once()) fail_on_trouble();
    share_maxima(0, machine_.view().num_maxima());
    if (machine_.knows_at_once()) check_all();
  }

  void find_forces()
  {
    scatter_with_loads(ScatterInertiaAndForces{machine_.view()});
    machine_.over_nodes(NodeInertiaAndForce{machine_.view()});
    balance();
  }

  /// The momentum balance of the nodes under all conditions, and their velocities.
  void balance()
  {
    impose_bodies(Contact::Find, true);
    machine_.over_nodes(NodeBalance{machine_.view()});
    if (!(options_.damping > 0.0)) return;
    impose_bodies(Contact::Keep, false);
    machine_.over_nodes(NodeDamped{machine_.view()});
  }

  /// Strains from the momenta at the end, which bodies have been imposed on, and the stresses that they give.
  void strain(double dt, const StressUpdate &update)
  {
    machine_.over_nodes(NodeVelocity{machine_.view()});
    machine_.over_points(StrainPoint{machine_.view(), dt});
    machine_.settle();
    check_all();
    update(machine_.increments(), dt);
    machine_.stresses_changed();
  }

  void impose_bodies(Contact contact, bool balances)
  {
    for (int b = 0; b < machine_.view().num_bodies; ++b)
      machine_.over_columns(
          ImposeBody{machine_.view(), b, options_.rigid_bodies[b], contact, balances});
  }

  template <class P> void scatter(const P &pass)
  {
    machine_.scatter(pass);
    share_sums(P::INERTIA, P::VECTORS);
  }
  template <class P> void scatter_with_loads(const P &pass)
  {
    machine_.scatter(pass);
    machine_.scatter_loads(ScatterLoad{machine_.view()});
    share_sums(P::INERTIA, true);
  }

  /// Sums over all ranks, where that matters to more than one of them.
  void share_sums(bool inertia, bool vectors)
  {
    const int count = static_cast<int>(shared_.nodes().size());
    if (count == 0) return;
    ListedSums sums{machine_.view(), machine_.shared_nodes(), count, inertia, vectors, nullptr};
    const std::size_t size = static_cast<std::size_t>(sums.components()) * count;
    sums.buffer = machine_.exchange_buffer(size);
    machine_.over_shared(PackSums{sums});
    machine_.wait();
    communication_.sum_over_ranks(sums.buffer, size);
    machine_.over_shared(UnpackSums{sums});
  }

  void share_maxima(int first, int count) { machine_.share_maxima(communication_, first, count); }

  void fail_on_trouble()
  {
    if (machine_.first_trouble() == FirstTrouble::NOWHERE) return;
    const StepView &view = machine_.view();
    throw_point_error(view.grid, machine_.host_points(), view.num_bodies, view.num_models,
                      machine_.first_trouble());
  }

  void check_sums()
  {
    StepView view = machine_.view();
    view.maximum = machine_.maxima();
    check_bound(view.maximum[MassBound], view.point_total, "mass");
    check_bound(view.maximum[MomentumBound], view.point_total, "momentum");
    check_bound(view.force_bound(), view.point_total, "force");
    check_bound(view.maximum[MomentumAgainBound], view.point_total, "momentum");
  }

  /// Everything that the machine can have found so far.
  void check_all()
  {
    fail_on_trouble();
    check_sums();
    const StepView &view = machine_.view();
    for (int b = 0; b < view.num_bodies; ++b)
      rve::require(std::isfinite(machine_.maxima()[view.body_maximum(b)]), [&] {
        return options_.name_of_body(b) + " has no points";
      });
  }

  Vec2 per_time(const Vec2 &impulse) const
  {
    return machine_.view().dt > 0.0 ? (1.0 / machine_.view().dt) * impulse : Vec2::zero();
  }

  SolverOptions options_;
  Communication communication_;
  Boundary boundary_;
  SharedNodes shared_;
  Machine machine_;
  std::vector<Vec2> vectors_;    ///< of all ranks, per node: what was asked for last
  std::vector<double> scalars_;
};

}    // namespace mpm

#endif
