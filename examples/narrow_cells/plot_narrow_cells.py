#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Means of in.narrow_cells before and after cells became too narrow, and narrow.png.

    python3 plot_narrow_cells.py      (in the folder where in.narrow_cells has run; needs python3-numpy, and python3-matplotlib for the picture)
"""

import numpy as np

COLUMNS = "step strain ratio_small ratio_large void_small void_large copies_small copies_large"
BEGIN = 0.2    # strain at which the packing has forgotten how it was made


def read(path="narrow.txt"):
    return dict(zip(COLUMNS.split(), np.loadtxt(path, ndmin=2).T))


def table(run):
    before = (run["strain"] > BEGIN) & (run["copies_small"] == 1)
    after = run["copies_small"] == run["copies_small"].max()
    print("                 q/p small  large    e small   large    strain")
    for words, rows in (("before copies", before), ("with copies", after)):
        means = [run[name][rows].mean() for name in COLUMNS.split()[2:6]]
        print(f"{words:15} {means[0]:9.2f} {means[1]:7.2f} {means[2]:9.3f} {means[3]:8.3f}    {run['strain'][rows].min():.2f} to {run['strain'][rows].max():.2f}")


def draw(run):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (ratio, copies) = plt.subplots(2, 1, sharex=True, figsize=(6, 5), height_ratios=(3, 1))
    ratio.plot(run["strain"], run["ratio_large"], "k", lw=1, label="four times as many grains")
    ratio.plot(run["strain"], run["ratio_small"], "C0", lw=1, label="small RVEs")
    ratio.set_ylabel("q/p, mean of RVEs")
    ratio.set_ylim(0, 1)
    ratio.legend()
    copies.plot(run["strain"], run["copies_small"], "C0")
    copies.set_ylabel("copies")
    copies.set_xlabel("logarithmic strain across the cell")
    figure.tight_layout()
    figure.savefig("narrow.png", dpi=100)


if __name__ == "__main__":
    curves = read()
    table(curves)
    try:
        draw(curves)
    except ImportError as missing:
        print(f"no picture: {missing}")
