#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# A Python with GrainLearning, which calibrates contact parameters by element tests, and h5py. It wants an older numpy than OVITO does. Makes it once, in the cache
# folder that get_lammps.sh uses, from the package index that this machine's pip knows (400 MB), and prints the interpreter (last line of stdout):
#
#   python=$(sh tools/calibration_python.sh)         makes it if it is not there
#   python=$(sh tools/calibration_python.sh --find)  prints it if it is there, or nothing
#
# The tests element_test and calibration use it where it is, and are skipped where it is not, unless GPU_RVE_REQUIRE_PICTURES=1.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/tools/venv.sh"
venv_of calibration "grainlearning==2.0.5 h5py==3.16.0 cffi" "python3 python3-venv" "${1:-}"
