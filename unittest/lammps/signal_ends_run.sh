#!/bin/sh
# A batch system ends a run with SIGTERM: the log that somebody follows shows how far the run is, the run ends after its present step with
# the restart file that the script asks for, and the continued run has the bits of an uninterrupted one. The scene: a plate
# pressed into 4 x 4 points with RVEs, by fix mpm.
#
#   signal_ends_run.sh <lmp> <packing>
set -eu
lmp=$1 packing=$2
work=$(mktemp -d "${TMPDIR:-/tmp}/signal_ends_run.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
end=400

cat > in.setup << END
units si
dimension 2
boundary f f p
atom_style sphere
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
END
cat > in.fixes << END
timestep 0.001
pair_style none
comm_modify cutoff 1.0
neighbor 0.5 bin
neigh_modify every 5 delay 0 check no
fix grains ground rve $packing threads 1 dt auto dt_check 10 drive mpm substeps match progress 0.02
fix soil all mpm 1.0 domain 0 4 0 6 model ground rve grains boundary xlo roller boundary xhi roller boundary ylo fixed &
  damping 0.05 rigid plate vx 0 vy -0.1 rough
thermo 100000
END
# write <name>: all that is compared. 17 digits are all bits of a double
write() {
  for id in $(seq 16); do echo "write_rve grains atom $id file $1.$id.rve format rve"; done
  echo "write_dump all custom $1.points id x y vx vy f_soil[*] modify sort id format float %.17g"
}
{ cat in.setup in.fixes; echo "run $end"; write whole; } > in.whole
"$lmp" -in in.whole -log whole.log > whole.out 2>&1 || { cat whole.out; exit 1; }

{ cat in.setup in.fixes; echo "restart 10000 one.restart two.restart"; echo "run $end"; write unwanted; echo "print done file done"; } > in.ended
"$lmp" -in in.ended -log ended.log > ended.out 2>&1 &
process=$!
# the line must be in the file while the run goes on: a log that is kept in a buffer shows it when all is over
while ! grep -q "^fix rve grains: step .* left" ended.log 2> /dev/null; do
  kill -0 $process 2> /dev/null || { echo "the run was over before its log showed a line of progress"; cat ended.out; exit 1; }
  sleep 0.005
done
kill -TERM $process
status=0
wait $process || status=$?
[ $status -eq 1 ] || { echo "exit status $status, expected that of an error, 1"; cat ended.out; exit 1; }
step=$(sed -n 's/.*SIGTERM ended the run after step \([0-9]*\); continue from restart file one.restart .*/\1/p' ended.log)
[ -n "$step" ] || { echo "no word about the signal:"; cat ended.log; exit 1; }
[ ! -e done ] || { echo "the script went on"; exit 1; }
[ "$step" -lt $end ] || { echo "the run was over"; exit 1; }

{ echo "read_restart one.restart"; cat in.fixes; echo "run $end upto"; write continued; } > in.continued
"$lmp" -in in.continued -log continued.log > continued.out 2>&1 || { cat continued.out; exit 1; }
first=$(awk '/^ *Step / {getline; print $1; exit}' continued.log)
[ "$first" = "$step" ] || { echo "continued from step $first, not from $step"; exit 1; }
cmp whole.points continued.points
for id in $(seq 16); do cmp whole.$id.rve continued.$id.rve; done
echo "equal: uninterrupted, and ended by SIGTERM after step $step of $end and continued"
