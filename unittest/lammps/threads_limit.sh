#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Too many threads in OMP_NUM_THREADS, which applies without a keyword, give an error before any
# thread is created.
#
#   threads_limit.sh <lmp> <packing>
set -eu
lmp=$1 packing=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/threads_limit.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"

cat > in.atom << END
units si
dimension 2
boundary f f p
atom_style sphere
region box block 0 1 0 1 -0.1 0.1
create_box 1 box
create_atoms 1 single 0.5 0.5 0.0
timestep 1e-3
END
recipe="grains 40 radius uniform 0.0025 0.005 kn 1e6 density 2650 thickness 0.075 pressure 1e5"

# refused <line of a script>: expects an error for OMP_NUM_THREADS=1025 and none for 2
refused() {
  { cat in.atom; echo "$1"; } > in.refused
  if OMP_NUM_THREADS=1025 "$lmp" -in in.refused -log none > refused.out 2>&1
  then echo "runs with 1025 threads: $1"; exit 1; fi
  grep -q "number of threads is 1025; it must be from 1 to 1024 (keyword threads, or OMP_NUM_THREADS without it)" refused.out ||
    { echo "no word about threads: $1"; cat refused.out; exit 1; }
  OMP_NUM_THREADS=2 "$lmp" -in in.refused -log none > refused.out 2>&1 || { cat refused.out
  exit 1; }
  echo "refused with 1025 threads, runs with 2: $1"
}
refused "fix grains all rve $packing"
refused "fix soil all mpm 1.0 model all elastic 1e6 0.3 density 2000"
refused "create_rve library.rve $recipe seeds 1 2"
