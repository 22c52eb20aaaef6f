#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Checks that the interface of librve is stable. Every function in the record of the present major
# version must be in the header as recorded, and every function of the header must be in the record,
# with the version that added it.
#
#   interface.sh <header> <record>
#
# A line of the record has version and prototype. A new function gets its own line with the next
# minor version. A changed or removed one needs the next major version and a new record.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
version() { sed -n "s/^#define RVE_API_$1 //p" "$2"; }
major=$(version MAJOR "$1")
minor=$(version MINOR "$1")
# Prototypes become one line each, without comments and with single blanks.
sed 's,/\*.*\*/,,' "$1" |
  awk '/^RVE_API / { on = 1; text = "" } on { text = text " " $0 } on && /;/ { print text; on = 0 }' |
  sed -E 's/^ *RVE_API +//; s/;.*//; s/ +/ /g' | sort > "$work/declared"
[ -s "$work/declared" ] || { echo "FAILED: no functions in $1"; exit 1; }
grep -v '^#' "$2" | sed -E 's/^[0-9.]+ //' | sort > "$work/recorded"
diff "$work/recorded" "$work/declared" || { echo "FAILED: < is recorded, > is in the header"
exit 1; }
grep -v '^#' "$2" | while read -r since rest; do
  [ "${since%.*}" = "$major" ] && [ "${since#*.}" -le "$minor" ] ||
    { echo "FAILED: $rest is of $since, and the header of $major.$minor"; exit 1; }
done
