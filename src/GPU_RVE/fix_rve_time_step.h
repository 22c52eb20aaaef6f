// SPDX-License-Identifier: GPL-2.0-only
// The DEM time step of the RVEs: chosen or checked by the stability bound.

#pragma once

#include "fix_rve_attached.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {

template <int D> class RveTimeStep : protected Pointers {
 public:
  using Check = FixRve::Impl::Check;

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

}    // namespace LAMMPS_NS
