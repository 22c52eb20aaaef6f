#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Configures the files of the repository, unpacked elsewhere and without git, and builds a library.
#
#   source_archive.sh <cmake> <repository> <folder to work in> <C++ compiler>
#                     <LAMMPS tree, or empty>
set -eu
cmake=$1 repository=$2 home=$3 compiler=$4 lammps=$5
work=$home/archive
rm -rf "$work"
mkdir -p "$work/gpu_rve" "$work/bin"
cd "$work"

# The files are those of `git archive` with uncommitted changes; in a source archive they are all
# files.
if git -C "$repository" rev-parse --git-dir > /dev/null 2>&1; then
  (cd "$repository" && git ls-files -z --cached --others --exclude-standard) > files
else
  (cd "$repository" && find . -path ./build -prune -o -type f -print0) > files
fi
# git lists deleted files that are not committed.
(cd "$repository" && xargs -0 sh -c 'for file; do [ -e "$file" ] && printf "%s\0" "$file"; done' \
  sh) < files > there
tar -C "$repository" --null -T there -cf gpu_rve.tar
tar -xf gpu_rve.tar -C gpu_rve

# all programs of the PATH except git
echo "$PATH" | tr ':' '\n' | while read -r folder; do ln -s "$folder"/* bin/ 2> errors || true; done
rm -f bin/git bin/git-*
PATH="$work/bin"
export PATH
if git --version > /dev/null 2>&1; then echo "FAILED: git is still there"; exit 1; fi

"$cmake" -S gpu_rve -B build -G Ninja -D "CMAKE_CXX_COMPILER=$compiler" -D GPU_RVE_CUDA=OFF \
  ${lammps:+-D "LAMMPS_SOURCE_DIR=$lammps"} > log 2>&1 &&
  "$cmake" --build build --target field gpurveplugin -- -n >> log 2>&1 &&
  "$cmake" --build build --target field >> log 2>&1 || { cat log; echo "FAILED: see above"
  exit 1; }
rm -rf "$work"
echo "source_archive: in order"
