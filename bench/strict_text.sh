#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Check of the compiler's output: the texts (PTX) of CUDA objects with strict arithmetic leave nothing to the driver that compiles them at first
# use. No operation may be contracted or made less precise, so the bits are those of the binaries. Run by .ci/run, when the CUDA code has changed,
# and by tools/gpu_check.sh; needs no GPU. Objects with "relaxed" in their names are left out.
#
#   sh bench/strict_text.sh <object>...
#
# 77, skipped, where there is no cuobjdump.
set -eu
fail() { echo "strict_text: $*"; exit 1; }
cuobjdump=${CUOBJDUMP:-$(command -v cuobjdump || echo /usr/local/cuda/bin/cuobjdump)}
[ -x "$cuobjdump" ] || { echo "strict_text: skipped, there is no cuobjdump"; exit 77; }
[ $# -gt 0 ] || fail "no objects"
text=$(mktemp)
trap 'rm -f "$text"' EXIT
checked=0
for object; do
  case $object in *relaxed*) continue ;; esac
  "$cuobjdump" --dump-ptx "$object" > "$text"
  grep -q '^\.target sm_' "$text" || continue    # binaries only
  loose=$(grep -oE '\b((add|sub|mul|mad)(\.ftz)?\.f(32|64)|(div|sqrt)\.(approx|full)[a-z.]*\.f32|(add|sub|mul|fma|div|sqrt)\.rn\.ftz\.f32)\b' "$text" | sort | uniq -c || true)
  [ -z "$loose" ] || fail "$object: the driver may change the bits of $loose"
  checked=$((checked + 1))
done
[ $checked -gt 0 ] || fail "no text in $# objects"
echo "strict_text: $checked texts are strict"
