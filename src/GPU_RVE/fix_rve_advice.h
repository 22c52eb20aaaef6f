// SPDX-License-Identifier: GPL-2.0-only
// Warnings about RVEs beyond a limit of the method: one of each kind, of the worst RVE.

#pragma once

#include "fix_rve_attached.h"
#include "rve/engine/advice.h"

#include <vector>

namespace LAMMPS_NS {

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

}    // namespace LAMMPS_NS
