#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Builds the image of the Dockerfile with podman, which needs no daemon, and runs the commands of the
# README in it. To be run by root on Debian 12; about 20 minutes on two cores.
#
#   sh tools/try_container.sh [options of podman build]
#
# If the registry of the base image cannot be reached, debootstrap makes that image from the archive
# of this machine's apt configuration. CONTAINERS_CONF can name a file with settings of podman that
# a machine needs. `podman image rm gpu_rve` removes the image.
set -eu
cd "$(dirname "$0")/.."
. tools/packages.sh
install_packages podman debootstrap

base=$(sed -n 's/^FROM \([^ ]*\) AS build$/\1/p' Dockerfile)
if ! podman image exists "$base" && ! podman pull -q "$base"; then
  # shellcheck disable=SC2016  # fields of apt-get
  archive=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' \
    'Codename: bookworm' | head -n 1)
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  debootstrap --variant=minbase bookworm "$work/debian" "$archive"
  tar -C "$work/debian" -c . | podman import -q - "$base"
fi

podman build -t gpu_rve "$@" .
in_image() { echo "== $*"; podman run --rm gpu_rve "$@"; }
in_image lmp -in in.first
in_image mpirun -np 2 --oversubscribe lmp -in in.first
in_image gpu-rve-check
