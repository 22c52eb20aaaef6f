#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# examples/restart: two halves, or the second one from a file in the middle of the first, are the same bits as one run; and none of them warns.
#
#   restart_example.sh <lmp> <folder examples>
set -eu
lmp=$1 examples=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/restart_example.XXXXXX")
trap 'rm -rf "$work"' EXIT
mkdir "$work/restart"
ln -s "$examples/packings" "$work/packings"
cp "$examples"/restart/in.* "$examples/restart/fixes" "$examples/restart/results" "$work/restart"
cd "$work/restart"

# run <name of the log> <options>
run() {
  name=$1
  shift
  "$lmp" "$@" -log "$name.log" > "$name.out" 2>&1 || { cat "$name.out"; exit 1; }
  if grep WARNING "$name.log"; then echo "warnings of: $*"; exit 1; fi
}
run whole -in in.press -var end 400 -var out whole
run first -in in.press
run second -in in.continue
cmp points.whole points.continue
cmp grains.whole.rve grains.continue.rve
# beyond step 200; before it all of the first half
awk '$1 > 200' curve.whole > beyond.whole
awk '$1 > 200' curve.continue > beyond.continue
[ "$(wc -l < beyond.whole)" = 20 ] || { echo "the curve has no 20 lines beyond step 200"; exit 1; }
cmp beyond.whole beyond.continue
head -n "$(wc -l < curve.press)" curve.whole | cmp - curve.press
# so are the files of step 400, behind LAMMPS' own head, which knows when time was set anew: records have no bytes that nobody sets
tail -c +1001 whole.restart > behind.whole
tail -c +1001 two.restart | cmp behind.whole -

# in.press ends before its end: the files of the command restart are of steps 100 and 150
rm -f ./*.restart
run killed -in in.press -var end 175 -var out killed
run again -in in.continue -var from one.restart -var out again
first=$(awk '/^ *Step / {getline; print $1; exit}' again.log)
[ "$first" = 150 ] || [ "$first" = 100 ] || { echo "continued from step $first"; exit 1; }
cmp points.whole points.again
cmp grains.whole.rve grains.again.rve
echo "equal: one run, two halves, and a run that is continued from step $first"
