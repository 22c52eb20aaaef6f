#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# host.sh <repository> <modules> <script> <arguments...>: runs a test in Python, with the Python of
# tools/pictures_python.sh. The exit status is 77 (skipped) without it or one of the modules ("oofem
# skfem").
set -eu
root=$1 modules=$2
shift 2
python=$(sh "$root/tools/pictures_python.sh" --find)
import=$(echo "$modules" | sed 's/  */, /g')
if [ -z "$python" ] || ! "$python" -c "import $import"; then
  echo "there is no Python with $import; sh tools/pictures_python.sh makes one"
  [ "${GPU_RVE_REQUIRE_PICTURES:-0}" = 1 ] && exit 1
  exit 77
fi
exec "$python" "$@"
