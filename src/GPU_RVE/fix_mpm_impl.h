// SPDX-License-Identifier: GPL-2.0-only
// Implementation of fix mpm in D dimensions. It stores the per-atom arrays of the points, exchanges
// them between ranks, and writes them to restart files and to the output. Its LAMMPS hooks call the
// classes of fix_mpm_jobs.h.

#pragma once

#include "fix_mpm_fields.h"
#include "fix_mpm_jobs.h"
#include "fix_mpm_water.h"
#include "lammps/progress.h"
#include "lammps/restart_record.h"
#include "mpm/memory_layout.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace LAMMPS_NS {

template <int D> struct FixMpm::ImplOf final : Impl, MpmSetup<D>, MpmFields<D> {
  using Setup = MpmSetup<D>;
  using Setup::fix, Setup::settings, Setup::solver, Setup::grains, Setup::laws, Setup::turning;
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
    Setup::find_models();
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
  int size_restart(int i) const override { return RECORD + water.width() + num_remembered(i); }
  int maxsize_restart() const override { return RECORD + water.width() + layout.width(); }
  void write_restart(FILE *fp) const override;
  void restart(const char *buf) override;

 private:
  // Columns of the per-atom output. The columns from STATE on are state variables.
  // doc/src/fix_mpm.rst lists all columns.
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
  // Components of the global vector: HEAD numbers of the whole model, then PER_BODY numbers for
  // each rigid body, TIMES wall times, D components of the local damping force, and PER_TURNING
  // numbers for each body that can turn.
  enum { UNBALANCED, COURANT, KINETIC, MASS, HEAD };
  enum { REACTION_X, BODY_UX = D, PER_BODY = 2 * D };
  static constexpr int TIMES = MpmTimes<D>::PARTS;
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
  MpmWater<D> water{*this};
  MpmGround<D> ground{*this, water};
  MpmTimes<D> times{*this};
  Progress progress;
  double restart_step = 0.0;    // step in the head of a restart file
  RestartRecords records;
  double **output = nullptr;
  bool has_new = false;          // some atoms of this rank are not material points yet
  bool output_is_old = false;    // the per-atom output belongs to an earlier step

  mpm::MemoryLayout layout;
  std::vector<double> rows;         // state variables; shape [nmax][layout.width()]
  std::vector<int> law_of_model;    // for each model, the index of its law in `layout`
  std::vector<int> law_of_file;     // for each law of the restart file, its index in `layout` or -1
  std::vector<int> size_in_file;    // number of state variables of each law in the restart file
  // state_columns: names of the output columns from STATE on. index_of_law[law][column]: index of
  // the state variable with the name of the column among the state variables of the law, or -1 if
  // the law has none.
  std::vector<std::string> state_columns;
  std::vector<std::vector<int>> index_of_law;
  // For each column from STATE on, the point field with the name of the column, or null. The column
  // shows the field for points whose law has no state variable of this name.
  std::vector<const std::vector<double> *> field_columns;
  std::vector<int> water_columns;    // for each column from STATE on, its MpmWater::Column or -1

  double *memory_of(int i) { return rows.data() + (std::size_t) i * layout.width(); }
  int num_columns() const { return STATE + (int) state_columns.size(); }

  /// Lays out the state variables of all laws, and chooses the state variables that become output
  /// columns.
  void lay_out_memory();

  /// Initialises the state variables of a point for the law of its present model.
  void begin_memory(int i);

  // IDs of the local points, and the indices of their models and rigid bodies (-1: none). The
  // groups of an atom determine its model and its body.
  std::vector<std::int64_t> ids;
  std::vector<int> model, body;
  // members_are_known: `ids`, `model`, `body` and the state variables are up to date.
  // members_are_sound: find_members_of_run() has checked all points since their last change.
  bool members_are_known = false, members_are_sound = false;

  /// Copies the fields that a device has changed back to the arrays on the host.
  void fetch_points() { solver->fetch(points()); }

  /// Must be called before the host changes the data, the number or the order of the points.
  /// Fetches the points from the device and marks the copies of the solver as outdated.
  void claim_points()
  {
    fetch_points();
    solver->points_changed();
    members_are_known = false;
  }

  // number of values of a restart record without water and state variables: header, point and
  // checksum
  static constexpr int RECORD = RestartRecords::HEADER + DOUBLES + 1;

  /// Returns the number of state variables of a point.
  int num_remembered(int i) const
  {
    return remembering[i] == NO_LAW ? 0 : (int) layout.variables((int) remembering[i]).size();
  }

  /// Updates ids, model and body. Initialises the state variables of points whose law has changed.
  void find_members();
  /// Calls find_members() in a run. Ends with an error if a deformable point has no model, or if
  /// its model consists of RVEs and the point has no RVE.
  void find_members_of_run();
  /// Initialises the hoop stress of a deformable point in axisymmetry: that of its RVE, or else
  /// `across_plane`, or else its radial stress.
  void begin_hoop_stress(int i, const std::optional<double> &across_plane);
  /// Initialises the point of an atom. Returns false if the atom is a material point already.
  bool make_point(int i, bool in_run);
  /// Initialises the points of all new atoms. Returns the new deformable points.
  std::vector<int> make_points(bool in_run);
  /// Copies the masses of points to atom->rmass, for fix gravity. Without atom->rmass, fix gravity
  /// uses the masses of atom types; the function then ends with an error if the mass of a
  /// deformable point differs from the mass of its type.
  void copy_masses();

  mpm::PointView<D> points();

  /// Sets the stress, mass, state variables and water of the new points `made`; collective.
  void begin_state(const std::vector<int> &made);
  void begin_in_situ(const std::vector<int> &made);
  /// Advances the points by one step. If `advance` is false, it evaluates only the forces.
  /// Collective.
  void solve(bool advance);
  /// Fills the scalar measures of stress and strain in a row of the per-atom output.
  template <class Matrix>
  static void fill_measures(double *row, const Matrix &sigma, const Matrix &F);
  /// Fills the per-atom output.
  void fill_output();
  /// Appends an entry to law_of_file and size_in_file for the next law of the restart file. `word`
  /// is the name of the law, and `names` are its state variables in the file. Ends with an error if
  /// this program has the law with other state variables.
  void find_law(const std::string &word, const std::string &names);
};

}    // namespace LAMMPS_NS
