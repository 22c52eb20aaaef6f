#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# examples/random_footing, its first millimetres: the ground of a random field has the same bits on
# one and two ranks. A ground whose left half mirrors the right one exerts no lateral force on the
# footing; a ground with one packing at all points does.
#
#   random_footing.sh <lmp> <in.random_footing> <mpiexec> <its flag for the number of ranks>
set -eu
lmp=$1 script=$2 mpiexec=$3 flag=$4
work=$(mktemp -d "${TMPDIR:-/tmp}/random_footing.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
run() {    # run <name> <command and options...>
  name=$1
  shift
  "$@" -in "$script" -var device cpu -var grains 60 -var seeds 3 -var within 0.02 -var out \
    "$name" > "$name.out" 2>&1 || { tail -20 "$name.out"; exit 1; }
}
run one "$lmp" -var stop 15
run two "$mpiexec" "$flag" 2 "$lmp" -var stop 15
for file in curve fields; do cmp "$file.one" "$file.two"; done

# horizontal over vertical force on the footing at the end
side() {
  tail -1 "curve.$1" | awk '{r = $3 / $2; print r < 0 ? -r : r}'
}
for ground in single mirrored; do run "$ground" "$lmp" -var ground "$ground" -var format double \
  -var stop 20; done
echo "horizontal over vertical force: one packing $(side single), mirrored $(side mirrored)"
# Rounding errors of 1e-15 in the first step grow by the chaos of the grains: to 1e-11 here, and to
# 1e-3 in three times as many steps.
echo "$(side single) $(side mirrored)" | awk '{exit $1 > 1e-3 && $2 < 1e-9 ? 0 : 1}'
