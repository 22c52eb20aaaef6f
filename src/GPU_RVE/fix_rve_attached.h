// SPDX-License-Identifier: GPL-2.0-only
// The RVEs of fix rve on this rank and their advance. LAMMPS' hooks are in fix_rve.cpp.

#pragma once

#include "fix_rve.h"

#include "lammps/collective_error.h"
#include "lammps/progress.h"
#include "lammps/restart_record.h"
#include "lammps/rve_settings.h"
#include "macro/in_situ.h"
#include "macro/rve_constitutive.h"
#include "macro/rve_points.h"
#include "pointers.h"
#include "rve_packings.h"
#include "update.h"

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Interface of the RVEs of this rank for LAMMPS' hooks and other styles. It also has the data and
/// functions that do not depend on the dimension of the RVEs.
struct FixRve::Impl : protected Pointers {
  FixRve *fix;
  const int dimension;    // dimension of the RVEs: 2 for disks, 3 for spheres
  FixRveSettings settings;
  double dt;                // DEM time step, or its upper limit with *substeps match* [time]
  std::vector<int> slot;    // number of the RVE in the engine, or -1; shape [nmax]
  // True if the notes and the time-step check of the last advance were postponed. Then
  // synchronise_ranks() handles them in the next step, or post_run() handles them after the last
  // step.
  bool checks_postponed = false;
  double restart_step = 0.0;    // step in the head of a restart file
  RestartRecords records;
  bool is_material = false;    // a fix mpm uses the RVEs as a material
  bool has_run = false;        // RVEs have advanced, in this program or before a restart
  Progress progress;

  /// Makes the implementation for the dimension of the packings.
  static std::unique_ptr<Impl> make(FixRve *fix, FixRveSettings settings);
  ~Impl() noexcept override = default;
  LAMMPS *lammps() const { return lmp; }

  /// Reads the packings, chooses or checks the DEM time step, and makes an engine on the device of
  /// the local rank; collective. Errors end in error->all.
  virtual void make_engine() = 0;

  // hooks of LAMMPS; all are collective
  virtual void init() = 0;
  virtual void setup() = 0;
  virtual void final_integrate() = 0;
  virtual void end_of_step() = 0;
  virtual void post_run() = 0;

  /// Gives an RVE to every atom of the group that has none; collective.
  virtual void attach() = 0;
  /// Brings the RVE of each of these atoms to its stress in `goals`, which has the order of
  /// `atoms`, within `tolerance` [stress]; collective. An RVE that does not reach its goal ends in
  /// error->all.
  virtual macro::InSituReport bring_to_stress(const std::vector<int> &atoms,
                                              const std::vector<macro::StressGoal> &goals,
                                              double tolerance) = 0;
  /// Waits for the advance that is under way on this rank and stores its results. Not collective.
  virtual void finish() = 0;

  /// Writes the head of the fix to a restart file: the settings of the RVEs. Called on rank 0 only;
  /// the next two functions are collective.
  virtual void write_restart_head(FILE *fp) const = 0;
  /// Reads the head and stores how the settings of the script differ from it. Settings that the
  /// script does not give are taken from the head. Ends with an error if the packings differ, or if
  /// there is not enough memory for the RVEs.
  virtual void read_restart_head(const char *buf) = 0;
  /// Applies `fix_modify ID ...`.
  virtual void modify(int narg, char **arg) = 0;
  /// Called when the fix is deleted: warns that its RVEs are lost if they have advanced.
  virtual void warn_of_loss() const = 0;

  /// Removes the RVE of an atom from the engine.
  virtual void remove(int atom) = 0;
  virtual std::vector<double> record(int atom) const = 0;
  virtual int record_size(int atom) const = 0;
  /// Adds the RVE of a record to the engine and assigns it to the atom. The atom gets no RVE if
  /// `size` is 0.
  virtual void add_record(int atom, const double *record, int size) = 0;

