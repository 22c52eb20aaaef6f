// SPDX-License-Identifier: GPL-2.0-only
// Per-atom records of a fix in a restart file. The record of an atom is found by the ID of the
// atom.
//
// read_restart stores the records in atom->extra, one row for each local atom. LAMMPS does not move
// the rows when a later command deletes, sorts or exchanges atoms, so the index of the row of an
// atom can differ from the index of the atom. A record therefore begins with a header that has the
// ID of its atom.

#pragma once

#include "lmptype.h"

#include <string>
#include <unordered_map>

namespace LAMMPS_NS {

class LAMMPS;

/// The record of an atom.
struct RestartRecord {
  const double *values;    ///< the header and the values of the fix after it
  int size;                ///< number of values, with the header
};

/// Finds the records of the local atoms of a fix.
class RestartRecords {
 public:
  /// Number of values in the header: size of the record, step, ID of the atom, its unwrapped
  /// position (3 values) and a checksum of these 6 values.
  static constexpr int HEADER = 7;
  /// Writes the header of the record of local atom i to the first HEADER values of `buf`. The
  /// record has `size` values with the header.
  static void write_header(LAMMPS *lmp, int i, int size, double *buf);

  /// Returns the record of local atom i for unpack_restart(i, nth) of a fix. Ends with error->one
  /// if there is no record, if it is damaged or of a step other than `step`, or if the atom has
  /// moved since the file was written. The message begins with `whose`.
  RestartRecord of(LAMMPS *lmp, const std::string &whose, int i, int nth, double step);

 private:
  int num_rows = -1;    ///< number of rows of atom->extra; -1: not counted yet
  /// Maps the ID of an atom to its row. It stays empty as long as all rows have the indices of
  /// their atoms.
  std::unordered_map<tagint, int> row_of_id;

  void count_rows(LAMMPS *lmp);
  void find_rows(LAMMPS *lmp, int nth, double step);
};

/// Warns if LAMMPS has dropped the records of a restart file before this fix was defined.
void warn_of_dropped_records(LAMMPS *lmp, const std::string &whose);

}    // namespace LAMMPS_NS
