#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# examples/footing on several ranks: RVEs migrate with their points, also when `fix balance`
# redistributes them by cost, and curve and fields keep their bits. The scene has the full domain,
# four points per cell, packings drawn for each point, DEM steps by strain, and quiescent RVEs.
#
#   footing_ranks.sh <lmp> <study.footing> <mpiexec> <its flag for the number of ranks>
set -eu
lmp=$1 script=$2 mpiexec=$3 flag=$4
work=$(mktemp -d "${TMPDIR:-/tmp}/footing_ranks.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
for ranks in 1 2 4; do
  "$mpiexec" "$flag" $ranks "$lmp" -in "$script" -var device cpu -var domain full -var h 1 \
    -var points 4 -var grains 50 -var ground different \
    -var packings 3 -var keywords "substeps adaptive 1e-5 1e-3 quiescent 2e-5" -var balance 5 \
    -var stop 40 -var pictures no -var out $ranks -log log.$ranks \
    > run.out 2>&1 || { tail -20 run.out; exit 1; }
  cmp curve.1 curve.$ranks
  cmp fields.1 fields.$ranks
done
# The points must have been redistributed; otherwise the first line of the balance is 0.
grep '^Ranks: 4' log.4
sed -n 's/^Ranks: 4.* cost \([0-9.]*\) before and \([0-9.]*\) after .*/\1 \2/p' log.4 |
  awk '{n++; moved = $1 > 1.05} END {exit n == 1 && moved ? 0 : 1}' ||
  { echo "the ranks were not balanced"; exit 1; }
