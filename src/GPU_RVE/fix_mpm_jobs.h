// SPDX-License-Identifier: GPL-2.0-only
// Classes for the jobs of fix mpm: loads, wave speeds, checks, in-situ stress and wall times. The
// arrays of the points are not here but in fix_mpm_impl.h. The classes access the points by a
// PointView, as the solver does. Their functions are collective.

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

/// Data of fix mpm in D dimensions that the classes below share: settings, solver and models.
template <int D> struct MpmSetup {
  using Points = mpm::PointView<D>;

  LAMMPS *const lmp;
  FixMpm *const fix;
  MpmSettings<D> settings;
  std::unique_ptr<mpm::MpmSolver<D>> solver;
  // for each model, the fix rve with its RVEs, or null for an analytic law
  std::vector<FixRve *> grains;
  std::vector<mpm::Constitutive<D> *> laws;    // law of each model
  std::vector<int> turning;                    // rigid bodies that can turn

  MpmSetup(LAMMPS *_lmp, FixMpm *_fix, MpmSettings<D> _settings) :
      lmp(_lmp), fix(_fix), settings(std::move(_settings))
  {
    for (int b = 0; b < (int) settings.bodies.size(); b++)
      if (settings.options.rigid_bodies[b].form != mpm::BodyForm::Face) turning.push_back(b);
  }

  /// Looks up the fixes of the models and passes the laws to the solver.
  void find_models();
  /// Ends with an error if the fix of a model was deleted. The check is needed in a run with "pre
  /// no", because LAMMPS then does not call init(), which looks up the fixes.
  void check_sources() const;
  /// Changes parameters of models. `when` is the beginning of the log line. The arrays of the host
  /// must be up to date.
  void change_models(const std::vector<MpmModel<D>> &wanted, const std::string &when);
  /// Applies `words`, the arguments of a fix_modify in the run that wrote the restart file. `then`
  /// are the arguments of fix mpm in that run. If this run defines the model differently, the
  /// changes are not applied and a warning is printed.
  void continue_modification(const MpmArguments &then, const std::string &words);

  /// Returns the fixes whose RVEs are models. Each fix is listed once, even if several models share
  /// it.
  std::vector<FixRve *> sources() const
  {
    std::vector<FixRve *> all;
    for (FixRve *some : grains)
      if (some && std::find(all.begin(), all.end(), some) == all.end()) all.push_back(some);
    return all;
  }
  bool has_grains() const { return !sources().empty(); }

  /// Returns the density that the script gives a point, or 0 if it gives none [mass/length^3].
  double given_density(const Points &points, int i) const
  {
    const int body = points.rigid_body[i];
    return body >= 0 ? settings.density_of(settings.bodies[body])
                     : settings.density_of(settings.models[points.model[i]]);
  }

  /// Returns the density that the script gives a point, or else the density of its RVE, or else 0
  /// [mass/length^3].
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
        lmp, [&] { return fmt::format("fix mpm {}: step {}", fix->id, lmp->update->ntimestep); },
        work);
  }
};

/// Returns the stress of the RVE of an atom in a continuum of D dimensions. For spheres in a plane
/// continuum it omits the components out of the plane.
template <int D> mpm::Tensor<D> stress_of(const FixRve &grains, int atom)
{
  if constexpr (D == 2)
    if (grains.rves().dimension == 2) return grains.rves_of<2>().point(atom).result.stress;
  return rve::leading_components<D>(grains.rves_of<3>().point(atom).result.stress);
}

/// Returns the hoop stress of the RVE of spheres of an atom in axisymmetry [stress].
inline double hoop_stress_of(const FixRve &grains, int atom)
{
  return grains.rves_of<3>().point(atom).result.stress(2, 2);
}

/// Applies the loads of the script in a step: tractions, and the motion of rigid bodies.
template <int D> class MpmLoads : protected Pointers {
 public:
  using Points = mpm::PointView<D>;
  using Vec = mpm::Vec<D>;

  explicit MpmLoads(const MpmSetup<D> &_setup) :
      Pointers(_setup.lmp), displacement(_setup.settings.bodies.size(), Vec::zero()), setup(_setup)
  {
  }

  /// Evaluates the loads and velocities of the script and advances the points by one step. If
  /// `advance` is false, it evaluates only the loads, velocities and forces.
  void solve(const Points &points, bool advance);

  /// Returns the largest velocity component that the script prescribes for any body in the last
  /// step [length/time].
  double body_speed() const { return speed; }
  std::vector<Vec>
      displacement;    ///< displacement of each body since the fix was defined [length]

  /// Returns true if the variables or regions that are evaluated in each step can depend on results
  /// of fixes or computes.
  bool reads_results() const;

 private:
  const MpmSetup<D> &setup;
  std::vector<mpm::TractionLoad<D>> loads;    // loads of this step
  double speed = 0.0;

  mpm::TractionLoad<D> load_of(const MpmTraction<D> &traction, const Points &points) const;
  void warn_of_empty_regions() const;
  void move_bodies(bool advance);
};

