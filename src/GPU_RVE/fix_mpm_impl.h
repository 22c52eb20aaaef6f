// SPDX-License-Identifier: GPL-2.0-only
/* -*- c++ -*- ----------------------------------------------------------
   LAMMPS - Large-scale Atomic/Molecular Massively Parallel Simulator
   https://www.lammps.org/, Sandia National Laboratories
   LAMMPS development team: developers@lammps.org

   Copyright (2003) Sandia Corporation.  Under the terms of Contract
   DE-AC04-94AL85000 with Sandia Corporation, the U.S. Government retains
   certain rights in this software.  This software is distributed under
   the GNU General Public License.

   See the README file in the top-level LAMMPS directory.
------------------------------------------------------------------------- */

// The points of fix mpm and what becomes of them: what does not depend on the dimension of the continuum, and what does.

#pragma once

#include "fix_mpm.h"

#include "fix_rve_impl.h"
#include "lammps/collective_error.h"
#include "lammps/mpm_settings.h"
#include "lammps/progress.h"
#include "lammps/restart_record.h"
#include "macro/in_situ.h"
#include "mpm/memory_layout.h"
#include "mpm/mpm_solver.h"
#include "pointers.h"
#include "update.h"

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

/// What LAMMPS' hooks ask for, in the words of those.
struct FixMpm::Impl : protected Pointers {
  FixMpm *fix;

  /// For the dimension of LAMMPS. Reads the command.
  static std::unique_ptr<Impl> make(FixMpm *fix, int narg, char **arg);
  ~Impl() override = default;

  virtual void find_models() = 0;
  virtual void setup_pre_force() = 0;
  virtual void pre_force() = 0;
  virtual void setup() = 0;
  virtual void final_integrate() = 0;
  virtual void post_run() = 0;
  virtual void modify_models(int narg, char **arg) = 0;
  virtual double scalar() const = 0;
  virtual double vector_component(int n) = 0;
  virtual bool reads_results() const = 0;
  virtual double bytes() const = 0;
  virtual void grow_arrays(int nmax) = 0;
  virtual void copy_arrays(int i, int j) = 0;
  virtual void set_arrays(int i) = 0;
  virtual int pack_exchange(int i, double *buf) = 0;
  virtual int unpack_exchange(int i, const double *buf) = 0;
  virtual int pack_restart(int i, double *buf) = 0;
  virtual void unpack_restart(int i, int nth) = 0;
  virtual int size_restart(int i) const = 0;
  virtual int maxsize_restart() const = 0;
  virtual void write_restart(FILE *fp) const = 0;
  virtual void restart(const char *buf) = 0;

 protected:
  explicit Impl(FixMpm *_fix) : Pointers(_fix->lmp), fix(_fix) {}
  /// Runs work(). If it throws, this rank ends with an error that names the fix and the step.
  template <class Work> void guarded(const Work &work) const
  {
    on_this_rank(
        lmp, [&] { return fmt::format("Fix mpm {}, step {}", fix->id, update->ntimestep); }, work);
  }
};

/// The stress of an RVE in a continuum of D dimensions. In the plane that of spheres has components across it.
template <int D> mpm::Tensor<D> stress_of(const FixRve &grains, int atom)
{
  if constexpr (D == 2)
    if (grains.rves().dimension == 2) return grains.rves_of<2>().point(atom).result.stress;
  return rve::leading_components<D>(grains.rves_of<3>().point(atom).result.stress);
}

