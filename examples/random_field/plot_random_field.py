#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws what in.random_field wrote.

    python3 plot_random_field.py [fields.random_field] [--out random_field.png]

Needs numpy and matplotlib (Debian: python3-numpy, python3-matplotlib).
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

def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fields", nargs="?", default="fields.random_field")
    parser.add_argument("--out", default="random_field.png")
    options = parser.parse_args()

    frame = dumps.last_frame(options.fields)
    columns, rows = (np.unique(np.round(frame[axis], 6)) for axis in "xy")
    order = np.lexsort((frame["x"], frame["y"]))
    half = 0.5 * (columns[1] - columns[0])
    extent = (columns[0] - half, columns[-1] + half, rows[0] - half, rows[-1] + half)

    panels = (("friction", 1.0, r"friction coefficient $\mu$", "viridis"),
              ("youngs_modulus", 1e-6, r"$E$ [MPa]", "viridis"),
              ("packing", 1.0, "packing", plt.get_cmap("viridis", 5)))
    figure, axes = plt.subplots(1, 3, figsize=(15, 3), constrained_layout=True)
    for panel, (name, scale, label, colors) in zip(axes, panels):
        values = scale * frame[name][order].reshape(len(rows), len(columns))
        limits = dict(vmin=-0.5, vmax=4.5) if name == "packing" else {}
        image = panel.imshow(values, origin="lower", extent=extent, cmap=colors, **limits)
        panel.set_xlabel("x [m]")
        panel.set_ylabel("y [m]")
        figure.colorbar(image, ax=panel, label=label, shrink=0.8)
    figure.savefig(options.out, dpi=80)
    print("wrote", options.out)


if __name__ == "__main__":
    main()
