#!/bin/sh
# What the compiled files of the GPU engine have, as cuobjdump sees it:
#   sh cuda_code.sh <source folder> <CUDA architectures, as CMake has them, separated by colons> <object>...
# Each has exactly what the build asked for, and the texts leave nothing to the driver that compiles them: where they are of strict
# arithmetic, no operation may be contracted or made less precise, so the bits are those of the binaries.
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
  case $object in *relaxed*) continue ;; esac
  loose=$(grep -oE '\b((add|sub|mul|mad)(\.ftz)?\.f(32|64)|(div|sqrt)\.(approx|full)[a-z.]*\.f32|(add|sub|mul|fma|div|sqrt)\.rn\.ftz\.f32)\b' "$text" | sort | uniq -c || true)
  [ -z "$loose" ] || fail "$object: the driver may change the bits of $loose"
done
echo "cuda_code: $# files with $expected"
