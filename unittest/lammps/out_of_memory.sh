#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Ranks of a host share its memory: their needs are added, and one error names the number of RVEs
# that would fit. With a third of the RVEs on each of three ranks, a limit that suffices for one
# rank does not suffice for all. A limit slightly above the total lets them run, one slightly below
# does not.
#
#   out_of_memory.sh <lmp> <packing> <mpiexec and its options...>
set -eu
lmp=$1 packing=$2
shift 2
work=$(mktemp -d "${TMPDIR:-/tmp}/out_of_memory.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
cat > in.many << END
units si
dimension 2
boundary p p p
processors 3 1 1
atom_style atomic
lattice sq 1.0
region box block 0 12 0 10 -0.5 0.5
create_box 1 box
create_atoms 1 box
mass 1 1.0
comm_modify cutoff 1.0
fix grains all rve $packing device cpu threads 1 dt 1e-4
run 1
END
# run <bytes> <mpiexec and its options...>: succeeds if the run does; the output is in many.out
run() {
  limit=$1; shift
  GPU_RVE_MEMORY_LIMIT=$limit "$@" 3 "$lmp" -in in.many -log none > many.out 2>&1
}

if run 2000000 "$@"; then echo "2 MB are enough for 120 RVEs"; exit 1; fi
grep "ERROR: fix rve grains: 120 RVEs of 3 MPI ranks need .* RVEs would fit" many.out || { cat many.out
exit 1; }
needed=$(sed -n 's/.*MPI ranks need \([0-9.]*\) MB.*/\1/p' many.out | head -1)
fit=$(sed -n 's/.* MB are free; \([0-9]*\) RVEs would fit.*/\1/p' many.out | head -1)
[ "$fit" -gt 30 ] && [ "$fit" -lt 60 ] ||
  { echo "$fit RVEs of about 40 kB are said to fit in 2 MB"; exit 1; }
# Messages have MB with one decimal.
bytes() { awk -v mb="$needed" -v more="$1" 'BEGIN {printf "%.0f", (mb + more) * 1048576}'; }
if run "$(bytes -0.1)" "$@"; then echo "ran with less memory than the $needed MB it needs"
exit 1; fi
run "$(bytes 0.1)" "$@" || { echo "not run with more memory than the $needed MB it needs:"
cat many.out; exit 1; }
echo "3 ranks need $needed MB together"
