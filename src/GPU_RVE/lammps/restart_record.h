// SPDX-License-Identifier: GPL-2.0-only
// Per-atom records of a fix in a restart file, which are found by the IDs of their atoms.
//
// LAMMPS keeps the records in rows of atom->extra, one for each local atom as read_restart left them, and moves no row when a later
// command deletes, sorts or exchanges atoms. A record therefore begins with a header that says whose it is.

#pragma once

#include "lmptype.h"

#include <string>
#include <unordered_map>

namespace LAMMPS_NS {

class LAMMPS;

struct RestartRecord {
  const double *values;    ///< the header and what follows it
  int size;                ///< number of all values
};

class RestartRecords {
 public:
  /// Numbers of the header: size of the record, step, ID and unwrapped position of the atom, and a
  /// checksum of these.
  static constexpr int HEADER = 7;
  static void write_header(LAMMPS *lmp, int i, int size, double *buf);

  /// Returns the record of local atom i for unpack_restart(i, nth) of a fix. Ends with an error, which begins with `whose`, if there is
  /// none, if it is damaged, of another step, or if the atom is not where it was when the file was written.
  RestartRecord of(LAMMPS *lmp, const std::string &whose, int i, int nth, double step);

 private:
  int num_rows = -1;                            // of atom->extra
  std::unordered_map<tagint, int> row_of_id;    // filled when a row is not that of its atom

  void count_rows(LAMMPS *lmp);
  void find_rows(LAMMPS *lmp, int nth, double step);
};

/// Warns if LAMMPS has dropped the records of a restart file before this fix was defined.
void warn_of_dropped_records(LAMMPS *lmp, const std::string &whose);

}    // namespace LAMMPS_NS
