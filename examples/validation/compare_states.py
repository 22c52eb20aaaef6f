#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Compares whole states with SudoDEM2D grain by grain: A_h0075, the three tests, steps 1, 100 and 1000, format double.

    python3 compare_states.py [--lmp build/host/bin/lmp]

Compared are positions (in mean diameters), peculiar velocities c = v - L x and spins (over their root mean squares), and normal and
tangential contact forces (over the mean normal force). Exit status 1 if a median or a largest difference is beyond its limit, 2 if a run fails.
"""

import os

import numpy as np

import element
import harness
from element import DT, RATE
from packing_file import contacts_of, nearest_image, read_packing

STEPS = (1, 100, 1000)
CASE = "A_h0075"

# Limits of (median, largest) differences, three times and more above what is found. Where they come from:
# * SudoDEM2D keeps velocities with L x in them, this package peculiar ones. Both are of first order in dt: an affine increment of a step differs
#   by dt L = 2.5e-6 of itself. That is the size of the differences in velocity at step 100.
# * Where such a difference turns the sign of a damping force, or makes a contact slip a step earlier, a grain gets another kick; from there
#   differences grow. The column "twin" has two runs of this package whose rates differ by 2.5e-6: they part as far from each other.
# * Step 1: SudoDEM2D has kicked the grains by the residual forces of the packing, 7e-9 of the contact forces.
# * Biaxial: in SudoDEM2D the cell is one step of the servo ahead of the grains, by up to dt |L_xx| = 3.4e-7 of its width of 19 diameters.
LIMITS = {
    1: {"position": (2e-12, 1e-11), "velocity": (1e-6, 5e-6), "spin": (1e-12, 1e-11)},
    100: {"position": (1e-8, 1e-6), "velocity": (1e-3, 0.1), "spin": (1e-3, 0.1), "normal force": (1e-6, 1e-4), "tangential force": (1e-6, 1e-4)},
    1000: {"position": (3e-6, 1e-4), "velocity": (0.1, 0.5), "spin": (0.1, 2.0), "normal force": (1e-4, 1e-3), "tangential force": (1e-4, 1e-3)},
}
BIAXIAL_LIMITS = {
    1: LIMITS[1],
    100: {"position": (1e-5, 2e-5), "velocity": (0.2, 1.0), "spin": (0.2, 2.0), "normal force": (1e-4, 1e-3), "tangential force": (1e-4, 1e-3)},
    1000: {"position": (2e-5, 5e-4), "velocity": (0.2, 1.0), "spin": (0.2, 3.0), "normal force": (1e-4, 1e-3), "tangential force": (1e-4, 1e-3)},
}
# contacts that only one of the two has: the rare one that is just opening or closing
OTHER_CONTACTS = 3
# the cell [of its width]: rounding, and in the biaxial test the servo, which acts on stresses that differ by 1e-5
CELL_LIMIT = {"uniaxial": 1e-12, "shear": 1e-12, "biaxial": 5e-8}
TWIN = 1.0 + DT * RATE
# SudoDEM2D's s_xx in the second step of its biaxial test, tension positive [Pa], and how well the computed start must have it
SECOND_STRESS = -100000.303997
SECOND_STRESS_LIMIT = 1e-8


def sudodem_state(test, step):
    """A state of SudoDEM2D. Positions are those after the step; the rest is what the step began with, after its kick."""
    blocks = []
    with open(os.path.join(element.REFERENCE, f"state.{test}.{step}.csv")) as stream:
        for line in stream:
            if line.startswith("#"):
                blocks.append([])
            else:
                blocks[-1].append([float(word) for word in line.split(",")])
    h_xx, h_yy, h_xy, l_xx, l_yy, l_xy = blocks[0][0]
    grains = np.array(blocks[1])
    position, velocity = grains[:, :2], grains[:, 2:4]
    return {
        "cell": np.array([[h_xx, h_xy], [0.0, h_yy]]),
        "position": position,
        "velocity": velocity - (position - DT * velocity) @ np.array([[l_xx, l_xy], [0.0, l_yy]]).T,
        "spin": grains[:, 4],
        "contacts": {(int(i) - 1, int(j) - 1): (fn, ft) for i, j, fn, ft in (blocks[2] if len(blocks) > 2 else [])},
    }


def our_state(now, before):
    """The same from two packing files of this package, a step apart."""
    i, j, _, overlap = contacts_of(before)
    force, spring = before["material"]["normal_stiffness"] * overlap, before["tangential_force"]
    return {
        "cell": before["cell"],
        "position": now["fraction"] * 2.0**-64 @ now["cell"].T,
        "velocity": before["velocity"],
        "spin": before["spin"],
        "contacts": {pair: (fn, spring.get(pair, 0.0)) for pair, fn in zip(zip(i.tolist(), j.tolist()), force)},
    }


def sudodem_start(packing, path):
    """Writes the packing as SudoDEM2D's biaxial test has it in its second step; returns its stress s_xx.

    In the first step the servo sets L after the grains have moved, so that the cell is strained and the grains stay where they are. The contacts
    across the boundary get the velocity of the cell, L H m with the number m of periods between the grains, and the others none.
    """
    material, cell = packing["material"], packing["cell"]
    goal, gain = -1e5, element.servo_gain(packing)

    def love(branches, forces, volume):
        return forces.T @ branches / volume    # tension positive: force on i towards j

    def steer(rate, stress):
        error = goal - stress
        return rate + (1.0 - 0.25 * np.sign(rate * error)) * gain * DT * error

    def forces(state, tangential):
        i, j, branch, overlap = contacts_of(state)
        normal = branch / np.hypot(branch[:, 0], branch[:, 1])[:, None]
        along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        force = -material["normal_stiffness"] * overlap[:, None] * normal
        spring = tangential(i, j, along)
        volume = np.linalg.det(state["cell"]) * material["thickness"]
        return i, j, spring, love(branch, force + spring[:, None] * along, volume)[0, 0]

    stress = forces(packing, lambda i, j, along: np.zeros(len(i)))[3]
    gradient = np.array([[steer(0.0, stress), 0.0], [0.0, -RATE]])
    start = dict(packing, cell=(np.eye(2) + DT * gradient) @ cell)
    # s_new = s H_old/H_new, both cells upright: exact products of integers, since 64 bits are more than a double has
    start["fraction"] = np.array(
        [[int(s) * int(cell[a, a] * 2**60) // int(start["cell"][a, a] * 2**60) % 2**64 for a, s in enumerate(row)]
         for row in packing["fraction"]], dtype=np.uint64)
    position = packing["fraction"] * 2.0**-64

    def across_boundary(i, j, along):
        periods = nearest_image(packing["fraction"][i], packing["fraction"][j]) - (position[j] - position[i])
        motion = np.round(periods) @ (gradient @ start["cell"]).T
        return material["tangential_stiffness"] * DT * np.sum(along * motion, axis=1)

    i, j, spring, stress = forces(start, across_boundary)
    rate = steer(gradient[0, 0], stress)
    with open(path, "w") as out:
        out.write("gpu_rve_packing 1\nmaterial\n" + "".join(f"  {name} {value!r}\n" for name, value in material.items()))
        out.write("cell\n" + "".join(f"  {float(row[0])!r} {float(row[1])!r}\n" for row in start["cell"]))
        out.write(f"servo_velocity_gradient\n  {float(rate)!r} 0\n  0 0\n")
        out.write(f"grains {len(position)}\n")
        for k, (radius, s) in enumerate(zip(packing["radius"], start["fraction"])):
            out.write(f"{k + 1} {float(radius)!r} {s[0]} {s[1]} 0 0 0\n")
        kept = np.flatnonzero(spring)
        out.write(f"contacts {len(kept)}\n" + "".join(f"{i[k] + 1} {j[k] + 1} {float(spring[k])!r}\n" for k in kept) + "checksum none\nend\n")
    return stress


def differences(step, first, second, cell, diameter):
    """{quantity: (median, largest)} of the differences of two states, and the numbers that have neither. `cell` is that of the positions."""
    fraction = np.linalg.solve(cell, (second["position"] - first["position"]).T).T
    offset = (fraction - np.round(fraction)) @ cell.T
    values = {"position": np.hypot(offset[:, 0], offset[:, 1]) / diameter}

    # in step 1 nothing has a peculiar velocity or a spin yet: relative to the affine motion
    scale = np.sqrt(np.mean(np.sum(first["velocity"] ** 2, axis=1))) if step > 1 else RATE * diameter
    values["velocity"] = np.hypot(*(second["velocity"] - first["velocity"]).T) / scale
    scale = np.sqrt(np.mean(first["spin"] ** 2)) if step > 1 else RATE
    values["spin"] = np.abs(second["spin"] - first["spin"]) / scale

    other = 0
    if first["contacts"]:
        pairs = sorted(set(first["contacts"]) | set(second["contacts"]))
        other = len(set(first["contacts"]) ^ set(second["contacts"]))
        force = np.array([[state["contacts"].get(pair, (0.0, 0.0)) for pair in pairs] for state in (first, second)])
        values["normal force"], values["tangential force"] = np.abs(force[1] - force[0]).T / np.mean(force[0, :, 0])
    cell_difference = np.abs(second["cell"] - first["cell"]).max() / first["cell"].max()
    return {name: (np.median(value), np.max(value)) for name, value in values.items()}, other, cell_difference


def main():
    options = harness.parse_arguments(harness.new_parser(__doc__), __file__)
    path = os.path.join(harness.PACKINGS, CASE + ".rve")
    packing = read_packing(path)
    start = os.path.join(options.dir, "sudodem_start.rve")
    stress = sudodem_start(packing, start)
    gain = repr(float(element.servo_gain(packing)))
    diameter = 2.0 * np.mean(packing["radius"])
    check = harness.Checks()
    error = abs(stress / SECOND_STRESS - 1.0)
    check(error <= SECOND_STRESS_LIMIT, f"start of the biaxial test: s_xx {stress:.6f} Pa, SudoDEM2D {SECOND_STRESS:.6f} Pa: {error:.1e}")

    for test in element.TESTS:
        # the prepared start of the biaxial test is SudoDEM2D's second step
        begin = 1 if test == "biaxial" else 0
        first = start if begin else path
        stops = sorted({n for step in STEPS for n in (step - 1 - begin, step - begin) if n > 0})
        harness.run_lmp(options, "in.element", test, test=test, packing=first, stop=stops, gain=gain)
        harness.run_lmp(options, "in.element", "twin." + test, test=test, packing=first, stop=stops, gain=gain, rate=repr(RATE * TWIN))

        def state(name, n):
            # before its first step the biaxial test has the packing as it is
            return read_packing(os.path.join(options.dir, f"state.{name}.{n}") if n > 0 else first if n == 0 else path)

        print(f"\n{test:30}{'against SudoDEM2D':>22}{'limit':>22}{'twin':>22}")
        for step in STEPS:
            now, before = state(test, step - begin), state(test, step - 1 - begin)
            ours = our_state(now, before)
            theirs = sudodem_state(test, step)
            if step == 1:
                theirs["contacts"] = {}    # those of the packing
            found, other, cell = differences(step, theirs, ours, now["cell"], diameter)
            twin_now = state("twin." + test, step - begin)
            # the twin's positions in our cell: its fractions count, not the strain it is ahead
            twin_ours = our_state(dict(twin_now, cell=now["cell"]), state("twin." + test, step - 1 - begin))
            twin = differences(step, ours, twin_ours, now["cell"], diameter)[0]
            limits = (BIAXIAL_LIMITS if begin else LIMITS)[step]
            for name, (median, most) in found.items():
                limit = limits[name]
                text = "".join(f"{a:12.1e}{b:10.1e}" for a, b in ((median, most), limit, twin[name]))
                check(median <= limit[0] and most <= limit[1], f"step {step:4} {name:18}{text}".rstrip())
            check(cell <= CELL_LIMIT[test], f"step {step:4} {'cell':18}{'':12}{cell:10.1e}{'':12}{CELL_LIMIT[test]:10.1e}")
            if step > 1:
                check(other <= OTHER_CONTACTS, f"step {step:4} {'contacts of one':18}{'':12}{other:10}{'':12}{OTHER_CONTACTS:10}")
    print("\nmedian and largest difference; positions in mean diameters, velocities and spins in their root mean squares, forces in the mean"
          "\nnormal force (in step 1: velocities and spins in those of the affine motion over a diameter)")
    check.exit()


if __name__ == "__main__":
    main()
