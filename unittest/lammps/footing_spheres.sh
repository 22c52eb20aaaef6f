#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# examples/footing with spheres in plane strain and with disks on a small ground: the pressure
# begins with the surcharge and increases severalfold. It is larger with spheres, which cannot move
# out of the plane between others.
#
#   footing_spheres.sh <lmp> <study.footing>
set -eu
lmp=$1 script=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/footing_spheres.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
press() {    # press <shape>
  "$lmp" -in "$script" -var device cpu -var h 0.5 -var length 6 -var grains 60 -var d_end 0.2 \
    -var shape "$1" -var pictures no -var frames 0 \
    -var keywords "substeps adaptive 1e-5 1e-3 50" -var out "$1" -log "log.$1" > run.out 2>&1 ||
    { tail -20 run.out; exit 1; }
}
press disk
press sphere
grep -qx "dimension 3" packing_*_spheres.rve || { echo "the grains are no spheres"; exit 1; }
awk '!/^#/ && NF == 3 {
       k = FILENAME == "curve.sphere"
       if (!(k in first)) first[k] = $2
       if ($1 > 0.15) {sum[k] += $2; n[k]++}
     }
     END {
       for (k = 0; k < 2; k++) {
         if (!n[k]) exit 1
         mean[k] = sum[k] / n[k]
         printf "%s: %.1f kPa at first, %.0f kPa beyond 0.15 m\n", k ? "spheres" : "disks", first[k] / 1e3, mean[k] / 1e3
         if (first[k] < 0.9 * 2e4 || first[k] > 1.1 * 2e4 || mean[k] < 3 * 2e4) bad = 1
       }
       exit bad || mean[1] < 1.1 * mean[0] ? 1 : 0
     }' curve.disk curve.sphere
