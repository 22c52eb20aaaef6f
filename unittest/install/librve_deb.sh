#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Tests the Debian package of librve: cpack makes it, dpkg unpacks it in an empty folder, and a C
# program uses it there.
#
#   librve_deb.sh <cmake> <cpack> <build tree> <folder to work in> <the project> <packing>
set -eu
cmake=$1 cpack=$2 build=$3 home=$4 consumer=$5 packing=$6
fail() { echo "FAILED: $*"; exit 1; }
for tool in dpkg dpkg-deb dpkg-shlibdeps pkg-config; do
  command -v $tool > /dev/null || { echo "there is no $tool here"; exit 77; }
done

work=$home/deb
rm -rf "$work"
mkdir -p "$work"
cd "$work"
"$cpack" --config "$build/CPackConfig.cmake" -B "$work" > cpack.log 2>&1 || { cat cpack.log
fail "cpack"; }
package=$(ls "$work"/librve_*.deb)
[ "$(echo "$package" | wc -l)" = 1 ] || fail "these are several packages: $package"

echo "== what is in it"
dpkg-deb -I "$package" > info.txt
for line in 'Package: librve' 'Depends: .*libc6' 'Description: granular packings'; do
  grep -q "^ $line" info.txt || { cat info.txt; fail "the package does not say $line"; }
done
dpkg-deb -c "$package" > files.txt
for file in usr/include/librve.h librve.so librve.so.1 pkgconfig/librve.pc; do
  grep -q "/$file\$\|/$file -> " files.txt || { cat files.txt; fail "there is no $file"; }
done
if grep -E 'bin/|lammps|gpurve' files.txt; then fail "these are no files of librve"; fi
# The library must not contain paths of this machine.
dpkg-deb -x "$package" unpacked
if grep -rlE "$build" unpacked > found.txt
then fail "these know where they were built: $(cat found.txt)"; fi

echo "== unpacked in an empty folder"
root=$work/root
mkdir -p "$root/var/lib/dpkg/info" "$root/var/lib/dpkg/updates"
: > "$root/var/lib/dpkg/status"
if [ "$(id -u)" = 0 ]; then
  # The package is not installed, since the folder has neither ldconfig nor the dependencies.
  dpkg --root="$root" --force-depends --unpack "$package" > dpkg.log 2>&1 || { cat dpkg.log
  fail "dpkg --unpack"; }
  dpkg --root="$root" -L librve > files.txt
  grep -q '/librve.h$' files.txt || fail "dpkg does not know the files of librve"
else
  dpkg-deb -x "$package" "$root"
fi

echo "== a program in C"
libraries=$(dirname "$(find "$root/usr" -name librve.so)")
PKG_CONFIG_LIBDIR="$libraries/pkgconfig" pkg-config --cflags --libs librve > flags.txt
# shellcheck disable=SC2046  # a list of words
cc -std=c99 -pedantic-errors -Wall -Werror "$consumer/c_host.c" -o c_host $(cat flags.txt) -lm ||
  fail "cc with $(cat flags.txt)"
LD_LIBRARY_PATH="$libraries" ./c_host "$packing" || fail "the program"

echo "== a project that has C alone"
mkdir project
cat > project/CMakeLists.txt <<'END_OF_PROJECT'
cmake_minimum_required(VERSION 3.25)
project(host LANGUAGES C)
find_package(gpu_rve 0.1 REQUIRED)
add_executable(host "${SOURCE}")
target_link_libraries(host PRIVATE gpu_rve::librve m)
END_OF_PROJECT
"$cmake" -S project -B project/build -D "SOURCE=$consumer/c_host.c" \
  -D "CMAKE_PREFIX_PATH=$root/usr" > project.log 2>&1 &&
  "$cmake" --build project/build >> project.log 2>&1 || { cat project.log
  fail "the project does not build"; }
project/build/host "$packing" > host.txt || fail "its program"
echo "librve_deb: in order"
rm -rf "$work"
