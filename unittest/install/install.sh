#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Runs `cmake --install` with a DESTDIR and tests the result in another place than it was installed
# for: lmp with an example, the plugin in a plain LAMMPS, the Python module, and a project that
# finds the CMake package.
#
#   install.sh <cmake> <build tree> <folder to work in> <the project> <C++ compiler>
#              <name of the folder of libraries> <lmp without the package> <python> <repository>
set -eu
cmake=$1 build=$2 home=$3 consumer=$4 compiler=$5 lib=$6 lmp_plain=$7 python=$8 repository=$9
fail() { echo "FAILED: $*"; exit 1; }

work=$home/work
rm -rf "$work"
mkdir -p "$work"
cd "$work"
unset LAMMPS_PLUGIN_PATH LD_LIBRARY_PATH PYTHONPATH

DESTDIR="$work/stage" "$cmake" --install "$build" --prefix /opt/gpu_rve > install.log 2>&1 ||
  { tail -20 install.log; fail "cmake --install"; }
[ "$(ls stage)" = opt ] || fail "something was installed outside of the prefix: $(ls stage)"
prefix="$work/a prefix"
mv stage/opt/gpu_rve "$prefix"
if grep -rlE "$build|$work" "$prefix" > found.txt
then fail "these know where they were built or installed: $(cat found.txt)"; fi

echo "== all examples are there, and nothing that runs have left"
if git -C "$repository" rev-parse --git-dir > found.txt 2>&1; then
  (cd "$repository" && git ls-files --cached --others --exclude-standard examples) |
    sort > in_repository.txt
  (cd "$prefix/share/gpu_rve" && find examples -type f) | sort > installed.txt
  diff in_repository.txt installed.txt ||
    fail "these files differ; cmake/Install.cmake says which names are installed"
fi

echo "== lmp, an example"
[ -f "$prefix/share/gpu_rve/packings/A_h0075.rve" ] || fail "no packings"
cp -r "$prefix/share/gpu_rve/examples" .
(cd examples/element_tests && "$prefix/bin/lmp_gpu_rve" -in in.element -var out installed \
  -log none > out.txt 2>&1) || { tail examples/element_tests/out.txt; fail "lmp_gpu_rve"; }
mkdir -p reference/element_tests
cp -r "$prefix/share/gpu_rve/examples/packings" reference
cp "$prefix/share/gpu_rve/examples/element_tests/in.element" reference/element_tests
(cd reference/element_tests && "$build/bin/lmp" -in in.element -var out installed \
  -log none > out.txt 2>&1)
cmp examples/element_tests/curve.installed reference/element_tests/curve.installed ||
  fail "the curve is not that of lmp in the build tree"
cp -r "$prefix/share/gpu_rve/tools" .
if /usr/bin/python3 -c 'import matplotlib, numpy' 2> /dev/null; then
  (cd examples/random_field && "$prefix/bin/lmp_gpu_rve" -in in.random_field \
    -log none > out.txt 2>&1 && /usr/bin/python3 plot_random_field.py &&
    [ -s random_field.png ]) || fail "the plot of an example"
fi
"$prefix/bin/lmp_gpu_rve" -h > help.txt
grep -qw GPU_RVE help.txt || fail "lmp_gpu_rve -h does not list the package"

echo "== the plugin"
cat > in.plugin <<'END_OF_SCRIPT'
info styles fix
END_OF_SCRIPT
LAMMPS_PLUGIN_PATH="$prefix/$lib/gpu_rve" "$lmp_plain" -in in.plugin -log none > plugin.txt 2>&1 ||
  { cat plugin.txt; fail "lmp with the plugin"; }
grep -q "Loaded 1 plugins" plugin.txt || { cat plugin.txt; fail "the plugin was not loaded"; }

if [ -n "$python" ]; then
  echo "== the Python module"
  (cd examples/python && PYTHONPATH="$prefix/$lib/gpu_rve/python" "$python" cyclic_shear.py &&
    [ -s cyclic_shear.txt ]) || fail "the example in Python"
fi

echo "== a host in C, by pkg-config"
libdir=$(dirname "$(find "$prefix" -name librve.pc)")/..
if command -v pkg-config > /dev/null; then
  flags=$(PKG_CONFIG_PATH="$libdir/pkgconfig" pkg-config --cflags --libs librve) ||
    fail "pkg-config does not know librve"
  sh -c "cc \"$consumer/c_host.c\" -o c_host $(echo "$flags" | sed 's/a prefix/a\\ prefix/g')" ||
    fail "cc with the flags of pkg-config: $flags"
  LD_LIBRARY_PATH="$libdir" ./c_host "$prefix/share/gpu_rve/packings/A_h0075.rve"
fi

echo "== a project that finds the package"
"$cmake" -S "$consumer" -B consumer "-DCMAKE_PREFIX_PATH=$prefix" \
  "-DCMAKE_CXX_COMPILER=$compiler" > consumer.log 2>&1 &&
  "$cmake" --build consumer >> consumer.log 2>&1 || { cat consumer.log
  fail "the project does not build"; }
consumer/consumer "$prefix/share/gpu_rve/packings/A_h0075.rve"
consumer/c_host "$prefix/share/gpu_rve/packings/A_h0075.rve"
consumer/through_lammps
echo "install: in order"
rm -rf "$work"
