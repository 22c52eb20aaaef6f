#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Builds the manual as HTML in build/doc and opens it in the browser, or prints where it is.
set -eu
cd "$(dirname "$0")/.."
. tools/packages.sh
install_packages python3-sphinx python3-sphinx-rtd-theme libjs-mathjax python3-numpy python3-cffi
python=$(command -v /usr/bin/python3 || command -v python3)
"$python" -m sphinx -q -b html doc/src build/doc
page=$PWD/build/doc/index.html
echo "== the manual: $page"
if [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ] && command -v xdg-open >/dev/null; then
  xdg-open "$page"
fi
