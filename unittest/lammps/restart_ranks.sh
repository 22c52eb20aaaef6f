#!/bin/sh
# SPDX-License-Identifier: GPL-2.0-only
# Material points carry their RVEs between ranks and through restart files, bit for bit. One process
# on 1 rank without interruption is compared with `ranks before`, stopped, and a new process on
# `ranks after`, after points have migrated, with sheared contacts, while the list is neither new
# nor due for a rebuild. States of RVEs and all data of points are compared byte by byte.
#
# Scenes:
#   shear     fix rve alone: each RVE has its own velocity gradient, and its atom crosses rank
#             borders
#   rolling   shear with rolling resistance: histories have a rolling force too
#   spheres   shear in dimension 3, with rolling and twisting resistance: histories are vectors
#             and a moment
#   footing   fix mpm with fix rve: a plate pressed into 4 x 4 points
#   knobs     shear, slower, with all options between a macro step and DEM steps: RVEs that are
#             quiescent at the stop, and shadows. It has no controls, since packing files do not
#             store quiescence.
#   narrow    cells that are stretched until they are too narrow and continue as copies next to
#             each other, some before the stop, some after it. It has no controls, since packing
#             files do not store copies.
# Controls: A run from packing files of the RVEs at the stop gives the same grains and contacts,
# some in another order, since its lists begin at the stop. The same run with tangential or rolling
# forces set to zero does not, so that a lost history would be detected.
#
#   restart_ranks.sh shear|rolling|spheres|footing|knobs|narrow <lmp> <packing> <ranks before>
#                    <ranks after> <mpiexec and its options...>
set -eu
scene=$1 lmp=$2 packing=$3 before=$4 after=$5
shift 5
mpi="$*"
work=$(mktemp -d "${TMPDIR:-/tmp}/restart_ranks.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"

# small_packing <its keywords>: makes a packing
small_packing() {
  cat > in.packing << END
units si
create_rve $work/small.rve $1 seed 1 radius uniform 0.0025 0.005 pressure 20000 kn 1e6 kt 1e6 friction 0.5 density 2650 damping 0.3
END
  $mpi 1 "$lmp" -in in.packing -log packing.log > packing.out || { cat packing.out; exit 1; }
  packing=$work/small.rve
}

# A scene: in.setup makes the atoms; in.settings has the settings that a restart file does not
# store; fixes <ID of fix rve> <its packings>; the atoms with RVEs; the steps of the stop and the
# end; the output of fix mpm, if there is one.
histories=3    # columns of the contacts in a packing file
turning=4      # columns that change sign when seen from the other grain
dimension=2
[ "$scene" = spheres ] && dimension=3
case $scene in
shear | rolling | spheres | knobs | narrow)
  cat > in.setup << END
units si
dimension $dimension
boundary p p p
atom_style atomic
region box block 0 4 0 4 -0.5 0.5
create_box 1 box
mass 1 1.0
create_atoms 1 single 0.5 0.5 0
create_atoms 1 single 2.5 0.5 0
create_atoms 1 single 0.5 2.5 0
create_atoms 1 single 2.5 2.5 0
velocity all set 80.0 90.0 0.0
END
  # 20 steps of 1 ms take each point across the middle of the box, in x and y
  cat > in.settings << END
