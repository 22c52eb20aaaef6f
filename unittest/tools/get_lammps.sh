#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Tests tools/get_lammps.sh with a stub of an archive: paths with blanks, and the check of unpacked
# trees.
#
#   sh get_lammps.sh <repository>
set -eu
repository=$1
top=$(mktemp -d)
trap 'rm -rf "$top"' EXIT
work="$top/a folder with blanks"
mkdir -p "$work/bin" "$work/parts" "$work/upstream/lammps-x/src/GRANULAR" \
  "$work/upstream/lammps-x/src/fmt" "$work/upstream/lammps-x/src/PLUGIN" \
  "$work/upstream/lammps-x/src/STUBS" "$work/upstream/lammps-x/cmake" \
  "$work/upstream/lammps-x/python/lammps"
fail() { echo "FAILED: $*"; exit 1; }

# a tarball like that of LAMMPS, and a copy of the script with its checksum
(cd "$work/upstream/lammps-x" && for file in LICENSE src/version.h src/modify.cpp \
  src/.clang-format src/GRANULAR/a.h src/fmt/b.h src/PLUGIN/c.h \
  src/STUBS/d.h cmake/CMakeLists.txt python/lammps/__init__.py; do echo "$file" > "$file"; done)
tar -cJf "$work/upstream/tarball" -C "$work/upstream" lammps-x
sum=$(sha256sum < "$work/upstream/tarball" | cut -d' ' -f1)
touch "$work/keyring"
sed -e "s/^sha256=.*/sha256=$sum/" -e "s|^keyring=.*|keyring='$work/keyring'|" \
  "$repository/tools/get_lammps.sh" > "$work/get_lammps.sh"
grep -q "^sha256=$sum" "$work/get_lammps.sh" || fail "the script has no line sha256="

# Stub of apt: prints the files with sources, records its calls, and provides the tarball if the
# given folders exist.
echo "deb http://archive.example/debian stable main" > "$work/sources.list"
cat > "$work/bin/apt-config" <<END
#!/bin/sh
echo "parts='$work/parts' list='$work/sources.list'"
END
cat > "$work/bin/apt-get" <<END
#!/bin/sh
echo "\$#" >> '$work/calls'
for word; do
  case \$word in Dir::State::Lists=*) [ -d "\${word#*=}" ] || exit 3 ;; Dir::Etc::sourcelist=*) [ -f "\${word#*=}" ] || exit 4 ;; esac
  [ "\$word" != source ] || cp '$work/upstream/tarball' lammps_20250204+dfsg.1.orig.tar.xz
done
END
chmod +x "$work/bin/apt-config" "$work/bin/apt-get"
PATH="$work/bin:$PATH"
export PATH
GPU_RVE_CACHE="$work/the cache"
export GPU_RVE_CACHE
tree="$GPU_RVE_CACHE/lammps-20250204"

get() {    # get <name>: runs the script and expects a complete tree
  : > "$work/calls"
  answer=$(sh "$work/get_lammps.sh" 2> "$work/said") || { cat "$work/said"
  fail "$1: the script ends with an error"; }
  [ "$answer" = "$tree" ] || fail "$1: the answer is '$answer'"
  [ "$(cat "$tree/src/modify.cpp")" = src/modify.cpp ] ||
    fail "$1: src/modify.cpp is not that of the tarball"
  [ -f "$tree/cmake/CMakeLists.txt" ] || fail "$1: cmake/CMakeLists.txt is missing"
  [ -z "$(find "$GPU_RVE_CACHE" -name 'get.*')" ] || fail "$1: a work folder is left"
}
asked() { [ -s "$work/calls" ]; }
unpacked() { grep -q unpacking "$work/said"; }

get "a new cache"
asked || fail "a new cache: nobody was asked"
get "a whole tree"
if asked || unpacked; then fail "a whole tree: it was not trusted"; fi

echo "src/modify.cp?" > "$tree/src/modify.cpp"
get "a file that differs"
if asked; then fail "a file that differs: the tarball is there already"; fi
[ "$(cat "$tree.untrusted/src/modify.cpp")" = "src/modify.cp?" ] ||
  fail "a file that differs: the old tree is lost"
rm "$tree/cmake/CMakeLists.txt"
get "a missing file"
echo more > "$tree/src/more.cpp"
get "another file"
[ ! -e "$tree/src/more.cpp" ] || fail "another file: it is still there"

rm -r "$tree/python"
(cd "$tree" && echo "$sum" && find . -type f ! -path ./.gpu_rve_stamp -print0 | LC_ALL=C sort -z |
  xargs -0 sha256sum) | sha256sum > "$work/stamp"
mv "$work/stamp" "$tree/.gpu_rve_stamp"
get "a whole tree of a time without the Python module"
[ -f "$tree/python/lammps/__init__.py" ] || fail "the Python module is missing"

rm "$tree"/.gpu_rve_stamp
get "a tree without a stamp"
unpacked || fail "a tree without a stamp: it was trusted"
rm -rf "$tree"
mkdir -p "$tree/src"
touch "$tree/src/version.h"
get "a tree of one file"

rm -rf "$tree"
echo damage >> "$GPU_RVE_CACHE/lammps_20250204+dfsg.1.orig.tar.xz"
get "a damaged tarball"
asked || fail "a damaged tarball: it was used"
echo "get_lammps: in order"
