#!/bin/sh
# element_test.sh <repository> <lmp> <script> <words...>: a Python script with the Python that has GrainLearning and h5py. 77, skipped, where there is none.
set -eu
root=$1 lmp=$2 script=$3
shift 3
python=$(sh "$root/tools/calibration_python.sh" --find)
if [ -z "$python" ]; then
  echo "there is no Python with GrainLearning; sh tools/calibration_python.sh makes one"
  [ "${GPU_RVE_REQUIRE_PICTURES:-0}" = 1 ] && exit 1
  exit 77
fi
exec "$python" "$script" --lmp "$lmp" "$@"
