# SPDX-License-Identifier: GPL-2.0-only
# A scene that several tests interrupt, to be sourced (. pressed_plate.sh): fix mpm presses a plate
# into 4 x 4 points with RVEs. Writes in.setup, the points, and in.fixes, all that a restart file
# lacks, into the current folder. Input: $packing, $speed of the plate [m/s], $thermo, $fix_words
# (more keywords of fix rve).

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
fix grains ground rve $packing threads 1 dt auto dt_check 10 drive mpm substeps match $fix_words
fix soil all mpm 1.0 domain 0 4 0 6 model ground rve grains boundary xlo roller boundary xhi roller boundary ylo fixed &
  damping 0.05 rigid plate vx 0 vy -$speed rough
thermo $thermo
END
# write <name>: writes everything that is compared. 17 digits have all bits of a double; counts are
# DEM steps and rebuilds of lists.
write() {
  for id in $(seq 16); do echo "write_rve grains atom $id file $1.$id.rve format rve"; done
  echo "write_dump all custom $1.points id x y vx vy f_soil[*] modify sort id format float %.17g"
  echo "print '\$(step) \$(f_grains[3]:%.0f) \$(f_grains[4]:%.0f) \$(f_grains[8]:%.17g) \$(f_soil[6]:%.17g) \$(f_soil[8]:%.17g)' file $1.counts"
}
