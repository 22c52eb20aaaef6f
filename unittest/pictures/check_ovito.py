"""OVITO opens grains.dump as particles and contacts.dump as their bonds, in every frame, with the numbers of the dumps; and what it has
then is in balance: the sum of force times branch vector over the area of OVITO's cell is the stress that the point has."""

import dumps
import numpy as np
import view_ovito

THICKNESS = 0.075    # of the packing's disks [m]
LOOK = 54            # the point whose RVE it is

grains, contacts, points = ({frame.step: frame for frame in dumps.frames(name + ".dump")} for name in ("grains", "contacts", "points"))
pipeline = view_ovito.load()    # as the example and the manual do it
steps = sorted(grains)
assert pipeline.num_frames == len(steps) == 5, pipeline.num_frames

for k, step in enumerate(steps):
    data = pipeline.compute(k)
    grain, contact = grains[step], contacts[step]
    assert data.attributes["Timestep"] == step
    assert data.particles.count == len(grain) == 400
    assert data.particles.bonds.count == len(contact) > 700
    assert np.allclose(data.cell[:, :3], grain.cell, rtol=1e-12, atol=0) and np.allclose(data.cell[:, 3], grain.origin)
    assert data.cell.pbc == (True, True, False)
    # radii are of 32 bits in OVITO
    assert np.allclose(data.particles["Radius"], grain["radius"], rtol=1e-6)
    assert np.allclose(data.particles["Position"][:, :2], np.stack([grain["x"], grain["y"]], axis=1), atol=1e-12)
    assert np.array_equal(data.particles["Particle Identifier"], grain["id"])
    assert np.allclose(data.particles["Angular Velocity"][:, 2], grain["omegaz"])
    found = data.particles.bonds
    ends = np.array(data.particles["Particle Identifier"])[np.array(found.topology)]
    assert np.array_equal(ends, np.stack([contact["id1"], contact["id2"]], axis=1))
    assert np.allclose(found["fn"], contact["fn"]) and np.allclose(found["sliding"], contact["sliding"])

    # OVITO's own way from grain to grain, through the periodic image that it chose
    position = np.array(data.particles["Position"])
    topology = np.array(found.topology)
    branch = position[topology[:, 1]] - position[topology[:, 0]] + np.array(found["Periodic Image"]) @ np.array(data.cell[:, :3]).T
    assert np.allclose(branch[:, :2], np.stack([contact["branch_x"], contact["branch_y"]], axis=1), atol=1e-9)
    force = np.stack([contact["force_x"], contact["force_y"]], axis=1)
    area = np.linalg.det(np.array(data.cell[:2, :2]))
    stress = force.T @ branch[:, :2] / (area * THICKNESS)
    row = list(points[step]["id"]).index(LOOK)
    says = [points[step][name][row] for name in ("stress_xx", "stress_yy", "stress_xy")]
    # grains that are not yet at rest have moments, and their stress a part that is not symmetric, which the continuum drops
    seen = [stress[0, 0], stress[1, 1], 0.5 * (stress[0, 1] + stress[1, 0])]
    # positions, forces and stress have ten digits in the dumps, and the engine is of format mixed
    assert np.allclose(seen, says, atol=1e-5 * abs(says[1])), (step, seen, says)
    print(f"step {step}: {data.particles.count} grains, {found.count} contacts, stress {seen[0]:.6g} {seen[1]:.6g} {seen[2]:.6g} Pa")
