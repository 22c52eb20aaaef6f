# SPDX-License-Identifier: GPL-2.0-only
"""A slow, obvious DEM of one RVE in double precision, with the printed alternatives of the paper as switches.

The motion is that of the documentation (theory_rve): fractional coordinates s, never wrapped, and peculiar velocities c; numbers in
parentheses are equations of Zhao, Zhao & Liang (2021). Contacts are looked for among the pairs of a list, which stays as it is
unless a rule renews it.
"""

import numpy as np

SIGNED, PRINTED = "signed", "printed"                       # tangential force, (14)
EXACT, EULER, EULER_FP32 = "exact", "Euler", "Euler fp32"    # the cell


class ReferenceDem:
    def __init__(self, packing, dt, tangential=SIGNED, cell_update=EXACT, spin=0.0):
        m = packing["material"]
        self.kn, self.kt, self.friction = m["normal_stiffness"], m["tangential_stiffness"], m["friction"]
        self.damping, self.thickness = m["local_damping"], m["thickness"]
        self.radius, self.s, self.cell = packing["radius"], packing["fraction"] * 2.0**-64, packing["cell"].copy()
        self.mass = packing["mass"]
        self.inertia = 0.5 * self.mass * self.radius**2
        self.c = np.zeros_like(self.s)
        self.spin = np.full(len(self.radius), float(spin))
        self.dt, self.tangential, self.cell_update = dt, tangential, cell_update
        self.cell32 = self.cell.astype(np.float32)
        self.memory = np.zeros((len(self.radius), len(self.radius)))    # tangential force of i < j
        self.i = self.j = np.zeros(0, int)
        self.find_pairs()

    # ------------------------------------------------------------ contacts

    def branches(self, i, j):
        """From i to the nearest image of j."""
        d = self.s[j] - self.s[i]
        return (d - np.round(d)) @ self.cell.T

    def use_pairs(self, i, j):
        """Looks for contacts among these pairs from now on; forces of the pairs before go along."""
        if len(self.i):
            self.memory[:] = 0.0
            self.memory[self.i, self.j] = self.ft
        self.i, self.j, self.ft = i, j, self.memory[i, j]
        self.sum_of_radii = self.radius[i] + self.radius[j]

    def find_pairs(self, margin=0.2):
        """Takes all pairs nearer than (1 + margin) times the sum of their radii."""
        i, j = np.triu_indices(len(self.radius), 1)
        b = self.branches(i, j)
        near = np.hypot(b[:, 0], b[:, 1]) < (1.0 + margin) * (self.radius[i] + self.radius[j])    # (30a)
        self.use_pairs(i[near], j[near])

    def contacts(self):
        """All pairs that touch, from a search over all pairs."""
        i, j = np.triu_indices(len(self.radius), 1)
        b = self.branches(i, j)
        touch = b[:, 0]**2 + b[:, 1]**2 < (self.radius[i] + self.radius[j])**2
        return i[touch], j[touch]

    # ------------------------------------------------------------ a step

    def move_cell(self, gradient):
        if self.cell_update == EXACT:    # exp(L dt) to third order: exact for a shear, 1e-17 for the rotations here
            a = gradient * self.dt
            self.cell = self.cell + a @ (self.cell + a @ (self.cell + a @ self.cell / 3.0) / 2.0)
        elif self.cell_update == EULER:
            self.cell = self.cell + self.dt * gradient @ self.cell
        else:
            self.cell32 = self.cell32 + (np.float32(self.dt) * gradient.astype(np.float32)) @ self.cell32
            self.cell = self.cell32.astype(float)

    def forces(self, gradient):
        """Sums of forces and torques, and Love's stress (24), tension positive."""
        i, j = self.i, self.j
        b = self.branches(i, j)
        distance = np.hypot(b[:, 0], b[:, 1])
        overlap = self.sum_of_radii - distance
        touch = overlap > 0.0
        n = b / distance[:, None]
        arm_i, arm_j = self.radius[i] - 0.5 * overlap, self.radius[j] - 0.5 * overlap
        v = self.c[j] - self.c[i] + b @ gradient.T    # (11), (20a)
        slip = (n[:, 0] * v[:, 1] - n[:, 1] * v[:, 0] - arm_i * self.spin[i] - arm_j * self.spin[j]) * self.dt    # (12)
        fn = np.where(touch, self.kn * overlap, 0.0)    # (13a)
        limit = self.friction * fn
        if self.tangential == SIGNED:
            ft = np.clip(self.ft + self.kt * slip, -limit, limit)
        else:    # (14) as printed; it has no direction without slip: the old force stays
            ft = np.where(slip == 0.0, np.clip(self.ft, -limit, limit),
                          np.minimum(np.abs(self.ft) + self.kt * np.abs(slip), limit) * np.sign(slip))
        self.ft = np.where(touch, ft, 0.0)
        f = np.stack([-fn * n[:, 0] - self.ft * n[:, 1], -fn * n[:, 1] + self.ft * n[:, 0]], axis=1)    # on i
        size = len(self.radius)
        force = np.stack([np.bincount(i, f[:, a], size) - np.bincount(j, f[:, a], size) for a in (0, 1)], axis=1)
        torque = np.bincount(i, arm_i * self.ft, size) + np.bincount(j, arm_j * self.ft, size)
        self.stress = f.T @ b / (np.linalg.det(self.cell) * self.thickness)
        self.largest_overlap = (overlap / self.sum_of_radii).max()
        self.unbalanced = np.hypot(force[:, 0], force[:, 1]).mean() / max(np.hypot(f[:, 0], f[:, 1])[touch].mean(), 1e-300) if touch.any() else 0.0
        return force, torque

    def step(self, gradient, renew_list=None):
        """Cell, drift, (list), force, kick."""
        self.move_cell(gradient)
        self.s += self.dt * self.c @ np.linalg.inv(self.cell).T
        if renew_list:
            renew_list(self)
        force, torque = self.forces(gradient)
        self.c += self.dt * self.damped(force / self.mass[:, None], self.c)
        self.spin += self.dt * self.damped(torque / self.inertia, self.spin)

    def damped(self, acceleration, velocity):
        """Local damping with the velocity at the full step, (4)."""
        return acceleration * (1.0 - self.damping * np.sign(acceleration) * np.sign(velocity + 0.5 * self.dt * acceleration))

    def p(self):
        return -0.5 * (self.stress[0, 0] + self.stress[1, 1])

    def q(self):
        s = 0.5 * (self.stress + self.stress.T)
        return np.hypot(0.5 * (s[0, 0] - s[1, 1]), s[0, 1])
