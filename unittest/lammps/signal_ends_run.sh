#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# A batch system ends a run with SIGTERM: the log shows the progress while the run continues, the
# run ends after its present step with the restart file of the script, and the continued run has the
# bits of an uninterrupted one. The scene is pressed_plate.sh.
#
#   signal_ends_run.sh <lmp> <packing>
set -eu
lmp=$1 packing=$2 speed=0.1 thermo=100000 fix_words="progress 0.02"
scene=$(cd "$(dirname "$0")" && pwd)/pressed_plate.sh
work=$(mktemp -d "${TMPDIR:-/tmp}/signal_ends_run.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
end=400

. "$scene"
{ cat in.setup in.fixes; echo "run $end"; write whole; } > in.whole
"$lmp" -in in.whole -log whole.log > whole.out 2>&1 || { cat whole.out; exit 1; }

{ cat in.setup in.fixes; echo "restart 10000 one.restart two.restart"; echo "run $end"
write unwanted; echo "print done file done"; } > in.ended
"$lmp" -in in.ended -log ended.log > ended.out 2>&1 &
process=$!
# The line must be in the file during the run; a buffered log would show it only at the end.
while ! grep -q "^fix rve grains: step .* left" ended.log 2> /dev/null; do
  kill -0 $process 2> /dev/null ||
    { echo "the run was over before its log showed a line of progress"; cat ended.out; exit 1; }
  sleep 0.005
done
kill -TERM $process
status=0
wait $process || status=$?
[ $status -eq 1 ] || { echo "exit status $status, expected that of an error, 1"; cat ended.out
exit 1; }
step=$(sed -n 's/.*SIGTERM ended the run after step \([0-9]*\); continue from restart file one.restart .*/\1/p' ended.log)
[ -n "$step" ] || { echo "no word about the signal:"; cat ended.log; exit 1; }
[ ! -e done ] || { echo "the script went on"; exit 1; }
[ "$step" -lt $end ] || { echo "the run was over"; exit 1; }

{ echo "read_restart one.restart"; cat in.fixes; echo "run $end upto"; write continued
} > in.continued
"$lmp" -in in.continued -log continued.log > continued.out 2>&1 || { cat continued.out; exit 1; }
first=$(awk '/^ *Step / {getline; print $1; exit}' continued.log)
[ "$first" = "$step" ] || { echo "continued from step $first, not from $step"; exit 1; }
cmp whole.points continued.points
cmp whole.counts continued.counts
for id in $(seq 16); do cmp whole.$id.rve continued.$id.rve; done
echo "equal: uninterrupted, and ended by SIGTERM after step $step of $end and continued"
