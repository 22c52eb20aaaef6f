# SPDX-License-Identifier: GPL-2.0-only
# Functions for scripts that make a Python environment, to be sourced.
#
#   venv_of <name> <modules> <packages> [--find] [modules without dependencies]
#       prints the interpreter of a virtual environment with these modules of pip's package index,
#       in the cache folder of get_lammps.sh. Makes it if it does not exist, with these packages
#       of the system; with --find it then prints nothing.
#
# `root` is the folder of the repository.

venv_of() {
  name=$1 modules=$2 packages=$3 find=${4:-} alone=${5:-}
  cache=${GPU_RVE_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/gpu_rve}
  folder=$cache/$name-python-$(echo "$modules $alone" | cksum | cut -d ' ' -f 1)
  if [ -x "$folder/bin/python" ] && [ -f "$folder/complete" ]; then
    echo "$folder/bin/python"
    return 0
  fi
  [ "$find" != "--find" ] || return 0
  . "$root/tools/packages.sh"
  # shellcheck disable=SC2086  # a list of words
  install_packages $packages >&2
  python=/usr/bin/python3
  [ -x "$python" ] || python=python3
  mkdir -p "$cache"
  rm -rf "$folder"
  "$python" -m venv "$folder" >&2
  # shellcheck disable=SC2086  # a list of words
  "$folder/bin/python" -m pip install -q --disable-pip-version-check $modules >&2
  # shellcheck disable=SC2086  # a list of words
  [ -z "$alone" ] || "$folder/bin/python" -m pip install \
    -q --disable-pip-version-check --no-deps $alone >&2
  touch "$folder/complete"
  echo "$folder/bin/python"
}
