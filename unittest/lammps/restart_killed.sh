#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# A killed run (SIGKILL) continues from its last complete restart file to the same bits: one
# uninterrupted run without restart files equals the same run, killed a few times at random moments
# and continued.
#
# LAMMPS writes a restart file in place, so the last one may be incomplete. Two alternating files
# are safe if a continued run first writes the one that it has not read. Incomplete files of several
# lengths must be refused with a message, and a run with an incomplete newer file must continue from
# the older one. The scene is pressed_plate.sh.
#
#   restart_killed.sh <lmp> <packing> [seed of the moments; default: the time]
set -eu
lmp=$1 packing=$2 seed=${3:-$(date +%s)} speed=0.3 thermo=10 fix_words=""
scene=$(cd "$(dirname "$0")" && pwd)/pressed_plate.sh
work=$(mktemp -d "${TMPDIR:-/tmp}/restart_killed.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
end=120
echo "seed of the moments: $seed"

. "$scene"
{ cat in.setup in.fixes; echo "run $end"; write whole; } > in.whole
start=$(date +%s%N)
"$lmp" -in in.whole -log whole.log > whole.out 2>&1 || { cat whole.out; exit 1; }
span=$(( ($(date +%s%N) - start) / 1000000 ))

# input <file to begin with, or "">: prints the run up to its end, with alternating restart files;
# the one it begins with is the second
input() {
  if [ -z "$1" ]; then cat in.setup; turns="one.restart two.restart"; else echo "read_restart $1"
  fi
  [ "$1" = one.restart ] && turns="two.restart one.restart"
  [ "$1" = two.restart ] && turns="one.restart two.restart"
  cat in.fixes
  echo "restart 5 $turns"
  echo "run $end upto"
  write killed
}

# complete <file>: succeeds if LAMMPS reads it; otherwise LAMMPS must give the reason
complete() {
  echo "read_restart $1" > in.look
  "$lmp" -in in.look -log none > look.out 2>&1 && return 0
  grep -q "^ERROR.*\(Incomplete or corrupted LAMMPS restart file\|end of file\|restart\)" look.out \
    ||
    { echo "a torn restart file is not refused with a message:"; cat look.out; exit 1; }
  return 1
}

# newest: the newest complete restart file, or nothing
newest() {
  for file in $(ls -t one.restart two.restart 2> /dev/null); do
    if complete "$file"; then echo "$file"; return; fi
  done
}

# moment <number>: seconds after the first restart file of a run
moment() { awk -v seed="$seed" -v n="$1" -v span="$span" \
  'BEGIN {srand(seed + 7919 * n); rand(); printf "%.3f", 1e-3 * span * 0.5 * rand()}'; }

# wrote_one: succeeds if the present run has begun a restart file
wrote_one() { [ -n "$(find . -name '*.restart' -newer begun)" ]; }

# The start-up time of a program is unrelated to its run, so the clock starts with the first restart
# file. If the machine is faster than in the first run, the span shrinks until each kill hits a run.
kills=0 continued=0 tries=0 file=""
while [ $kills -lt 3 ] || [ $continued -lt 1 ] || [ -z "$file" ]; do
  tries=$((tries + 1))
  [ $tries -le 12 ] || { echo \
    "12 tries: killed $kills times, restart files: $(ls ./*.restart 2> /dev/null)"; exit 1; }
  input "$file" > in.killed
  touch begun
  "$lmp" -in in.killed -log killed.log > killed.out 2>&1 &
  process=$!
  while ! wrote_one && kill -0 $process 2> /dev/null; do sleep 0.005; done
  sleep "$(moment $tries)"
  kill -KILL $process 2> /dev/null || true
  wait $process 2> /dev/null || true
  if [ -f killed.counts ]; then    # the run was faster
    rm -f killed.counts
    [ $continued -gt 0 ] && break
    rm -f one.restart two.restart
    span=$((span / 2)) file=""
    continue
  fi
  kills=$((kills + 1))
  [ -n "$file" ] && continued=$((continued + 1))
  file=$(newest)
done

# A kill during writing leaves an incomplete newer file, and the run continues from the older one.
newer=$(newest)
older=$([ "$newer" = one.restart ] && echo two.restart || echo one.restart)
size=$(wc -c < "$newer")
cp "$newer" whole_newer.restart
for length in 0 10 $((size / 3)) $((size - 1)); do
  head -c "$length" whole_newer.restart > torn.restart
  if complete torn.restart
  then echo "a restart file of $length of $size bytes passes for complete"; exit 1; fi
done
if [ -f "$older" ] && complete "$older"; then
  head -c $((size / 2)) whole_newer.restart > "$newer"
  file=$(newest)
  [ "$file" = "$older" ] || { echo "continued from '$file' and not from the older file $older"
  exit 1; }
else
  file=$newer
fi
input "$file" > in.last
rm -f killed.counts
"$lmp" -in in.last -log last.log > last.out 2>&1 || { cat last.out; exit 1; }
first=$(awk '/^ *Step / {getline; print $1; exit}' last.log)
[ "${first:-0}" -gt 0 ] || { echo "the last part began at step $first: nothing was continued"
exit 1; }

cmp whole.points killed.points
cmp whole.counts killed.counts
for id in $(seq 16); do cmp whole.$id.rve killed.$id.rve; done
echo "equal: uninterrupted, and killed $kills times, $continued times in a continued run, with a torn newer file, from step $first last"
