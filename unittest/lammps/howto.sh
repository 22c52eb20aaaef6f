#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Runs the scripts of the how-to pages and of two tutorials unchanged, with small packings if the
# script has a variable for them, and checks the statements of the pages.
#
#   howto.sh <lmp> <examples/howto>
set -eu
lmp=$1 examples=$2
. "$(dirname "$0")/checks.sh"
work=$(mktemp -d "${TMPDIR:-/tmp}/howto.XXXXXX")
trap 'rm -rf "$work"' EXIT
cp "$examples"/in.* "$examples"/../getting_started/in.* "$work"
cd "$work"

# run <script> <options...>: its output goes to run.out
run() {
  "$lmp" -in "$@" > run.out 2>&1 || { tail -20 run.out; echo "FAILED: $*"; exit 1; }
}
# last <column>: prints the column of the last row of the last run
last() { sed '/^Loop time/,$d' run.last | tail -1 | awk -v column="$1" '{print $column}'; }
keep_last() { awk '/^ *(Step|v_|c_|f_)/ {rows = ""; inside = 1; next} /^Loop time/ {inside = 0} inside && /^ *[-0-9]/ {rows = rows $0 "\n"} END {printf "%s", rows}' run.out > run.last; }

# Columns: step, F_yy, F_xy, sxx, syy, sxy, p, q/p, void ratio. Stress goals are held within 2 %,
# volumes exactly.
path() { run in.stress_paths -var path "$1"; keep_last; }
path isotropic; within "$(last 7)" 294e3 306e3 "p of the isotropic path"
path oedometer; within "$(last 5)" -720e3 -700e3 "syy of the oedometer"
path biaxial; within "$(last 4)" -102e3 -98e3 "sxx of the biaxial path"
path extension; within "$(last 4)" -102e3 -98e3 "sxx of the extension"; within "$(last 5)" -50e3 \
  -30e3 "syy of the extension"
path constant_p; within "$(last 7)" 98e3 102e3 "p of the path at constant p"
path undrained; within "$(last 9)" 0.1577 0.1579 "void ratio of the undrained path"
path shear; within "$(last 5)" -102e3 -98e3 "syy of simple shear"
path shear_constant_volume; within "$(last 9)" 0.1577 0.1579 \
  "void ratio of shear at constant volume"
path cyclic; within "$(last 3)" -0.001 0.001 "shear strain after a cycle"

run in.initial_stress -var grains 100
unbalanced=$(sed -n 's/.*largest unbalanced nodal force of the in-situ state is \([^ ]*\) of the weight of a cell.*/\1/p' run.out)
within "$unbalanced" 0 1e-3 "unbalanced nodal force of a column in situ [weight of a cell]"
keep_last
within "$(last 5)" 0 1e-6 "displacement of a column that is in equilibrium [m]"
within "$(last 6)" 0 1e-3 "largest unbalanced force ratio of its grains"

run in.excavate
keep_last
within "$(last 2)" 70 70 "points after digging and filling"
within "$(last 3)" 70 70 "their RVEs"

run in.soils
keep_last
within "$(last 4)" 0.155 0.17 "void ratio of the dense sand"
within "$(last 5)" 0.235 0.25 "void ratio of the loose sand"

run in.factor_of_safety
moved() { sed -n "s/^factor $1: the slope moves by \\(.*\\) m$/\\1/p" run.out; }
within "$(moved 1.5)" 0 0.01 "motion of a slope at its factor of safety [m]"
within "$(moved 1.6)" 0.05 10 "motion beyond it [m]"

run in.grains -var grains 50
keep_last
within "$(last 2)" 0.25 0.5 "q/p of eight packings"

# Spheres: the sides are held at 100 kPa, and in plane strain yy is the intermediate stress.
run in.spheres -var grains 100 -var steps 100
keep_last
within "$(last 4)" -102e3 -98e3 "syy of triaxial compression"
run in.spheres -var grains 100 -var steps 100 -var test plane_strain
keep_last
within "$(last 3)" -102e3 -98e3 "sxx in plane strain"
within "$(last 4)" -250e3 -120e3 "syy in plane strain"

# The torque of the sand over its force is the lever arm above the foot of the wall.
run in.wall -var h 0.5 -var grains 50 -var duration 1
keep_last
within "$(last 5)" 0.10 0.30 "K of a wall that leans away from the sand"
within "$(last 6)" 0.5 1.0 "lever arm of its force [m]"
run in.pile -var grains 50 -var duration 0.2
keep_last
within "$(last 2)" 0.0999 0.1001 "depth of the tip of a pile [m]"
within "$(last 3)" 1e5 5e5 "pressure on it"

# With a large shear stress the loose packing fails first.
run in.cyclic_shear -var grains 100 -var seeds 1 -var ratio 0.25 -var cycles 5
cycles() { sed -n "s/^packing $1: .*, \(.*\) cycles, .*/\1/p" run.out; }
within "$(cycles 1)" 0.5 3 "cycles of a loose packing"
within "$(cycles 2)" 3 5 "cycles of a denser packing"

run in.isotropic_state -var grains 100 -var seeds 2
keep_last
within "$(last 3)" 0 1e-5 "largest q/p of spheres without shear stress"
run in.isotropic_state -var shape disk -var grains 100 -var seeds 2
keep_last
within "$(last 3)" 0 5e-3 "largest q/p of disks without shear stress"

# On the curve of the script without its fines d10 is 0.335, d50 0.483 and d60 0.524 mm. One of 200
# grains has up to 5 % of the mass in the coarse part and 1.5 % at d60.
run in.grading -var grains 200 -var steps 20
grep -q '12 % of the mass, are cut off' run.out
size() { sed -n "s/.*sand.rve: .*$1 \([0-9.e-]*\)[ ,].*by mass.*/\1/p" run.out; }
within "$(size d10)" 3.3e-4 3.4e-4 "d10 of a graded sand [m]"
within "$(size d50)" 4.7e-4 4.95e-4 "d50 of a graded sand [m]"
within "$(size d60)" 5.1e-4 5.35e-4 "d60 of a graded sand [m]"

run in.free_surface -var a 0.5 -var grains 50
keep_last
within "$(last 2)" 0 0.01 "displacement of a slope of 20 degrees [m]"
within "$(last 4)" 0 0 "RVEs without contacts"

run in.softness -var E 7e8 -var grains 50 -var seeds 2 -var steps 100
ratio=$(sed -n 's/^E = .* is \(.*\) +- .*/\1/p' run.out)
within "$ratio" 1.1 1.6 "q/p of soft spheres"
