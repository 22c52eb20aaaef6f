// SPDX-License-Identifier: GPL-2.0-only

// SIGTERM and SIGINT end a run when its present step is done, with a restart file where the script asks for restart files; the script then
// ends with an error. The same signal again ends the program at once.

#pragma once

#include <string>

namespace LAMMPS_NS {

class LAMMPS;

/// Of a style that takes part in runs. Several may watch the same run. All calls but the destructor are collective.
class RunSignals {
 public:
  /// `_who` begins the message.
  RunSignals(LAMMPS *_lmp, std::string _who);
  ~RunSignals();
  RunSignals(const RunSignals &) = delete;
  RunSignals &operator=(const RunSignals &) = delete;

  /// A run begins: from now on signals are noted. Those that the program ignores stay ignored.
  void begin();
  /// A step has been done: it is the last one if a rank has noted a signal. Returns what rank 0 says, so that a question of its own
  /// costs no communication of its own. Several ranks ask each other in some steps only, the oftener the longer steps take: in all
  /// others nobody says anything.
  bool step_done(bool rank_zero_says);
  /// The run is over: signals are again what they were. Ends with a restart file and error->all if one was noted.
  void end();

 private:
  LAMMPS *lmp;
  std::string who;
  // the same on all ranks
  int interval = 1;      ///< steps from one question to the next
  int steps_left = 1;    ///< to the next one
  double asked = 0.0;    ///< wall time of the last one, this rank's
};

}    // namespace LAMMPS_NS
