#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Checks that kernels keep the numbers that all pairs share in uniform registers, one for a whole
# warp (CudaHints::uniform), and that products read them from there. If such a kernel grows, the
# compiler silently uses registers of threads instead and spills others, which costs a sixth of the
# speed but does not change results. .ci/nightly and tools/gpu_check.sh run the check. It needs no
# GPU.
#
#   sh bench/uniform_registers.sh <bench_kernels>
#
# The exit status is 77 (skipped) without cuobjdump or nvdisasm, or with another compiler than NVRTC
# 13.0, for which the limits hold.
set -eu
fail() { echo "uniform_registers: $*"; exit 1; }
cuobjdump=${CUOBJDUMP:-$(command -v cuobjdump || echo /usr/local/cuda/bin/cuobjdump)}
[ -x "$cuobjdump" ] || { echo "uniform_registers: skipped, there is no cuobjdump"; exit 77; }
PATH=$(dirname "$cuobjdump"):$PATH
command -v nvdisasm >/dev/null || { echo "uniform_registers: skipped, there is no nvdisasm"
exit 77; }
kept=$(mktemp -d)
trap 'rm -rf "$kept"' EXIT
for kernel in many:PlainSpheres:fast many:SphereMindlinForce:fast many:PlainSphereHertz:fast \
  many:PlainSpheres:mixed many:SphereMindlinForce:mixed \
  many:PlainSphereHertz:mixed largest:PlainSpheres:fast; do
  name=${kernel%%:*} format=${kernel##*:}
  program=${kernel#*:} program=${program%:*}
  said=$("$1" --capability 90 --program $program --format $format --kernel advance_$name \
    --keep "$kept") || { echo "uniform_registers: skipped: $said"; exit 77; }
  # The limits do not hold for other compilers.
  case $said in *"NVRTC 13.0 "*) ;; \
    *) echo "uniform_registers: skipped, the limits are those of NVRTC 13.0: $said"; exit 77 ;; esac
  # For each of eight pairs, products read 18 numbers of the cell and its rate, and those of the
  # law.
  products=$(nvdisasm -c "$kept"/*.cubin | grep -cE '\b[DF](FMA|MUL|ADD)\b.*\bUR[0-9]' || true)
  [ "$products" -ge 150 ] ||
    fail "of $name of $program in $format $products products read a register of the warp; 150 and more do while the kernel is small"
  echo "uniform_registers: $name of $program in $format: $products products"
  rm "$kept"/*
done
