#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws the files of in.retaining_wall and study.retaining_wall: K against the movement of the wall, and the strain of two runs.

    python3 plot_retaining_wall.py                     curve.active and curve.passive, as far as they exist, with Rankine's K of 28.7 degrees
    python3 plot_retaining_wall.py active_rotation passive_rotation active passive --phi 30

A name is that of `-var out NAME`; the strain is drawn for the first two. --phi is the friction angle of Rankine's coefficients (28.7 degrees: an
RVE of disks at its peak; study.retaining_wall with Mohr-Coulomb has 30). The script needs numpy and matplotlib.
"""

import argparse
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools"))
import dumps
from plot_fields import field

WALL = [2]    # type of its points


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="default: active and passive")
    parser.add_argument("--phi", type=float, default=28.7, help="friction angle [degrees] of Rankine's coefficients (default: 28.7)")
    parser.add_argument("--out", default="retaining_wall.png")
    args = parser.parse_args()
    args.names = args.names or [name for name in ("active", "passive") if os.path.exists(f"curve.{name}")]
    if not args.names:
        parser.error("there is no curve.active: run in.retaining_wall first")
    shown = args.names[:2]
    figure, axes = plt.subplots(1, 1 + len(shown), figsize=(5 + 5.5 * len(shown), 4), constrained_layout=True)
    axes = np.atleast_1d(axes)
    for name in args.names:
        rows = np.loadtxt(f"curve.{name}", ndmin=2)[1:]    # the first mean is not there yet
        axes[0].plot(100 * np.abs(rows[:, 0]), rows[:, 1], marker=".", label=name.replace("_", ", "))
        end = rows[-1]
        extreme = rows[np.argmin(rows[:, 1])] if end[0] < 0 else rows[np.argmax(rows[:, 1])]
        print(f"{name}: K = {extreme[1]:.3f} at a movement of {100 * extreme[0]:.1f} % of the height, {end[1]:.3f} at {100 * end[0]:.1f} %")
    sine = np.sin(np.radians(args.phi))
    for coefficient, words in (((1.0 - sine) / (1.0 + sine), f"Rankine, φ = {args.phi:g}°"), ((1.0 + sine) / (1.0 - sine), None)):
        axes[0].axhline(coefficient, color="0.4", lw=0.8, ls="--", label=words)
    axes[0].set(xlabel="movement of the wall (of its top) / height [%]", ylabel="K", yscale="log", yticks=(0.3, 0.5, 1, 2, 3))
    axes[0].set_yticks([], minor=True)
    axes[0].set_yticklabels(("0.3", "0.5", "1", "2", "3"))
    axes[0].legend(fontsize=7)
    for panel, name in zip(axes[1:], shown):
        frame = dumps.last_frame(f"fields.{name}")
        soil = ~np.isin(frame["type"], WALL)
        lines = np.diff(np.unique(np.round(frame["x"] - frame["ux"], 3)))
        field(panel, frame, "eps_q", "deviatoric strain, " + name.replace("_", ", "), (0.0, np.quantile(frame["eps_q"][soil], 0.98)), cmap="viridis",
              solid=WALL, window=(-0.7, 6.1, 0.0, 3.0), size=lines[lines > 0.01].min())
    figure.savefig(args.out, dpi=75)
    print("wrote", args.out)


if __name__ == "__main__":
    main()
