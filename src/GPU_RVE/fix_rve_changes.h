// SPDX-License-Identifier: GPL-2.0-only
// Changes of RVEs that exist: in a run that is continued from a restart file, and by fix_modify. All
// functions are collective.

#pragma once

#include "fix_rve_attached.h"
#include "fix_rve_drives.h"
#include "fix_rve_memory.h"
#include "fix_rve_time_step.h"

#include <cstdio>
#include <string>
#include <vector>

namespace LAMMPS_NS {

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
