// SPDX-License-Identifier: GPL-2.0-only
// The shadows of RVEs: copies in double precision with finer steps, which measure the error.

#pragma once

#include "fix_rve_attached.h"

namespace LAMMPS_NS {

template <int D> class RveShadows : protected Pointers {
 public:
  explicit RveShadows(AttachedRves<D> &_rves) : Pointers(_rves.lammps()), rves(_rves) {}

  /// Adds shadows up to the number of the settings, to atoms that depend on IDs only; collective.
  void choose();
  FixRve::Impl::ShadowReport report() const;

 private:
  /// Keeps so many shadows, of those that choose() would choose first; collective.
  void remove(int number);

  AttachedRves<D> &rves;
};

}    // namespace LAMMPS_NS
