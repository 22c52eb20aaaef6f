#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws the files of in.footing and study.footing: pressure-settlement curves, and the fields of the last frame.

    python3 plot_footing.py                              curve.footing and fields.footing, footing.png
    python3 plot_footing.py --rves rves.png              also the fields of the RVEs: void ratio, coordination number, and those of study.footing
    python3 plot_footing.py curve.half="half domain" curve.full="full domain" --fields fields.half

A curve is FILE or FILE=LEGEND. The grey band is the bearing capacity of Prandtl and Reissner for a surcharge of 20 kPa, between the residual and the
peak friction of an RVE of disks; --plain leaves out the band and the peak of Zhao, Zhao & Liang (2021). The script prints the peak of each curve.
It needs numpy and matplotlib (Debian: python3-numpy, python3-matplotlib).
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
# Bearing capacity [kPa] for a surcharge of 20 kPa with sin phi = 0.30 (residual) and 0.46 (peak), and the peak of the paper.
CLOSED_FORM, PAPER = (100, 285), 186
SHOWN = 0.98    # single points at the corner have far larger values than the others


def read_curve(path):
    """Rows of `settlement [m]  pressure [Pa]`; lines that begin with # are comments."""
    rows = [line.split() for line in open(path) if line.strip() and not line.startswith("#")]
    return [float(r[0]) for r in rows], [float(r[1]) for r in rows]


def words_of(path):
    """Returns the words of a legend for a file without words of its own: those of its ending."""
    ending = os.path.basename(path).partition(".")[2] or path
    return {"footing": "RVEs of disks", "strip_footing": "closed-form law"}.get(ending, ending.replace("_", " "))


# column, label, whether its logarithm decides the colour
RVE_QUANTITIES = [("void_ratio", "void ratio", False), ("coordination", "coordination number", False),
                  ("anisotropy", "anisotropy of the contacts", False), ("inertial", "inertial number", True)]


def strain_and_displacement(axes, frame, most_strain=None):
    """Draws |u| and the deviatoric strain on two axes; a share SHOWN of the points is within the colours."""
    soil = ~np.isin(frame["type"], FOOTING)
    for panel, name, label, most in zip(axes, ("displacement", "eps_q"), ("displacement |u| [m]", "deviatoric strain [-]"), (None, most_strain)):
        field(panel, frame, name, label, (0.0, most or np.quantile(frame[name][soil], SHOWN)), cmap="viridis", solid=FOOTING)


def draw_rves(frame, path, window=None):
    """Draws the fields of the RVEs that the frame has, in the window (xlo, xhi, ylo, yhi) [m]; returns False if it has none."""
    drawn = [quantity for quantity in RVE_QUANTITIES if quantity[0] in frame]
    if not drawn:
        return False
    left = frame["x"].min() - 0.5 * dumps.spacing(frame)
    rows = (len(drawn) + 1) // 2
    figure, axes = plt.subplots(rows, 2, figsize=(13, 5.5 * rows), constrained_layout=True, squeeze=False)
    for panel in axes.flat[len(drawn):]:
        panel.set_axis_off()
    for panel, (name, label, is_logarithm) in zip(axes.flat, drawn):
        field(panel, frame, name, label, log=is_logarithm, cmap="viridis", solid=FOOTING, window=window or (left, left + 12.0, 2.0, 9.0))
    figure.savefig(path, dpi=150)
    plt.close(figure)
    print("wrote", path)
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("curves", nargs="*", default=["curve.footing"], metavar="FILE[=LEGEND]")
    parser.add_argument("--fields", default="fields.footing")
    parser.add_argument("--out", default="footing.png")
    parser.add_argument("--rves", metavar="FILE.png", help="a picture of the fields of the RVEs")
    parser.add_argument("--plain", action="store_true", help="without closed form and paper")
    options = parser.parse_args()

    fields = os.path.exists(options.fields)
    figure, axes = plt.subplots(1, 3 if fields else 1, figsize=(15 if fields else 6, 4.2), squeeze=False, constrained_layout=True)
    for argument in options.curves:
        path, _, words = argument.partition("=")
        settlement, pressure = read_curve(path)
        top = int(np.argmax(pressure))
        print(f"{path}: largest pressure {pressure[top] / 1000:.0f} kPa at a settlement of {settlement[top]:.3f} m")
        axes[0][0].plot(settlement, [p / 1000 for p in pressure], label=words or words_of(path))
    if not options.plain:
        axes[0][0].axhspan(*CLOSED_FORM, color="grey", alpha=0.15, linewidth=0, label="Prandtl, Reissner: residual to peak friction")
        axes[0][0].axhline(PAPER, color="grey", linestyle=":", label=f"Zhao et al. (2021): peak {PAPER} kPa")
    axes[0][0].set_xlabel("settlement [m]")
    axes[0][0].set_ylabel("pressure [kPa]")
    axes[0][0].set_ylim(bottom=0)
    axes[0][0].legend(frameon=False, fontsize=9)
    if fields:
        frame = dumps.last_frame(options.fields)
        strain_and_displacement(axes[0][1:], frame)
    figure.savefig(options.out, dpi=100)
    print("wrote", options.out)
    if options.rves and not (fields and draw_rves(frame, options.rves)):
        print(f"{options.fields} has no columns of RVEs")


if __name__ == "__main__":
    main()
