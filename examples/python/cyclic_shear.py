#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Cyclic simple shear under constant pressure, with the turning points decided by Python.

    python3 cyclic_shear.py [packing]

Four RVEs of the same grains, as four images of one packing, are sheared at a constant rate. A stress servo holds both normal stresses at
100 kPa. When the mean shear stress of the four has reached 25 kPa, the direction of shear is turned. A run of plain LAMMPS cannot do
that: it does not know beforehand when the stress will be there.

The file cyclic_shear.txt has the shear strain and the shear stress of each RVE.
"""

import os
import sys

import numpy as np
from lammps import LMP_STYLE_ATOM, LMP_STYLE_GLOBAL, LMP_TYPE_ARRAY, LMP_TYPE_VECTOR, lammps

here = os.path.dirname(os.path.abspath(__file__))
packing = sys.argv[1] if len(sys.argv) > 1 else os.path.join(here, '..', 'packings', 'A_h0075.rve')

rate = 0.2        # of shear strain [1/s]
limit = 25e3      # of the shear stress [Pa]
turns = 2         # changes of direction
steps = 5         # LAMMPS steps between two looks at the stress

# What LAMMPS would print goes to the log file only.
lmp = lammps(cmdargs=['-screen', 'none', '-log', 'cyclic_shear.log'])

# Four points; where they lie does not matter here. Each LAMMPS step of 5e-4 s is ten DEM steps of 5e-5 s.
lmp.commands_string(f"""
units        si
dimension    2
boundary     f f p
atom_style   sphere
atom_modify  map array sort 0 0.0
region       box block 0 4 0 1 -0.5 0.5
create_box   1 box
create_atoms 1 single 0.5 0.5 0.0
create_atoms 1 single 1.5 0.5 0.0
create_atoms 1 single 2.5 0.5 0.0
create_atoms 1 single 3.5 0.5 0.0
pair_style   none
comm_modify  cutoff 0.5
timestep     5e-4

variable     image atom id-1
fix          grains all rve {packing} packing_image v_image drive velocity_gradient xy {rate} servo xx -1e5 yy -1e5 dt 5e-5
compute      state all rve/atom def_xy sxy p void_ratio
thermo       1000
run          0
""")

curve = []
turned = []
while len(turned) <= turns:
    lmp.command(f'run {steps}')

    # One row for each atom of this rank, one column for each quantity of the compute: a view of LAMMPS' own memory, valid until the
    # next command, so what shall stay is copied.
    state = lmp.numpy.extract_compute('state', LMP_STYLE_ATOM, LMP_TYPE_ARRAY)
    strain, stress = state[:, 0].copy(), state[:, 1].copy()
    curve.append(np.concatenate((strain, stress)))

    # the sign of the rate is the direction of shear
    if np.mean(stress) * np.sign(rate) >= limit:
        turned.append(lmp.extract_global('ntimestep'))
        print(f'step {turned[-1]}: mean shear stress {np.mean(stress) / 1e3:.1f} kPa at a shear strain of {np.mean(strain):.5f}')
        rate = -rate
        lmp.command(f'fix_modify grains drive velocity_gradient xy {rate}')

# Values of a global vector are had one by one; Python counts from 0, the manual of fix rve from 1.
dem_steps = lmp.numpy.extract_fix('grains', LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR, nrow=2)
print(f'{lmp.get_natoms()} RVEs made {dem_steps:.0f} DEM steps')

np.savetxt('cyclic_shear.txt', curve, fmt='%.17g', header='shear strain of 4 RVEs [-], shear stress of 4 RVEs [Pa]')
lmp.close()
