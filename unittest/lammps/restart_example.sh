#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# examples/restart: two halves of a run, also with the second one from an earlier restart file, have
# the bits of one run, without warnings.
#
#   restart_example.sh <lmp> <folder examples>
set -eu
lmp=$1 examples=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/restart_example.XXXXXX")
trap 'rm -rf "$work"' EXIT
mkdir "$work/restart"
ln -s "$examples/packings" "$work/packings"
cp "$examples"/restart/in.* "$examples/restart/ground" "$examples/restart/fixes" "$examples/restart/results" "$work/restart"
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
# Steps after 200 are compared; the run from the earlier file also has all steps before.
awk '$1 > 200' curve.whole > beyond.whole
awk '$1 > 200' curve.continue > beyond.continue
[ "$(wc -l < beyond.whole)" = 20 ] || { echo "the curve has no 20 lines beyond step 200"; exit 1; }
cmp beyond.whole beyond.continue
head -n "$(wc -l < curve.press)" curve.whole | cmp - curve.press
# The files of step 400 are the same after LAMMPS' own head, which has the time of the last reset:
# records have no unset bytes.
tail -c +1001 whole.restart > behind.whole
tail -c +1001 two.restart | cmp behind.whole -

# in.press ends early: the command restart writes files of steps 100 and 150.
rm -f ./*.restart
run killed -in in.press -var end 175 -var out killed
run again -in in.continue -var from one.restart -var out again
first=$(awk '/^ *Step / {getline; print $1; exit}' again.log)
[ "$first" = 150 ] || [ "$first" = 100 ] || { echo "continued from step $first"; exit 1; }
cmp points.whole points.again
cmp grains.whole.rve grains.again.rve

# in.job continues by itself after SIGTERM, which arrives when the first restart file exists.
"$lmp" -in in.job -log job.log > job.out 2>&1 &
job=$!
while [ ! -s restart_one ] && kill -0 $job 2> /dev/null; do sleep 0.1; done
kill -TERM $job 2> /dev/null || true
if wait $job; then echo "SIGTERM did not end in.job"; exit 1; fi
grep "SIGTERM ended the run" job.log
from=$(ls -t restart_one restart_two 2> /dev/null | head -n 1)
run continued -in in.job -var from "$from"
cmp points.whole points.job
cmp grains.whole.rve grains.job.rve
echo "equal: one run, two halves, a job that is interrupted, and a run that is continued from step $first"
