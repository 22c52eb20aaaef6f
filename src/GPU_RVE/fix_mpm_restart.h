// SPDX-License-Identifier: GPL-2.0-only
// What restart files have of fix mpm besides the records of its points.

#pragma once

#include "lammps/mpm_settings.h"

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

namespace LAMMPS_NS {

class LAMMPS;

/// Of what restart files hold of points and bodies: raise it with every change of that. Files
/// before version 3 had no number.
constexpr int MPM_RESTART_VERSION = 8;

/// A checksum of numbers, as the bits of another one.
double mpm_checksum(const double *numbers, std::size_t count);
/// Whether two checksums are the same: their bits may be those of no number, which equals nothing.
bool is_same_checksum(double a, double b);

/// The head of fix mpm in a restart file.
template <int D> struct MpmRestartHead {
  struct Body {
    mpm::Vec<D> displacement, velocity;    ///< [length], [length/time]
    std::vector<double> turning;           ///< record of a body that can turn, or nothing
  };
  double step = 0.0;
  std::vector<Body> bodies;
  MpmWords words;    ///< what the script says
  MpmWords laws;     ///< words of laws and the names of their state variables
  std::vector<std::string> modifications;    ///< words of fix_modify for models that it has changed

  void write(FILE *fp) const;
  /// Errors end in error->all.
  static MpmRestartHead read(LAMMPS *lmp, const char *buf);
};

/// What has another value in `now` than in `then`, as "damping 0.05 -> 0, ...", or "" for nothing:
/// of what points keep that exist (their volume, mass and stress at the beginning), or of the rest.
std::string mpm_differences(const MpmWords &then, const MpmWords &now, bool of_points);

}    // namespace LAMMPS_NS
