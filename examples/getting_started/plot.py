#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Pictures of the two runs of Getting started: element.png and problem.png.

    python3 plot.py      (in the folder where in.element and in.problem have run; needs python3-matplotlib)
"""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection

from results import passive, read_dump


def read_packing(path):
    """Corners of the cell, radii and centers of a LAMMPS data file of write_rve."""
    size, tilt, grains, section = {}, 0.0, [], None
    for line in open(path):
        words = line.split("#")[0].split()
        if not words:
            continue
        if words[-1] in ("xhi", "yhi"):
            size[words[-1][0]] = float(words[1]) - float(words[0])
        elif words[-1] == "yz":
            tilt = float(words[0])
        elif words[0] in ("Atoms", "Velocities"):
            section = words[0]
        elif section == "Atoms":
            grains.append([float(words[column]) for column in (2, 4, 5)])
    grains = np.array(grains)
    corners = np.array([[0, 0], [size["x"], 0], [size["x"] + tilt, size["y"]], [tilt, size["y"]], [0, 0]])
    return corners, grains[:, 0] / 2, grains[:, 1:]


def draw_packing(axes, name, title):
    """Grains, and contact forces as lines between their centers."""
    corners, radius, center = read_packing(name)
    contacts = np.loadtxt(name + ".contacts")
    axes.add_collection(EllipseCollection(2 * radius, 2 * radius, 0 * radius, units="x", offsets=center, offset_transform=axes.transData,
                                          facecolor="0.92", edgecolor="0.7", linewidth=0.4))
    start = center[contacts[:, 0].astype(int) - 1]
    force = contacts[:, 7]
    axes.add_collection(LineCollection(np.stack([start, start + contacts[:, 2:4]], axis=1), colors="firebrick",
                                       linewidths=1.2 * force / force.mean(), capstyle="round"))
    axes.plot(*corners.T, color="navy", linewidth=0.8)
    axes.set(title=title, aspect="equal", xticks=[], yticks=[])


def draw_element():
    strain, _, _, ratio, volume = np.loadtxt("curve.element").T[:5]
    figure, axes = plt.subplots(2, 2, figsize=(9, 7.6), constrained_layout=True)
    axes = axes.flat
    axes[0].plot(100 * strain, ratio)
    axes[0].set(xlabel="axial strain [%]", ylabel="q/p", ylim=(0, None))
    axes[1].plot(100 * strain, 100 * volume)
    axes[1].set(xlabel="axial strain [%]", ylabel="volumetric strain, dilation positive [%]")
    draw_packing(axes[2], "before.element", "before")
    draw_packing(axes[3], "after.element", "after, strain 9.5 %")
    figure.savefig("element.png", dpi=110)


def draw_field(axes, fields, name, label):
    """One column as coloured squares where the points are now, the wall in grey."""
    columns = np.unique(np.round(fields["x"] - fields["ux"], 3))
    side = (columns[-1] - columns[0]) / (len(columns) - 1)
    square = side / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    corners = np.stack([fields["x"], fields["y"]], axis=1)[:, None] + square
    ground = fields["type"] == 1
    points = axes.add_collection(PolyCollection(corners[ground], array=fields[name][ground], cmap="viridis", edgecolor="white", linewidth=0.3))
    axes.add_collection(PolyCollection(corners[~ground], facecolor="0.4"))
    axes.set(aspect="equal", xlim=(0.2, 5), ylim=(0, 2.1), xlabel="x [m]", ylabel="y [m]")
    axes.figure.colorbar(points, ax=axes, label=label, orientation="horizontal", shrink=0.9)


def draw_problem():
    moved, pressure = np.loadtxt("curve.problem").T
    strain, _, _, ratio = np.loadtxt("curve.element").T[:4]
    fields = read_dump("fields.problem")
    figure, panels = plt.subplot_mosaic([["curve", "curve"], ["strain", "voids"]], figsize=(9, 6.8), constrained_layout=True)
    axes = list(panels.values())
    axes[0].plot(moved, pressure / 1000)
    axes[0].axhline(passive(ratio.max(), 100), color="0.3", linestyle="--", label="Rankine, peak friction")
    axes[0].axhline(passive(ratio[strain > 0.06].mean(), 100), color="0.3", linestyle=":", label="Rankine, residual friction")
    axes[0].set(xlabel="displacement of the wall [m]", ylabel="pressure on the wall [kPa]", ylim=(0, None))
    axes[0].legend()
    draw_field(axes[1], fields, "eps_q", "deviatoric strain")
    draw_field(axes[2], fields, "void_ratio", "void ratio")
    figure.savefig("problem.png", dpi=110)


if __name__ == "__main__":
    draw_element()
    draw_problem()
