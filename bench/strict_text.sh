#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Checks that texts (PTX) of CUDA objects with strict arithmetic determine all bits: no operation
# may be contracted or made less precise by the driver that compiles them at first use. Objects with
# "relaxed" in their names are skipped. .ci/run runs the check if the CUDA code has changed, and
# tools/gpu_check.sh runs it too. It needs no GPU.
#
#   sh bench/strict_text.sh <object>...
#
# The exit status is 77 (skipped) without cuobjdump.
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
