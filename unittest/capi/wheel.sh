#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Builds the wheel (tools/wheel.sh) and uses it as a user without compilers would: a clean virtual
# environment, gpu-rve-check, the notebooks, and a short run with the bits of this build's library.
#
#   wheel.sh <repository> <C++ compiler> <C compiler> <librve.so of the build> <folder>
#
# The exit status is 77 (skipped) without a virtual environment or the package index, unless
# GPU_RVE_REQUIRE_PICTURES=1. Without nvcc the wheel is for CPUs only. Kernels that the compiler
# cache lacks are compiled in minutes.
set -eu
root=$1
export CXX="$2" CC="$3"    # the compilers of the tests, not those of Python
library=$4 folder=$5
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset GPU_RVE_LIBRARY PYTHONPATH
export PYTHONDONTWRITEBYTECODE=1 PIP_DISABLE_PIP_VERSION_CHECK=1

cannot() {
  cat "$work/log"
  echo "$1"
  [ "${GPU_RVE_REQUIRE_PICTURES:-0}" = 1 ] && exit 1
  exit 77
}
fail() { echo "FAILED: $1"; exit 1; }
if [ -z "${CMAKE_CXX_COMPILER_LAUNCHER:-}" ] && command -v ccache > /dev/null
then export CMAKE_CXX_COMPILER_LAUNCHER=ccache CMAKE_CUDA_COMPILER_LAUNCHER=ccache; fi
/usr/bin/python3 -m venv "$work/venv" > "$work/log" 2>&1 || cannot "there is no virtual environment"
python=$work/venv/bin/python
# Downloads come first, before the package can fail.
"$python" -m pip install -q cffi numpy matplotlib nbclient ipykernel > "$work/log" 2>&1 ||
  cannot "the package index cannot be had"

cpu=
if [ -z "${CUDACXX:-}" ] && ! command -v nvcc > /dev/null && [ ! -x /usr/local/cuda/bin/nvcc ]
then cpu=--cpu; fi
# The flags are those of the tests, so that the compiler cache has the kernels.
# shellcheck disable=SC2086  # no word or one
GPU_RVE_OPTIONS="-D GPU_RVE_WERROR=ON" sh "$root/tools/wheel.sh" $cpu "$folder" \
  > "$work/out" 2> "$work/log" || { cat "$work/log"; fail "tools/wheel.sh"; }
wheel=$(tail -n 1 "$work/out")
tail -n 1 "$work/log"
case ${wheel##*/} in
  gpu_rve-*-py3-none-manylinux_*_x86_64.whl) echo "${wheel##*/}" ;;
  *) fail "the name is $wheel" ;;
esac

extra=
[ -n "$cpu" ] || extra="[cuda]"
"$python" -m pip install -q "$wheel$extra" > "$work/log" 2>&1 || { cat "$work/log"; fail "pip"; }
cd "$work"
"$work/venv/bin/gpu-rve-check"
"$python" "$root/unittest/capi/wheel_contents.py" $cpu

"$python" "$root/unittest/capi/batch_bits.py" "$root/examples/packings" > wheel
PYTHONPATH=$root/python GPU_RVE_LIBRARY=$library /usr/bin/python3 \
  "$root/unittest/capi/batch_bits.py" "$root/examples/packings" > build
diff build wheel || fail "the bits are not those of $library"
"$python" "$root/unittest/capi/test_notebooks.py" "$root/examples"
