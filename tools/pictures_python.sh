#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# A Python with modules of others that open what the package writes, OVITO, VTK (ParaView's reader) and meshio (ParaView's files), and that host its
# RVEs, scikit-fem, OOFEM, singlepointsim, the Micro Manager of preCICE and notebooks; and mypy, which checks types. Makes it once, in the cache folder that
# get_lammps.sh uses, from the package index that this machine's pip knows (400 MB), and prints the interpreter (last line of stdout):
#
#   python=$(sh tools/pictures_python.sh)         makes it if it is not there
#   python=$(sh tools/pictures_python.sh --find)  prints it if it is there, or nothing
#
# ctest -L pictures uses it where it is, and skips those tests where it is not, unless GPU_RVE_REQUIRE_PICTURES=1.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/tools/venv.sh"
# the system's Python, whose packages Debian has; what OVITO's libraries need besides. The Micro Manager wants pyprecice, which wants libprecice, which is neither in
# Debian 12 nor on the index;
# singlepointsim wants meson, with which it compiles UMATs in Fortran
venv_of pictures "ovito==3.17.2 vtk==9.7.2 meshio==5.3.5 scikit-fem==12.0.2 oofem==2.6.0.dev1 mpi4py==4.1.2 psutil precice-adapter-schema==0.4.3
  nbclient==0.11.0 ipykernel==7.4.0 matplotlib==3.11.2 mypy==2.4.1 pandas==3.1.1 thick==0.0.6 cffi numpy" \
  "python3 python3-venv libdbus-1-3 libegl1 libfontconfig1 libgl1 libglib2.0-0 libgssapi-krb5-2 libxkbcommon0" "${1:-}" "micro-manager-precice==0.12.0 singlepointsim==0.0.6"
