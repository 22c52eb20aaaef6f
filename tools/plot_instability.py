#!/usr/bin/env python3
"""Draws where grains lose their stability, beside the strain that follows: of the examples footing and biaxial_specimen, or of any dump with their columns.

    lmp -in in.footing -var d_end 0.3 -var frames 5 -var tangents yes -var out instability
    python3 ../../tools/plot_instability.py [--frames frames.instability] [--curve curve.instability] [--out instability.png]

A map for each frame with tangents: points that have lost ellipticity (a band may form; the stroke lies along it), those that have lost second-order work only, and the
deviatoric strain of the last frame. Prints how many points have lost what, how much of the strain that follows is theirs, and how the bands that may form are inclined to x, in
the mean of their absolute values. Needs numpy and matplotlib (Debian:
python3-numpy, python3-matplotlib).
"""

import argparse
import os
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import dumps
from plot_fields import field

COLOURS = {"stable": "0.88", "second-order work lost": "#e0a030", "ellipticity lost": "#b02020"}
MOST_NONLINEARITY = 0.5    # RVEs that rearrange under the probe itself have no tangent


def kinds(frame):
    """For each point with a tangent: 0 stable, 1 second-order work lost along some strain, 2 ellipticity lost."""
    return np.where(frame["acoustic"] <= 0.0, 2, np.where(frame["work2_least"] <= 0.0, 1, 0))


def has_tangent(frame):
    return (frame["measured"] > 0.0) & (frame["nonlinearity"] < MOST_NONLINEARITY)


def place_of(frame, curve, last):
    """First column of the curve at the time of a frame: its rows are equally far apart in time, up to the step `last`."""
    return np.interp(frame.step / last, np.linspace(0.0, 1.0, len(curve)), curve)


def inclination(frame, bands):
    """Of the bands that may form at these points, mean of absolute values [deg]."""
    return np.degrees(np.arctan2(np.abs(frame["normal_x"]), np.abs(frame["normal_y"])))[bands].mean() if bands.any() else np.nan


def draw_map(axes, frame, side):
    known = has_tangent(frame)
    kind = kinds(frame)
    corners = dumps.domains(frame, side)
    axes.add_collection(matplotlib.collections.PolyCollection(corners[frame["measured"] > 0.0], facecolor="white", edgecolor="0.8", linewidth=0.4))
    axes.add_collection(matplotlib.collections.PolyCollection(corners[known], facecolor=np.array(list(COLOURS.values()), dtype=object)[kind[known]].tolist(),
                                                              edgecolor="0.6", linewidth=0.4))
    bands = known & (kind == 2)
    at = np.stack([frame["x"], frame["y"]], axis=1)[bands]
    along = 0.4 * side * np.stack([-frame["normal_y"], frame["normal_x"]], axis=1)[bands]
    axes.add_collection(matplotlib.collections.LineCollection(np.stack([at - along, at + along], axis=1), colors="white", linewidth=1.2))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", default="frames.instability")
    parser.add_argument("--curve", default="curve.instability")
    parser.add_argument("--out", default="instability.png")
    parser.add_argument("--of", nargs=4, metavar=("NAME", "UNIT", "NAME", "UNIT"), default=("settlement", "m", "pressure", "kPa"),
                        help="what the first two columns of the curve are; kPa divides by 1000 (default: settlement m pressure kPa)")
    parser.add_argument("--show", type=int, default=4, help="frames to draw, from the first one with a tangent on (default: 4)")
    options = parser.parse_args()
    name, unit, of_load, unit_of_load = options.of
    frames = list(dumps.frames(options.frames))
    curve = np.loadtxt(options.curve)[:, :2]
    if unit_of_load == "kPa":
        curve[:, 1] /= 1e3
    last = frames[-1]
    side = dumps.spacing(frames[0])
    measured = [frame for frame in frames if (frame["measured"] > 0.0).any()]
    if not measured:
        sys.exit(f"{options.frames} has no tangents: run the example with -var tangents yes and -var frames 1 or more")
    shown = measured[:options.show]
    rows = (len(shown) + 4) // 3
    figure, axes = plt.subplots(rows, 3, figsize=(10.5, 3.4 * rows))
    axes = list(axes.flat)
    for axis in axes[len(shown) + 2:]:
        axis.set_axis_off()
    places = [float(place_of(frame, curve[:, 0], last.step)) for frame in measured]
    loads = [float(place_of(frame, curve[:, 1], last.step)) for frame in measured]
    axes[0].plot(curve[:, 0], curve[:, 1], color="0.3")
    axes[0].plot(places[:len(shown)], loads[:len(shown)], "o", color=COLOURS["ellipticity lost"])
    axes[0].set(xlabel=f"{name} [{unit}]", ylabel=f"{of_load} [{unit_of_load}]", xlim=(0, None), ylim=(0, None))
    near = measured[0]["measured"] > 0.0
    window = [f(frames[0][axis][near]) for axis in "xy" for f in (np.min, np.max)]
    of_unit = "" if unit == "-" else " " + unit
    limits = {"aspect": "equal", "xlim": (window[0] - side, window[1] + side), "ylim": (window[2] - side, window[3] + 1.5 * side)}
    for axis, frame, where in zip(axes[1:], shown, places):
        draw_map(axis, frame, side)
        axis.set(title=f"{name} {where:.3f}" + of_unit, **limits)
    at_end = axes[len(shown) + 1]
    field(at_end, last, "eps_q", solid=[2])
    at_end.set(title=f"{name} {curve[-1, 0]:.3f}" + of_unit, **limits)
    axes[0].legend(handles=[matplotlib.patches.Patch(color=colour, label=label) for label, colour in COLOURS.items()], loc="lower right", fontsize=7)
    figure.tight_layout()
    figure.savefig(options.out, dpi=90)
    print(f"{name} [{unit}]  {of_load} [{unit_of_load}]  points with a tangent  second-order work lost  ellipticity lost  later strain of the lost, over that of the others"
          "  inclination of the bands [deg]")
    for frame, where, load in zip(measured, places, loads):
        known, kind = has_tangent(frame), kinds(frame)
        later = last["eps_q"] - frame["eps_q"]
        lost, others = known & (kind == 2), known & (kind < 2)
        ratio = later[lost].mean() / later[others].mean() if lost.any() and others.any() and frame is not last else np.nan
        print(f"{where:8.3f} {load:12.1f} {known.sum():10d} {(known & (kind >= 1)).sum():14d} {lost.sum():14d} {ratio:14.2f} {inclination(frame, lost):14.1f}")


if __name__ == "__main__":
    main()
