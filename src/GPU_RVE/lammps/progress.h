// SPDX-License-Identifier: GPL-2.0-only

// What a long run owes to who waits for it: lines in the log, how far it is and when it will end, and an end in good order when a signal
// asks for it. They cost several ranks a reduction of three numbers in some steps, and change no result.

#pragma once

#include "lammps/run_signals.h"
#include "lmptype.h"

#include <functional>
#include <string>

namespace LAMMPS_NS {

class LAMMPS;
class ScriptWords;

class Progress {
 public:
  /// `_who` begins the lines; at least `_interval` seconds of wall time between two of them, 0: none.
  Progress(LAMMPS *_lmp, std::string _who, double _interval);

  /// As the constructor's.
  void set_interval(double seconds) { interval = seconds; }

  /// DEM steps of the RVEs of this rank since they were made, or nothing where there are none.
  using RveSteps = std::function<double()>;

  /// A run begins; collective.
  void begin(const RveSteps &rve_steps = nullptr);
  /// A step has been done; collective.
  void step_done(const RveSteps &rve_steps = nullptr);
  /// A run is over; collective. Ends with error->all if a signal has ended it.
  void end() { signals.end(); }

 private:
  LAMMPS *lmp;
  std::string who;
  RunSignals signals;
  double interval, last_line;
  // of the run that has begun
  bigint first_step = 0;
  double start = 0.0;
  // at the last line, or at the begin of the run if that was later
  double steps_then = 0.0, time_then = 0.0;
};

/// Value of the keyword *progress*, the interval of lines.
double read_progress(ScriptWords &words);

/// "2:03:04" of seconds: hours, minutes, seconds.
std::string hours_minutes_seconds(double seconds);

}    // namespace LAMMPS_NS