/// A continuum of D dimensions.
template <int D> struct FixMpm::ImplOf final : Impl {
  using Vec = mpm::Vec<D>;
  using Tensor = mpm::Tensor<D>;

  ImplOf(FixMpm *_fix, int narg, char **arg);
  ~ImplOf() override;

  void find_models() override;
  void check_sources() const;
  void setup_pre_force() override;
  void pre_force() override;
  void setup() override;
  void final_integrate() override;
  void post_run() override;
  void modify_models(int narg, char **arg) override;
  double scalar() const override { return courant; }
  double vector_component(int n) override;
  bool reads_results() const override;
  double bytes() const override;
  void grow_arrays(int nmax) override;
  void copy_arrays(int i, int j) override;
  void set_arrays(int i) override;
  int pack_exchange(int i, double *buf) override;
  int unpack_exchange(int i, const double *buf) override;
  int pack_restart(int i, double *buf) override;
  void unpack_restart(int i, int nth) override;
  int size_restart(int i) const override;
  int maxsize_restart() const override;
  void write_restart(FILE *fp) const override;
  void restart(const char *buf) override;

 private:
  // Columns of the per-atom output, the last of which are state variables, and of the global vector, which begins with HEAD numbers,
  // has PER_BODY for each body, TIMES, and D of the force of local damping; doc/src/fix_mpm.rst has the list
  enum {
    UX,
    U = UX + D,
    SXX,
    P = SXX + rve::Space<D>::strains,
    Q,
    EPS_V,
    EPS_Q,
    RHO,
    FXX,
    STATE = FXX + rve::Space<D>::components
  };
  enum { UNBALANCED, COURANT, KINETIC, MASS, HEAD };
  enum { REACTION_X, BODY_UX = D, PER_BODY = 2 * D };
  enum { TIME_RVE, TIME_MPM, TIME_TRANSFERS, TIMES };
  // behind the force of local damping, for each body that can turn: velocity, spin, angle and torque
  static constexpr int SPINS = rve::Space<D>::spins;
  enum {
    VELOCITY_X,
    SPIN = D,
    ANGLE = SPIN + SPINS,
    TORQUE = ANGLE + SPINS,
    PER_TURNING = TORQUE + SPINS
  };

  static constexpr double NO_LAW = -1.0;

  MpmSettings<D> settings;
  std::unique_ptr<mpm::MpmSolver<D>> solver;
  std::unique_ptr<Progress> progress;
  std::vector<FixRve *> grains;                // per model; nullptr: an analytic law
  std::vector<mpm::Constitutive<D> *> laws;    // per model, those of the solver
  double courant = 0.0;
  double restart_step = 0.0;    // of the head of a restart file
  RestartRecords records;
  bool warned = false, warned_damping = false, warned_sides = false;
  bool warned_rounding = false;    // of coordinates far from the origin, in this run
  double body_speed = 0.0;         // largest prescribed component of a body in this step [velocity]
  std::vector<Vec> body_displacement;
  std::vector<bigint> body_points;            // of all ranks, when atoms were exchanged last
  std::vector<int> turning;                   // bodies that can turn
  std::vector<mpm::TractionLoad<D>> loads;    // of this step
  double **output = nullptr;
  // as the last run left them, to see whether others have moved points: their number and a sum over positions; box sides
  bigint points_then = -1;
  std::uint64_t positions_then = 0;
  double box_then[2 * D] = {};
  bool said_overlap = false;
  bool has_new = false;    // atoms of this rank that are no points yet
  bool warned_full =
      false;    // of cells with too much volume, by points that were created in this run
  bool said_parts = false;
  double times[TIMES] = {};                        // wall time of this run [seconds]
  double damping_sum = 0.0, reaction_sum = 0.0;    // of looks in this run [force]
  // of new points with a stress in situ, until their forces have been looked at [force]
  double weight_of_cell = 0.0;
  bool is_in_situ = false;       // such points have been made
  bool output_is_old = false;    // rows of the per-atom output are those of an earlier step

  // what a point carries, besides position and velocity in atom->x and atom->v; initial volume 0: not yet made
  std::vector<Vec> reference, half_size;
  std::vector<double> mass, volume0, volume;
  std::vector<Tensor> deformation_gradient, stress, velocity_gradient;
  std::vector<double> remembering;    // whose state variables: a law in `layout`, or NO_LAW

  template <class F> void for_each_array(F &&f)
  {
    f(reference), f(half_size), f(mass), f(volume0), f(volume);
    f(deformation_gradient), f(stress), f(velocity_gradient), f(remembering);
  }

  // and the state variables, in rows of the same width
  mpm::MemoryLayout layout;
  std::vector<double> rows;
  std::vector<int> law_of_model;    // in `layout`
  std::vector<int> law_of_file;     // in `layout`, of each law in the restart file, or -1
  std::vector<int> size_in_file;    // state variables of each law in the restart file
  // of the per-atom output from STATE on: the state variable of each column, and its place in a row, -1 where a law has none
  std::vector<std::string> state_columns = first_state_columns();
  std::vector<std::vector<int>> place_of_law;

  double *memory_of(int i) { return rows.data() + (std::size_t) i * layout.width(); }
  static std::vector<std::string> first_state_columns()
  {
    if (D == 2) return {"out_of_plane_stress", "plastic_strain"};
    return {"plastic_strain"};
  }
  int num_columns() const { return STATE + (int) state_columns.size(); }

  /// Which state variables the laws have, and which of them are columns of the output.
  void lay_out_memory();

  /// What a law remembers of a point that had another one, or none.
  void begin_memory(int i);

  // made anew whenever they are needed: they follow from groups
  std::vector<std::int64_t> ids;
  std::vector<int> model, body;
  bool members_are_known = false, members_are_sound = false;    // all that follows from these, too

  /// The arrays that only a device has changed are those of the last step again.
  void bring_back() { solver->fetch(points()); }

  /// Somebody will change points, their number or their order.
  void take_over()
  {
    bring_back();
    solver->points_changed();
    members_are_known = false;
  }

  /// With the first `num_memory` doubles of its row of memory.
  int pack(int i, double *buf, int num_memory);

  int unpack(int i, const double *buf, int num_memory);

  // without its row of memory
  static constexpr int DOUBLES = (2 * sizeof(Vec) + 3 * sizeof(Tensor)) / sizeof(double) + 4;
  // of a restart file: header, the point and a checksum, without its row of memory
  static constexpr int RECORD = RestartRecords::HEADER + DOUBLES + 1;

  /// State variables that a point has now.
  int num_remembered(int i) const
  {
    return remembering[i] == NO_LAW ? 0 : (int) layout.variables((int) remembering[i]).size();
  }

  /// Wall time so far in calls of the engine of RVEs, in bounds of their stable DEM time steps, and in
  /// models that are RVEs, which includes the first and not the second [seconds].
  struct ModelTimes {
    double engine = 0.0, bounds = 0.0, models = 0.0;
  };
  ModelTimes model_times() const;

  /// Density that the script gives a point [mass/length^3]; 0: none.
  double given_density(int i) const
  {
    return body[i] >= 0 ? settings.density_of(settings.bodies[body[i]])
                        : settings.density_of(settings.models[model[i]]);
  }

  // fix rve speaks of the progress of scenes with grains, and of its RVEs
  bool has_grains() const;

  /// Of the positions of all points, in no order.
  std::uint64_t sum_of_positions() const;
  void find_box(double *box) const;

  void find_members();
  /// The same in a run. Ends with an error unless each point has a model, and its RVE if it needs one.
  void find_members_of_run();
  bool make_point(int i, bool in_run);
  std::vector<int> make_points(bool in_run);
  void give_masses();

  mpm::PointView<D> points();

  // in fix_mpm_in_situ.cpp
  void begin_in_situ(const std::vector<int> &made);
  void begin_at_rest(const std::vector<int> &made);
  void begin_by_components(const std::vector<int> &made);
  macro::GroundAtRest ground_at_rest(const std::vector<int> &made);
  std::vector<macro::StressGoal> stresses_by_components(const std::vector<int> &made);
  std::vector<double> densities(const std::vector<int> &made) const;
  macro::HeightProfile density_of_grains(const std::vector<int> &made,
                                         const macro::GroundAtRest &ground) const;
  std::vector<double> stress_ratios(const std::vector<int> &made) const;
  macro::InSituReport bring_grains(const std::vector<int> &made,
                                   const std::vector<macro::StressGoal> &goals, double tolerance);
  void take_stress(int i, const macro::StressGoal &goal);
  void tell_of_grains(const macro::InSituReport &report, int rounds) const;
  void check_strength(const std::vector<int> &made);
  void report_in_situ();
  double cell_volume() const;

  mpm::Communication communication() const;
  void check_positions();
  void check_overlap();
  void tell_parts();
  void check_volume(const std::vector<int> &made);
  void test_waves();
  void check_courant();
  /// Warns if coordinates are so large that the motion of a step is rounded.
  void check_rounding();
  void check_time_step();
  void check_absorbing_sides();
  void solve(bool advance);
  void fill_output();
  void check_bodies(bool advance);
  void check_enclosed();
  void look_at_damping();
  void tell_damping();
  void report_times() const;
  void find_law(const std::string &word, const std::string &names);
  void change_models(const std::vector<MpmModel<D>> &wanted, const std::string &when);
  void continue_modification(const MpmWords &then, const std::string &words);
};

}    // namespace LAMMPS_NS
