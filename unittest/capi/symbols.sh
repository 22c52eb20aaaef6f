#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Checks that a library exports exactly the functions of its header.
#
#   symbols.sh <library> <header>
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
nm -D --defined-only "$1" |
  awk '$2 == "T" || $2 == "D" || $2 == "B" || $2 == "V" || $2 == "W" { sub(/@.*/, "", $3); print $3 }' | sort -u > "$work/defined"
grep -oE '^RVE_API [^(]*\(' "$2" | sed -E 's/.*[ *](rve_[a-z_]+)\($/\1/' |
  sort -u > "$work/declared"
[ -s "$work/declared" ] || { echo "FAILED: no functions in $2"; exit 1; }
diff "$work/declared" "$work/defined" || { echo "FAILED: < is declared, > is defined"; exit 1; }