/// Compares the time step and the dashpots of absorbing sides with the wave speeds of the points.
template <int D> class MpmWaves : protected Pointers {
 public:
  using Points = mpm::PointView<D>;

  explicit MpmWaves(const MpmSetup<D> &_setup) : Pointers(_setup.lmp), setup(_setup) {}

  /// Returns the Courant number of the last check [-].
  double courant() const { return number; }

  /// Allows warnings again at the beginning of a run.
  void begin_run() { warned = warned_rounding = warned_tangent = false; }
  /// Measures the tangents of those RVEs that have the highest upper bounds of the wave speed. The
  /// largest ratio of a measured P-wave modulus to its upper bound then scales the bounds of all
  /// RVEs of the fix rve. The Courant number follows from the scaled bounds.
  void measure(const Points &points);
  /// Ends with an error if the Courant number is above its limit. `body_speed`: see
  /// MpmLoads::body_speed().
  void check_courant(const Points &points, double body_speed);
  /// Warns if coordinates are so large that rounding changes the motion of a step by more than 1 %.
  void check_rounding(const Points &points, double body_speed);
  /// Warns of a time step that is far below the stable one.
  void check_time_step() const;
  /// Warns of dashpots that reflect a large part of the stress of a wave.
  void check_absorbing_sides(const Points &points);

 private:
  const MpmSetup<D> &setup;
  double number = 0.0;
  bool warned = false, warned_sides = false;
  bool warned_rounding = false;    // warned of coordinates far from the origin in this run
  bool warned_tangent = false;     // warned of RVEs without a measured tangent in this run

  /// Ends with an error if the time step is too large for water that flows.
  void check_flow(const Points &points) const;
  std::vector<int> fastest(const Points &points, const FixRve &source,
                           const mpm::Constitutive<D> &law) const;
};

/// Checks the points and bodies between runs and in runs.
template <int D> class MpmChecks : protected Pointers {
 public:
  using Points = mpm::PointView<D>;

  explicit MpmChecks(const MpmSetup<D> &_setup) : Pointers(_setup.lmp), setup(_setup) {}

  /// Stores the number of points, a checksum of their positions, and the box at the end of a run.
  void keep_positions();
  /// Warns if other commands have moved points since keep_positions(). Ends with an error if the
  /// box has changed as well.
  void check_positions() const;
  /// Warns once of points in the groups of several models or bodies.
  void check_overlap();
  /// Warns if the points in a cell have more volume than the cell: they overlap or are too large.
  /// Checks only the cells with new points (`made`), but sums the volume of all points in them.
  /// Ends with an error if all points are new and most of their cells are too full. Warns at most
  /// once in a run.
  void check_volume(const Points &points, const std::vector<int> &made, bool in_run);
  /// Ends with an error if a rigid body has lost points since the last call. If `advance` is false,
  /// it counts the points without comparing the counts with those of the last call.
  void check_bodies(const Points &points, bool advance);
  /// Warns of points inside of bodies that can turn, before these bodies move.
  void check_enclosed(const Points &points) const;
  /// Logs once how many nodes of the grid each rank stores.
  void report_parts();

  // Local damping is a force on the nodes without a reaction. The next functions sum this force and
  // the largest reaction over some steps of a run, and report the ratio of both sums at the end of
  // the run.

  void begin_damping() { damping_sum = reaction_sum = 0.0; }
  void add_damping();
  /// `last`: index of the last component of the damping force in the vector of the fix, from 1.
  void report_damping(int last);

 private:
  using Box = std::array<double, 2 * D>;    // low and high sides of LAMMPS' box, axis by axis

  const MpmSetup<D> &setup;
  // number of points, checksum of their positions, and box at the end of the last run
  bigint points_then = -1;
  std::uint64_t positions_then = 0;
  Box box_then = {};
  bool warned_overlap = false, reported_parts = false, warned_damping = false;
  bool warned_full = false;    // warned of too full cells in this run
  std::vector<bigint>
      body_points;    // points of each body at the last exchange of atoms, all ranks
  double damping_sum = 0.0, reaction_sum = 0.0;    // sums over some steps of this run [force]

  /// Returns a checksum of IDs and positions that does not depend on the order of atoms.
  std::uint64_t sum_of_positions() const;
  Box box() const;
};

