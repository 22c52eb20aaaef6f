// SPDX-License-Identifier: GPL-2.0-only
// A plugin that reports another version of LAMMPS than this one; LAMMPS must refuse it before it
// registers anything.

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
