// SPDX-License-Identifier: GPL-2.0-only
// Progress lines in the log of a long run, and the end of a run by a signal. SIGTERM and SIGINT end
// a run after its present step. A restart file is written if the script has a restart command, and
// the script ends with an error. The same signal again ends the program at once.

#pragma once

#include "lmptype.h"

#include <functional>
#include <string>

namespace LAMMPS_NS {

class LAMMPS;
class ScriptArguments;

/// Progress of the runs of a style. Several styles can each have such an object in the same run.
/// Progress lines do not change the results of the run.
class Progress {
 public:
  /// Lines begin with `_who`. At least `_interval` seconds of wall time lie between two lines; 0
  /// switches them off.
  Progress(LAMMPS *_lmp, std::string _who, double _interval);
  ~Progress();
  Progress(const Progress &) = delete;
  Progress &operator=(const Progress &) = delete;

  /// Sets the interval of lines as in the constructor [seconds].
  void set_interval(double seconds) { interval = seconds; }

  /// Returns the number of DEM steps of the RVEs of this rank since they were made. Null for a
  /// style without RVEs.
  using RveSteps = std::function<double()>;

  /// Begins a run: signals are recorded from now on. Signals that the program ignores stay ignored.
  /// Collective.
  void begin(const RveSteps &rve_steps = nullptr);
  /// Ends a step: prints a line if one is due, and makes the step the last one if a rank has
  /// recorded a signal. Collective.
  void step_done(const RveSteps &rve_steps = nullptr);
  /// Ends the run: restores the handlers of signals. If a signal was recorded, writes a restart
  /// file and ends with error->all. Collective.
  void end();

 private:
  LAMMPS *lmp;
  std::string who;
  double interval;          ///< between two lines [seconds]
  double last_line;         ///< wall time of the last line [seconds]
  bigint first_step = 0;    ///< step at the start of the run
  double start = 0.0;       ///< wall time at the start of the run [seconds]
  // DEM steps and wall time at the last line, or at the start of the run if that was later
  double steps_then = 0.0, time_then = 0.0;
  // Several ranks communicate only in some steps. The longer a step takes, the fewer steps lie
  // between two communications.
  int steps_between = 1;         ///< steps from one communication to the next; equal on all ranks
  int steps_left = 1;            ///< steps until the next communication; equal on all ranks
  double last_exchange = 0.0;    ///< wall time of the last communication of this rank [seconds]

  bool exchange_signals(bool line_is_due);
  void print(double now, double steps, bool has_rves) const;
};

/// Reads the value of the keyword *progress*, the interval of lines [seconds].
double read_progress(ScriptArguments &words);

}    // namespace LAMMPS_NS
