#!/bin/sh
# finite_elements.sh <repository>: the tests of the finite-element host, with the Python that has scikit-fem. 77, skipped, where there is none.
set -eu
root=$1
python=$(sh "$root/tools/pictures_python.sh" --find)
if [ -z "$python" ]; then
  echo "there is no Python with scikit-fem; sh tools/pictures_python.sh makes one"
  [ "${GPU_RVE_REQUIRE_PICTURES:-0}" = 1 ] && exit 1
  exit 77
fi
exec "$python" "$root/unittest/capi/test_finite_elements.py" "$root/examples"
