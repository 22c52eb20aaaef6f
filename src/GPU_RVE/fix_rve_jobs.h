// SPDX-License-Identifier: GPL-2.0-only
// Classes for the jobs of fix rve: time step, shadows, warnings, prescribed motions, memory, and
// changes of existing RVEs.

#pragma once

#include "fix_rve_attached.h"
#include "rve/engine/advice.h"

#include <cstdio>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/// Chooses the DEM time step of the RVEs, or compares it with the stability bound.
template <int D> class RveTimeStep : protected Pointers {
 public:
  /// Occasion of a check. It determines which RVEs are checked.
  enum class Check {
    EveryStep,    ///< after each step: RVEs that have stiffened since their last check
    Interval,     ///< at the interval of checks: all RVEs
    InSitu,       ///< before the first step from a stress in situ: all RVEs
    Run    ///< before and after a run: all RVEs, unless dt is automatic; errors but no warnings
  };

  explicit RveTimeStep(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// Ends with an error if the time step `used` is above the stability bound `bound` [time], and
  /// warns once if `used` is near the bound. `whose` names the RVE or packing of the bound in
  /// messages.
  void check(double used, double bound, const std::string &whose);
  /// Compares the time step with the present bounds of RVEs. If dt is automatic, lowers it where
  /// necessary. If the script gives dt, warns if dt is near the bound, and ends with an error if it
  /// is above the bound. Collective.
  void recheck(Check check);
  /// Chooses the time step for the present RVEs and packings if dt is automatic, and otherwise
  /// checks the dt of the script; collective.
  void choose();

  bool is_old = false;        // the step was chosen or checked for other materials or settings
  bool has_warned = false;    // the warning that the step is near the bound was printed

 private:
  struct LeastBound {
    double dt;      ///< smallest stable time step [time]; infinite if it is not below `enough`
    tagint atom;    ///< ID of the atom of this RVE; the lowest ID if several RVEs have this step
  };
  /// Returns the smallest stable time step of these RVEs if it is below `enough` [time];
  /// collective.
  LeastBound least(const std::vector<int> &atoms, double enough);
  /// Returns the local atoms whose RVEs a check covers.
  std::vector<int> atoms_to_check(Check check);

  AttachedRves<D> &rves;
};

/// Chooses RVEs that get shadows, and reports how much the RVEs deviate from their shadows. A
/// shadow is a copy in double precision with finer steps, which measures the error of its RVE.
template <int D> class RveShadows : protected Pointers {
 public:
  explicit RveShadows(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// Adds or removes shadows until their number is that in the settings. The choice depends on atom
  /// IDs only; collective.
  void choose();
  /// Relative deviations of the stresses of RVEs from the stresses of their shadows.
  struct Report {
    double mean, largest;    ///< [-]
    tagint atom;             ///< ID of the atom with the largest deviation; 0 without shadows
  };
  /// Returns the report over all ranks; collective.
  Report report() const;
  /// Logs the wall time of shadows and the deviations; collective.
  void log_report() const;

 private:
  /// Keeps `number` shadows, the first in the order of choose(), and removes the others;
  /// collective.
  void remove(int number);

  AttachedRves<D> &rves;
};

/// Warns about RVEs that are beyond a limit of the method. Each kind of limit causes at most one
/// warning. A warning names the worst RVE.
template <int D> class RveAdvice : protected Pointers {
 public:
  explicit RveAdvice(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// Checks all RVEs and prints the warnings that are due; collective.
  void advise(bool at_start);
  /// Logs the largest share of RVEs that strained too fast in a check of this run. Logs nothing if
  /// the share is 0, or if a warning of fast strain was printed.
  void report_fast_strain();

 private:
  std::vector<rve::Advice> advice_on(int atom, bool at_start);
  /// Records a check in which the share `share` of the RVEs strained too fast [-]. `worst` is the
  /// largest ratio of an inertial number to its limit [-], and `id` is the ID of the atom with this
  /// ratio. Returns true if a warning is due, at most once in a run.
  bool note_fast_strain(double share, double worst, tagint id);

  AttachedRves<D> &rves;
  bool advised[rve::NUM_ADVICE_KINDS] = {};
  /// Maxima of this run over the checks in which RVEs had inertial numbers above the limit of
  /// quasi-static deformation.
  struct FastStrain {
    double share = 0.0;    // share of the RVEs above the limit [-]
    double worst = 0.0;    // largest ratio of an inertial number to the limit [-]
    tagint id = 0;         // ID of the atom with the largest inertial number
    bigint step = 0;       // step of the largest inertial number
    bool has_warned = false;
  } fast_strain;
};

/// Advances RVEs by the prescribed motions of the script: velocity gradients, servos, loading
/// paths.
template <int D> class RveDrives : protected Pointers {
 public:
  explicit RveDrives(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// Advances all RVEs over this LAMMPS step.
  void advance_by_script();
  /// Position of an RVE on its path.
  struct PathReport {
    double stage = 0.0;     ///< from 1; 0 if the RVE has no path
    double time = 0.0;      ///< in the stage [time]
    double cycles = 0.0;    ///< in the stage
    double ended = 0.0;     ///< 1 if the path has ended
  };
  PathReport path_report(int atom) const;
  /// Returns true if all RVEs that are not frozen are at the ends of their paths; collective.
  bool all_paths_ended() const;
  /// Continues the RVEs of a restart file on the changed paths of this script.
  void resume_paths(const macro::LoadPathsOf<D> &paths);

 private:
  std::vector<rve::DriveOf<D>> drives(const std::vector<int> &atoms);
  void advance_on_paths(const macro::LoadPathsOf<D> &paths);
  void begin_paths(const macro::LoadPathsOf<D> &paths);
  macro::PathStep path_step(int atom, const macro::RveClock &clock) const;

  AttachedRves<D> &rves;
  bool warned_tension = false;
};

/// Checks the memory for RVEs, on the host or on the devices that ranks share.
template <int D> class RveMemory : protected Pointers {
 public:
  explicit RveMemory(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// Ends with error->all if further RVEs do not fit into the free memory; collective. `grains` has
  /// the number of grains of each RVE.
  void check(const std::vector<int> &grains);

 private:
  AttachedRves<D> &rves;
  bool warned_sharing = false;
};

/// Applies changed settings to existing RVEs. Settings change by fix_modify, or if a run continues
/// from a restart file with another script. The functions are collective unless noted.
template <int D> class RveChanges : protected Pointers {
 public:
  RveChanges(AttachedRves<D> &_rves, RveTimeStep<D> &_time_step, RveDrives<D> &_drives,
             RveMemory<D> &_rve_memory) :
      Pointers(_rves.lammps()),
      rves(_rves), time_step(_time_step), drives(_drives), rve_memory(_rve_memory)
  {
  }

  /// Writes the head; on rank 0 only.
  void write_restart_head(FILE *fp) const;
  void read_restart_head(const char *buf);
  /// Applies changed settings to the RVEs of a restart file, when all of them have been read.
  void adopt_restart();
  /// Returns true from read_restart_head() to adopt_restart().
  bool continues() const { return is_continued; }
  /// Applies the arguments of fix_modify. If this ends with an error that the caller catches,
  /// nothing has changed.
  void modify(int narg, char **arg);
  /// Warns that the RVEs are lost; not collective.
  void warn_of_loss() const;

 private:
  /// Changes the settings, materials and paths. Changes made before an error are not undone.
  void apply(FixRveSettings wanted);
  /// Changes the materials of existing RVEs. Returns a text for each parameter that changed.
  std::vector<std::string> change_materials(const MaterialArguments &words,
                                            double mass_scaling_before);

  AttachedRves<D> &rves;
  RveTimeStep<D> &time_step;
  RveDrives<D> &drives;
  RveMemory<D> &rve_memory;
  // data of a restart file, until adopt_restart()
  bool is_continued = false;
  double mass_scaling_of_rves = 1.0;
  std::vector<std::string> changes;    // texts as "friction 0.5 -> 0.3"
  // the path of the script differs from the path of the restart file
  bool path_has_changed = false;
};

}    // namespace LAMMPS_NS
