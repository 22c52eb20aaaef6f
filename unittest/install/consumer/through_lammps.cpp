// SPDX-License-Identifier: GPL-2.0-only
// Uses LAMMPS with the package through its C interface.

#include <library.h>

#include <cstdio>

int main()
{
  const char *args[] = {"lmp", "-screen", "none", "-log", "none"};
  void *lammps = lammps_open_no_mpi(5, const_cast<char **>(args), nullptr);
  const bool known =
      lammps_has_style(lammps, "fix", "rve") && lammps_has_style(lammps, "fix", "mpm");
  std::printf("LAMMPS %d %s\n", lammps_version(lammps),
              known ? "with fix rve and fix mpm" : "without the styles");
  lammps_close(lammps);
  lammps_mpi_finalize();
  return known ? 0 : 1;
}
