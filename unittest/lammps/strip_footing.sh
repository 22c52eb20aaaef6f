#!/bin/sh
# Bearing capacity by examples/strip_footing on its coarse grid, against the closed form.
#
#   strip_footing.sh <lmp> <in.strip_footing> <least ratio> <largest ratio> <options of lmp...>
set -eu
lmp=$1 script=$2 least=$3 largest=$4
shift 4
work=$(mktemp -d "${TMPDIR:-/tmp}/strip_footing.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
"$lmp" -in "$script" "$@" > run.out 2>&1 || { tail -20 run.out; exit 1; }
grep '^Mean pressure of the last quarter' run.out || { tail -20 run.out; exit 1; }
sed -n 's/^Mean pressure.*ratio: //p' run.out |
  awk -v least="$least" -v largest="$largest" '{n++; ok = $1 >= least && $1 <= largest} END {exit n == 1 && ok ? 0 : 1}' ||
  { echo "the ratio must be from $least to $largest"; exit 1; }
