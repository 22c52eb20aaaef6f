# SPDX-License-Identifier: GPL-2.0-only
"""OVITO opens grains.dump as particles and contacts.dump as their bonds in every frame, with the
numbers of the dumps. The sum of force times branch vector over the area of OVITO's cell is the
stress of the point. The same holds for spheres."""

import dumps
import numpy as np
import view_ovito
from ovito.io import import_file
from ovito.modifiers import LoadTrajectoryModifier

THICKNESS = 0.075    # thickness of the packing's disks [m]
LOOK = 54    # point of the dumped RVE

grains, contacts, points = ({frame.step: frame
                             for frame in dumps.frames(name + ".dump")}
                            for name in ("grains", "contacts", "points"))
pipeline = view_ovito.load()    # as in the example and the manual
steps = sorted(grains)
assert pipeline.num_frames == len(steps) == 5, pipeline.num_frames

for k, step in enumerate(steps):
    data = pipeline.compute(k)
    grain, contact = grains[step], contacts[step]
    assert data.attributes["Timestep"] == step
    assert data.particles.count == len(grain) == 400
    assert data.particles.bonds.count == len(contact) > 700
    assert np.allclose(data.cell[:, :3], grain.cell, rtol=1e-12, atol=0) and np.allclose(
        data.cell[:, 3], grain.origin)
    assert data.cell.pbc == (True, True, False)
    # OVITO has 32-bit radii.
    assert np.allclose(data.particles["Radius"], grain["radius"], rtol=1e-6)
    assert np.allclose(data.particles["Position"][:, :2],
                       np.stack([grain["x"], grain["y"]], axis=1),
                       atol=1e-12)
    assert np.array_equal(data.particles["Particle Identifier"], grain["id"])
    assert np.allclose(data.particles["Angular Velocity"][:, 2], grain["omegaz"])
    found = data.particles.bonds
    ends = np.array(data.particles["Particle Identifier"])[np.array(found.topology)]
    assert np.array_equal(ends, np.stack([contact["id1"], contact["id2"]], axis=1))
    assert np.allclose(found["fn"], contact["fn"]) and np.allclose(found["sliding"],
                                                                   contact["sliding"])

    # OVITO's branch vectors use its own choice of periodic images.
    position = np.array(data.particles["Position"])
    topology = np.array(found.topology)
    branch = position[topology[:, 1]] - position[topology[:, 0]] + np.array(
        found["Periodic Image"]) @ np.array(data.cell[:, :3]).T
    assert np.allclose(branch[:, :2],
                       np.stack([contact["branch_x"], contact["branch_y"]], axis=1),
                       atol=1e-9)
    force = np.stack([contact["force_x"], contact["force_y"]], axis=1)
    area = np.linalg.det(np.array(data.cell[:2, :2]))
    stress = force.T @ branch[:, :2] / (area * THICKNESS)
    row = list(points[step]["id"]).index(LOOK)
    says = [points[step][name][row] for name in ("stress_xx", "stress_yy", "stress_xy")]
    # Grains in motion have moments, so that their stress has a nonsymmetric part, which the
    # continuum drops.
    seen = [stress[0, 0], stress[1, 1], 0.5 * (stress[0, 1] + stress[1, 0])]
    # Positions, forces and stress have ten digits in the dumps, and the engine has format mixed.
    assert np.allclose(seen, says, atol=1e-5 * abs(says[1])), (step, seen, says)
    print(
        f"step {step}: {data.particles.count} grains, {found.count} contacts, stress {seen[0]:.6g} "
        f"{seen[1]:.6g} {seen[2]:.6g} Pa"
    )

# Spheres have positions, radii, a cell with all tilts, and the network of contacts.
grains, contacts = ({frame.step: frame
                     for frame in dumps.frames(name + ".dump")}
                    for name in ("spheres", "sphere_contacts"))
pipeline = import_file("spheres.dump")
bonds = LoadTrajectoryModifier()
bonds.source.load("sphere_contacts.dump",
                  multiple_frames=True,
                  columns=[
                      "Particle Identifiers.1", "Particle Identifiers.2", "fn", "branch_x",
                      "branch_y", "branch_z", "force_x", "force_y", "force_z", "sliding"
                  ])
pipeline.modifiers.append(bonds)
stresses = np.atleast_2d(np.loadtxt("spheres.stress"))
assert pipeline.num_frames == len(grains) == len(stresses) == 3
for k, step in enumerate(sorted(grains)):
    data = pipeline.compute(k)
    grain, contact = grains[step], contacts[step]
    assert data.particles.count == len(grain) == 500 and data.particles.bonds.count == len(
        contact) > 1000
    assert data.cell.pbc == (True, True, True)
    cell = np.array(data.cell[:, :3])
    assert np.allclose(cell, grain.cell, rtol=1e-12, atol=0)
    if k > 0:
        assert np.all(np.abs(cell) > 1e-4), cell    # no component of the cell is zero
    place = np.stack([grain["x"], grain["y"], grain["z"]], axis=1)
    position = np.array(data.particles["Position"])
    assert np.allclose(position, place, atol=1e-12)
    assert np.allclose(data.particles["Radius"], grain["radius"], rtol=1e-6)
    assert np.allclose(data.particles["Angular Velocity"],
                       np.stack([grain["omegax"], grain["omegay"], grain["omegaz"]], axis=1))
    found = data.particles.bonds
    topology = np.array(found.topology)
    ends = np.array(data.particles["Particle Identifier"])[topology]
    assert np.array_equal(ends, np.stack([contact["id1"], contact["id2"]], axis=1))
    branch = position[topology[:, 1]] - position[topology[:, 0]] + np.array(
        found["Periodic Image"]) @ cell.T
    assert np.allclose(branch,
                       np.stack([contact[f"branch_{axis}"] for axis in "xyz"], axis=1),
                       atol=1e-12)
    # Bonds are contacts, with the length of both radii less the overlap.
    reach = grain["radius"][topology].sum(axis=1) - np.linalg.norm(branch, axis=1)
    assert np.allclose(1e6 * reach, contact["fn"], rtol=1e-6, atol=1e-6 * contact["fn"].max())
    assert np.array_equal(np.bincount(topology.ravel(), minlength=500), grain["contacts"])
    force = np.stack([contact[f"force_{axis}"] for axis in "xyz"], axis=1)
    stress = force.T @ branch / abs(np.linalg.det(cell))
    xx, yy, zz, xy, yx, xz, zx, yz, zy = stresses[k, 1:]
    assert np.allclose(stress, [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]],
                       atol=1e-9 * abs(xx)), (step, stress, stresses[k])
    print(
        f"step {step}: {data.particles.count} spheres, {found.count} contacts, trace of the stress "
        f"{np.trace(stress):.6g} Pa"
    )