timestep 1e-3
neighbor 0.3 bin
neigh_modify every 1 delay 0 check no
comm_modify cutoff 0.5
variable rate atom -0.3*id
END
  fixes() {
    rve=$1; shift
    echo "fix move all nve"
    if [ "$scene" = shear ]; then
      echo "fix $rve all rve $* threads 1 dt 1e-4 drive velocity_gradient yy v_rate xy 1.0"
    elif [ "$scene" = rolling ]; then
      echo "fix $rve all rve $* threads 1 dt 0.8e-4 drive velocity_gradient yy v_rate xy 1.0 kr 1e6 rolling_friction 0.2"
    elif [ "$scene" = spheres ]; then
      echo "fix $rve all rve $* threads 1 dt 3.5e-6 drive velocity_gradient zz v_rate xy 2.0 yz 1.0 kr 3e5 rolling_friction 0.2 &"
      echo "  k_twist 2 twisting_friction 2e-4"
    elif [ "$scene" = narrow ]; then
      echo "variable pull atom 8+2*id"
      echo "variable push atom -v_pull"
      echo "fix $rve all rve $* threads 1 dt 2e-5 drive velocity_gradient xx v_pull yy v_push"
    else
      echo "variable slow atom -0.01*id*id"
      echo "fix $rve all rve $* threads 1 dt 1e-4 drive velocity_gradient yy v_slow xy 0.01 substeps adaptive 1e-6 1e-3 quiescent 1.5e-4 &"
      echo "  stress regression 3 2 mass_scaling 2 shadow 3 2"
    fi
  }
  # Columns: two components of the tangential force, one of the rolling force, the twisting moment.
  atoms=$(seq 4) stop=20 end=40 columns="" vector=""
  [ "$scene" = rolling ] && histories="3 4"
  if [ "$scene" = spheres ]; then
    histories="3 5 7 10"
    turning="3 4 5"
    small_packing "shape sphere grains 80"
  fi
  if [ "$scene" = narrow ]; then
    small_packing "grains 16 thickness 0.075"
    vector='$(f_RVE[17]:%.0f)'
  fi
  # output of shadows, and the number of quiescent RVEs
  [ "$scene" = knobs ] &&
    vector='$(f_RVE[11]:%.17g) $(f_RVE[12]:%.17g) $(f_RVE[13]:%.17g) $(f_RVE[14]:%.0f)'
  ;;
footing)
  # the border between two ranks is just below the upper row of points, and the plate pushes them
  # across it
  cat > in.setup << END
units si
dimension 2
boundary f f p
atom_style sphere
processors 1 * 1
region box block 0 4 0 6.98 -0.1 0.1 units box
create_box 2 box
lattice sq 1.0 origin 0.5 0.5 0.0
region ground block 0 4 0 4 -0.05 0.05 units box
create_atoms 1 region ground
region plate block 0 2 4 5 -0.05 0.05 units box
create_atoms 2 region plate
set group all diameter 1.0
group ground type 1
group plate type 2
region top block 2 4 3 4 -0.05 0.05 units box
group surface region top
END
  cat > in.settings << END
timestep 0.005
pair_style none
comm_modify cutoff 1.0
neighbor 0.5 bin
neigh_modify every 5 delay 0 check no
END
  fixes() {
    rve=$1; shift
    echo "fix $rve ground rve $* threads 1 dt 1e-4 drive mpm substeps match"
    echo "fix soil all mpm 1.0 domain 0 4 0 6 model ground rve $rve boundary xlo roller boundary xhi roller boundary ylo fixed &"
    echo "  damping 0.05 rigid plate vx 0 vy -0.3 rough traction surface 0 -20000"
  }
  atoms=$(seq 16) stop=63 end=80 columns="f_soil[*]" \
    vector='$(f_soil[1]:%.17g) $(f_soil[5]:%.17g) $(f_soil[6]:%.17g) $(f_soil[8]:%.17g)'
  small_packing "grains 50 thickness 0.075"
  ;;
*) echo "the scene must be shear, rolling, spheres, footing, knobs or narrow, got $scene"; exit 1 ;;
esac

# write <name> <ID of fix rve>: writes everything that is compared. 17 digits have all bits of a
# double; counts are DEM steps and rebuilds of lists.
write() {
  for id in $atoms; do echo "write_rve $2 atom $id file $1.$id.rve format rve"; done
  echo "write_dump all custom $1.points id x y vx vy $columns modify sort id format float %.17g"
  echo "print '\$(f_$2[3]:%.0f) \$(f_$2[4]:%.0f) $(echo "$vector" | sed "s/f_RVE/f_$2/g")' file $1.counts"
}

{ cat in.setup in.settings; fixes grains "$packing"; echo "thermo $end"; echo "run $end"
write whole grains; } > in.whole
{ cat in.setup in.settings; fixes grains "$packing"; echo "compute rank all property/atom proc"
  echo "dump ranks all custom $stop ranks.* id c_rank"; echo "dump_modify ranks sort id"
  echo "run $stop"; write stop grains; echo "write_restart half.restart"; } > in.first
{ echo "read_restart half.restart"; cat in.settings; fixes grains "$packing"
echo "run $((end - stop))"; write second grains; } > in.second
# fix rve finds its RVEs in a restart file by its ID; with another ID it begins with its packings.
from_states() {
  echo "read_restart half.restart"
  cat in.settings
  echo "variable which atom id-1"
  files=""
  for id in $atoms; do files="$files $1.$id.rve"; done
  # the first is the packing, the others are further ones
  fixes other $(echo $files | sed 's/ / packings /') packing_variable v_which
  echo "run $((end - stop))"
  write "$2" other
}
from_states stop again > in.again
from_states forgetful forgot > in.forgot

