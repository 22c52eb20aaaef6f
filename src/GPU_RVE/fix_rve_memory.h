// SPDX-License-Identifier: GPL-2.0-only
// Memory for RVEs, on the host or on the devices that ranks share.

#pragma once

#include "fix_rve_attached.h"

#include <vector>

namespace LAMMPS_NS {

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

}    // namespace LAMMPS_NS
