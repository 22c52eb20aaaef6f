#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Plots of the element tests: stress ratio and volumetric strain over strain, and the force chains of the packing.

    python3 plot_element.py uniaxial shear biaxial        (the endings of the files that in.element wrote)

Writes element_tests.png and force_chains.<ending>.png for each ending.
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection


def read_packing(path):
    """Box matrix (columns = cell vectors), radii and positions of a LAMMPS data file."""
    lengths, tilt, grains, section = {}, 0.0, [], None
    for line in open(path):
        words = line.split("#")[0].split()
        if not words:
            continue
        if words[-1] in ("xhi", "yhi"):
            lengths[words[-1][0]] = float(words[1]) - float(words[0])
        elif words[-1] == "yz":
            tilt = float(words[0])
        elif words[0] in ("Atoms", "Velocities"):
            section = words[0]
        elif section == "Atoms":
            grains.append([float(word) for word in (words[2], words[4], words[5])])
    grains = np.array(grains)
    return np.array([[lengths["x"], tilt], [0.0, lengths["y"]]]), grains[:, 0] / 2, grains[:, 1:]


def plot_curves(endings):
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4))
    for ending in endings:
        curve = np.loadtxt("curve." + ending)
        left.plot(100 * curve[:, 0], curve[:, 3], label=ending)
        right.plot(100 * curve[:, 0], 100 * curve[:, 4], label=ending)
    left.set(xlabel="strain [%]", ylabel="q/p [-]", xlim=(0, None), ylim=(0, None))
    right.set(xlabel="strain [%]", ylabel="volumetric strain, dilation positive [%]", xlim=(0, None))
    left.legend()
    figure.tight_layout()
    figure.savefig("element_tests.png", dpi=120)


def plot_force_chains(ending):
    figure, axes = plt.subplots(1, 2, figsize=(11, 5.6))
    for axis, moment in zip(axes, ("before", "after")):
        cell, radius, position = read_packing(f"{moment}.{ending}")
        contacts = np.loadtxt(f"{moment}.{ending}.contacts")
        axis.add_collection(EllipseCollection(2 * radius, 2 * radius, 0 * radius, units="x", offsets=position,
                                              offset_transform=axis.transData, facecolor="0.93", edgecolor="0.7", lw=0.4))
        start = position[contacts[:, 0].astype(int) - 1]
        force = contacts[:, 7]
        chains = LineCollection(np.stack([start, start + contacts[:, 2:4]], axis=1), colors="firebrick",
                                linewidths=1.3 * force / force.mean(), capstyle="round")
        axis.add_collection(chains)
        corners = (cell @ np.array([[0, 1, 1, 0, 0], [0, 0, 1, 1, 0]])).T
        axis.plot(corners[:, 0], corners[:, 1], "b-", lw=0.8)
        axis.set(title=f"{ending}, {moment}", aspect="equal", xticks=[], yticks=[])
        margin = 0.05 * np.ptp(corners, axis=0).max()
        axis.set_xlim(corners[:, 0].min() - margin, corners[:, 0].max() + margin)
        axis.set_ylim(corners[:, 1].min() - margin, corners[:, 1].max() + margin)
    figure.tight_layout()
    figure.savefig(f"force_chains.{ending}.png", dpi=120)


def main():
    endings = sys.argv[1:]
    if not endings:
        sys.exit(__doc__)
    plot_curves(endings)
    for ending in endings:
        plot_force_chains(ending)


if __name__ == "__main__":
    main()
