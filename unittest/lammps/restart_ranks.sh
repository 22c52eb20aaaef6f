#!/bin/sh
# Material points carry their RVEs from rank to rank and through restart files, bit for bit:
#   one process on 1 rank, uninterrupted   =   `ranks` ranks, stopped, and a new process on another number of ranks,
# after points have migrated, with sheared contacts, in the middle of a list's life. The states are compared byte by byte.
# Controls: a run from the states at the stop as packing files gives the same grains and contacts too (in another order: its list
# began at the stop), and the same run with the tangential forces set to zero does not: so a lost history would be seen.
#
#   restart_ranks.sh <lmp> <packing> <ranks before> <ranks after> <mpiexec and its options...>
set -eu
lmp=$1 packing=$2 before=$3 after=$4
shift 4
work=$(mktemp -d "${TMPDIR:-/tmp}/restart_ranks.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"

cat > in.setup << END
units si
dimension 2
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
cat > in.go << END
timestep 1e-3
neighbor 0.3 bin
neigh_modify every 1 delay 0 check no
comm_modify cutoff 0.5
variable rate atom -0.3*id
fix move all nve
compute rank all property/atom proc
thermo 20
END
fix="threads 1 dt 1e-4 drive velocity_gradient yy v_rate xy 1.0"
write_states() {
  for id in 1 2 3 4; do echo "write_rve grains atom $id file $1.$id.rve format rve"; done
}

{ cat in.setup in.go; echo "fix grains all rve $packing $fix"; echo "run 40"; write_states whole
  echo 'print "$(f_grains[3]:%.0f) $(f_grains[4]:%.0f)" file whole.counts'; } > in.whole
{ cat in.setup in.go; echo "fix grains all rve $packing $fix"
  echo "dump ranks all custom 20 ranks.* id c_rank"; echo "dump_modify ranks sort id"; echo "run 20"
  write_states stop; echo "write_restart half.restart"; } > in.first
{ echo "read_restart half.restart"; cat in.go; echo "fix grains all rve $packing $fix"; echo "run 20"; write_states second
  echo 'print "$(f_grains[3]:%.0f) $(f_grains[4]:%.0f)" file second.counts'; } > in.second
from_states() {
  cat in.setup in.go
  echo "reset_timestep 20"
  echo "variable which atom id-1"
  echo "fix grains all rve $1.1.rve packings $1.2.rve $1.3.rve $1.4.rve packing_variable v_which $fix"
  echo "run 20"; write_states "$2"
}
from_states stop again > in.again
from_states forgetful forgot > in.forgot

"$@" 1 "$lmp" -in in.whole -log whole.log > whole.out || { cat whole.out; exit 1; }
"$@" "$before" "$lmp" -in in.first -log first.log > first.out || { cat first.out; exit 1; }
"$@" "$after" "$lmp" -in in.second -log second.log > second.out || { cat second.out; exit 1; }

if [ "$before" -gt 1 ] && tail -4 ranks.0 > r0 && tail -4 ranks.20 > r20 && cmp -s r0 r20; then
  echo "no point has migrated"; cat ranks.20; exit 1
fi
for id in 1 2 3 4; do
  cmp whole.$id.rve second.$id.rve
  awk '/^contacts/ {on = 1; next} on && NF == 3 && $3 != 0 {n++} END {exit n > 20 ? 0 : 1}' stop.$id.rve ||
    { echo "the tangential history of atom $id is empty"; exit 1; }
done
cmp whole.counts second.counts    # DEM steps and rebuilds: the list went on too
[ "$(awk '{print $2}' whole.counts)" -gt 4 ] || { echo "no list was rebuilt:"; cat whole.counts; exit 1; }

# the controls
in_order() { awk '/^contacts/ {on = 1; next} /^end/ {next} on && NF == 3 {if ($1 > $2) {t = $1; $1 = $2; $2 = t}} {print}' "$1" | sort; }
for id in 1 2 3 4; do
  awk '/^contacts/ {on = 1; print; next} on && NF == 3 {$3 = 0} {print}' stop.$id.rve > forgetful.$id.rve
done
for run in again forgot; do
  "$@" 1 "$lmp" -in in.$run -log $run.log > $run.out || { cat $run.out; exit 1; }
done
for id in 1 2 3 4; do
  for run in whole again forgot; do in_order $run.$id.rve > $run.$id; done
  cmp whole.$id again.$id
  if cmp -s whole.$id forgot.$id; then echo "a lost history goes unseen (atom $id)"; exit 1; fi
done
echo "equal: 1 rank, and $before ranks stopped and continued on $after; different without the tangential history"
