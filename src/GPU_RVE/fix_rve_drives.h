// SPDX-License-Identifier: GPL-2.0-only
// Drives of RVEs by the script: velocity gradients, servos and loading paths.

#pragma once

#include "fix_rve_attached.h"

#include <vector>

namespace LAMMPS_NS {

template <int D> class RveDrives : protected Pointers {
 public:
  explicit RveDrives(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// All RVEs make what the script asks for in this LAMMPS step.
  void advance_by_script();
  FixRve::Impl::PathReport path_report(int atom) const;
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

}    // namespace LAMMPS_NS
