#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws axial stress over axial strain of several programs.

    python3 plot_curves.py curve.csv="scikit-fem" curve.specimen="MPM" ../umat/curve.csv="OOFEM, UMAT" [--out curves.png]

An argument is FILE=LEGEND; a file has columns with commas: axial strain, axial stress [Pa]. The script needs numpy and matplotlib.
"""

import argparse

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("curves", nargs="+", metavar="FILE=LEGEND")
    parser.add_argument("--out", default="curves.png")
    options = parser.parse_args()
    figure, axes = plt.subplots(figsize=(6, 4), constrained_layout=True)
    for argument, style in zip(options.curves, ("o", "-", "x", "+")):
        path, _, words = argument.partition("=")
        with open(path) as stream:
            rows = np.array([line.split(",")[:2] for line in stream if line.strip() and line[0] not in "#a"], dtype=float)
        print(f"{path}: {rows[-1, 1] / 1e3:.1f} kPa at {100 * rows[-1, 0]:.2f} %")
        axes.plot(100 * rows[:, 0], rows[:, 1] / 1e3, style, label=words or path, fillstyle="none")
    axes.set(xlabel="axial strain [%]", ylabel="axial stress [kPa]")
    axes.legend(frameon=False)
    figure.savefig(options.out, dpi=90)
    print("wrote", options.out)


if __name__ == "__main__":
    main()
