#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Runs all checks for a machine with a GPU: builds (preset cuda), runs the tests of the CUDA engine
# with GPU_RVE_REQUIRE_CUDA=1 and the sanitizers, compares 50 steps of the footing on CPU and GPU
# bit for bit, and measures the throughput of disks and spheres and the engine at the extremes.
# Suite full also measures the costs of presets and the error against cost of the settings.
#
#   sh tools/gpu_check.sh                      builds here, results in bench/results
#   sh tools/gpu_check.sh --bin DIR --out DIR  uses existing programs; results go to DIR
#   ... --suite NAME                           of the benchmark: quick (less than a minute),
#                                              full, memory, ... (doc/src/dev_gpu_kernels.rst)
set -u
cd "$(dirname "$0")/.." || exit 1
root=$PWD
bin= out=$root/bench/results suite=quick
while [ $# -gt 0 ]; do
  case $1 in
    --bin) bin=$(cd "$2" && pwd); shift 2 ;;
    --out) mkdir -p "$2"; out=$(cd "$2" && pwd); shift 2 ;;
    --suite) suite=$2; shift 2 ;;
    *) echo "gpu_check: unknown argument $1"; exit 1 ;;
  esac
done
if [ -z "$bin" ]; then
  cmake --preset cuda && cmake --build --preset cuda || exit 1
  bin=$root/build/cuda/bin
fi
mkdir -p "$out"
export GPU_RVE_REQUIRE_CUDA=1
failed=0
step() { # step <name> <command...>
  name=$1
  shift
  echo "======== $name"
  if "$@"; then echo "-------- $name: passed"; else echo "-------- $name: FAILED"; failed=1; fi
}

for test in "$bin"/*_Cuda; do
  [ -x "$test" ] && step "$(basename "$test")" "$test" --gtest_brief=1
done
for test in engine_tests:test_backends engine_tests:test_rolling mpm_tests:test_mpm_backends; do
  [ -x "$bin/${test%:*}" ] && step "${test#*:}" "$bin/${test%:*}" "--file=${test#*:}" \
    --gtest_brief=1
done
# checks of the compiled kernels
# 77: there is no cuobjdump, or another compiler
skips() { "$@"; status=$?; [ $status = 77 ] || return $status; }
[ -x "$bin/bench_kernels" ] && step "uniform registers" skips sh bench/uniform_registers.sh \
  "$bin/bench_kernels"
if [ -d "$root/build/cuda" ] && [ "$bin" = "$root/build/cuda/bin" ]; then
  # shellcheck disable=SC2046  # a list of files
  step "strict texts" skips sh bench/strict_text.sh $(find "$root/build/cuda/src" -name '*.cu.o')
fi

# golden bits, which the CPU engine computed
[ -x "$bin/golden_bits" ] && step "golden bits" "$bin/golden_bits" --device cuda \
  --file "$root/unittest/golden/golden_bits.txt"

# The sanitizers run a small batch with rebuilds, lists that overflow, lattice reduction and
# failures, in all formats, programs and kernels. Processes divide the batch, since a sanitizer
# mostly rewrites kernels on a core of the host. Racecheck keeps the GPU busy, so its processes take
# turns: seven minutes in all, while ten at a time had not ended in five.
sanitize() { # sanitize <tool> <suite> <packing>
  case $1 in racecheck) parts=1 ;; *) parts=$((($(nproc) + 1) / 2)) ;; esac
  logs=$(mktemp -d) || return 1
  shared_out=
  for part in $(seq "$parts"); do
    compute-sanitizer --tool "$1" --error-exitcode 1 "$bin/bench_engine" \
      "examples/packings/$3.rve" /dev/null --device cuda --suite "$2" \
      --part "$part/$parts" >"$logs/$part" 2>&1 &
    shared_out="$shared_out $!"
  done
  clean=0
  for process in $shared_out; do wait "$process" || clean=1; done
  cat "$logs"/*
  rm -rf "$logs"
  return $clean
}
if command -v compute-sanitizer >/dev/null; then
  # Racecheck tests the threads of a block. The items of a phase are tested on a CPU too (preset
  # host-tsan).
  for test in test_block_Cuda test_verlet_list_Cuda test_pair_ownership_Cuda; do
    step "compute-sanitizer racecheck, $test" compute-sanitizer --tool racecheck \
      --error-exitcode 1 "$bin/$test" --gtest_brief=1
  done
  for tool in memcheck synccheck initcheck racecheck; do
    case $tool in racecheck) batch=races ;; *) batch=sanitize ;; esac    # racecheck takes very long
    for packing in A_h0075 S1000; do    # disks and spheres
      step "compute-sanitizer $tool, $packing" sanitize $tool $batch $packing
    done
  done
else
  echo "gpu_check: no compute-sanitizer here"
fi

# 50 steps of the footing on both backends must give the same bits of positions, stresses and curve.
footing() {
  work=$(mktemp -d) || return 1
  cp -r "$root/examples/footing" "$work/footing"
  cd "$work/footing" || return 1
  for device in cpu cuda; do
    mkdir "$device" && (cd "$device" && cp ../study.footing . &&
      echo 'write_rve grains atom 17 file rve.bits format rve' >> study.footing &&
      "$bin/lmp" -in study.footing -var device "$device" -var stop 50 -var out bits \
        -log none > log.txt 2>&1) || { tail -20 "$device/log.txt"; cd "$root"; return 1; }
  done
  cmp cpu/fields.bits cuda/fields.bits && cmp cpu/curve.bits cuda/curve.bits &&
    cmp cpu/rve.bits cuda/rve.bits
  same=$?
  cd "$root" && rm -rf "$work"
  return $same
}
step "50 footing steps, CPU and GPU alike" footing

GPU_RVE_COMMIT=$(git rev-parse --short HEAD 2>/dev/null)
export GPU_RVE_COMMIT
gpu=$(nvidia-smi --query-gpu=name --format=csv,noheader 2>/dev/null |
  sed -n '1{s/^NVIDIA //;s/ [0-9]*GB.*//;s/ /-/g;p}')