  /// Returns the wall time in calls of the engine of the RVEs on this rank [seconds].
  virtual double engine_time() const = 0;
  /// Returns the wall time for computing bounds of DEM time steps on this rank [seconds].
  virtual double bounding_time() const = 0;
  /// Returns component n of the vector of the fix; collective.
  virtual double vector_component(int n) const = 0;
  virtual double bytes() const = 0;
  /// Returns the bulk density of the RVE of an atom: the mass of its grains divided by the volume
  /// of its cell [mass/length^3].
  virtual double bulk_density(int atom) const = 0;
  /// Returns the void ratio of the RVE of an atom [-].
  virtual double void_ratio(int atom) const = 0;
  virtual mpm::Constitutive<2> *material_of_plane() = 0;
  /// Returns the RVEs as a material in three dimensions, or null if they consist of disks.
  virtual mpm::Constitutive<3> *material_of_space() = 0;
  /// Measures the tangents of the RVEs of these atoms, and divides each measured P-wave modulus by
  /// its upper bound from the contacts. Returns the largest ratio [-], or 0 if no tangent could be
  /// measured.
  virtual double measured_wave_share(const std::vector<int> &atoms) const = 0;
  /// Sets the ratio of the wave moduli of the materials to the upper bounds from their contacts
  /// [-].
  virtual void scale_waves(double share) = 0;

  /// Looks up the variables of the keywords drive, servo and path.
  void find_variables();
  /// Returns the local atoms that have an RVE.
  std::vector<int> atoms_with_rve() const;
  /// Returns the DEM time step and the number of DEM steps for a LAMMPS step of `lammps_dt` [time].
  macro::RveClock clock(double lammps_dt) const;
  /// Ends with an error if a LAMMPS step needs too many DEM steps. Warns if the script sets no
  /// timestep and the default is not longer than a DEM step.
  void check_clock() const;
  /// Ends with an error unless all atoms of the keyword *dump* have RVEs; collective.
  void check_dump() const;
  /// Logs the notes of all ranks since the last call; collective.
  void log_notes();
  /// Returns the local atoms of the keyword *dump*.
  std::vector<int> dumped_atoms() const;
  /// Returns the path of the file for the RVE of an atom in this step.
  std::string dump_file(int atom) const;

  /// Returns work(). If it throws, this rank ends with an error that names the fix, the step and
  /// the atom. The error names no atom if `atom` is -1.
  template <class Work> auto guarded(const Work &work, int atom = -1) const -> decltype(work())
  {
    return on_this_rank(
        lmp, [&] { return failure_context(atom); }, work);
  }

  bigint step_of_advance = -1;    // LAMMPS step of the last advance
  bool reports_last_advance = false;
  /// Returns the LAMMPS step for messages. While the notes and checks of the last advance are
  /// handled, it is the step of that advance; otherwise it is the present step.
  bigint reported_step() const
  {
    return reports_last_advance ? step_of_advance : update->ntimestep;
  }
  /// Kind of a note. Rank 0 logs a Line. It prints the first Tension as a warning and drops later
  /// ones. It prints the first Frozen of each run as a warning and logs later ones as lines. An
  /// Error ends the run on all ranks.
  enum class NoteKind { Line, Frozen, Tension, Error };
  /// An event of an RVE for the log.
  struct Note {
    tagint atom;
    NoteKind kind;
    std::string text;
  };
  std::vector<Note> notes;    // notes of this rank
  bool printed_tension = false;
  int num_frozen = 0;    // RVEs that were frozen in this run, on rank 0
  /// Prints the notes of all ranks on rank 0. Returns the message of the first error, or "".
  std::string print_all(const std::string &all);

  Impl(FixRve *_fix, FixRveSettings _settings, int _dimension) :
      Pointers(_fix->lmp), fix(_fix), dimension(_dimension), settings(std::move(_settings)),
      dt(settings.dt), progress(lmp, fmt::format("fix rve {}", fix->id), settings.progress_interval)
  {
  }
  /// Returns the beginning of an error message, as in "fix rve ID: RVE of atom 3, step 10". It
  /// names no atom if `atom` is -1.
  std::string failure_context(int atom) const;
};

