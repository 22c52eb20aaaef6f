#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Compares an example on its coarse grid with its closed form, by the line "closed form: ...; ratio:
# ..." of its output.
#
#   closed_form.sh <lmp> <input script> <least ratio> <largest ratio> <options of lmp...>
set -eu
lmp=$1 script=$2 least=$3 largest=$4
shift 4
work=$(mktemp -d "${TMPDIR:-/tmp}/closed_form.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
"$lmp" -in "$script" "$@" > run.out 2>&1 || { tail -20 run.out; exit 1; }
grep 'closed form: .*ratio: ' run.out || { tail -20 run.out; exit 1; }
sed -n 's/.*closed form: .*ratio: \([0-9.]*\).*/\1/p' run.out |
  awk -v least="$least" -v largest="$largest" \
    '{n++; ok = $1 >= least && $1 <= largest} END {exit n == 1 && ok ? 0 : 1}' ||
  { echo "the ratio must be from $least to $largest"; exit 1; }