step "throughput" "$bin/bench_engine" examples/packings/A_h0075.rve \
  "$out/engine-${gpu:-gpu}-$suite.json" \
  --device cuda --suite "$suite" --seconds 0.3
step "throughput of spheres" "$bin/bench_engine" examples/packings/S1000.rve \
  "$out/engine-${gpu:-gpu}-spheres-$suite.json" \
  --device cuda --suite "$suite" --seconds 0.3
command -v ncu >/dev/null && step "profile" python3 bench/profile_pipes.py --bin "$bin" \
  --packing examples/packings/A_h0075.rve --out "$out/profile-${gpu:-gpu}.json" &&
  step "roofline" python3 bench/roofline.py "$out/profile-${gpu:-gpu}.json" \
    "$out/engine-${gpu:-gpu}-$suite.json"
command -v ncu >/dev/null && step "profile of spheres" python3 bench/profile_pipes.py --bin "$bin" \
  --packing examples/packings/S1000.rve \
  --out "$out/profile-${gpu:-gpu}-spheres.json" &&
  step "roofline of spheres" python3 bench/roofline.py "$out/profile-${gpu:-gpu}-spheres.json" \
    "$out/engine-${gpu:-gpu}-spheres-$suite.json"
# All scenes of a number format are one batch (doc/src/stability.rst); the whole length takes ten
# times as long.
case $suite in quick) percent=10 ;; *) percent=100 ;; esac
[ -x "$bin/extremes_report" ] &&
  step "stability at the extremes" "$bin/extremes_report" "$out/extremes-${gpu:-gpu}.json" \
    --device cuda --length $percent &&
  step "stability at the extremes, spheres" "$bin/extremes_report" \
    "$out/extremes-spheres-${gpu:-gpu}.json" --shape sphere --device cuda --length $percent

# The costs of presets with 9600 RVEs and the error against cost (doc/src/accuracy.rst) take
# minutes. 49 copies of eight packings are three RVEs for each of 132 multiprocessors, and eight for
# small packings of spheres.
if [ "$suite" = full ] && [ -x "$bin/bench_accuracy" ]; then
  step "cost of the presets" python3 bench/accuracy.py --bin "$bin" \
    --out "$out/accuracy-presets-${gpu:-gpu}.json" --device cuda --copies 1200 --presets
  step "error against cost" python3 bench/accuracy.py --bin "$bin" \
    --out "$out/accuracy-${gpu:-gpu}.json" --device cuda --copies 49
  step "cost of the presets, spheres" python3 bench/accuracy.py --shape sphere --bin "$bin" \
    --out "$out/accuracy-presets-spheres-${gpu:-gpu}.json" \
    --device cuda --copies 1200 --presets
  step "error against cost, spheres" python3 bench/accuracy.py --shape sphere --bin "$bin" \
    --out "$out/accuracy-spheres-${gpu:-gpu}.json" \
    --device cuda --copies 132
fi
exit $failed
