// SPDX-License-Identifier: GPL-2.0-only
// The jobs of fix mpm besides the arrays of its points, and what they have in common. They get the
// points as the solver does. Their functions are collective.

#pragma once

#include "fix_mpm.h"
#include "fix_rve_impl.h"
#include "lammps/collective_error.h"
#include "lammps/mpm_settings.h"
#include "macro/in_situ.h"
#include "mpm/mpm_solver.h"
#include "pointers.h"
#include "update.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

/// The settings of the script, the solver and the models of the points, in a continuum of D
/// dimensions.
template <int D> struct MpmScene {
  using Points = mpm::PointView<D>;

  LAMMPS *const lmp;
  FixMpm *const fix;
  MpmSettings<D> settings;
  std::unique_ptr<mpm::MpmSolver<D>> solver;
  std::vector<FixRve *> grains;                // per model; nullptr: an analytic law
  std::vector<mpm::Constitutive<D> *> laws;    // per model, those of the solver
  std::vector<int> turning;                    // bodies that can turn

  MpmScene(LAMMPS *_lmp, FixMpm *_fix, MpmSettings<D> _settings) :
      lmp(_lmp), fix(_fix), settings(std::move(_settings))
  {
    for (int b = 0; b < (int) settings.bodies.size(); b++)
      if (settings.options.rigid_bodies[b].form != mpm::BodyForm::Face) turning.push_back(b);
  }

  /// Looks up the fixes of the models, and gives the solver its laws.
  void find_models();
  /// Ends with an error if a fix of a model is not there any more: a run with "pre no" has no init,
  /// which would find others.
  void check_sources() const;
  /// Other parameters of models, from `when` on. The host must have the points.
  void change_models(const std::vector<MpmModel<D>> &wanted, const std::string &when);
  /// The same by the words of a fix_modify of the run that has written the restart file, if that
  /// run has defined the model as `settings` do; if not, the new definition counts.
  void continue_modification(const MpmWords &then, const std::string &words);

  /// The fixes whose RVEs are models, each once: groups may share one.
  std::vector<FixRve *> sources() const
  {
    std::vector<FixRve *> all;
    for (FixRve *some : grains)
      if (some && std::find(all.begin(), all.end(), some) == all.end()) all.push_back(some);
    return all;
  }
  bool has_grains() const { return !sources().empty(); }

  /// Density that the script gives a point [mass/length^3]; 0: none.
  double given_density(const Points &points, int i) const
  {
    const int body = points.rigid_body[i];
    return body >= 0 ? settings.density_of(settings.bodies[body])
                     : settings.density_of(settings.models[points.model[i]]);
  }

  /// Density that the script gives a point or its RVE has [mass/length^3]; 0: none.
  double density_of(const Points &points, int i) const
  {
    const double given = given_density(points, i);
    if (given > 0.0 || points.rigid_body[i] >= 0) return given;
    const FixRve *source = grains[points.model[i]];
    return source ? source->rves().bulk_density(i) : 0.0;
  }

  /// Runs work(). If it throws, this rank ends with an error that names the fix and the step.
  template <class Work> void guarded(const Work &work) const
  {
    on_this_rank(
        lmp, [&] { return fmt::format("Fix mpm {}, step {}", fix->id, lmp->update->ntimestep); },
        work);
  }
};

/// The stress of an RVE in a continuum of D dimensions. In the plane that of spheres has components
/// across it.
template <int D> mpm::Tensor<D> stress_of(const FixRve &grains, int atom)
{
  if constexpr (D == 2)
    if (grains.rves().dimension == 2) return grains.rves_of<2>().point(atom).result.stress;
  return rve::leading_components<D>(grains.rves_of<3>().point(atom).result.stress);
}

