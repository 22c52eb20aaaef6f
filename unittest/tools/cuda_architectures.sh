#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# The default CUDA architectures for the GPUs of a machine, whose driver is simulated by scripts.
#
#   sh cuda_architectures.sh <source folder> [cmake]
set -eu
unset GPU_RVE_OPTIONS GPU_RVE_PRESET    # the set-up reads them
source=$1
cmake=${2:-cmake}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
fail() { echo "cuda_architectures: $*"; exit 1; }

# Simulates nvidia-smi with these lines of output.
machine() {
  printf '#!/bin/sh\ncat <<END\n%s\nEND\n' "$1" > "$work/nvidia-smi"
  chmod +x "$work/nvidia-smi"
}
cards() { PATH="$work:$PATH" sh "$source/tools/cuda_cards.sh" | tr '\n' ' '; }

machine '9.0
8.6
9.0'
[ "$(cards)" = "86 90 " ] || fail "two kinds of cards: '$(cards)'"
machine '12.0'
[ "$(cards)" = "120 " ] || fail "a card with a long number: '$(cards)'"
machine 'Field "compute_cap" is not a valid field to query.'
[ "$(cards)" = "" ] || fail "a driver that cannot tell: '$(cards)'"
machine 'No devices were found'
[ "$(cards)" = "" ] || fail "no card: '$(cards)'"
printf '#!/bin/sh\necho "NVIDIA-SMI has failed because it could not communicate with the NVIDIA driver."\nexit 9\n' > "$work/nvidia-smi"
[ "$(cards)" = "" ] || fail "no driver: '$(cards)'"

"$cmake" -P "$source/unittest/tools/cuda_architectures.cmake" || fail "wrong architectures"

# refused, with a message
refused() {    # refused <message> <arguments of choose_cuda_architectures>
  text=$1
  shift
  printf 'cmake_policy(VERSION 3.25)\ninclude("%s/cmake/CudaArchitectures.cmake")\nchoose_cuda_architectures(list why %s)\n' "$source" "$*" > "$work/refused.cmake"
  if "$cmake" -P "$work/refused.cmake" > "$work/said" 2>&1; then fail "$*: not refused"; fi
  tr -s '\n ' '  ' < "$work/said" | grep -qF "$text" || { cat "$work/said"; fail "$*: it does not say '$text'"; }
}
refused "has 75; the kernels need 80 or newer" ASKED 90 75 KNOWN 75 80 90
refused "native, but nvidia-smi shows no card" ASKED native KNOWN 75 80 90
refused "is 'sm_90'; it must be native, all, all-major, or a list of numbers" ASKED sm_90 KNOWN 75 80 90
refused "use CUDA 11.8 or newer" KNOWN 50 75

# The set-up scripts choose the build on machines with all packages; cmake is a stub that prints its
# arguments.
printf '#!/bin/sh\necho install ok installed\n' > "$work/dpkg-query"
printf '#!/bin/sh\necho "cmake $*"\n' > "$work/cmake"
printf '#!/bin/sh\n' > "$work/nvcc"
chmod +x "$work/dpkg-query" "$work/cmake" "$work/nvcc"
sets_up() {    # sets_up <preset> <description of the machine>
  said=$(env -u GPU_RVE_PRESET -u CUDACXX -u LAMMPS_SOURCE_DIR PATH="$work:$PATH" stages=4 sh -c '. "$1/tools/setup.sh"' "$source/tools/x.sh" "$source")
  echo "$said" | grep -qx "cmake --preset $1" || { echo "$said"; fail "$2: not preset $1"; }
}
machine '8.6'
sets_up cuda "a compiler and a card"
machine '7.5'
sets_up host "a compiler and an old card"
machine ''
sets_up host "a compiler without a card"
echo "$said" | grep -q "GPU_RVE_PRESET=cuda builds it" || fail "it is not said how to build the GPU engine without a card"
echo "cuda_architectures: in order"
