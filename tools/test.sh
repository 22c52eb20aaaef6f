#!/bin/sh
# Builds everything and runs the tests; set-up as in footing.sh. Arguments go to ctest:
#
#   sh tools/test.sh                     all tests
#   sh tools/test.sh -L physics          those of one room
#
# GPU_RVE_REQUIRE_CUDA=1 turns a skipped GPU test, or a fallback to the CPU, into a failure.
. "$(dirname "$0")/setup.sh"

say "building"
cmake --build --preset "$preset"

say "testing"
exec ctest --preset "$preset" --parallel "$(nproc)" "$@"
