#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Checks that LAMMPS scripts of the repository redefine no string variable from itself in quotes.
# LAMMPS of 2026 deletes the variable before it reads the new text ("Substitution for illegal
# variable"); without quotes the name is replaced earlier.
#
#   sh string_variables.sh <repository>
set -eu
cd "$1"
found=$(mktemp)
trap 'rm -f "$found"' EXIT
search() { grep -nE "variable +([a-zA-Z_0-9]+) +(string|index) +[\"'][^\"']*[$]\{?\1\b" \
  "$@" > "$found"; }

# test of the search itself
printf 'variable a string "${b} ${a}"\n' > "$found.bad"
printf 'variable a string ${a}_2\nvariable a string "${ab} ${b}"\n' > "$found.good"
trap 'rm -f "$found" "$found.bad" "$found.good"' EXIT
search "$found.bad" || { echo "the search does not find what it is for"; exit 1; }
if search "$found.good"; then echo "the search finds what is in order"; exit 1; fi

find examples bench doc/src unittest \( -name 'in.*' -o -name '*.rst' \) -type f > "$found.good"
set --
while read -r file; do set -- "$@" "$file"; done < "$found.good"
[ $# -gt 20 ] || { echo "only $# scripts in $(pwd)"; exit 1; }
if search "$@"; then
  cat "$found"
  exit 1
fi
echo "string_variables: in order, $# files"
