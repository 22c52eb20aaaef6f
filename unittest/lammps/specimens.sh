#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# A small example in space or between plates: its physics, by the script that draws it.
#
#   specimens.sh biaxial_specimen|triaxial_specimen|footing_3d <lmp> <python with numpy> <examples>
set -eu
example=$1 lmp=$2 python=$3 folder=$4/$1
work=$(mktemp -d "${TMPDIR:-/tmp}/$example.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"

script=study.$example
[ -f "$folder/$script" ] || script=in.$example
# run <options of lmp...>
run() { "$lmp" -in "$folder/$script" -var device cpu "$@" > run.out 2>&1 ||
  { tail -20 run.out; exit 1; }; }
check() { "$python" "$folder/plot_$example.py" --check "$@"; }

case $example in
  biaxial_specimen)
    # With these settings a band crosses the specimen.
    run -var grains 100 -var packings 4 -var strain 0.04 -var seed 301
    check smooth ;;
  triaxial_specimen)
    for plates in rough smooth; do run -var plates $plates -var grains 80 -var packings 2 \
      -var strain 0.04 -var rate 0.8; done
    check rough smooth ;;
  footing_3d)
    run -var shape square -var length 3 -var d_end 0.1
    run -var shape strip -var length 6 -var d_end 0.1
    check
    tresca="-var pic 0.001 -var phi 0 -var cohesion 10000 -var qs 0 -var d_end 0.03 -var h 0.125"
    run -var shape circle -var length 2 -var out tresca_circle $tresca
    run -var shape strip -var out tresca_strip $tresca
    check --model tresca ;;
esac
