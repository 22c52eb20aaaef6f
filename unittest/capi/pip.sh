#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Follows the manual's instructions for the Python package: a clean virtual environment, pip install
# of the repository, the command that tests the package, the cells of a notebook, and types, without
# files of this build. The engine is for CPUs only, since that of a GPU takes minutes.
#
#   pip.sh <repository> <C++ compiler> <C compiler> <GPU_RVE_BASELINE_KERNELS>
#
# The exit status is 77 (skipped) without a virtual environment or the package index, unless
# GPU_RVE_REQUIRE_PICTURES=1. The kernels are compiled again unless a compiler cache
# (CMAKE_CXX_COMPILER_LAUNCHER=ccache) has them.
set -eu
root=$1
export CXX="$2" CC="$3"    # the compilers of the tests, not those of Python
work=$(mktemp -d)
trap 'rm -rf "$work" "$root/build/pip"' EXIT
unset GPU_RVE_LIBRARY PYTHONPATH
export PYTHONDONTWRITEBYTECODE=1 MPLBACKEND=Agg PIP_DISABLE_PIP_VERSION_CHECK=1

cannot() {
  cat "$work/log"
  echo "$1"
  [ "${GPU_RVE_REQUIRE_PICTURES:-0}" = 1 ] && exit 1
  exit 77
}
if [ -z "${CMAKE_CXX_COMPILER_LAUNCHER:-}" ] && command -v ccache > /dev/null
then export CMAKE_CXX_COMPILER_LAUNCHER=ccache; fi
/usr/bin/python3 -m venv "$work/venv" > "$work/log" 2>&1 || cannot "there is no virtual environment"
python=$work/venv/bin/python
# Downloads come first, before the package can fail.
"$python" -m pip install -q cffi numpy matplotlib "scikit-build-core>=0.10" > "$work/log" 2>&1 ||
  cannot "the package index cannot be had"

# These flags and this folder call the compiler as for the tests, so that the compiler cache has the
# kernels.
"$python" -m pip install -q --no-build-isolation --config-settings=cmake.define.GPU_RVE_CUDA=OFF \
  --config-settings=cmake.define.GPU_RVE_WERROR=ON \
  --config-settings=cmake.define.GPU_RVE_BASELINE_KERNELS="$4" \
  --config-settings=cmake.define.GPU_RVE_QUICK_KERNELS= \
  --config-settings=build-dir="$root/build/pip" "$root" > "$work/log" 2>&1 || {
  cat "$work/log"
  echo "FAILED: pip install"
  exit 1
}

cd "$work"
"$work/venv/bin/gpu-rve-check"
"$python" - "$root/examples/notebooks/biaxial.ipynb" <<'END'
import json
import os
import pathlib
import sys

import gpu_rve

folder = pathlib.Path(gpu_rve.__file__).parent
assert folder.is_relative_to(sys.prefix), folder
assert (folder / "py.typed").exists(), "py.typed is not installed: the package would not count as typed"
notebook = pathlib.Path(sys.argv[1])
cells = ["".join(cell["source"]) for cell in json.loads(notebook.read_text())["cells"] if cell["cell_type"] == "code"]
assert cells
os.chdir(notebook.parent)
names = {}
for cell in cells:    # test_notebooks.py tests their output
    exec("\n".join(line for line in cell.splitlines() if not line.startswith("%")), names)
print(len(cells), "cells of", notebook.name)
END
