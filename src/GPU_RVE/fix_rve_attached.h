// SPDX-License-Identifier: GPL-2.0-only
// Behind fix rve: the RVEs of this rank and the time that passes for them. LAMMPS' hooks are in fix_rve.cpp.

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

/// What LAMMPS' hooks ask of the RVEs, whatever their dimension, and what does not depend on it.
struct FixRve::Impl : protected Pointers {
  FixRve *fix;
  const int dimension;    // of the RVEs: 2 for disks, 3 for spheres
  FixRveSettings settings;
  double dt;                // DEM time step, or its upper limit where substeps are matched
  std::vector<int> slot;    // per atom: RVE in the engine, or -1
  // notes and checks of this step are exchanged between ranks in the next, by synchronise_ranks()
  bool checks_postponed = false;
  double restart_step = 0.0;    // of the head of a restart file
  RestartRecords records;
  bool is_material = false;    // fix mpm has asked for it
  bool has_run = false;        // RVEs have advanced, here or before a restart
  Progress progress;

  /// That of the RVEs that the packings make.
  static std::unique_ptr<Impl> make(FixRve *fix, FixRveSettings settings);
  ~Impl() noexcept override = default;
  LAMMPS *lammps() const { return lmp; }

  /// Reads the packings, chooses or checks the DEM time step, and makes an engine on the device of the local rank; collective.
  virtual void make_engine() = 0;

  // LAMMPS' hooks, which are collective
  virtual void init() = 0;
  virtual void setup() = 0;
  virtual void final_integrate() = 0;
  virtual void end_of_step() = 0;
  virtual void post_run() = 0;

  /// Gives an RVE to every atom of the group that has none; collective.
  virtual void attach() = 0;
  virtual macro::InSituReport bring_to_stress(const std::vector<int> &atoms,
                                              const std::vector<macro::StressGoal> &goals,
                                              double tolerance) = 0;
  /// Ends the advance that is under way, on this rank alone.
  virtual void finish() = 0;

  // What changes of RVEs that are there; all collective. A restart file has a head of this fix: what its RVEs were made with.
  virtual void write_restart_head(FILE *fp) const = 0;
  /// Obeys what the fix says otherwise, as far as it can be obeyed without the RVEs, and refuses other packings and RVEs for which there is
  /// no memory.
  virtual void read_restart_head(const char *buf) = 0;
  /// `fix_modify ID ...`
  virtual void modify(int narg, char **arg) = 0;
  /// Says what is lost with the RVEs that have advanced, when the fix is deleted.
  virtual void warn_of_loss() const = 0;

  // An RVE goes with its atom, or comes as so many numbers; or none, as none.
  virtual void remove(int atom) = 0;
  virtual std::vector<double> record(int atom) const = 0;
  virtual int record_size(int atom) const = 0;
  virtual void take_in(int atom, const double *record, int size) = 0;

  /// Wall time in calls of the engine of the RVEs, and in bounds of their DEM time steps, on this rank [seconds]
  virtual double engine_time() const = 0;
  virtual double bounding_time() const = 0;
  /// Component n of the vector of the fix; collective.
  virtual double vector_component(int n) const = 0;
  virtual double bytes() const = 0;
  virtual double bulk_density(int atom) const = 0;
  /// As materials of a continuum; nullptr in space if they are of disks.
  virtual mpm::Constitutive<2> *material_of_plane() = 0;
  virtual mpm::Constitutive<3> *material_of_space() = 0;
  /// Of those materials: modulus of waves that tangents of these atoms have at most, over the bound of their contacts; 0: none measured.
  virtual double measured_wave_share(const std::vector<int> &atoms) const = 0;
  virtual void scale_waves(double share) = 0;

  /// Looks up the variables of drive and servo.
  void find_variables();
  std::vector<int> atoms_with_rve() const;
  macro::RveClock clock(double lammps_dt) const;
  /// Ends with an error unless the clock has as many DEM steps as can be; warns of a timestep that nobody has set.
  void check_clock() const;
  /// Ends with an error unless all atoms of `dump` have RVEs; collective.
  void check_dump() const;
  /// What happened to RVEs since this was called last, for the log; collective.
  void say_notes();
  /// Local atoms that `dump` names.
  std::vector<int> dumped_atoms() const;
  /// Returns the path of the file for the RVE of an atom in this step.
  std::string dump_file(int atom) const;

  /// Returns work(). If it throws, this rank ends with an error that names the fix, the step and,
  /// unless it is -1, the atom.
  template <class Work> auto guarded(const Work &work, int atom = -1) const -> decltype(work())
  {
    return on_this_rank(
        lmp, [&] { return place_of_failure(atom); }, work);
  }

