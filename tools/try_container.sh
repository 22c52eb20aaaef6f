#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Builds the image of the Dockerfile with buildah, which needs no daemon, and runs the README's
# commands in it. To be run by root on Debian; about 20 minutes on two cores.
#
#   sh tools/try_container.sh [options of buildah build]
#
# If the registry of the base image cannot be reached, debootstrap makes the image from the archive
# of this machine's apt configuration. The images stay: `buildah images` lists them.
set -eu
cd "$(dirname "$0")/.."
. tools/packages.sh
install_packages buildah golang-github-containers-common debootstrap
export BUILDAH_ISOLATION=chroot STORAGE_DRIVER=vfs

base=$(sed -n 's/^FROM \([^ ]*\) .*/\1/p' Dockerfile | head -n 1)
if ! buildah inspect --type image "$base" >/dev/null 2>&1 && ! buildah pull -q "$base"; then
  uri=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' |
    head -n 1)
  root=$(mktemp -d)
  trap 'rm -rf "$root"' EXIT
  debootstrap --variant=minbase bookworm "$root/debian" "$uri"
  container=$(buildah from scratch)
  buildah add -q "$container" "$root/debian" /
  buildah commit -q --rm "$container" "$base"
fi

buildah build -q --network host "$@" -t gpu_rve .
container=$(buildah from gpu_rve)
in_image() { echo "== $*"; buildah run "$container" -- "$@"; }
in_image lmp -in in.first
in_image mpirun -np 2 --oversubscribe lmp -in in.first
in_image gpu-rve-check
buildah rm "$container" >/dev/null
