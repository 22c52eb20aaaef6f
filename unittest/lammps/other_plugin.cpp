// SPDX-License-Identifier: GPL-2.0-only
// A plugin that was built for another LAMMPS than this one, as far as it knows: it must be refused before it registers anything.

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
