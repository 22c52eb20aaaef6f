# SPDX-License-Identifier: GPL-2.0-only
# What .ci/run and .ci/nightly share; to be read (`. .ci/steps.sh`) in the repository, not run.

set -u
export CMAKE_COLOR_DIAGNOSTICS=OFF CLICOLOR=0
mkdir -p build
summary=()
failed=0

# Runs a command, also where one before it failed, and notes its verdict and its time:  step <name> <command...>
step() {
  local name=$1 begin=$SECONDS verdict=passed
  shift
  echo "======== $name"
  "$@" || { verdict=FAILED; failed=1; }
  summary+=("$(printf '%-58s %-8s %5d s' "$name" "$verdict" $((SECONDS - begin)))")
}
# The last lines of a run, and its exit status
finish() {
  echo "======== steps"
  printf '%s\n' "${summary[@]}"
  exit $failed
}

packages() { (set -eu; . tools/packages.sh; install_packages clang-format-14 python3-sphinx python3-sphinx-rtd-theme libjs-mathjax ccache mold); }
# The compiler cache has what nvcc and g++ have compiled once; nvcc is often installed next to the PATH.
compilers_of_this_machine() {
  if command -v ccache >/dev/null; then export CMAKE_CXX_COMPILER_LAUNCHER=ccache CMAKE_CUDA_COMPILER_LAUNCHER=ccache; fi
  if [ -z "${CUDACXX:-}" ] && ! command -v nvcc >/dev/null && [ -x /usr/local/cuda/bin/nvcc ]; then export CUDACXX=/usr/local/cuda/bin/nvcc; fi
}
has_nvcc() { [ -n "${CUDACXX:-}" ] || command -v nvcc >/dev/null; }

# ---- steps that are left out where their inputs have not changed --------------------------------------------------------------------------------
# A step that has passed leaves the hash of its inputs in the user's cache folder, next to the compiler cache. With an empty folder every step is
# run.
ci_cache=${GPU_RVE_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/gpu_rve}/ci

# Hash of files (paths may be folders or patterns of git) and of further words, for example a compiler's version.
#   inputs_hash "words" <path>...
inputs_hash() {
  local words=$1
  shift
  {
    echo "$words"
    if git rev-parse --is-inside-work-tree >/dev/null 2>&1; then
      git ls-files -z --cached --others --exclude-standard -- "$@"
    else    # the source archive
      find "$@" -type f -print0 2>/dev/null
    fi | LC_ALL=C sort -zu | while IFS= read -r -d '' file; do [ -f "$file" ] && sha256sum "$file"; done
  } | sha256sum | cut -d' ' -f1
}

# True if the step has passed with these inputs:  has_passed <name> <hash>
has_passed() { [ "$(cat "$ci_cache/$1" 2>/dev/null)" = "$2" ]; }
# Notes that it has:  note_pass <name> <hash>
note_pass() { mkdir -p "$ci_cache" && echo "$2" >"$ci_cache/$1.$$" && mv "$ci_cache/$1.$$" "$ci_cache/$1"; }

# Runs a step unless it has passed with these inputs (CI_RUN_ALL=1: in any case), and says so:  step_if_changed <name> <part of inputs_of> <command...>
step_if_changed() {
  local name=$1 part=$2 inputs hash before=$failed
  shift 2
  inputs_of "$part" || { failed=1; return; }
  hash=$(inputs_hash "$(compilers; sha256sum .ci/steps.sh)" "${inputs[@]}")
  if [ "${CI_RUN_ALL:-0}" = 0 ] && has_passed "$part" "$hash"; then
    echo "======== $name: left out, nothing that it depends on has changed since it passed"
    summary+=("$(printf '%-58s %-8s' "$name" unchanged)")
    return
  fi
  failed=0
  step "$name" "$@"
  if [ $failed = 0 ]; then note_pass "$part" "$hash"; fi
  failed=$((before | failed))
}

compilers() { ${CXX:-c++} --version 2>/dev/null | head -1; ${CUDACXX:-nvcc} --version 2>/dev/null | tail -1; cmake --version | head -1; }