run() {
  "$@" > run.out 2>&1 || { cat run.out; exit 1; }
}
run "$@" 1 "$lmp" -in in.whole -log whole.log
run "$@" "$before" "$lmp" -in in.first -log first.log
run "$@" "$after" "$lmp" -in in.second -log second.log

if [ "$before" -gt 1 ]; then
  for step in 0 $stop; do sed '1,/ITEM: ATOMS/d' ranks.$step > moved.$step; done
  if cmp -s moved.0 moved.$stop; then echo "no point has migrated"; cat ranks.$stop; exit 1; fi
fi
cmp whole.points second.points
cmp whole.counts second.counts    # DEM steps and rebuilds too, since the lists continue
for id in $atoms; do
  cmp whole.$id.rve second.$id.rve
  for column in $histories; do
    awk -v h="$column" '/^contacts/ {on = 1; next} on && NF > 2 && $h != 0 {n++} END {exit n > 20 ? 0 : 1}' stop.$id.rve ||
      { echo "column $column of the contacts of atom $id is empty"; exit 1; }
  done
done
if [ "$scene" = narrow ]; then
  read -r _ _ at_stop < stop.counts
  read -r _ _ at_end < second.counts
  [ "$at_stop" -gt 0 ] && [ "$at_end" -gt "$at_stop" ] ||
    { echo "copies at the stop and at the end: $at_stop and $at_end RVEs"; exit 1; }
  echo "equal: 1 rank, and $before ranks stopped and continued on $after, with $at_stop RVEs that are copies side by side, and $at_end in the end"
  exit 0
fi
if [ "$scene" = knobs ]; then
  awk '{exit $4 > 0 && $6 > 0 ? 0 : 1}' stop.counts ||
    { echo "nothing sleeps, or shadows see nothing:"; cat stop.counts; exit 1; }
  echo "equal: 1 rank, and $before ranks stopped and continued on $after, with sleeping RVEs and shadows"
  exit 0
fi
[ "$(awk '{print $2}' stop.counts)" -gt 4 ] || { echo "no list was rebuilt:"; cat stop.counts
exit 1; }

# Controls. For disks the tangential force is the same seen from both grains and the rolling force
# changes its sign; for spheres it is the opposite.
in_order() {
  awk -v turning="$turning" 'function other(x) {return x ~ /^-/ ? substr(x, 2) : x == "0" ? x : "-" x}
    BEGIN {columns = split(turning, column)} /^contacts/ {on = 1; next} /^(checksum|end)/ {next}
    on && NF > 2 && $1 > $2 {t = $1; $1 = $2; $2 = t; for (k = 1; k <= columns; ++k) if (column[k] <= NF) $column[k] = other($column[k])} {print}' "$1" | sort
}
run "$@" 1 "$lmp" -in in.again -log again.log
old_lists=0
for id in $atoms; do
  for name in whole again; do in_order $name.$id.rve > $name.$id; done
  cmp whole.$id again.$id
  cmp -s whole.$id.rve again.$id.rve || old_lists=$((old_lists + 1))
done
[ $old_lists -gt 0 ] || { echo "all lists were new at the stop"; exit 1; }
cmp whole.points again.points
for column in $histories; do
  for id in $atoms; do
    awk -v h="$column" '/^contacts/ {on = 1; print; next} /^checksum/ {$2 = "none"} on && NF > 2 {$h = 0} {print}' stop.$id.rve > forgetful.$id.rve
  done
  run "$@" 1 "$lmp" -in in.forgot -log forgot.log
  for id in $atoms; do
    in_order forgot.$id.rve > forgot.$id
    if cmp -s whole.$id forgot.$id
    then echo "a lost history goes unseen (atom $id, column $column)"; exit 1; fi
  done
  if [ -n "$columns" ] && cmp -s whole.points forgot.points
  then echo "a lost history goes unseen in the points"; exit 1; fi
done
echo "equal: 1 rank, and $before ranks stopped and continued on $after; different without the history of contacts"
