#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Tests the plugin in a plain LAMMPS: by `plugin load`, and by LAMMPS_PLUGIN_PATH, where the styles
# survive `clear`. Plugins built for another kind of LAMMPS must end the run.
#
#   sh plugin.sh <lmp without the package> <gpurveplugin.so> <packing>
#                <folder of the plugins for other LAMMPS>
set -eu
lmp=$1 plugin=$2 packing=$3 others=$4
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
compute contacts all rve/contact/local id1 id2 fn
compute tangent all rve/tangent shear
dump contacts all local 1 contacts.dump c_contacts[*]
dump grains all rve/grain 1 grains.dump id x y radius
run 1"

# Without the plugin the style must be unknown; otherwise the test shows nothing.
echo "$scene" > in.without
if "$lmp" -in in.without -log none > out.without 2>&1
then echo "fix rve is known without the plugin"; exit 1; fi
grep -q "Unrecognized fix style 'rve'" out.without

{ echo "plugin load $plugin"; echo "$scene"
echo "write_rve grains atom 1 file loaded.rve format rve"; } > in.loaded
"$lmp" -in in.loaded -log none > out.loaded 2>&1 || { cat out.loaded; exit 1; }

for file in grains contacts; do mv $file.dump $file.loaded; done

{ echo clear; echo "$scene"; echo "write_rve grains atom 1 file path.rve format rve"; } > in.path
LAMMPS_PLUGIN_PATH=$(dirname "$plugin") "$lmp" -in in.path -log none > out.path 2>&1 ||
  { cat out.path; exit 1; }
cmp loaded.rve path.rve
for file in grains contacts; do [ -s $file.loaded ] && cmp $file.loaded $file.dump; done

# refused <version|sizes|mpi> <expected error>
refused() {
  echo "plugin load $others/other_$1_plugin.so" > in.other
  if "$lmp" -in in.other -log none > "out.$1" 2>&1; then cat "out.$1"
  echo "a plugin for another LAMMPS was loaded ($1)"; exit 1; fi
  grep -qF "$2" "out.$1" || { cat "out.$1"; echo "the error does not say: $2"; exit 1; }
}
refused version "ERROR: gpurveplugin.so was built for LAMMPS 20240829, and the LAMMPS that loads it is LAMMPS 20"
refused version "build the plugin with the source of that version (-D LAMMPS_SOURCE_DIR=<tree>)"
refused sizes "8 bytes in an atom ID and 8 in a step number, and the LAMMPS that loads it has 4 bytes in an atom ID and 8 in a step number; build the plugin with -D LAMMPS_SIZES=smallbig"
refused mpi "whose communicators have "
refused mpi "build the plugin with that MPI library"
