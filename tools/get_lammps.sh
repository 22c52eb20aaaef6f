#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Obtains the LAMMPS source with which this package is built and tested, and prints its folder (last
# line of stdout).
#
#   sh tools/get_lammps.sh
#
# The source is Debian 13's source package of LAMMPS 4Feb2025, from the Debian archive of this
# machine's apt configuration; the script contacts no other host. It does not change the system
# (private package lists, no root needed). An existing tree can be given to CMake as -D
# LAMMPS_SOURCE_DIR=<tree> instead.
set -eu

version=20250204+dfsg.1-2
tarball=lammps_20250204+dfsg.1.orig.tar.xz
sha256=3671165bd52fad36734e0a9136c5bc5ecb225e03988f8c89aa13366a8b53b1c7
suite=trixie
keyring=/usr/share/keyrings/debian-archive-keyring.gpg

cache=${GPU_RVE_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/gpu_rve}
tree=$cache/lammps-20250204

say() { echo "get_lammps: $*" >&2; }
die() { say "$*"; exit 1; }

# The stamp of a complete tree has the tarball and the contents of its files. It is written last.
stamp=.gpu_rve_stamp
contents() {    # contents <tree>
  (cd "$1" && echo "$sha256" && find . -type f ! -path "./$stamp" -print0 | LC_ALL=C sort -z |
    xargs -0 sha256sum) | sha256sum
}
if [ -f "$tree/python/lammps/__init__.py" ] && [ -f "$tree/$stamp" ] &&
  [ "$(cat "$tree/$stamp")" = "$(contents "$tree")" ]; then
  echo "$tree"
  exit 0
fi

# The first archive of the machine's apt configuration that has a release (without security, updates
# and backports) with component main, in both forms of configuration: deb822 (*.sources) and
# one-line (sources.list, *.list).
archive_uri() {
  eval "$(apt-config shell parts Dir::Etc::sourceparts/d list Dir::Etc::sourcelist/f)"
  for file in "$parts"/*.sources; do
    [ -f "$file" ] && cat "$file" && echo
  done | awk '
    function stanza_end() {
      if (enabled && uris != "" && (" " components " ") ~ / main / && suites !~ /^[^ ]*(-security|-updates|-backports|\/)/) {
        split(uris, uri, " "); print uri[1]
      }
      enabled = 1; uris = suites = components = field = ""
    }
    BEGIN { enabled = 1 }
    /^#/ { next }
    /^[ \t]*$/ { stanza_end(); next }
    /^[^ \t]/ { field = tolower($1); sub(/:.*/, "", field); sub(/^[^:]*:[ \t]*/, "") }
    { sub(/^[ \t]+/, "")
      if (field == "uris") uris = uris $0 " "
      else if (field == "suites") suites = suites $0 " "
      else if (field == "components") components = components $0 " "
      else if (field == "enabled" && tolower($0) ~ /^no/) enabled = 0 }
    END { stanza_end() }'
  for file in "$list" "$parts"/*.list; do
    [ -f "$file" ] && cat "$file" && echo
  done | awk '
    $1 == "deb" || $1 == "deb-src" {
      sub(/^[^ \t]+[ \t]+/, ""); sub(/^\[[^]]*\][ \t]*/, "")
      if ($1 !~ /^cdrom:/ && $2 !~ /-security|-updates|-backports|\// && (" " $0 " ") ~ / main /) print $1
    }'
}

fetch() {
  command -v apt-get >/dev/null ||
    die "no apt-get here; give a LAMMPS tree (4Feb2025 or newer) with -D LAMMPS_SOURCE_DIR=<tree>"
  [ -f "$keyring" ] || die "$keyring is missing: install the package debian-archive-keyring"
  archive_uri | awk '!seen[$0]++' > "$work/archives"
  [ -s "$work/archives" ] ||
    die "the apt configuration names no Debian archive; give a LAMMPS tree with -D LAMMPS_SOURCE_DIR=<tree>"
  mkdir -p "$work/lists/partial" "$work/archive/partial"
  while read -r uri; do
    echo "deb-src [signed-by=$keyring] $uri $suite main" > "$work/sources.list"
    set -- apt-get -q -o "Dir::State::Lists=$work/lists" \
      -o "Dir::Etc::sourcelist=$work/sources.list" -o Dir::Etc::sourceparts=/dev/null \
      -o "Dir::Cache=$work/archive" -o Debug::NoLocking=1 -o "APT::Sandbox::User=$(id -un)" \
      -o Acquire::Languages=none
    say "asking the machine's archive for LAMMPS $version (132 MB)"
    if (cd "$work" && "$@" -o APT::Update::Error-Mode=any update &&
      "$@" source --tar-only --download-only --only-source "lammps=$version") >&2; then
      return 0
    fi
  done < "$work/archives"
  die "no archive of the apt configuration gave LAMMPS $version (suite $suite)"
}

checked() { [ -f "$1" ] && [ "$(sha256sum < "$1")" = "$sha256  -" ]; }

mkdir -p "$cache"
work=$(mktemp -d "$cache/get.XXXXXX")
trap 'rm -rf "$work"' EXIT
trap 'exit 1' HUP INT TERM

if ! checked "$cache/$tarball"; then
  fetch
  checked "$work/$tarball" || die "$tarball is not the file that is expected (sha256)"
  mv "$work/$tarball" "$cache/$tarball"
fi

# Only the files that the build reads are unpacked: the core, the enabled packages, the Python
# module, LAMMPS' licence and format file. They are unpacked next to their final place and moved
# there when complete, so that an interruption leaves no incomplete tree.
say "unpacking"
mkdir "$work/tree"
tar -xJf "$cache/$tarball" -C "$work/tree" --strip-components=1 \
  --wildcards --no-wildcards-match-slash \
  '*/LICENSE' '*/src/*.h' '*/src/*.cpp' '*/src/.clang-format' '*/src/fmt' '*/src/GRANULAR' \
  '*/src/PLUGIN' '*/src/STUBS' '*/cmake' \
  '*/python/lammps'
[ -f "$work/tree/src/version.h" ] && [ -f "$work/tree/cmake/CMakeLists.txt" ] ||
  die "the tarball is not a LAMMPS tree"
contents "$work/tree" > "$work/stamp"
mv "$work/stamp" "$work/tree/$stamp"
if [ -e "$tree" ]; then
  # The tree is damaged, changed, from another tarball, or without a stamp or the Python module.
  say "$tree is not what the tarball has: it becomes $tree.untrusted"
  rm -rf "$tree.untrusted"
  mv "$tree" "$tree.untrusted"
fi
mv "$work/tree" "$tree"
echo "$tree"
