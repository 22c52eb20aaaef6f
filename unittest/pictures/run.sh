#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Runs examples/pictures shortly, and an RVE of spheres.
#
#   run.sh <lmp> <root of the project> <folder to write in>
set -eu
lmp=$1 root=$2 folder=$3
rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
"$lmp" -in "$root/examples/pictures/in.pictures" -var packing \
  "$root/examples/packings/A_h0075.rve" -var steps 40 -var frames 4 \
  -var speed 2 > out 2>&1 || { tail -20 out; exit 1; }
"$lmp" -in "$root/unittest/pictures/in.spheres" -var packing \
  "$root/examples/packings/S500.rve" > out.spheres 2>&1 || { tail -20 out.spheres; exit 1; }
"$lmp" -in "$root/unittest/pictures/in.read_spheres" > out.read 2>&1 || { tail -20 out.read
exit 1; }
ls -- *.dump
