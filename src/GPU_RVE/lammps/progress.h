// SPDX-License-Identifier: GPL-2.0-only
// Lines in the log about a long run: how far it is and when it will end. SIGTERM and SIGINT end a
// run when its present step is done, with a restart file where the script asks for restart files;
// the script then ends with an error. The same signal again ends the program at once.

#pragma once

#include "lmptype.h"

#include <functional>
#include <string>

namespace LAMMPS_NS {

class LAMMPS;
class ScriptWords;

/// The progress of the runs of a style. Several styles may watch the same run. Changes no result.
class Progress {
 public:
  /// `_who` begins the lines; at least `_interval` seconds of wall time between two of them, 0:
  /// none.
  Progress(LAMMPS *_lmp, std::string _who, double _interval);
  ~Progress();
  Progress(const Progress &) = delete;
  Progress &operator=(const Progress &) = delete;

  /// As the constructor's.
  void set_interval(double seconds) { interval = seconds; }

  /// DEM steps of the RVEs of this rank since they were made, or nothing where there are none.
  using RveSteps = std::function<double()>;

  /// A run begins: from now on signals are noted. Those that the program ignores stay ignored.
  /// Collective.
  void begin(const RveSteps &rve_steps = nullptr);
  /// A step has been done: it is the last one if a rank has noted a signal; collective.
  void step_done(const RveSteps &rve_steps = nullptr);
  /// The run is over: signals are again what they were. Ends with a restart file and error->all if
  /// one was noted; collective.
  void end();

 private:
  LAMMPS *lmp;
  std::string who;
  double interval, last_line;
  // of the run that has begun
  bigint first_step = 0;
  double start = 0.0;
  // at the last line, or at the begin of the run if that was later
  double steps_then = 0.0, time_then = 0.0;
  // Several ranks ask each other in some steps only, the oftener the longer steps take.
  int steps_between = 1,
      steps_left = 1;    ///< from one question to the next; the same on all ranks
  double asked = 0.0;    ///< wall time of the last one, this rank's

  bool ask_ranks(bool rank_zero_says);
  void print(double now, double steps, bool has_rves) const;
};

/// Value of the keyword *progress*, the interval of lines.
double read_progress(ScriptWords &words);

}    // namespace LAMMPS_NS
