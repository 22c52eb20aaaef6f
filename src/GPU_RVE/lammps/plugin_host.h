// SPDX-License-Identifier: GPL-2.0-only
// Whether the LAMMPS that loads the plugin is of the kind that the plugin was built for. Its classes are shared by both, and LAMMPS itself
// loads any plugin whose symbols it has: with other layouts of classes that ends in wrong numbers or a crash.

#pragma once

#include <string>

namespace LAMMPS_NS {

/// What plugin and LAMMPS must agree on.
struct LammpsKind {
  int version;        ///< yyyymmdd
  int atom_id;        ///< size of atom IDs: 4, or 8 with LAMMPS_SIZES bigbig [bytes]
  int step_number;    ///< size of step numbers: 8, or 4 with LAMMPS_SIZES smallsmall [bytes]
  /// Size of a communicator, by which the families of MPI libraries differ: 8 Open MPI, 4 MPICH; 0 without MPI [bytes].
  int mpi;
};

/// The LAMMPS that this code is compiled for.
LammpsKind kind_compiled_for();

/// What is wrong, and what helps; empty if the two agree.
std::string complaint_about_host(const LammpsKind &plugin, const LammpsKind &host);

/// Ends with LAMMPS' error if the LAMMPS that loads a plugin is not of its kind. A program that has no C interface of LAMMPS in it cannot
/// be asked, and is trusted.
void require_host(void *lmp, const LammpsKind &plugin);

}    // namespace LAMMPS_NS
