# SPDX-License-Identifier: GPL-2.0-only
# Checks that tests of scripts share; to be sourced (`. checks.sh`), not run.

# within <value> <least> <largest> <what>: ends the test if the value is outside
within() {
  awk -v value="$1" -v least="$2" -v largest="$3" \
    'BEGIN {exit value >= least && value <= largest ? 0 : 1}' ||
    { echo "FAILED: $4 is $1, not from $2 to $3"; exit 1; }
  echo "ok $4: $1"
}
