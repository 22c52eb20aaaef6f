#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# examples/narrow_cells with two RVEs of each size: the small ones become copies next to each other
# and continue, with the stress ratio and the density of flowing grains. Copies that stay in step
# would form rows with a q/p of 0.9 at a void ratio below 0.13.
#
#   narrow_cells.sh <lmp> <in.narrow_cells>
set -eu
lmp=$1 script=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/narrow_cells.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
"$lmp" -in "$script" -var seeds 2 -var strain 1.3 > run.out 2>&1 || { tail -20 run.out; exit 1; }
grep "^RVEs that are copies side by side: 2, frozen: 0" log.lammps
awk '!/^#/ && $2 > 1.05 {n++; ratio += $3; voids += $5; if ($7 < 2 || $8 != 1) wrong = 1}
  END {printf "q/p %.3f, void ratio %.3f beyond a strain of 1.05\n", ratio / n, voids / n; exit !wrong && n >= 5 && ratio / n < 0.6 && voids / n > 0.16 ? 0 : 1}' narrow.txt ||
  { cat narrow.txt; exit 1; }
