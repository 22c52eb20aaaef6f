#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Checks (or with --fix makes) the format of all C++ and CUDA code by .clang-format and the
# clang-format of Debian 12; other versions differ in details.
set -eu
cd "$(dirname "$0")/.."
clang_format=$(command -v clang-format-14 || command -v clang-format)
mode="--dry-run -Werror"
[ "${1:-}" = "--fix" ] && mode=-i
folders=src
for folder in unittest bench; do [ -d "$folder" ] && folders="$folders $folder"; done
# shellcheck disable=SC2086  # lists of words
find $folders \( -name '*.h' -o -name '*.cpp' -o -name '*.cu' -o -name '*.cuh' \) -print0 |
  xargs -0 -r "$clang_format" --style=file $mode
echo "check_format: in order"
