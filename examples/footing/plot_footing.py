#!/usr/bin/env python3
"""Draws what in.footing wrote: the pressure-settlement curve and the fields of the last dump frame.

    python3 plot_footing.py [curve.footing ...] [--fields fields.footing] [--out footing.png] [--rves rves.png]

Several curves are drawn over each other (RVEs, elastic points, mu = 0, q_s = 40 kPa). --rves draws what the RVEs of the points say: void
ratio, coordination number, anisotropy of the contacts, inertial number. Needs matplotlib (Debian: python3-matplotlib).
"""

import argparse
import math
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection


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


def spacing(frame):
    """Distance between neighbouring points at first [m]."""
    soil = [k for k, kind in enumerate(frame["type"]) if kind != 2]
    if "ux" in frame:
        columns = sorted({round(frame["x"][k] - frame["ux"][k], 6) for k in soil})
        return min(b - a for a, b in zip(columns, columns[1:]))
    width, height = (max(frame[key][k] for k in soil) - min(frame[key][k] for k in soil) for key in ("x", "y"))
    return math.sqrt(width * height / len(soil))


def squares(axes, frame, chosen, side, **looks):
    """The points `chosen` as squares; a collection."""
    corners = [(-side / 2, -side / 2), (side / 2, -side / 2), (side / 2, side / 2), (-side / 2, side / 2)]
    where = [[(frame["x"][k] + a, frame["y"][k] + b) for a, b in corners] for k in chosen]
    return axes.add_collection(PolyCollection(where, linewidths=0, **looks))


def logarithm(value):
    return math.log10(min(max(value, 1e-12), 1e12))


def field(axes, frame, name, label, is_logarithm=False, limits=None, cmap="jet", window=None):
    """One column of a frame as coloured squares, the footing in black. `limits` is what the colours span, or the frame decides; `window`
    (xlo, xhi, ylo, yhi) [m] is what is seen."""
    soil = [k for k, kind in enumerate(frame["type"]) if kind != 2]
    rigid = [k for k, kind in enumerate(frame["type"]) if kind == 2]
    value = [logarithm(frame[name][k]) if is_logarithm else frame[name][k] for k in soil]
    # the largest one per cent, at the footing's corner, would wash out everything else
    low, high = limits or (0.0, sorted(value)[int(0.99 * (len(value) - 1))] or 1.0)
    side = 1.02 * spacing(frame)    # no seams
    points = squares(axes, frame, soil, side, cmap=cmap, antialiased=False)
    points.set_array(value)
    points.set_clim(low, high)
    squares(axes, frame, rigid, side, facecolor="black")
    x, y = frame["x"], frame["y"]
    window = window or (min(x) - side, max(x) + side, min(y) - side, max(y) + side)
    axes.set_xlim(window[:2])
    axes.set_ylim(window[2:])
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.figure.colorbar(points, ax=axes, label=label, orientation="horizontal", shrink=0.6)


# column, label, whether its logarithm is drawn
RVE_QUANTITIES = [("void_ratio", "void ratio", False), ("coordination", "coordination number", False),
                  ("anisotropy", "anisotropy of the contacts", False), ("inertial", r"$\log_{10}$ inertial number", True)]


def draw_rves(frame, path, window=None):
    """What the RVEs say, in the window (xlo, xhi, ylo, yhi) [m]; False if the frame has it not."""
    if any(name not in frame for name, _, _ in RVE_QUANTITIES):
        return False
    window = window or (min(frame["x"]), min(frame["x"]) + 12.0, 2.0, 9.0)
    inside = [k for k, kind in enumerate(frame["type"]) if kind != 2 and window[0] <= frame["x"][k] <= window[1] and window[2] <= frame["y"][k] <= window[3]]
    figure, axes = plt.subplots(2, 2, figsize=(13, 11), constrained_layout=True)
    for panel, (name, label, is_logarithm) in zip(axes.flat, RVE_QUANTITIES):
        values = sorted(logarithm(frame[name][k]) if is_logarithm else frame[name][k] for k in inside)
        limits = [values[int(share * (len(values) - 1))] for share in (0.01, 0.99)]
        field(panel, frame, name, label, is_logarithm, limits, "viridis", window)
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
        frame = read_last_frame(options.fields)
        field(axes[0][1], frame, "displacement", "|u| [m]")
        field(axes[0][2], frame, "eps_q", r"$\epsilon_q$ [-]")
    figure.savefig(options.out, dpi=150)
    print("wrote", options.out)
    if options.rves and not (fields and draw_rves(frame, options.rves)):
        print(f"{options.fields} has no columns of RVEs")


if __name__ == "__main__":
    main()
