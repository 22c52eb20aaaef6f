#!/usr/bin/env python3
"""Draws what in.footing wrote: the pressure-settlement curve and the fields of the last dump frame.

    python3 plot_footing.py [curve.footing ...] [--fields fields.footing] [--out footing.png]

Several curves are drawn over each other (RVEs, elastic points, mu = 0, q_s = 40 kPa). Needs matplotlib (Debian: python3-matplotlib).
"""

import argparse
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def read_curve(path):
    """Rows of `settlement [m]  pressure [Pa]`; lines that begin with # are comments."""
    rows = [line.split() for line in open(path) if line.strip() and not line.startswith("#")]
    return [float(r[0]) for r in rows], [float(r[1]) for r in rows]


def read_last_frame(path):
    """The last frame of a LAMMPS text dump, as {column name: list of numbers}."""
    frame, names = [], []
    with open(path) as stream:
        for line in stream:
            if line.startswith("ITEM: ATOMS"):
                names, frame = line.split()[2:], []
                reading = True
            elif line.startswith("ITEM:"):
                reading = False
            elif names and reading:
                frame.append([float(word) for word in line.split()])
    return {name: [row[k] for row in frame] for k, name in enumerate(names)}


def field(axes, frame, name, label, size):
    soil = [k for k, kind in enumerate(frame["type"]) if kind != 2]
    rigid = [k for k, kind in enumerate(frame["type"]) if kind == 2]
    x, y, value = ([frame[key][k] for k in soil] for key in ("x", "y", name))
    # the largest one per cent, at the footing's corner, would wash out everything else
    top = sorted(value)[int(0.99 * (len(value) - 1))]
    points = axes.scatter(x, y, c=value, s=size, marker="s", cmap="jet", vmin=0, vmax=top or 1.0, linewidths=0)
    axes.scatter([frame["x"][k] for k in rigid], [frame["y"][k] for k in rigid], s=size, marker="s", color="black")
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.figure.colorbar(points, ax=axes, label=label, shrink=0.8)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("curves", nargs="*", default=["curve.footing"])
    parser.add_argument("--fields", default="fields.footing")
    parser.add_argument("--out", default="footing.png")
    options = parser.parse_args()

    fields = os.path.exists(options.fields)
    figure, axes = plt.subplots(1, 3 if fields else 1, figsize=(18 if fields else 7, 4.5), squeeze=False)
    for path in options.curves:
        settlement, pressure = read_curve(path)
        axes[0][0].plot(settlement, [p / 1000 for p in pressure], label=path)
    axes[0][0].axhline(186, color="grey", linestyle=":", label="paper's peak, 186 kPa")
    axes[0][0].set_xlabel("settlement d [m]")
    axes[0][0].set_ylabel("pressure [kPa]")
    axes[0][0].set_ylim(bottom=0)
    axes[0][0].legend()
    if fields:
        frame = read_last_frame(options.fields)
        size = 120.0 * 400 / max(len(frame["x"]), 1)
        field(axes[0][1], frame, "displacement", "|u| [m]", size)
        field(axes[0][2], frame, "eps_q", r"$\epsilon_q$ [-]", size)
    figure.tight_layout()
    figure.savefig(options.out, dpi=150)
    print("wrote", options.out)


if __name__ == "__main__":
    main()
