# SPDX-License-Identifier: GPL-2.0-only
# Set-up for footing.sh and test.sh, to be sourced (`. tools/setup.sh`), not run. Installs missing
# Debian packages, obtains and builds LAMMPS (once, in a cache), and configures the build.
#
#   GPU_RVE_PRESET      CMake preset: host, cuda, ... (default: cuda with nvcc and a GPU, else host)
#   GPU_RVE_CACHE       folder of LAMMPS (default: gpu_rve in the user's cache folder)
#   LAMMPS_SOURCE_DIR   a LAMMPS tree, 4Feb2025 or newer
#                       (default: tools/get_lammps.sh obtains 4Feb2025)
#   GPU_RVE_OPTIONS     further options of CMake, for example "-D GPU_RVE_TESTS=OFF"
#
# Input: $stages, the number of stages of the calling script, the first two of which are here.
# Output: $root (the repository), $preset, $build (the build tree), and minutes(), which prints how
# long work takes on this machine.

set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"

say() { echo "== $*"; }
minutes() {    # minutes <seconds of one core>
  cores=$(nproc)
  echo "about $((($1 / cores + 59) / 60)) min on $cores cores that do nothing else"
}

say "1 of $stages: Debian packages"
. tools/packages.sh
install_packages g++ cmake ninja-build xz-utils debian-archive-keyring libopenmpi-dev openmpi-bin \
  libpng-dev libfftw3-dev libgtest-dev nlohmann-json3-dev \
  python3 python3-numpy python3-matplotlib python3-cffi

# CUDA is often installed outside of the PATH.
if [ -z "${CUDACXX:-}" ] && ! command -v nvcc >/dev/null && [ -x /usr/local/cuda/bin/nvcc ]; then
  export CUDACXX=/usr/local/cuda/bin/nvcc
fi
if [ -n "${GPU_RVE_PRESET:-}" ]; then
  preset=$GPU_RVE_PRESET
elif [ -z "${CUDACXX:-}" ] && ! command -v nvcc >/dev/null; then
  preset=host
elif sh tools/cuda_cards.sh | awk '$1 >= 80 { found = 1 } END { exit !found }'; then
  preset=cuda
else
  preset=host
  say "a CUDA compiler, but no card of compute capability 8.0 or newer here: the GPU engine is left out (GPU_RVE_PRESET=cuda builds it)"
fi
build=$root/build/$preset

if [ -z "${CMAKE_CXX_COMPILER_LAUNCHER:-}" ] && command -v ccache >/dev/null; then
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache CMAKE_CUDA_COMPILER_LAUNCHER=ccache
fi

say "2 of $stages: configuring (preset $preset); the first time LAMMPS is obtained and built, $(minutes 270)"
# shellcheck disable=SC2086  # a list of words
cmake --preset "$preset" ${LAMMPS_SOURCE_DIR:+-D "LAMMPS_SOURCE_DIR=$LAMMPS_SOURCE_DIR"} \
  ${GPU_RVE_OPTIONS:-}