# Inputs of the steps CUDA and races and of the parts of .ci/nightly. Numerics are watched by the golden bits, so the text of the engine is no input of
# examples: golden_bits.txt changes with them.
build_files=(CMakeLists.txt CMakePresets.json cmake src/GPU_RVE/CMakeLists.txt)
styles=(':(glob)src/GPU_RVE/*.h' ':(glob)src/GPU_RVE/*.cpp' src/GPU_RVE/lammps)
inputs_of() {    # inputs_of <part>: sets `inputs`
  case $1 in
    cuda | cuda_architectures) inputs=(src/GPU_RVE/rve src/GPU_RVE/cuda ':(glob)src/GPU_RVE/mpm/*.h' ':(glob)src/GPU_RVE/mpm/*.cu' ':(glob)src/GPU_RVE/mpm/*.cuh'
      unittest/cuda unittest/support unittest/engine/test_cuda_drivers.cpp unittest/engine/test_runtime_kernels.cpp unittest/tools/cuda_code.sh
      bench/strict_text.sh bench/uniform_registers.sh bench/bench_kernels.cpp tools/cuda_code.sh "${build_files[@]}") ;;
    races) inputs=(src/GPU_RVE/rve/core src/GPU_RVE/rve/physics src/GPU_RVE/rve/block src/GPU_RVE/rve/algorithm unittest/engine/test_phases.cpp
      "${build_files[@]}") ;;
    packaging) inputs=(pyproject.toml debian python src/GPU_RVE/capi unittest/install unittest/capi/pip.sh unittest/capi/package.sh
      unittest/capi/wheel.sh unittest/capi/wheel_contents.py unittest/capi/batch_bits.py tools/wheel.sh tools/plugin_wheel.sh tools/venv.sh
      tools/cuda_cards.sh tools/get_lammps.sh ':(glob)src/GPU_RVE/*.h' src/GPU_RVE/lammps/gpurveplugin.cpp .gitignore "${build_files[@]}") ;;
    notebooks) inputs=(examples/notebooks python src/GPU_RVE/capi unittest/capi/test_notebooks.py unittest/capi/host.sh unittest/golden/golden_bits.txt
      tools/pictures_python.sh) ;;
    pictures) inputs=(examples/pictures examples/packings unittest/pictures ':(glob)tools/*.py' tools/pictures_python.sh unittest/golden/golden_bits.txt "${styles[@]}") ;;
    examples) inputs=(examples unittest/lammps unittest/capi unittest/golden/golden_bits.txt src/GPU_RVE/macro src/GPU_RVE/capi python tools/plot_instability.py
      tools/calibration_python.sh "${styles[@]}") ;;
    *) echo "inputs_of: there is no part $1" >&2; return 1 ;;
  esac
}

# ---- CUDA, where there is no GPU ----------------------------------------------------------------------------------------------------------------
cuda_of_variants() {    # the value of GPU_RVE_PROGRAMS_AT_RUN_TIME for all variants except General
  sed -n 's/^  variant(\([A-Za-z]*\),.*/\1/p' src/GPU_RVE/rve/engine/kernel_variants.h | grep -vx General | paste -sd ';'
}
# Compiles the CUDA code for one architecture and checks the machine code. The variant General of disks is compiled ahead, the other variants by
# test_runtime_kernels. A missing cuobjdump is a failure.
cuda() {
  local cuobjdump
  cuobjdump=$(sh tools/get_cuobjdump.sh) &&
    cmake --preset cuda -B build/ci-cuda -D GPU_RVE_LAMMPS=OFF -D GPU_RVE_BASELINE_KERNELS=OFF -D CMAKE_CUDA_ARCHITECTURES=90 \
      -D "GPU_RVE_PROGRAMS_AT_RUN_TIME=$(cuda_of_variants)" &&
    cmake --build build/ci-cuda --target cuda_parts &&
    CUOBJDUMP=$cuobjdump ctest --test-dir build/ci-cuda --parallel 2 --output-on-failure --no-tests=error \
      -R '^(cuda_code|cuda_driver_.*|test_cuda_choice|test_runtime_kernels_[0-9]+)$' &&
    find build/ci-cuda/src/GPU_RVE -name '*.cu.o' -exec env "CUOBJDUMP=$cuobjdump" sh bench/strict_text.sh {} +
}
# Compiles one variant for all architectures that a build serves by default, and checks that its code is there.
cuda_architectures() {
  local cuobjdump variant=src/GPU_RVE/CMakeFiles/rve_cuda.dir/programs/cuda_General_Mixed.cu.o architectures
  cuobjdump=$(sh tools/get_cuobjdump.sh) &&
    cmake --preset cuda -B build/ci-cuda-cards -D GPU_RVE_LAMMPS=OFF -D GPU_RVE_BASELINE_KERNELS=OFF &&
    cmake --build build/ci-cuda-cards --target "$variant" &&
    CUOBJDUMP=$cuobjdump sh bench/strict_text.sh "build/ci-cuda-cards/$variant" &&
    architectures=$(sed -n 's/^GPU_RVE_CHOSEN_ARCHITECTURES:[A-Z]*=//p' build/ci-cuda-cards/CMakeCache.txt | tr ';' ':') &&
    CUOBJDUMP=$cuobjdump sh unittest/tools/cuda_code.sh . "$architectures" "build/ci-cuda-cards/$variant"
}
