#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Prints the path of cuobjdump with nvdisasm next to it: that of the CUDA toolkit or, if the toolkit
# lacks it, that of the Python package index, which is installed in a virtual environment in
# build/cuobjdump.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
for found in "${CUOBJDUMP:-}" "$(command -v cuobjdump || true)" /usr/local/cuda/bin/cuobjdump; do
  if [ -n "$found" ] && [ -x "$found" ]; then echo "$found"; exit 0; fi
done
folder=$root/build/cuobjdump
program() { find "$folder" -name cuobjdump -type f 2>/dev/null | head -n 1; }
if [ -z "$(program)" ] || [ ! -e "$(dirname "$(program)")/nvdisasm" ]; then
  . "$root/tools/packages.sh"
  # Debian's own Python has the package for virtual environments.
  python=$(command -v /usr/bin/python3 || command -v python3)
  install_packages python3-venv >&2
  rm -rf "$folder"
  "$python" -m venv "$folder" >&2
  "$folder/bin/python" -m pip install -q --disable-pip-version-check nvidia-cuda-cuobjdump \
    nvidia-cuda-nvdisasm >&2
  chmod +x "$(program)" "$(dirname "$(program)")/nvdisasm"
fi
program
