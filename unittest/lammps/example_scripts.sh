#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Runs the scripts of one screen of the boundary-value examples on coarse grids and checks their
# last results against the range that the README of the example states for finer ones.
#
#   example_scripts.sh <lmp> <examples>
set -eu
lmp=$1 examples=$2
. "$(dirname "$0")/checks.sh"
work=$(mktemp -d "${TMPDIR:-/tmp}/example_scripts.XXXXXX")
trap 'rm -rf "$work"' EXIT
mkdir "$work/run"
ln -s "$examples/packings" "$work/packings"
cd "$work/run"

# run <example> <options of lmp...>: its output goes to run.out
run() {
  example=$1
  shift
  "$lmp" -in "$examples/$example/in.$example" "$@" > run.out 2>&1 ||
    { tail -20 run.out; echo "FAILED: $example $*"; exit 1; }
}
# largest <file> <column>
largest() { awk -v column="$2" '!/^#/ && $column > most {most = $column} END {print most}' "$1"; }

# The pressure is above the surcharge and below the load with the peak friction of disks (README).
run footing -var h 0.5 -var grains 100 -var settlement 0.1
within "$(largest curve.footing 2)" 50e3 285e3 "pressure on the footing [Pa]"

run retaining_wall -var h 0.5 -var duration 1
within "$(sed -n 's/^K = \([0-9.]*\), Rankine.*/\1/p' run.out)" 0.33 0.40 "active K, Rankine 0.351"

# At 0.8 of the weight of limit analysis the slope stands, at 24 it has moved.
run slope
within "$(awk '!/^#/ && $1 < 13 {moved = $2} END {print moved}' curve.slope)" 0 0.005 \
  "movement of the slope before failure"
within "$(largest curve.slope 2)" 0.05 0.2 "movement of the slope after failure"

run column_collapse -var h 0.2
within "$(awk '/^Loop time/ {exit} $1 ~ /^[0-9]+$/ {last = $3} END {print last}' run.out)" 0.8 1.8 \
  "run-out of the column"

run biaxial_specimen -var h 0.2 -var strain 0.03
within "$(largest curve.smooth 3)" 0.38 0.5 "peak of (s1 - s3) / (s1 + s3)"

run triaxial_specimen -var h 0.5 -var strain 0.03
within "$(largest curve.rough 3)" 1.0 1.5 "peak of q/p"

run triaxial_axisymmetric -var h 0.25 -var strain 0.03
within "$(largest curve.rough 3)" 1.0 1.5 "peak of q/p of a cylinder"

# N_c = 6.05 (Eason & Shield 1960)
run circular_footing -var phi 0 -var cohesion 10000 -var qs 0 -var d_end 0.03 -var speed 0.025
within "$(largest curve.mohr_coulomb 2)" 53e3 63e3 "pressure under a circle on Tresca ground [Pa]"

# N_q = 9.62 by slip lines; 4.5 cells in the radius have 0.84 of it
run circular_footing -var psi 20 -var d_end 0.04 -var speed 0.025 -var courant 4e-3
within "$(largest curve.mohr_coulomb 2)" 155e3 195e3 \
  "pressure under a circle on associated Mohr-Coulomb ground [Pa]"
