# SPDX-License-Identifier: GPL-2.0-only
"""LAMMPS reads the spheres of write_rve: after read_data it has their numbers and box, finds the
contacts of the table next to the file, and their normal forces give the same virial."""

import numpy as np


def section(lines, name, columns):
    start = next(k for k, line in enumerate(lines) if line.startswith(name)) + 2
    rows = []
    while start < len(lines) and lines[start].strip():
        rows.append(lines[start].split()[:columns])
        start += 1
    table = np.array(rows, dtype=float)
    return table[np.argsort(table[:, 0])]


lines = open("spheres.data").read().split("\n")
atoms, velocities = section(lines, "Atoms", 7), section(lines, "Velocities", 7)
edges = np.array([[float(word) for word in line.split()[:2]] for line in lines if "lo " in line])
tilts = np.array(
    [float(word) for line in lines if line.endswith("xy xz yz") for word in line.split()[:3]])
assert len(atoms) == 500 and np.all(
    np.abs(tilts) <= 0.5 * np.array([edges[0, 1], edges[0, 1], edges[1, 1]]) * (1 + 1e-12))
assert np.all(tilts != 0)
volume = np.prod(edges[:, 1] - edges[:, 0])

dump = open("spheres.lammps").read().split("\n")
start = next(k for k, line in enumerate(dump) if line.startswith("ITEM: ATOMS"))
read = np.array([line.split() for line in dump[start + 1:] if line], dtype=float)
assert np.array_equal(read[:, 0], atoms[:, 0])
assert np.array_equal(read[:, 1:4], atoms[:, 4:7]) or np.allclose(
    read[:, 1:4], atoms[:, 4:7], rtol=0, atol=1e-16)
assert np.array_equal(2 * read[:, 4], atoms[:, 2])
assert np.allclose(read[:, 5], 2650 * np.pi / 6 * atoms[:, 2] ** 3, rtol=1e-14)
assert np.array_equal(read[:, 6:12],
                      velocities[:, 1:7]) and np.all(np.ptp(velocities[:, 1:], axis=0) > 0)

head = open("spheres.data.contacts").readlines()[1].split()[1:]
contacts = dict(zip(head, np.loadtxt("spheres.data.contacts").T))
seen = np.array(open("spheres.normal").read().split(), dtype=float)
assert seen[0] == 2 * len(contacts["i"]) > 2000    # LAMMPS counts the contacts of each grain
branch, normal, force = (np.stack([contacts[f"{name}_{axis}"] for axis in "xyz"], axis=1)
                         for name in ("branch", "n", "force"))
virial = np.einsum("c,ca,cb->ab", contacts["f_n"], normal, branch) / volume
expected = virial[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
assert np.allclose(seen[1:], expected, rtol=0, atol=1e-11 * expected[0]), (seen[1:], expected)

# All forces together give the stress of the RVE, whose axes are rotated from those of the box:
# invariants agree.
stress = np.array(open("spheres.stress").read().split("\n")[-2].split()[1:], dtype=float)
xx, yy, zz, xy, yx, xz, zx, yz, zy = stress
of_rve = np.array([[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]])
of_file = force.T @ branch / volume
for power in (1, 2, 3):
    one, other = (np.trace(np.linalg.matrix_power(tensor, power)) for tensor in (of_rve, of_file))
    assert abs(one - other) < 1e-9 * abs(one), (power, one, other)
print(
    f"{len(atoms)} spheres, {len(contacts['i'])} contacts, pressure of their normal forces "
    f"{np.trace(virial) / 3:.6g} Pa"
)
