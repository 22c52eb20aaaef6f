// SPDX-License-Identifier: GPL-2.0-only
// A plugin that was compiled for another LAMMPS: for another version, other sizes or another MPI.
// LAMMPS must refuse it before it registers any style.

#include "lammps/plugin_host.h"

using namespace LAMMPS_NS;

extern "C" void lammpsplugin_init(void *lmp, void *, void *)
{
  LammpsKind kind = kind_compiled_for();
#if defined(OTHER_version)
  kind.version = 20240829;
#elif defined(OTHER_sizes)
  kind.atom_id = 8;
#else
  kind.mpi = kind.mpi == 4 ? 8 : 4;
#endif
  require_host(lmp, kind);
}