template <int D> class MpmWater;

/// Finds the in-situ stress of new points, and reports unbalanced forces.
template <int D> class MpmGround : protected Pointers {
 public:
  using Points = mpm::PointView<D>;
  using Tensor = mpm::Tensor<D>;
  using Atoms = std::vector<int>;
  using Goals = std::vector<macro::StressGoal>;

  MpmGround(const MpmSetup<D> &_setup, MpmWater<D> &_water) :
      Pointers(_setup.lmp), setup(_setup), water(_water)
  {
  }

  /// The initial state of a new point.
  struct Start {
    Tensor stress;     ///< effective Cauchy stress [stress]
    double density;    ///< with the water [mass/length^3]
    /// Out-of-plane stress of a point without an RVE at rest in the plane [stress].
    std::optional<double> across_plane;
  };
  using Starts = std::vector<Start>;
  /// Finds the in-situ stress of the new points `made` and brings their RVEs to this stress.
  /// Returns their initial states in the same order.
  Starts find(const Points &points, const Atoms &made);
  /// Warns of points in `made` whose stress is beyond the strength of their law. The law changes
  /// such a stress even at zero strain.
  void check_strength(const Points &points, const Atoms &made);
  /// Reports the largest unbalanced force if there are new points since the last report. The nodal
  /// forces must have been evaluated.
  void report(const Points &points);
  /// Cancels the report that is due for the points created so far.
  void forget() { is_new = false; }

 private:
  const MpmSetup<D> &setup;
  MpmWater<D> &water;
  bool is_new = false;
  bool warned_strength = false;    // warned of stress beyond the strength in this run
  double weight_of_cell = 0.0;    // weight of a cell of new points, or 0 if it is not known [force]

  Starts find_at_rest(const Points &points, const Atoms &made);
  Starts find_by_components(const Points &points, const Atoms &made);
  Tensor stress_at(const Points &points, int i, const macro::StressGoal &goal) const;
  macro::GroundAtRest at_rest(const Points &points, const Atoms &made) const;
  Goals goals_by_components(const Atoms &made) const;
  /// Returns the density of a new point with its water, reduced by buoyancy [mass/length^3]. Its
  /// product with gravity is the weight that the effective stress and the water balance.
  double density_of_weight(const Points &points, int i) const;
  /// Finds the porosities of new points, and returns their densities of weight [mass/length^3].
  std::vector<double> densities(const Points &points, const Atoms &made) const;
  macro::HeightProfile density_of_grains(const Points &points, const Atoms &made,
                                         const macro::GroundAtRest &ground) const;
  std::vector<double> stress_ratios(const Points &points, const Atoms &made) const;
  macro::InSituReport bring_grains(const Points &points, const Atoms &made, const Goals &goals,
                                   double tolerance) const;
  void report_grains(const macro::InSituReport &report, int rounds) const;
  double cell_volume() const;
};

/// Measures the wall times of RVEs, MPM and transfers in the steps of this run, on this rank.
template <int D> class MpmTimes : protected Pointers {
 public:
  enum Part { RVE, MPM, TRANSFERS, PARTS };

  explicit MpmTimes(const MpmSetup<D> &_setup) : Pointers(_setup.lmp), setup(_setup) {}

  void begin_run() { std::fill_n(seconds, (int) PARTS, 0.0); }
  void begin_step() { begun = now(); }
  /// Marks the time at which a step is solved and the output columns are not filled yet.
  void end_solution() { solved = now(); }
  void end_step();
  /// Logs the wall times per step at the end of a long run, as means over all ranks.
  void report() const;
  /// Returns the wall time of a Part in this run, maximum over all ranks [seconds].
  double longest(int part) const;

 private:
  /// Accumulated wall times [seconds].
  struct Moment {
    double clock = 0.0;     // wall clock
    double copies = 0.0;    // copies from and to a device
    double engine = 0.0;    // calls of the engine of RVEs
    double bounds = 0.0;    // bounds of the stable DEM time steps of RVEs
    double models = 0.0;    // models with RVEs; includes `engine` but not `bounds`
  };
  const MpmSetup<D> &setup;
  double seconds[PARTS] = {};
  Moment begun, solved;

  Moment now() const;
};

}    // namespace LAMMPS_NS
