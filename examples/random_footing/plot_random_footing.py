#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws the ensemble of in.random_footing, and the symmetric footing with one packing, with its mirror image, and with many.

    python3 plot_random_footing.py [--dir ensemble] [--out random_footing.png] [--symmetric symmetric_footing.png]

Reads ensemble/ensemble.csv and curves of ensemble.py, and curve.<name>, fields.<name> of the runs `-var ground <name> -var out <name>`
with the names field, single, mirrored and uniform, as far as they are there. Needs numpy and matplotlib (Debian: python3-numpy,
python3-matplotlib).
"""

import argparse
import csv
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from ensemble import read_curve, table

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools"))
import dumps
from plot_fields import field

WIDTH = 2.0    # of the footing [m]


def kilopascal(curve, column):
    return [row[0] for row in curve], [row[column] / 1000 for row in curve]


def draw_ensemble(folder, out):
    with open(os.path.join(folder, "ensemble.csv")) as stream:
        rows = list(csv.DictReader(stream))
    statistics = table(rows)
    uniform = statistics.pop("uniform", None)
    lengths = sorted(statistics, key=float)
    x = [float(length) / WIDTH for length in lengths]
    n, mean, mean_error, variation, variation_error = zip(*(statistics[length] for length in lengths))

    figure, axes = plt.subplots(2, 2, figsize=(12, 7.5), constrained_layout=True)
    if os.path.exists("fields.field"):
        frame = dumps.last_frame("fields.field")
        field(axes[0][0], frame, "void_ratio", "initial void ratio", solid=[2])
    middle = lengths[len(lengths) // 2]
    for group, color, label in (("uniform", "tab:gray", "uniform"), (middle, "tab:blue", f"correlation length {float(middle):g} m")):
        for k, row in enumerate(row for row in rows if row["length"] == group):
            curve = read_curve(os.path.join(folder, f"curve.{group}.{row['seed']}"))
            axes[0][1].plot(*kilopascal(curve, 1), color=color, linewidth=0.8, alpha=0.7, label=None if k else label)
    axes[0][1].set_xlabel("settlement [m]")
    axes[0][1].set_ylabel("pressure [kPa]")
    axes[0][1].set_ylim(bottom=0)
    axes[0][1].legend()
    panels = ((axes[1][0], mean, mean_error, 1e-3, "mean bearing capacity [kPa]", 1),
              (axes[1][1], variation, variation_error, 1.0, "coefficient of variation", 3))
    for panel, values, errors, factor, label, column in panels:
        panel.errorbar(x, factor * np.array(values), factor * np.array(errors), marker="o", capsize=3, label="random fields")
        if uniform:
            value, error = factor * uniform[column], factor * uniform[column + 1]
            panel.axhspan(value - error, value + error, color="tab:gray", alpha=0.4, label="uniform void ratio")
        panel.set_xscale("log", base=2)
        panel.set_xticks(x, [f"{value:g}" for value in x])
        panel.set_xlabel("correlation length / width of the footing")
        panel.set_ylabel(label)
        panel.legend()
    axes[1][1].set_ylim(bottom=0)
    figure.savefig(out, dpi=80)
    print("wrote", out)


def draw_symmetric(names, out):
    figure, axes = plt.subplots(2, 2, figsize=(12, 7), constrained_layout=True)
    titles = {"single": "one packing", "mirrored": "one packing, mirrored in the left half", "uniform": "packings drawn point by point"}
    frames = {name: dumps.last_frame(f"fields.{name}") for name in names}
    # the largest one per cent, at the footing's corners, would wash out everything else
    top = max(np.quantile(frame["displacement"][frame["type"] == 1], 0.99) for frame in frames.values())
    for panel, name in zip((axes[0][0], axes[0][1], axes[1][0]), names):
        field(panel, frames[name], "displacement", "|u| [m]", limits=(0.0, top), solid=[2])
        panel.set_title(titles[name])
        axes[1][1].plot(*kilopascal(read_curve(f"curve.{name}"), 2), label=titles[name])
    axes[1][1].axhline(0, color="black", linewidth=0.6)
    axes[1][1].set_xlabel("settlement [m]")
    axes[1][1].set_ylabel("horizontal force / width [kPa]")
    axes[1][1].margins(y=0.35)
    axes[1][1].legend(loc="lower left", fontsize="small")
    figure.savefig(out, dpi=80)
    print("wrote", out)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dir", default="ensemble")
    parser.add_argument("--out", default="random_footing.png")
    parser.add_argument("--symmetric", default="symmetric_footing.png")
    options = parser.parse_args()

    if os.path.exists(os.path.join(options.dir, "ensemble.csv")):
        draw_ensemble(options.dir, options.out)
    names = ["single", "mirrored", "uniform"]
    if all(os.path.exists(f"fields.{name}") for name in names):
        draw_symmetric(names, options.symmetric)


if __name__ == "__main__":
    main()
