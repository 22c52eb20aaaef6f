#!/bin/sh
# A specimen of the examples, small: its physics, as the script that draws it sees it.
#
#   specimens.sh biaxial|triaxial <lmp> <python with numpy> <examples>
set -eu
kind=$1 lmp=$2 python=$3 folder=$4/${1}_specimen
work=$(mktemp -d "${TMPDIR:-/tmp}/specimen.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"

run() {    # run <plates> <options of lmp...>
  plates=$1
  shift
  "$lmp" -in "$folder/in.${kind}_specimen" -var device cpu -var plates "$plates" "$@" > run.out 2>&1 || { tail -20 run.out; exit 1; }
}

if [ "$kind" = biaxial ]; then
  run smooth -var h 0.125 -var grains 100 -var packings 4 -var strain 0.04
  "$python" "$folder/plot_biaxial_specimen.py" --check smooth
else
  for ends in rough smooth; do run $ends -var grains 80 -var packings 2 -var strain 0.04 -var rate 0.8; done
  "$python" "$folder/plot_triaxial_specimen.py" --check rough smooth
fi
