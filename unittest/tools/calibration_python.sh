#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# calibration_python.sh <repository> <script> <words...>: a Python script with the Python that has
# GrainLearning and h5py. 77, skipped, where there is none.
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
