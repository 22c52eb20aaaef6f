#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# examples/footing with so few grains that the cell of a point next to the footing becomes too
# narrow. Without copies the run ends there. With copies it continues, with the same earlier results
# and the same bits on two ranks.
#
#   footing_narrow.sh <lmp> <study.footing> <mpiexec> <its flag for the number of ranks>
set -eu
lmp=$1 script=$2 mpiexec=$3 flag=$4
work=$(mktemp -d "${TMPDIR:-/tmp}/footing_narrow.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
stop=520
press() {    # press <ranks> <name> <keywords of fix rve>
  "$mpiexec" "$flag" "$1" "$lmp" -in "$script" -var device cpu -var format fast -var h 1 \
    -var length 4 -var grains 12 -var stop $stop -var pictures no \
    -var keywords "$3" -var out "$2" -log "log.$2" > run.out 2>&1
}
if press 1 without "copies 1"; then echo "no cell became too narrow in $stop steps"; exit 1; fi
step=$(sed -n 's/^ERROR.* failed at step \([0-9]*\): cell too narrow.*/\1/p' log.without)
[ -n "$step" ] || { echo "the run without copies ended for another reason:"; tail -3 run.out
exit 1; }
press 1 with "copies 2" || { tail -20 run.out; exit 1; }
press 2 ranks "copies 2" || { tail -20 run.out; exit 1; }
grep "became too narrow at step $step; the RVE continues as 2 copies side by side with 24 grains" \
  log.with
cmp curve.with curve.ranks
cmp fields.with fields.ranks
# Earlier lines are the same. Each step writes a line of the curve, and the last line of a run that
# ends with an error may be missing.
before=$((step - 2))
for run in without with; do head -n $before curve.$run > until.$run; done
cmp until.without until.with
# The reaction of so coarse a footing oscillates; its mean exceeds the surcharge of 20 kPa.
awk -v stop=$stop -v step="$step" \
  '!/^#/ && NF == 3 {n++; if (n > step) {later++; sum += $2}} END {exit n >= stop && sum / later > 2e4 && sum / later < 4e5 ? 0 : 1}' curve.with ||
  { echo "the curve does not go on as it should:"; tail -40 curve.with; exit 1; }
