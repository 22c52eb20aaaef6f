#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws the logs of in.stress_paths: shear stress over mean stress, and stress ratio over the driven strain.

    for path in biaxial undrained; do lmp -in in.stress_paths -var path $path -log log.$path; done
    python3 plot_paths.py biaxial undrained [--out stress_paths.png]

A name is the ending of a log. The script needs numpy and matplotlib.
"""

import argparse

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np


def rows_of(path):
    """Returns the rows of the thermo output of a log: step, F_yy, F_xy, sxx, syy, sxy, p, q/p, void ratio."""
    rows, inside = [], False
    for line in open(path):
        words = line.split()
        if words[:1] == ["Step"]:
            inside = True
        elif words[:2] == ["Loop", "time"]:
            inside = False
        elif inside and words and words[0].isdigit():
            rows.append([float(word) for word in words])
    return np.array(rows)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+")
    parser.add_argument("--out", default="stress_paths.png")
    options = parser.parse_args()
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
    for path in options.paths:
        rows = rows_of(f"log.{path}")
        strain = np.maximum(np.abs(rows[:, 1] - 1.0), np.abs(rows[:, 2]))
        left.plot(rows[:, 6] / 1e3, rows[:, 6] * rows[:, 7] / 1e3, marker=".", label=path.replace("_", " "))
        right.plot(100 * strain, rows[:, 7], marker=".", label=path.replace("_", " "))
    left.set(xlabel="p [kPa]", ylabel="q [kPa]", xlim=(0, None), ylim=(0, None))
    right.set(xlabel="driven strain [%]", ylabel="q/p", ylim=(0, None))
    left.legend(frameon=False, fontsize=8)
    figure.savefig(options.out, dpi=90)
    print("wrote", options.out)


if __name__ == "__main__":
    main()
