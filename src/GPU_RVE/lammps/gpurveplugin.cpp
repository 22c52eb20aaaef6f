// SPDX-License-Identifier: GPL-2.0-only
// The package as a plugin: it registers all styles of the package with a LAMMPS that has the PLUGIN
// package.

#include "lammpsplugin.h"
#include "version.h"

#include "compute_rve_atom.h"
#include "compute_rve_contact_local.h"
#include "compute_rve_tangent.h"
#include "create_rve.h"
#include "dump_rve_grain.h"
#include "fix_mpm.h"
#include "fix_rve.h"
#include "lammps/plugin_host.h"
#include "random_field.h"
#include "write_rve.h"

#include "lammps.h"
#include "output.h"

using namespace LAMMPS_NS;

/// Makes a fix or a compute.
template <class Style> static void *make_style(void *lmp, int narg, char **arg)
{
  return new Style(static_cast<LAMMPS *>(lmp), narg, arg);
}
template <class Command> static void *make_command(void *lmp)
{
  return new Command(static_cast<LAMMPS *>(lmp));
}

static Dump *make_dump(LAMMPS *lmp, int narg, char **arg)
{
  return new DumpRveGrain(lmp, narg, arg);
}

extern "C" void lammpsplugin_init(void *lmp, void *handle, void *regfunc)
{
  require_host(lmp, kind_compiled_for());

  lammpsplugin_t plugin;
  plugin.version = LAMMPS_VERSION;
  plugin.author = "the GPU_RVE authors";
  plugin.handle = handle;
  const auto add = [&](const char *style, const char *name, const char *info) {
    plugin.style = style;
    plugin.name = name;
    plugin.info = info;
    reinterpret_cast<lammpsplugin_regfunc>(regfunc)(&plugin, lmp);
  };

  plugin.creator.v2 = &make_style<FixRve>;
  add("fix", "rve", "RVE of grains behind each atom v0.1");
  plugin.creator.v2 = &make_style<FixMpm>;
  add("fix", "mpm", "material point method v0.1");
  plugin.creator.v2 = &make_style<ComputeRveAtom>;
  add("compute", "rve/atom", "per-atom results of the RVEs v0.1");
  plugin.creator.v2 = &make_style<ComputeRveContactLocal>;
  add("compute", "rve/contact/local", "contacts between the grains of RVEs v0.1");
  plugin.creator.v2 = &make_style<ComputeRveTangent>;
  add("compute", "rve/tangent", "tangent stiffness of the RVEs by probing v0.1");
  plugin.creator.v1 = &make_command<CreateRve>;
  add("command", "create_rve", "packing generator for RVEs v0.1");
  plugin.creator.v1 = &make_command<RandomField>;
  add("command", "random_field", "random field at the atoms v0.1");
  plugin.creator.v1 = &make_command<WriteRve>;
  add("command", "write_rve", "export of an RVE as a data file v0.1");

  // LAMMPS has no registration of dumps by plugins, so the dump is added to the list of LAMMPS
  (*static_cast<LAMMPS *>(lmp)->output->dump_map)["rve/grain"] = &make_dump;
}
