#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Tests the package that pip makes from pyproject.toml, without another compilation: its
# configuration needs neither LAMMPS nor FFTW nor the libraries of tests, and the installed files of
# this build work from their own folder.
#
#   package.sh <cmake> <repository> <build tree>
set -eu
cmake=$1 root=$2 build=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
defines=$(/usr/bin/python3 - "$root/pyproject.toml" <<'END'
import sys
import tomllib

with open(sys.argv[1], "rb") as file:
    settings = tomllib.load(file)["tool"]["scikit-build"]
assert settings["build"]["targets"] == ["librve"] and settings["install"]["components"] == ["python_package"], settings
print(" ".join(f"-D{name}={value}" for name, value in settings["cmake"]["define"].items()))
END
)
# shellcheck disable=SC2086  # a list of words
"$cmake" -G Ninja -S "$root" -B "$work/configured" -DGPU_RVE_CUDA=OFF \
  -DCMAKE_DISABLE_FIND_PACKAGE_FFTW3=ON \
  -DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON -DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON \
  $defines > "$work/log" 2>&1 || { cat "$work/log"; echo "FAILED: pip's configuration"; exit 1; }
"$cmake" --install "$build" --component python_package --prefix "$work/site" > /dev/null
cp "$root"/python/gpu_rve/*.py "$work/site/gpu_rve"
found=$(cd "$work/site/gpu_rve" && ls | sort | tr '\n' ' ')
case $found in *librve.h*librve.so*) ;; *) echo "FAILED: installed are $found"; exit 1 ;; esac
cd "$work/site"
env -u GPU_RVE_LIBRARY PYTHONPATH="$work/site" /usr/bin/python3 -m gpu_rve.check
