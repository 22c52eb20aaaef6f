#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# What the compiled files of the GPU engine have, as cuobjdump sees it:
#   sh cuda_code.sh <source folder> <CUDA architectures, as CMake has them, separated by colons>
#   <object>... Each has code for exactly the architectures that the build asked for, and its text
#   can be read. bench/strict_text.sh looks into the text.
set -eu
source=$1 asked=$2
shift 2
fail() { echo "cuda_code: $*"; exit 1; }
cuobjdump=${CUOBJDUMP:-$(command -v cuobjdump || echo /usr/local/cuda/bin/cuobjdump)}
[ -x "$cuobjdump" ] || { echo "cuda_code: skipped, there is no cuobjdump"; exit 77; }
CUOBJDUMP=$cuobjdump
export CUOBJDUMP

expected=$(echo "$asked" | tr ':' '\n' | while read -r word; do
  number=${word%-*}
  case $word in *-virtual) ;; *) echo "sm_$number" ;; esac
  case $word in *-real) ;; *) echo "compute_$number" ;; esac
done | sort -u | xargs)
text=$(mktemp)
trap 'rm -f "$text"' EXIT
[ $# -gt 0 ] || fail "no objects"
for object; do
  line=$(sh "$source/tools/cuda_code.sh" "$object")
  [ "$line" = "$object: $expected" ] || fail "$line: expected $expected"
  case $expected in *compute_*) ;; *) continue ;; esac
  "$cuobjdump" --dump-ptx "$object" > "$text"
  grep -q '^\.target sm_' "$text" || fail "$object: its text cannot be read"
done
echo "cuda_code: $# files with $expected"
