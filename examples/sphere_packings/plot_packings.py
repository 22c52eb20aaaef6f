#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Solid fraction and coordination number of the packings of in.sphere_packings: a table and sphere_packings.png.

    python3 plot_packings.py      (in the folder where in.sphere_packings has run; needs python3-numpy, and python3-matplotlib for the picture)
"""

import glob

import numpy as np


def read_library(path):
    """Cell, radii and fractional coordinates of each packing of a library."""
    packings, lines = [], (line.split("#")[0].split() for line in open(path))
    for words in lines:
        if words == ["cell"]:
            cell = np.array([next(lines) for _ in range(3)], dtype=float)
        elif words[:1] == ["grains"]:
            rows = []
            while len(rows) < int(words[1]):
                row = next(lines)
                if row:
                    rows.append([float(row[1])] + [int(s) / 2.0**64 for s in row[2:5]])
            grains = np.array(rows)
            packings.append((cell, grains[:, 0], grains[:, 1:]))
    return packings


def describe(cell, radius, fraction, fewest_contacts):
    """Solid fraction, coordination number of those that bear load, and the share of those that do not."""
    apart = fraction[:, None] - fraction[None]
    distance = np.linalg.norm((apart - np.round(apart)) @ cell.T, axis=2)
    touching = distance < radius[:, None] + radius[None]
    np.fill_diagonal(touching, False)
    bearing = np.ones(len(radius), dtype=bool)
    while True:    # a grain that bears nothing may leave its neighbours with too few contacts
        contacts = (touching & bearing[:, None] & bearing[None]).sum(axis=1)
        idle = bearing & (contacts < fewest_contacts)
        if not idle.any():
            break
        bearing &= ~idle
    solid = (4 / 3 * np.pi * radius**3).sum() / np.linalg.det(cell)
    return solid, contacts[bearing].mean(), 1 - bearing.mean()


def table():
    """Rows of friction, and of each number its mean and standard error over the seeds."""
    rows = []
    for path in glob.glob("friction_*.rve"):
        friction = float(path[len("friction_"):-len(".rve")])
        # without friction a sphere rests on four others; with it, two can hold one
        numbers = np.array([describe(*packing, 4 if friction == 0 else 2) for packing in read_library(path)])
        error = numbers.std(axis=0, ddof=1) / np.sqrt(len(numbers))
        rows.append([friction, *np.stack([numbers.mean(axis=0), error], axis=1).ravel()])
    return np.array(sorted(rows))


def draw(rows):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    # Agnolin and Roux, Phys. Rev. E 76, 061302 (2007): equal spheres compressed directly
    reference = {1: ([0, 0.3], [0.639, 0.593]), 3: ([0, 0.3], [6.0, 4.5])}
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), constrained_layout=True)
    for one, column, label in ((axes[0], 1, "solid fraction"), (axes[1], 3, "contacts of a sphere that bears load")):
        one.errorbar(rows[:, 0], rows[:, column], rows[:, column + 1], fmt="o-", markersize=4, capsize=2, label="these packings")
        one.plot(*reference[column], "s", color="firebrick", fillstyle="none", label="Agnolin and Roux (2007)")
        one.set(xlabel="friction", ylabel=label)
        one.legend()
    figure.savefig("sphere_packings.png", dpi=150)


if __name__ == "__main__":
    rows = table()
    print("friction  solid fraction        coordination        idle spheres")
    for mu, solid, d_solid, contacts, d_contacts, idle, d_idle in rows:
        print(f"{mu:8.2f}  {solid:.4f} +- {d_solid:.4f}    {contacts:.3f} +- {d_contacts:.3f}    {idle:.3f} +- {d_idle:.3f}")
    draw(rows)