/// The RVEs of dimension D of the atoms of this rank, and their advance.
template <int D> struct AttachedRves : FixRve::Impl, macro::RveOwner<D> {
  using State = rve::RveStateOf<D>;
  using Drive = rve::DriveOf<D>;
  using Points = macro::RvePointsOf<D>;
  using Matrix = rve::Tensor<double, D>;

  /// Pointer to the RVEs. An access waits for the advance under way and fetches its results.
  class FinishedPoints {
   public:
    explicit FinishedPoints(AttachedRves &_owner) : owner(_owner) {}
    void operator=(std::unique_ptr<Points> _points) { points = std::move(_points); }
    Points *operator->() const { return get(); }
    Points &operator*() const { return *get(); }
    /// Returns the RVEs without waiting. Use it only in the advance itself, and for data that an
    /// advance does not change.
    Points &as_they_are() const { return *points; }

   private:
    Points *get() const
    {
      owner.finish();
      owner.guarded([this] { points->fetch_results(); });
      return points.get();
    }
    AttachedRves &owner;
    std::unique_ptr<Points> points;
  };

  RvePackingsOf<D> packings;
  FinishedPoints points;
  bool all_on_devices = false;    // the RVEs of all ranks are on CUDA devices
  bigint num_advances = 0;

  AttachedRves(FixRve *_fix, FixRveSettings _settings) :
      Impl(_fix, std::move(_settings), D), points(*this)
  {
  }

  int threads() const { return settings.options.threads; }
  std::vector<int> slots_of(const std::vector<int> &atoms) const;
  /// Returns the local atoms whose RVEs are not frozen.
  std::vector<int> advancing_atoms() const;
  /// Makes an engine without RVEs on the same device, in the number format `format`, for RVEs with
  /// the contact model of this fix. Throws the errors of rve::make_engine().
  std::unique_ptr<rve::EngineOf<D>> empty_engine(rve::Format format) const;
  State state(int atom) const
  {
    return guarded([&] { return points->state(slot[atom]); }, atom);
  }
  void remove(int atom) override { points->remove(slot[atom]); }
  std::vector<double> record(int atom) const override { return points->record(slot[atom]); }
  int record_size(int atom) const override { return points->record_size(slot[atom]); }
  void add_record(int atom, const double *record, int size) override;
  /// Returns the number of DEM steps of the RVEs of this rank since their packings were read.
  double dem_steps() const;

  /// Advances RVEs by prescribed motions, one for each atom. Evaluates complete results only if
  /// wants_details() is true.
  void advance(const std::vector<int> &atoms, const std::vector<Drive> &drives);
  /// Ends with an error if a component of the tensor is not finite. `what` and `unit` describe the
  /// tensor in the message.
  void check(const Matrix &tensor, const char *what, const char *unit, int atom) const;
  /// Adds notes about RVEs that were replaced by several copies side by side.
  void note_copies(const std::vector<int> &atoms);
  /// Adds notes about RVEs that failed, as the policy demands. `failed`: their slots. `is_new`: the
  /// RVEs have not been advanced yet.
  void report(const std::vector<int> &failed, const std::vector<int> &atoms, double dt_dem,
              bool is_new);

  // functions of macro::RveOwner
  macro::RveClock clock(double lammps_dt) const override { return Impl::clock(lammps_dt); }
  rve::Request *begin(const std::vector<int> &atoms,
                      macro::MacroIncrementsOf<D> &increments) override;
  rve::Request *plan(const std::vector<int> &atoms, bool is_as_before,
                     const rve::PointsOnDevice &there,
                     macro::MacroIncrementsOf<D> &increments) override;
  void finish() override;
  bool is_as_before(const std::vector<int> &atoms) override;
  const Matrix &stress(int atom) const override { return points->stress(slot[atom]); }
  const typename Points::Point &point(int atom) const override
  {
    return guarded([&]() -> const typename Points::Point & { return points->point(slot[atom]); },
                   atom);
  }
  void complete() override
  {
    guarded([&] { points->complete(); });
  }

 private:
  /// Returns true if the fix itself needs complete results in this step: for the loading paths or
  /// for the checks at the interval dt_check. Other readers request complete results when they read
  /// them.
  bool wants_details() const;
  /// Called when an advance begins: stores its step, and whether its checks are postponed.
  void note_begin();
  void advance_by_drives(const std::vector<int> &atoms, macro::MacroIncrementsOf<D> &increments);
  /// Replaces failed RVEs by fresh ones. Returns the slots that could not be replaced.
  std::vector<int> renew(const std::vector<int> &failed, const std::vector<int> &atoms);

  std::vector<int> slots;    // slots of the last advance
  struct UnderWay {
    const std::vector<int> *atoms = nullptr;
    macro::MacroIncrementsOf<D> *increments = nullptr;
  };
  UnderWay under_way;
};

}    // namespace LAMMPS_NS
