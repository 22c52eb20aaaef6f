#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Makes a Python with GrainLearning, which calibrates contact parameters by element tests, and h5py.
# GrainLearning needs an older numpy than OVITO. The environment is made once in the cache folder of
# get_lammps.sh, from the package index of pip (400 MB). The last line of stdout is the interpreter.
#
#   python=$(sh tools/calibration_python.sh)         makes it if it does not exist
#   python=$(sh tools/calibration_python.sh --find)  prints it if it exists
#
# Without it the tests element_test and calibration are skipped, unless GPU_RVE_REQUIRE_PICTURES=1.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/tools/venv.sh"
venv_of calibration "grainlearning==2.0.5 h5py==3.16.0 cffi" "python3 python3-venv" "${1:-}"