/// What the script does to the points in a step: tractions, and the motion of rigid bodies.
template <int D> class MpmLoads : protected Pointers {
 public:
  using Points = mpm::PointView<D>;
  using Vec = mpm::Vec<D>;

  explicit MpmLoads(const MpmScene<D> &_scene) :
      Pointers(_scene.lmp), displacement(_scene.settings.bodies.size(), Vec::zero()), scene(_scene)
  {
  }

  /// Makes a step, or an evaluation that advances nothing, with the loads and velocities that the
  /// script has now.
  void solve(const Points &points, bool advance);

  /// Largest prescribed component of a body in the last step [velocity].
  double body_speed() const { return speed; }
  std::vector<Vec> displacement;    ///< of each body since the fix was defined [length]

  /// Whether variables or regions that are evaluated in each step may read fixes or computes.
  bool reads_results() const;

 private:
  const MpmScene<D> &scene;
  std::vector<mpm::TractionLoad<D>> loads;    // of this step
  double speed = 0.0;

  mpm::TractionLoad<D> load_of(const MpmTraction<D> &traction, const Points &points) const;
  void warn_of_empty_regions() const;
  void move_bodies(bool advance);
};

/// Compares the time step and absorbing sides with the speeds of waves in the points.
template <int D> class MpmWaves : protected Pointers {
 public:
  using Points = mpm::PointView<D>;

  explicit MpmWaves(const MpmScene<D> &_scene) : Pointers(_scene.lmp), scene(_scene) {}

  /// Courant number of the last check [-].
  double courant() const { return number; }

  /// Warnings come again, in a run that is initialized.
  void begin_run() { warned = warned_rounding = false; }
  /// Measures wave speeds of RVEs by the tangents of those whose bounds are the fastest: they
  /// decide the Courant number.
  void measure(const Points &points);
  /// Ends with an error if the Courant number is above its limit. `body_speed`: largest prescribed
  /// component of a body [velocity].
  void check_courant(const Points &points, double body_speed);
  /// Warns if coordinates are so large that the motion of a step is rounded.
  void check_rounding(const Points &points, double body_speed);
  /// Warns of a time step that is far below what is stable.
  void check_time_step() const;
  /// Warns of dashpots that send back much of the stress of a wave.
  void check_absorbing_sides(const Points &points);

 private:
  const MpmScene<D> &scene;
  double number = 0.0;
  bool warned = false, warned_sides = false;
  bool warned_rounding = false;    // of coordinates far from the origin, in this run

  std::vector<int> fastest(const Points &points, const FixRve &source,
                           const mpm::Constitutive<D> &law) const;
};

/// Checks the points and bodies, between runs and in them.
template <int D> class MpmChecks : protected Pointers {
 public:
  using Points = mpm::PointView<D>;

  explicit MpmChecks(const MpmScene<D> &_scene) : Pointers(_scene.lmp), scene(_scene) {}

  /// Positions, number and box are those of the end of a run.
  void keep_positions();
  /// Warns if others have moved points since then; an error if they have changed the box, too.
  void check_positions() const;
  /// Warns of points in several groups, until there are some.
  void check_overlap();
  /// Boxes of points that do not overlap fill no cell more than once. This looks at cells that have
  /// new points, `made`, next to each other or on top of those that were there. In a run it warns
  /// once.
  void check_volume(const Points &points, const std::vector<int> &made, bool in_run);
  /// Ends with an error if a rigid body has lost points since the last call; unless `advance` none
  /// counts as lost.
  void check_bodies(const Points &points, bool advance);
  /// Warns of points inside of bodies that can turn, before these move.
  void check_enclosed(const Points &points) const;
  /// Says once what the ranks hold of the grid.
  void report_parts();

  /// Local damping is a force on the nodes that no reaction holds. In some steps of a run this adds
  /// up how large it is compared with the largest reaction; the end of the run has the mean.
  /// `last`: of the components of its force in the vector of the fix, from 1.
  void begin_damping() { damping_sum = reaction_sum = 0.0; }
  void add_damping();
  void report_damping(int last);

 private:
  using Box = std::array<double, 2 * D>;    // low and high sides of LAMMPS' box, axis by axis

  const MpmScene<D> &scene;
  // as the last run left them: number of points, a sum over their positions, and the box
  bigint points_then = -1;
  std::uint64_t positions_then = 0;
  Box box_then = {};
  bool said_overlap = false, said_parts = false, warned_damping = false;
  bool warned_full = false;           // of cells that new points of this run have filled too much
  std::vector<bigint> body_points;    // of all ranks, when atoms were exchanged last
  double damping_sum = 0.0, reaction_sum = 0.0;    // of some steps of this run [force]

  std::uint64_t sum_of_positions() const;
  Box box() const;
};

