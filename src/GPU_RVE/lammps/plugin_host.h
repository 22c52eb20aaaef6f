// SPDX-License-Identifier: GPL-2.0-only
// Check of the LAMMPS that loads the plugin: it must have the version, the integer sizes and the
// MPI library that the plugin was built for. LAMMPS itself loads any plugin whose symbols it has.
// LAMMPS and the plugin share classes: different layouts of a class would give wrong numbers or a
// crash.

#pragma once

#include <string>

namespace LAMMPS_NS {

/// Properties that must be the same in the plugin and in LAMMPS.
struct LammpsKind {
  int version;        ///< yyyymmdd
  int atom_id;        ///< size of atom IDs: 4, or 8 with LAMMPS_SIZES bigbig [bytes]
  int step_number;    ///< size of step numbers: 8, or 4 with LAMMPS_SIZES smallsmall [bytes]
  /// Size of a communicator: 8 for Open MPI, 4 for MPICH, 0 without MPI [bytes].
  int mpi;
};

/// Returns the properties of the LAMMPS that this code is compiled for.
LammpsKind kind_compiled_for();

/// Returns an error message with the first difference between `plugin` and `host` and its remedy,
/// or "" if there is no difference.
std::string complaint_about_host(const LammpsKind &plugin, const LammpsKind &host);

/// Ends with an error of LAMMPS if the LAMMPS instance `lmp` differs from `plugin`. The check is
/// skipped in a program that does not contain the C interface of LAMMPS.
void require_host(void *lmp, const LammpsKind &plugin);

}    // namespace LAMMPS_NS
