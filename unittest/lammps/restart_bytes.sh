#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# A repeated run writes the same restart file: it contains nothing of the process, its memory or the
# time of day.
#
#   restart_bytes.sh <lmp>
set -eu
lmp=$1
work=$(mktemp -d "${TMPDIR:-/tmp}/restart_bytes.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"

cat > in.bytes <<'END_OF_SCRIPT'
units si
dimension 2
boundary p p p
atom_style atomic
region box block 0 4 0 4 -0.5 0.5
create_box 1 box
mass 1 1.0
create_atoms 1 single 0.5 0.5 0
create_atoms 1 single 2.5 0.5 0
timestep 1e-3
if "${shape} == disk" then "variable depth string 'thickness 0.075'" else "variable depth string ''"
create_rve few.rve shape ${shape} grains 60 seed 5 radius uniform 0.004 0.005 kn 1e6 friction 0.5 damping 0.3 density 2650 pressure 2e4 ${depth}
# The RVEs include one that fails and is replaced, one with a servo, and one with a shadow.
variable crush atom -400*(id==2)*(step==5)
group second id 2
fix g all rve few.rve drive velocity_gradient yy v_crush xy 0.1 dt 1e-5 policy fresh overlap_limit 0.1 shadow 1 energy yes device cpu threads 1
run 8
write_restart ${out}.rates
fix_modify g drive none servo xx -2e4 yy -2e4
run 4
write_restart ${out}.servo
END_OF_SCRIPT
for shape in disk sphere; do
  for out in one other; do
    "$lmp" -in in.bytes -var shape "$shape" -var out "$out" -log "$out.log" > "$out.out" 2>&1 ||
      { tail "$out.out"; exit 1; }
  done
  grep -q "a fresh RVE of packing" one.log || { echo "no RVE was replaced"; exit 1; }
  cmp one.rates other.rates
  cmp one.servo other.servo
done
echo "equal: restart files of two runs, of disks and of spheres"
