#!/bin/sh
# The plugin in a plain LAMMPS: by `plugin load`, and by LAMMPS_PLUGIN_PATH, where the styles survive `clear`.
#
#   sh plugin.sh <lmp without the package> <gpurveplugin.so> <packing>
set -eu
lmp=$1 plugin=$2 packing=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

scene="units si
dimension 2
boundary f f p
atom_style sphere
region box block 0 1 0 1 -0.5 0.5
create_box 1 box
create_atoms 1 single 0.5 0.5 0.0
pair_style none
comm_modify cutoff 0.5
timestep 1e-4
fix grains all rve $packing drive velocity_gradient yy -0.05 dt 5e-5 device cpu
compute grains all rve/atom p q
fix phi all property/atom d_phi
random_field all d_phi covariance exponential lengths 0.5 0.5 spacing 0.1 0.1
run 1"

# without the plugin the style must be unknown, or the test shows nothing
echo "$scene" > in.without
if "$lmp" -in in.without -log none > out.without 2>&1; then echo "fix rve is known without the plugin"; exit 1; fi
grep -q "Unrecognized fix style 'rve'" out.without

{ echo "plugin load $plugin"; echo "$scene"; echo "write_rve grains atom 1 file loaded.rve format rve"; } > in.loaded
"$lmp" -in in.loaded -log none > out.loaded 2>&1 || { cat out.loaded; exit 1; }

{ echo clear; echo "$scene"; echo "write_rve grains atom 1 file path.rve format rve"; } > in.path
LAMMPS_PLUGIN_PATH=$(dirname "$plugin") "$lmp" -in in.path -log none > out.path 2>&1 || { cat out.path; exit 1; }
cmp loaded.rve path.rve
