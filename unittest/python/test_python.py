#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""The shared library through LAMMPS' Python module gives the bits of lmp for the same scene.

    test_python.py cyclic_shear|footing|errors <lmp> <folder of the examples>
"""

import os
import shutil
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'tools'))
import dumps


def run(*command):
    done = subprocess.run(command,
                          stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT,
                          text=True,
                          check=False)
    if done.returncode:
        sys.exit(f'{done.stdout}\nFAILED: {" ".join(command)}')
    return done.stdout


def require(holds, what):
    if not holds:
        sys.exit(f'FAILED: {what}')


def read_dump(path):
    """Returns the atoms of each frame of a dump, sorted by id."""
    return [np.column_stack(list(frame.columns.values())) for frame in dumps.frames(path)]


def cyclic_shear(lmp, examples):
    """Runs the example of the manual, and lmp with known times of reversals: their curves are the
    same."""
    said = run(sys.executable, os.path.join(examples, 'python', 'cyclic_shear.py'))
    print(said)
    curve = np.loadtxt('cyclic_shear.txt')
    turns = [
        int(line.split()[1].rstrip(':')) for line in said.splitlines() if line.startswith('step ')
    ]
    require(len(turns) == 3, 'the shear turns twice, and the third time the script ends')
    mean = curve[:, 4:].mean(axis=1)
    require(mean.max() > 25e3 and mean.min() < -25e3,
            'the shear stress reaches its limit in both directions')

    # lmp runs the same scene from the text of the example.
    with open(os.path.join(examples, 'python', 'cyclic_shear.py'), encoding='utf-8') as f:
        scene = f.read().split('commands_string(f"""')[1].split('"""')[0]
    scene = scene.format(packing=os.path.join(examples, 'packings', 'A_h0075.rve'), rate=0.2)
    scene += ('dump curve all custom 5 curve.dump id c_state[1] c_state[2]\n'
              'dump_modify curve sort id format float %.17g\n')
    rate = 0.2
    for begin, end in zip([0] + turns, turns):
        scene += 'run 5\n' * ((end - begin) // 5)
        rate = -rate
        scene += f'fix_modify grains drive velocity_gradient xy {rate}\n'
    with open('in.cyclic_shear', 'w', encoding='utf-8') as f:
        f.write(scene)
    run(lmp, '-in', 'in.cyclic_shear', '-log', 'none')
    frames = read_dump('curve.dump')[1:]    # without step 0
    dumped = np.array([np.concatenate((frame[:, 1], frame[:, 2])) for frame in frames])
    require(dumped.shape == curve.shape, f'lmp has {dumped.shape[0]} rows, Python {curve.shape[0]}')
    require(np.array_equal(dumped, curve), f'largest difference {np.abs(dumped - curve).max()}')


def footing(lmp, examples):
    """Runs a small footing with MPM and RVEs: per-atom arrays of fix and compute, global vectors,
    and atoms are those of lmp."""
    from lammps import LMP_STYLE_ATOM, LMP_STYLE_GLOBAL, LMP_TYPE_ARRAY, LMP_TYPE_VECTOR, lammps

    script = os.path.join(examples, 'footing', 'study.footing')
    words = [
        '-var', 'h', '1', '-var', 'grains', '50', '-var', 'stop', '20', '-var', 'device', 'cpu'
    ]
    soil = [f'f_soil[{i + 1}]' for i in range(17)]
    computed = [f'c_rve[{i + 1}]' for i in range(9)]
    with open('in.dumped', 'w', encoding='utf-8') as f:
        f.write(
            f'include {script}\n'
            f'write_dump all custom soil.dump id x y {" ".join(soil)} modify format float %.17g\n'
            f'write_dump ground custom rve.dump id {" ".join(computed)} modify format float %.17g\n'
            'print "$(f_soil[6]:%.17g) $(f_grains[3]:%.17g)" file vector.txt\n')
    run(lmp, '-in', 'in.dumped', '-log', 'none', *words)

    os.mkdir('python')
    os.chdir('python')
    shutil.copy('../packing_50_20000_4711.rve', '.')
    instance = lammps(cmdargs=['-screen', 'none', '-log', 'none', *words])
    instance.file(script)
    ids = instance.numpy.extract_atom('id')
    order = np.argsort(ids)
    x = instance.numpy.extract_atom('x')
    fix = instance.numpy.extract_fix('soil', LMP_STYLE_ATOM, LMP_TYPE_ARRAY)
    compute = instance.numpy.extract_compute('rve', LMP_STYLE_ATOM, LMP_TYPE_ARRAY)
    require(fix.shape == (len(ids), 17) and compute.shape == (len(ids), 9),
            f'shapes {fix.shape} and {compute.shape}')

    of_lmp = read_dump('../soil.dump')[0]
    of_python = np.column_stack((ids, x[:, :2], fix))[order]
    require(np.array_equal(of_lmp, of_python),
            f'fix mpm: largest difference {np.abs(of_lmp - of_python).max()}')
    require(np.abs(of_python[:, 4]).max() > 0, 'the ground moves')
    of_lmp = read_dump('../rve.dump')[0]
    of_python = np.column_stack((ids, compute))[order][np.isin(np.sort(ids), of_lmp[:, 0])]
    require(np.array_equal(of_lmp, of_python),
            f'compute rve/atom: largest difference {np.abs(of_lmp - of_python).max()}')
    require(np.ptp(of_python[:, 1]) > 0, 'void ratios differ')
    with open('../vector.txt', encoding='utf-8') as f:
        force, dem_steps = (float(word) for word in f.read().split())
    require(force == instance.numpy.extract_fix('soil', LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR, nrow=5),
            'force on the footing')
    require(
        dem_steps == instance.numpy.extract_fix('grains', LMP_STYLE_GLOBAL, LMP_TYPE_VECTOR,
                                                nrow=2), 'number of DEM steps')
    require(force != 0, 'there is a force on the footing')
    instance.close()


def errors(_lmp, examples):
    """Expects that an error of a script is an exception with its message and the interpreter
    continues."""
    from lammps import lammps
    packing = os.path.join(examples, 'packings', 'A_h0075.rve')
    header = (
        'units si\ndimension 2\nboundary f f p\natom_style sphere\nregion box block 0 1 0 1 -0.5 '
        '0.5\ncreate_box 1 box\n'
        'create_atoms 1 single 0.5 0.5 0\npair_style none\ncomm_modify cutoff 0.5\ntimestep 5e-4\n')
    for attempt in range(2):
        instance = lammps(cmdargs=['-screen', 'none', '-log', 'none'])
        require(all(instance.has_style('fix', style) for style in ('rve', 'mpm')),
                'the styles are there')
        require(instance.has_package('GPU_RVE'), 'the package is listed')
        instance.commands_string(header)
        message = ''
        try:
            instance.command(f'fix grains all rve {packing} friction -0.5')
        except Exception as error:
            message = str(error)
        require('friction' in message and '-0.5' in message, f'the message is {message!r}')
        instance.command(
            f'fix grains all rve {packing} friction 0.5 drive velocity_gradient yy -0.05 dt 5e-5')
        instance.command('run 1')
        instance.close()


if __name__ == '__main__':
    scene, lmp, examples = sys.argv[1], os.path.abspath(sys.argv[2]), os.path.abspath(sys.argv[3])
    home = os.getcwd()
    with tempfile.TemporaryDirectory() as work:
        os.chdir(work)
        {'cyclic_shear': cyclic_shear, 'footing': footing, 'errors': errors}[scene](lmp, examples)
        os.chdir(home)
    print(f'{scene}: in order')
