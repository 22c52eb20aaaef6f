// SPDX-License-Identifier: GPL-2.0-only

#include "lammps/plugin_host.h"

#include "library.h"
#include "lmptype.h"

#include <fmt/format.h>
#include <mpi.h>

// These functions of the C interface are the same in all versions of LAMMPS. They can be missing in
// a program that links LAMMPS as a static library.
#pragma weak lammps_version
#pragma weak lammps_extract_setting
#pragma weak lammps_config_has_mpi_support
#pragma weak lammps_error

using namespace LAMMPS_NS;

static std::string sizes(const LammpsKind &kind)
{
  return fmt::format("{} bytes in an atom ID and {} in a step number", kind.atom_id,
                     kind.step_number);
}

static std::string mpi_library(const LammpsKind &kind)
{
  if (kind.mpi == 0) return "no MPI library";
  return fmt::format("an MPI library whose communicators have {} bytes{}", kind.mpi,
                     kind.mpi == 8       ? ", as those of Open MPI have"
                         : kind.mpi == 4 ? ", as those of MPICH have"
                                         : "");
}

LammpsKind LAMMPS_NS::kind_compiled_for()
{
  return {LAMMPS_VERSION_NUMBER, sizeof(tagint), sizeof(bigint), sizeof(MPI_Comm)};
}

std::string LAMMPS_NS::complaint_about_host(const LammpsKind &plugin, const LammpsKind &host)
{
  std::string built, loads, remedy;
  if (plugin.version != host.version) {
    built = fmt::format("LAMMPS {}", plugin.version);
    loads = fmt::format("is LAMMPS {}", host.version);
    remedy = "build the plugin with the source of that version (-D LAMMPS_SOURCE_DIR=<tree>)";
  } else if (plugin.atom_id != host.atom_id || plugin.step_number != host.step_number) {
    built = "a LAMMPS with " + sizes(plugin);
    loads = "has " + sizes(host);
    remedy = fmt::format("build the plugin with -D LAMMPS_SIZES={}",
                         host.atom_id == 8           ? "bigbig"
                             : host.step_number == 8 ? "smallbig"
                                                     : "smallsmall");
  } else if (plugin.mpi != host.mpi) {
    built = "a LAMMPS with " + mpi_library(plugin);
    loads = "has " + mpi_library(host);
    remedy = host.mpi == 0
        ? "build LAMMPS with MPI"
        : "build the plugin with that MPI library (-D MPI_CXX_COMPILER=<its mpicxx>)";
  } else
    return "";
  return fmt::format("gpurveplugin.so was built for {}, and the LAMMPS that loads it {}; {}", built,
                     loads, remedy);
}

void LAMMPS_NS::require_host(void *lmp, const LammpsKind &plugin)
{
  if (!lammps_version || !lammps_extract_setting || !lammps_config_has_mpi_support || !lammps_error)
    return;
  const LammpsKind host = {lammps_version(lmp), lammps_extract_setting(lmp, "tagint"),
                           lammps_extract_setting(lmp, "bigint"), lammps_config_has_mpi_support()};
  const std::string complaint = complaint_about_host(plugin, host);
  if (!complaint.empty()) lammps_error(lmp, LMP_ERROR_ALL, complaint.c_str());
}
