#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# calibration_python.sh <repository> <script> <words...>: runs a Python script with the Python of
# GrainLearning and h5py. The exit status is 77 (skipped) without it.
set -eu
root=$1
shift
python=$(sh "$root/tools/calibration_python.sh" --find)
if [ -z "$python" ]; then
  echo "there is no Python with GrainLearning and h5py; sh tools/calibration_python.sh makes one"
  [ "${GPU_RVE_REQUIRE_PICTURES:-0}" = 1 ] && exit 1
  exit 77
fi
exec "$python" "$@"
