// SPDX-License-Identifier: GPL-2.0-only
// The jobs of fix rve on the RVEs of a rank: time step, shadows, warnings, prescribed motions, memory, and changes of RVEs that exist.

#pragma once

#include "fix_rve_attached.h"
#include "rve/engine/advice.h"

#include <cstdio>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Chooses the DEM time step of the RVEs, or checks it by the stability bound.
template <int D> class RveTimeStep : protected Pointers {
 public:
  /// When the DEM time step is looked at again.
  enum class Check {
    EveryStep,    ///< of RVEs that have stiffened since their last check
    Interval,     ///< of all RVEs
    InSitu,       ///< of all RVEs, before the first step from a stress that they were brought to
    /// Of all RVEs, before and after a run, if the step was given: it fails only above the bound.
    Run
  };

  explicit RveTimeStep(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// Refuses a time step above the bound [time] of `whose`, and warns of one that is near it.
  void check(double used, double bound, const std::string &whose);
  /// Checks the bound of RVEs again: warns, fails, or lowers an automatic step; collective.
  void recheck(Check check);
  /// Chooses the step for the present RVEs and packings, or checks the one that was given; collective.
  void choose();

  bool is_old = false;        // chosen or checked for other RVEs
  bool has_warned = false;    // of a step near the bound

 private:
  struct LeastBound {
    double dt;      ///< infinite: none is below what was asked for
    tagint atom;    ///< atom of that RVE; the lowest ID of several
  };
  /// The least stable time step of RVEs, if it is below `enough`; collective.
  LeastBound least(const std::vector<int> &atoms, double enough);
  std::vector<int> atoms_to_check(Check check);

  AttachedRves<D> &rves;
};

/// The shadows of RVEs: copies in double precision with finer steps, which measure the error.
template <int D> class RveShadows : protected Pointers {
 public:
  explicit RveShadows(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// Adds shadows up to the number of the settings, to atoms that depend on IDs only; collective.
  void choose();
  /// Deviation from shadows: mean, largest, and the ID of its atom (0: no shadow).
  struct Report {
    double mean, largest;
    tagint atom;
  };
  /// Returns the report of all ranks; collective.
  Report report() const;
  /// Logs the wall time of shadows and their deviations at the end of a run; collective.
  void log_report() const;

 private:
  /// Keeps so many shadows, of those that choose() would choose first; collective.
  void remove(int number);

  AttachedRves<D> &rves;
};

/// Warns about RVEs beyond a limit of the method: once of each kind, of the worst RVE.
template <int D> class RveAdvice : protected Pointers {
 public:
  explicit RveAdvice(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// Warns once of each kind; collective.
  void advise(bool at_start);
  /// Logs at the end of a run the share of fast RVEs that was too small for a warning.
  void report_fast_strain();

 private:
  std::vector<rve::Advice> advice_on(int atom, bool at_start);
  bool note_fast_strain(double share, double worst, tagint id);

  AttachedRves<D> &rves;
  bool advised[rve::NUM_ADVICE_KINDS] = {};
  /// Checks of this run in which RVEs had inertial numbers above the limit of quasi-static
  /// deformation.
  struct FastStrain {
    double share = 0.0;    // largest share of the RVEs [-]
    double worst = 0.0;    // largest inertial number over the limit
    tagint id = 0;         // of the atom that had it
    bigint step = 0;
    bool is_told = false;    // a warning has come
  } fast_strain;
};

/// Drives RVEs by the script: velocity gradients, servos and loading paths.
template <int D> class RveDrives : protected Pointers {
 public:
  explicit RveDrives(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// All RVEs make what the script asks for in this LAMMPS step.
  void advance_by_script();
  /// Where an RVE is on its path: stage from 1 (0: on none), time in it, cycles in it, and whether it has ended.
  struct PathReport {
    double stage = 0.0, time = 0.0, cycles = 0.0, ended = 0.0;
  };
  PathReport path_report(int atom) const;
  /// True if all RVEs that can advance are at the ends of their paths; collective.
  bool all_paths_ended() const;
  /// RVEs that have ended another path continue on this one.
  void resume_paths(const macro::LoadPathsOf<D> &paths);

 private:
  std::vector<rve::DriveOf<D>> drives(const std::vector<int> &atoms);
  void advance_on_paths(const macro::LoadPathsOf<D> &paths);
  void begin_paths(const macro::LoadPathsOf<D> &paths);
  macro::PathStep path_step(int atom, const macro::RveClock &clock) const;

  AttachedRves<D> &rves;
  bool warned_tension = false;
};

/// Memory for RVEs, on the host or on the devices that ranks share.
template <int D> class RveMemory : protected Pointers {
 public:
  explicit RveMemory(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// Ends with error->all if further RVEs with these numbers of grains do not fit into the free
  /// memory; collective.
  void check(const std::vector<int> &grains);

 private:
  AttachedRves<D> &rves;
  bool warned_sharing = false;
};

/// Changes RVEs that exist: in a run that is continued from a restart file, and by fix_modify. All
/// functions are collective.
template <int D> class RveChanges : protected Pointers {
 public:
  RveChanges(AttachedRves<D> &_rves, RveTimeStep<D> &_time_step, RveDrives<D> &_drives,
             RveMemory<D> &_rve_memory) :
      Pointers(_rves.lammps()),
      rves(_rves), time_step(_time_step), drives(_drives), rve_memory(_rve_memory)
  {
  }

  void write_restart_head(FILE *fp) const;
  void read_restart_head(const char *buf);
  /// Takes over the RVEs of a restart file, once all of them have come.
  void adopt_restart();
  /// True from read_restart_head() to adopt_restart().
  bool continues() const { return is_continued; }
  void modify(int narg, char **arg);
  void warn_of_loss() const;

 private:
  /// Changes the settings, materials and paths. What it has changed stays if it ends with an error.
  void apply(FixRveSettings wanted);
  std::vector<std::string> change_materials(const MaterialWords &words, double mass_scaling_before);

  AttachedRves<D> &rves;
  RveTimeStep<D> &time_step;
  RveDrives<D> &drives;
  RveMemory<D> &rve_memory;
  // of a restart file, until its RVEs have been adopted
  bool is_continued = false;
  double mass_scaling_of_rves = 1.0;
  std::vector<std::string> changes;    // "friction 0.5 -> 0.3"
  bool path_has_changed = false;       // from that of the restart file
};

}    // namespace LAMMPS_NS
