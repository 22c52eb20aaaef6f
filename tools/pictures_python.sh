#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Makes a Python with modules that open results of the package, OVITO, VTK (ParaView's reader) and
# meshio (ParaView's files), that use its RVEs, scikit-fem, OOFEM, singlepointsim, the Micro Manager
# of preCICE and notebooks, and with mypy. The environment is made once in the cache folder of
# get_lammps.sh, from the package index of pip (400 MB). The last line of stdout is the interpreter.
#
#   python=$(sh tools/pictures_python.sh)         makes it if it does not exist
#   python=$(sh tools/pictures_python.sh --find)  prints it if it exists
#
# Without it ctest -L pictures skips its tests, unless GPU_RVE_REQUIRE_PICTURES=1.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/tools/venv.sh"
# The packages are those of the system's Python and of OVITO's libraries. The Micro Manager requires
# pyprecice, which requires libprecice, which neither Debian 12 nor the index has; singlepointsim
# requires meson, with which it compiles UMATs in Fortran.
venv_of pictures "ovito==3.17.2 vtk==9.7.2 meshio==5.3.5 scikit-fem==12.0.2 oofem==2.6.0.dev1 mpi4py==4.1.2 psutil precice-adapter-schema==0.4.3
  nbclient==0.11.0 ipykernel==7.4.0 matplotlib==3.11.2 mypy==2.4.1 pandas==3.1.1 thick==0.0.6 cffi numpy" \
  "python3 python3-venv libdbus-1-3 libegl1 libfontconfig1 libgl1 libglib2.0-0 libgssapi-krb5-2 libxkbcommon0" "${1:-}" "micro-manager-precice==0.12.0 singlepointsim==0.0.6"
