#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws the figure of README.md from the files of in.overview: the strain in the ground, the grains
and force chains of two RVEs, and the load-settlement curve.

    python3 plot_overview.py [--out overview.png]

Needs numpy and matplotlib (Debian: python3-numpy, python3-matplotlib).
"""

import argparse
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.patches import ConnectionPatch, Polygon, Rectangle

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools"))
import dumps

WINDOW = (0.0, 9.0, 3.0, 8.5)    # of the ground that is shown [m]
RVES = {"band": ((1.125, 7.125), "tab:red"), "rest": ((8.125, 5.125), "tab:blue")}


def draw_ground(axes, frame):
    soil = frame["type"] == 1
    middle = np.column_stack([frame["x"][soil], frame["y"][soil]])
    square = 0.128 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])    # h/2, without gaps
    drawn = PolyCollection(middle[:, None] + square, array=100 * frame["eps_q"][soil],
                           cmap="viridis", norm=Normalize(0, 20), lw=0)
    axes.add_collection(drawn)
    axes.add_patch(Rectangle((0, frame["y"][~soil].min() - 0.125), 1.0, 0.5, color="0.25"))
    axes.set(xlim=WINDOW[:2], ylim=WINDOW[2:], aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.figure.colorbar(drawn, ax=axes, location="bottom", shrink=0.5, pad=0.16, aspect=30,
                         extend="max", label="deviatoric strain [%]")


def draw_rve(axes, name, color):
    """Draws the cell, the grains, and each contact as a line whose width is its normal force."""
    grains = dumps.last_frame("grains." + name)
    contacts = dumps.last_frame("contacts." + name)
    cell = grains.cell[:2, :2]
    position = np.column_stack([grains["x"], grains["y"]]) - grains.origin[:2]
    radius = grains["radius"]
    corners = np.array([[0, 0], cell[:, 0], cell[:, 0] + cell[:, 1], cell[:, 1]])
    images = [a * cell[:, 0] + b * cell[:, 1] for a in (-1, 0, 1) for b in (-1, 0, 1)]
    border = Polygon(corners, fill=False, ec=color, lw=1.5)
    axes.add_patch(border)
    start = position[contacts["id1"].astype(int) - 1]
    branch = position[contacts["id2"].astype(int) - 1] - start
    branch -= np.round(branch @ np.linalg.inv(cell).T) @ cell.T    # to the nearest image
    width = 3.5 * contacts["fn"] / 250.0
    for image in images:
        disks = EllipseCollection(2 * radius, 2 * radius, 0 * radius, units="x",
                                  offsets=position + image, offset_transform=axes.transData,
                                  facecolor="0.92", edgecolor="0.6", lw=0.4)
        chains = LineCollection(np.stack([start + image, start + image + branch], axis=1),
                                linewidths=width, colors=color, capstyle="round")
        for drawn in (disks, chains):
            axes.add_collection(drawn)
            drawn.set_clip_path(border)
    axes.set(xlim=(corners[:, 0].min(), corners[:, 0].max()),
             ylim=(corners[:, 1].min(), corners[:, 1].max()), aspect="equal")
    axes.axis("off")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default="overview.png")
    options = parser.parse_args()

    figure = plt.figure(figsize=(13, 4.6))
    grid = figure.add_gridspec(2, 3, width_ratios=[2.3, 0.8, 1.2], wspace=0.2, hspace=0.1,
                               left=0.045, right=0.985, bottom=0.13, top=0.97)
    ground = figure.add_subplot(grid[:, 0])
    draw_ground(ground, dumps.last_frame("fields.footing"))
    for row, (name, (point, color)) in enumerate(RVES.items()):
        axes = figure.add_subplot(grid[row, 1])
        draw_rve(axes, name, color)
        ground.add_patch(Rectangle((point[0] - 0.125, point[1] - 0.125), 0.25, 0.25, fill=False,
                                   ec=color, lw=1.5))
        figure.add_artist(ConnectionPatch(point, (0.0, 0.5), "data", "axes fraction",
                                          axesA=ground, axesB=axes, color=color, lw=1))
    curve = np.loadtxt("curve.footing")
    axes = figure.add_subplot(grid[:, 2])
    axes.plot(curve[:, 0], curve[:, 1] / 1000, color="0.15")
    axes.set(xlabel="settlement [m]", ylabel="pressure on the footing [kPa]", xlim=(0, None),
             ylim=(0, None))
    figure.savefig(options.out, dpi=100)
    print("wrote", options.out)


if __name__ == "__main__":
    main()
