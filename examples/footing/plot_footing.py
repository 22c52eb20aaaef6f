#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws what study.footing wrote: the pressure-settlement curve and the fields of the last dump frame.

    python3 plot_footing.py [curve.footing ...] [--fields fields.footing] [--out footing.png] [--rves rves.png]

Several curves are drawn over each other (RVEs, elastic points, mu = 0, q_s = 40 kPa). --rves draws what the RVEs of the points say: void
ratio, coordination number, anisotropy of the contacts, inertial number. Needs numpy and matplotlib (Debian: python3-numpy, python3-matplotlib).
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

FOOTING = [2]    # type of its points


def read_curve(path):
    """Rows of `settlement [m]  pressure [Pa]`; lines that begin with # are comments."""
    rows = [line.split() for line in open(path) if line.strip() and not line.startswith("#")]
    return [float(r[0]) for r in rows], [float(r[1]) for r in rows]


# column, label, whether its logarithm decides the colour
RVE_QUANTITIES = [("void_ratio", "void ratio", False), ("coordination", "coordination number", False),
                  ("anisotropy", "anisotropy of the contacts", False), ("inertial", "inertial number", True)]


def strain_and_displacement(axes, frame, most_strain=None):
    """|u| and the deviatoric strain on two axes. The largest one per cent, at the footing's corner, would wash out everything else."""
    soil = ~np.isin(frame["type"], FOOTING)
    for panel, name, label, most in zip(axes, ("displacement", "eps_q"), ("|u| [m]", r"$\epsilon_q$ [-]"), (None, most_strain)):
        field(panel, frame, name, label, (0.0, most or np.quantile(frame[name][soil], 0.99)), solid=FOOTING)


def draw_rves(frame, path, window=None):
    """What the RVEs say, in the window (xlo, xhi, ylo, yhi) [m]; False if the frame has it not."""
    if any(name not in frame for name, _, _ in RVE_QUANTITIES):
        return False
    left = frame["x"].min() - 0.5 * dumps.spacing(frame)
    figure, axes = plt.subplots(2, 2, figsize=(13, 11), constrained_layout=True)
    for panel, (name, label, is_logarithm) in zip(axes.flat, RVE_QUANTITIES):
        field(panel, frame, name, label, log=is_logarithm, solid=FOOTING, window=window or (left, left + 12.0, 2.0, 9.0))
    figure.savefig(path, dpi=150)
    plt.close(figure)
    print("wrote", path)
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("curves", nargs="*", default=["curve.footing"])
    parser.add_argument("--fields", default="fields.footing")
    parser.add_argument("--out", default="footing.png")
    parser.add_argument("--rves", help="a picture of what the RVEs say")
    options = parser.parse_args()

    fields = os.path.exists(options.fields)
    figure, axes = plt.subplots(1, 3 if fields else 1, figsize=(18 if fields else 7, 4.5), squeeze=False, constrained_layout=True)
    for path in options.curves:
        settlement, pressure = read_curve(path)
        axes[0][0].plot(settlement, [p / 1000 for p in pressure], label=path)
    axes[0][0].axhline(186, color="grey", linestyle=":", label="paper's peak, 186 kPa")
    axes[0][0].set_xlabel("settlement d [m]")
    axes[0][0].set_ylabel("pressure [kPa]")
    axes[0][0].set_ylim(bottom=0)
    axes[0][0].legend()
    if fields:
        frame = dumps.last_frame(options.fields)
        strain_and_displacement(axes[0][1:], frame)
    figure.savefig(options.out, dpi=150)
    print("wrote", options.out)
    if options.rves and not (fields and draw_rves(frame, options.rves)):
        print(f"{options.fields} has no columns of RVEs")


if __name__ == "__main__":
    main()
