// SPDX-License-Identifier: GPL-2.0-only
// The head of fix mpm in restart files. The records of points are in fix_mpm_fields.h.

#pragma once

#include "lammps/mpm_settings.h"

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

namespace LAMMPS_NS {

class LAMMPS;

/// Version of the records of points and bodies in restart files; it increases with every change of
/// their contents. Files of versions 1 and 2 have no version number.
constexpr int MPM_RESTART_VERSION = 9;

/// Returns a checksum of `count` numbers, stored in the bits of a double.
double mpm_checksum(const double *numbers, std::size_t count);
/// Returns true if two checksums have the same bits. Operator == does not work, because a checksum
/// can have the bits of a NaN.
bool is_same_checksum(double a, double b);

/// The head of fix mpm in a restart file.
template <int D> struct MpmRestartHead {
  struct Body {
    mpm::Vec<D> displacement, velocity;    ///< [length], [length/time]
    std::vector<double> turning;           ///< record of a body that can turn, or empty
  };
  double step = 0.0;
  std::vector<Body> bodies;
  MpmArguments words;    ///< keywords and values of the script
  MpmArguments laws;     ///< words of laws and the names of their state variables
  std::string water;     ///< names of the numbers of the pore water, or "" without water
  std::vector<std::string> modifications;    ///< arguments of fix_modify, one text for each model

  /// Writes the size in bytes and the head.
  void write(FILE *fp) const;
  /// Reads a head. Errors end in error->all, with messages that begin with `name`, the name of the
  /// fix.
  static MpmRestartHead read(LAMMPS *lmp, const std::string &name, const char *buf);
};

/// Returns the keywords whose values differ between `then` and `now`, as in "damping 0.05 -> 0,
/// ...", or "" if there are none. If `of_points` is true, compares only volume, density, stress and
/// insitu, because points of the restart file keep the old values of these keywords. If it is
/// false, compares only the other keywords. Keywords without influence on results are omitted.
std::string mpm_differences(const MpmArguments &then, const MpmArguments &now, bool of_points);

}    // namespace LAMMPS_NS