  // for AttachedRves and what uses it
  bigint step_of_advance = -1;    // LAMMPS step of the last advance
  bool reports_last_advance = false;
  /// The step that messages are about.
  bigint reported_step() const
  {
    return reports_last_advance ? step_of_advance : update->ntimestep;
  }
  /// How rank 0 reports a note: in the log, as a warning, or as a warning once. An error ends the
  /// run on all ranks.
  enum class NoteKind { Line, Warning, Tension, Error };
  struct Note {
    tagint atom;
    NoteKind kind;
    std::string text;
  };
  std::vector<Note> notes;    // of this rank
  bool printed_tension = false;
  // on rank 0
  std::string print_all(const std::string &all);

  Impl(FixRve *_fix, FixRveSettings _settings, int _dimension) :
      Pointers(_fix->lmp), fix(_fix), dimension(_dimension), settings(std::move(_settings)),
      dt(settings.dt), progress(lmp, fmt::format("fix rve {}", fix->id), settings.progress_interval)
  {
  }
  /// "fix rve ID: RVE of atom 3, step 10"; without an atom if it is -1.
  std::string place_of_failure(int atom) const;
};

/// RVEs of dimension D that belong to atoms of this rank, and how they advance.
template <int D> struct AttachedRves : FixRve::Impl, macro::RveOwner<D> {
  using State = rve::RveStateOf<D>;
  using Drive = rve::DriveOf<D>;
  using Points = macro::RvePointsOf<D>;
  using Matrix = rve::Tensor<double, D>;

  /// The RVEs as the rest of the fix sees them: an access finishes the advance that is under way.
  class FinishedPoints {
   public:
    explicit FinishedPoints(AttachedRves &_owner) : owner(_owner) {}
    void operator=(std::unique_ptr<Points> _points) { points = std::move(_points); }
    Points *operator->() const { return get(); }
    Points &operator*() const { return *get(); }
    /// For the advance itself, and for data that it does not change.
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
  bool all_on_devices = false;    // the RVEs of all ranks
  bigint num_advances = 0;

  AttachedRves(FixRve *_fix, FixRveSettings _settings) :
      Impl(_fix, std::move(_settings), D), points(*this)
  {
  }

  int threads() const { return settings.options.threads; }
  std::vector<int> slots_of(const std::vector<int> &atoms) const;
  /// Atoms whose RVEs are not frozen.
  std::vector<int> advancing_atoms() const;
  /// Makes an engine without RVEs that takes these, on the same device, in another number format.
  /// Throws what rve::make_engine() does.
  std::unique_ptr<rve::EngineOf<D>> empty_engine(rve::Format format) const;
  State state(int atom) const
  {
    return guarded([&] { return points->state(slot[atom]); }, atom);
  }
  void remove(int atom) override { points->remove(slot[atom]); }
  std::vector<double> record(int atom) const override { return points->record(slot[atom]); }
  int record_size(int atom) const override { return points->record_size(slot[atom]); }
  void take_in(int atom, const double *record, int size) override;
  /// DEM steps of the RVEs of this rank since their packings were read.
  double dem_steps() const;

  /// Advances RVEs by drives, with complete results if this step needs them.
  void advance(const std::vector<int> &atoms, const std::vector<Drive> &drives);
  /// Refuses a tensor that is not finite.
  void check(const Matrix &tensor, const char *what, const char *unit, int atom) const;
  /// Notes RVEs that became copies side by side.
  void note_copies(const std::vector<int> &atoms);
  /// Notes RVEs that failed, as the policy asks. `is_new`: nothing has been advanced yet.
  void report(const std::vector<int> &failed, const std::vector<int> &atoms, double dt_dem,
              bool is_new);

  // macro::RveOwner
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
  /// True if this step needs complete results. Other readers request them on demand.
  bool wants_details() const;
  /// Notes whether the checks of an advance that begins in this step are postponed.
  void note_begin();
  void advance_by_drives(const std::vector<int> &atoms, macro::MacroIncrementsOf<D> &increments);
  /// Replaces RVEs that failed by fresh ones; returns those that could not be replaced.
  std::vector<int> renew(const std::vector<int> &failed, const std::vector<int> &atoms);

  std::vector<int> slots;    // of the last advance
  struct UnderWay {
    const std::vector<int> *atoms = nullptr;
    macro::MacroIncrementsOf<D> *increments = nullptr;
  };
  UnderWay under_way;
};

}    // namespace LAMMPS_NS
