// SPDX-License-Identifier: GPL-2.0-only
// The points of fix mpm: their arrays, exchange, restart and output, and the order of the jobs that
// LAMMPS' hooks ask for.

#pragma once

#include "fix_mpm_fields.h"
#include "fix_mpm_jobs.h"
#include "lammps/progress.h"
#include "lammps/restart_record.h"
#include "mpm/memory_layout.h"

#include <cstdint>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// A continuum of D dimensions.
template <int D> struct FixMpm::ImplOf final : Impl, MpmScene<D>, MpmFields<D> {
  using Scene = MpmScene<D>;
  using Scene::fix, Scene::settings, Scene::solver, Scene::grains, Scene::laws, Scene::turning;
  using Fields = MpmFields<D>;
  using Fields::DOUBLES, Fields::NO_LAW, Fields::reference, Fields::half_size, Fields::mass;
  using Fields::initial_volume, Fields::volume, Fields::deformation_gradient, Fields::stress;
  using Fields::remembering;
  using Vec = mpm::Vec<D>;
  using Tensor = mpm::Tensor<D>;

  ImplOf(FixMpm *_fix, int narg, char **arg);
  ~ImplOf() override;

  void find_models() override
  {
    Scene::find_models();
    waves.begin_run();
  }
  void setup_pre_force() override;
  void pre_force() override;
  void setup() override;
  void final_integrate() override;
  void post_run() override;
  void modify_models(int narg, char **arg) override;
  double scalar() const override { return waves.courant(); }
  double vector_component(int n) override;
  bool reads_results() const override { return loads.reads_results(); }
  double bytes() const override;
  void grow_arrays(int nmax) override;
  void copy_arrays(int i, int j) override;
  void set_arrays(int i) override;
  int pack_exchange(int i, double *buf) override;
  int unpack_exchange(int i, const double *buf) override;
  int pack_restart(int i, double *buf) override;
  void unpack_restart(int i, int nth) override;
  int size_restart(int i) const override { return RECORD + num_remembered(i); }
  int maxsize_restart() const override { return RECORD + layout.width(); }
  void write_restart(FILE *fp) const override;
  void restart(const char *buf) override;

 private:
  // Columns of the per-atom output, the last of which are state variables, and of the global
  // vector, which begins with HEAD numbers, has PER_BODY for each body, TIMES, and D of the force
  // of local damping; doc/src/fix_mpm.rst has the list
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
  static constexpr int TIMES = MpmTimes<D>::PARTS;
  // behind the force of local damping, for each body that can turn: velocity, spin, angle and
  // torque
  static constexpr int SPINS = rve::Space<D>::spins;
  enum {
    VELOCITY_X,
    SPIN = D,
    ANGLE = SPIN + SPINS,
    TORQUE = ANGLE + SPINS,
    PER_TURNING = TORQUE + SPINS
  };

  MpmLoads<D> loads{*this};
  MpmWaves<D> waves{*this};
  MpmChecks<D> checks{*this};
  MpmGround<D> ground{*this};
  MpmTimes<D> times{*this};
  Progress progress;
  double restart_step = 0.0;    // of the head of a restart file
  RestartRecords records;
  double **output = nullptr;
  bool has_new = false;          // atoms of this rank that are no points yet
  bool output_is_old = false;    // rows of the per-atom output are those of an earlier step

  // the state variables of the points, in rows of the same width
  mpm::MemoryLayout layout;
  std::vector<double> rows;
  std::vector<int> law_of_model;    // in `layout`
  std::vector<int> law_of_file;     // in `layout`, of each law in the restart file, or -1
  std::vector<int> size_in_file;    // state variables of each law in the restart file
  // of the per-atom output from STATE on: the state variable of each column, and its place in a
  // row, -1 where a law has none
  std::vector<std::string> state_columns;
  std::vector<std::vector<int>> place_of_law;
  // the field of the points that a column shows where a law has no such state variable, or null
  std::vector<const std::vector<double> *> field_columns;

  double *memory_of(int i) { return rows.data() + (std::size_t) i * layout.width(); }
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

  // of a restart file: header, the point and a checksum, without its row of memory
  static constexpr int RECORD = RestartRecords::HEADER + DOUBLES + 1;

  /// State variables that a point has now.
  int num_remembered(int i) const
  {
    return remembering[i] == NO_LAW ? 0 : (int) layout.variables((int) remembering[i]).size();
  }

  void find_members();
  /// The same in a run. Ends with an error unless each point has a model, and its RVE if it needs
  /// one.
  void find_members_of_run();
  bool make_point(int i, bool in_run);
  std::vector<int> make_points(bool in_run);
  void give_masses();

  mpm::PointView<D> points();

  /// Gives new points their stress, mass and memory in situ; collective.
  void begin_in_situ(const std::vector<int> &made);
  /// A step, or an evaluation that advances nothing.
  void solve(bool advance);
  void fill_output();
  void find_law(const std::string &word, const std::string &names);
};

}    // namespace LAMMPS_NS