/// Finds the stress in situ of points that are made together, and reports what is out of balance.
template <int D> class MpmGround : protected Pointers {
 public:
  using Points = mpm::PointView<D>;
  using Tensor = mpm::Tensor<D>;
  using Atoms = std::vector<int>;
  using Goals = std::vector<macro::StressGoal>;

  explicit MpmGround(const MpmScene<D> &_scene) : Pointers(_scene.lmp), scene(_scene) {}

  /// How a new point begins.
  struct Start {
    Tensor stress;                         ///< [stress]
    double density;                        ///< [mass/length^3]
    std::optional<double> across_plane;    ///< of a law in the plane that remembers it [stress]
  };
  using Starts = std::vector<Start>;
  /// Finds the stress in situ of the new points `made`, and brings their RVEs there. Returns how
  /// they begin, in the same order.
  Starts find(const Points &points, const Atoms &made);
  /// Warns of stresses of new points that are beyond the strength of their law: it changes them at
  /// no strain.
  void check_strength(const Points &points, const Atoms &made) const;
  /// Says what is out of balance, where forces are complete, if there are new points since the last
  /// report.
  void report(const Points &points);
  /// What is out of balance is not that of the new points.
  void forget() { is_new = false; }

 private:
  const MpmScene<D> &scene;
  bool is_new = false;
  double weight_of_cell = 0.0;    // of the new points; 0 if it is not known [force]

  Starts find_at_rest(const Points &points, const Atoms &made);
  Starts find_by_components(const Points &points, const Atoms &made);
  Tensor stress_at(const Points &points, int i, const macro::StressGoal &goal) const;
  macro::GroundAtRest at_rest(const Points &points, const Atoms &made) const;
  Goals goals_by_components(const Atoms &made) const;
  std::vector<double> densities(const Points &points, const Atoms &made) const;
  macro::HeightProfile density_of_grains(const Points &points, const Atoms &made,
                                         const macro::GroundAtRest &ground) const;
  std::vector<double> stress_ratios(const Points &points, const Atoms &made) const;
  macro::InSituReport bring_grains(const Points &points, const Atoms &made, const Goals &goals,
                                   double tolerance) const;
  void report_grains(const macro::InSituReport &report, int rounds) const;
  double cell_volume() const;
};

/// Measures where the wall time of the steps of this run goes, on this rank.
template <int D> class MpmTimes : protected Pointers {
 public:
  enum Part { RVE, MPM, TRANSFERS, PARTS };

  explicit MpmTimes(const MpmScene<D> &_scene) : Pointers(_scene.lmp), scene(_scene) {}

  void begin_run() { std::fill_n(seconds, (int) PARTS, 0.0); }
  void begin_step() { begun = now(); }
  /// The step is done, but for columns of the output.
  void end_solution() { solved = now(); }
  void end_step();
  /// Says at the end of a long run what a step took, in the mean of all ranks.
  void report() const;
  /// The longest time of a part, of all ranks [seconds].
  double longest(int part) const;

 private:
  /// Wall times so far [seconds].
  struct Moment {
    double clock = 0.0, copies = 0.0;
    double engine = 0.0;    // in calls of the engine of RVEs
    double bounds = 0.0;    // in bounds of their stable DEM time steps
    double models = 0.0;    // in models that are RVEs, which includes `engine` and not `bounds`
  };
  const MpmScene<D> &scene;
  double seconds[PARTS] = {};
  Moment begun, solved;

  Moment now() const;
};

}    // namespace LAMMPS_NS
