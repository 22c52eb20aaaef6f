#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Builds everything and runs the tests; the set-up is that of footing.sh. Arguments go to ctest.
#
#   sh tools/test.sh                     all tests
#   sh tools/test.sh -L physics          those of one folder
#
# The tests of pictures (-L pictures) open results with OVITO and VTK. sh tools/pictures_python.sh
# makes a Python with them (400 MB); without it these tests are skipped, unless
# GPU_RVE_REQUIRE_PICTURES=1. GPU_RVE_REQUIRE_CUDA=1 turns a skipped GPU test, or a fallback to the
# CPU, into a failure.
stages=4
. "$(dirname "$0")/setup.sh"

say "3 of $stages: building everything, which is long the first time; Ninja counts"
cmake --build --preset "$preset"

say "4 of $stages: testing"
exec ctest --preset "$preset" --parallel "$(nproc)" "$@"
