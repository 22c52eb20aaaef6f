#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws what study.retaining_wall wrote: K against the movement of the wall, and the strain of two runs.

    python3 plot_retaining_wall.py active passive [--out retaining_wall.png]

Each name is that of an `-var out name`; the strain is drawn of the first two. Needs numpy and matplotlib.
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

WALL = [2]    # type of its points


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="+")
    parser.add_argument("--out", default="retaining_wall.png")
    args = parser.parse_args()
    shown = args.names[:2]
    figure, axes = plt.subplots(1, 1 + len(shown), figsize=(5 + 4 * len(shown), 3.6), constrained_layout=True)
    axes = np.atleast_1d(axes)
    for name in args.names:
        rows = np.loadtxt(f"curve.{name}", ndmin=2)[1:]    # the first mean is not there yet
        axes[0].plot(100 * rows[:, 0], rows[:, 1], marker=".", label=name)
    for coefficient in (1.0 / 3.0, 3.0):
        axes[0].axhline(coefficient, color="0.6", lw=0.8, ls="--")
    axes[0].set(xlabel="movement of the top / height [%]", ylabel="K", yscale="log")
    axes[0].legend(fontsize=7)
    for panel, name in zip(axes[1:], shown):
        frame = dumps.last_frame(f"fields.{name}")
        soil = ~np.isin(frame["type"], WALL)
        panel.plot(frame["x"][~soil], frame["y"][~soil], "s", color="0.3", ms=4)
        points = panel.scatter(frame["x"][soil], frame["y"][soil], c=frame["eps_q"][soil], s=9, marker="s",
                               vmax=np.quantile(frame["eps_q"][soil], 0.98))
        panel.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", xlim=(-0.6, 6.0))
        figure.colorbar(points, ax=panel, orientation="horizontal", label=r"$\epsilon_q$, " + name)
    figure.savefig(args.out, dpi=90)
    print("wrote", args.out)


if __name__ == "__main__":
    main()
