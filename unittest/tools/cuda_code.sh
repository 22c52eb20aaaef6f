#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Checks the compiled files of the GPU engine by cuobjdump. Each has code for exactly the
# architectures of the build, and its text can be read. bench/strict_text.sh checks the text.
#
#   sh cuda_code.sh <source folder> <CUDA architectures in CMake's form, separated by colons>
#                   <object>...
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
