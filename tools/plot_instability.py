#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
r"""Draws where grains lose their stability, next to the strain that follows.

    lmp -in study.footing -var d_end 0.3 -var frames 5 -var tangents yes -var out instability
    python3 ../../tools/plot_instability.py [--frames frames.instability] \
        [--curve curve.instability] [--out instability.png]

The input is that of the examples footing and biaxial_specimen, or any dump with their columns. A
map for each frame with tangents shows points that have lost ellipticity (a band may form along the
stroke), points that have lost only second-order work, and the deviatoric strain of the last frame.
The script prints the numbers of these points and the mean absolute inclination of possible bands to
x.

It also compares later strain: the mean later strain of points that have lost ellipticity over that
of the others, with two controls. The first is the ratio that as many random points exceed in one of
a hundred draws. The second is the ratio of as many points with the largest present strain. The last
number is the rank correlation between the negative least acoustic determinant and the later strain.
The script needs numpy and matplotlib (Debian: python3-numpy, python3-matplotlib).
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
MOST_NONLINEARITY = 0.5    # RVEs that rearrange under the probe have no tangent


DRAWS = 10000    # draws of random points; the error of the hundredth part is a tenth


def lost_work(frame):
    """Returns points at which some strain has zero or negative second-order work."""
    return frame["work2_least"] <= 0.0


def lost_ellipticity(frame):
    """Returns points at which a band may form. By Hill (1958) they have lost second-order work too;
    neither is derived from the other here."""
    return frame["acoustic"] <= 0.0


def ratio_of_means(values, chosen):
    """Returns the mean of the chosen values over that of the others."""
    return values[chosen].mean() / values[~chosen].mean()


def ranks(values):
    return np.argsort(np.argsort(values)).astype(float)


def foresight(frame, last):
    """Returns four numbers for the points with a tangent.

    These are the later strain of points that have lost ellipticity over that of the others, the
    ratio that as many random points exceed in one of a hundred draws, the ratio of as many points
    with the largest present strain, and the rank correlation of loss and later strain. They are NaN
    if there is nothing to compare.
    """
    known = has_tangent(frame)
    lost, now, later = lost_ellipticity(frame)[known], frame["eps_q"][known], (
        last["eps_q"] - frame["eps_q"])[known]
    if frame is last or not lost.any() or lost.all():
        return 4 * (np.nan,)
    random = np.random.default_rng(1)
    drawn = [ratio_of_means(later, random.permutation(lost)) for _ in range(DRAWS)]
    most = np.zeros_like(lost)
    most[np.argsort(-now, kind="stable")[:lost.sum()]] = True
    return (ratio_of_means(later, lost), np.quantile(drawn, 0.99), ratio_of_means(later, most),
            np.corrcoef(ranks(-frame["acoustic"][known]), ranks(later))[0, 1])


def has_tangent(frame):
    return (frame["measured"] > 0.0) & (frame["nonlinearity"] < MOST_NONLINEARITY)


def place_of(frame, curve, last):
    """Returns the first column of the curve at the time of a frame; rows are equidistant in time up
    to the step `last`."""
    return np.interp(frame.step / last, np.linspace(0.0, 1.0, len(curve)), curve)


def inclination(frame, bands):
    """Returns the mean absolute inclination of the bands that may form at these points [deg]."""
    return np.degrees(np.arctan2(np.abs(frame["normal_x"]), np.abs(
        frame["normal_y"])))[bands].mean() if bands.any() else np.nan


def draw_map(axes, frame, side):
    known = has_tangent(frame)
    kind = np.where(lost_ellipticity(frame), 2, np.where(lost_work(frame), 1, 0))
    corners = dumps.domains(frame, side)
    axes.add_collection(
        matplotlib.collections.PolyCollection(corners[frame["measured"] > 0.0],
                                              facecolor="white",
                                              edgecolor="0.8",
                                              linewidth=0.4))
    axes.add_collection(
        matplotlib.collections.PolyCollection(
            corners[known],
            facecolor=np.array(list(COLOURS.values()), dtype=object)[kind[known]].tolist(),
            edgecolor="0.6",
            linewidth=0.4))
    bands = known & (kind == 2)
    at = np.stack([frame["x"], frame["y"]], axis=1)[bands]
    along = 0.4 * side * np.stack([-frame["normal_y"], frame["normal_x"]], axis=1)[bands]
    axes.add_collection(
        matplotlib.collections.LineCollection(np.stack([at - along, at + along], axis=1),
                                              colors="white",
                                              linewidth=1.2))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", default="frames.instability")
    parser.add_argument("--curve", default="curve.instability")
    parser.add_argument("--out", default="instability.png")
    parser.add_argument(
        "--of",
        nargs=4,
        metavar=("NAME", "UNIT", "NAME", "UNIT"),
        default=("settlement", "m", "pressure", "kPa"),
        help=
        "what the first two columns of the curve are; kPa divides by 1000 (default: settlement m "
        "pressure kPa)"
    )
    parser.add_argument("--show",
                        type=int,
                        default=4,
                        help="frames to draw, from the first one with a tangent on (default: 4)")
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
        sys.exit(
            f"{options.frames} has no tangents: run the example with -var tangents yes and -var "
            "frames 1 or more"
        )
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
    axes[0].set(xlabel=f"{name} [{unit}]",
                ylabel=f"{of_load} [{unit_of_load}]",
                xlim=(0, None),
                ylim=(0, None))
    near = measured[0]["measured"] > 0.0
    window = [f(frames[0][axis][near]) for axis in "xy" for f in (np.min, np.max)]
    of_unit = "" if unit == "-" else " " + unit
    limits = {
        "aspect": "equal", "xlim": (window[0] - side, window[1] + side),
        "ylim": (window[2] - side, window[3] + 1.5 * side)
    }
    for axis, frame, where in zip(axes[1:], shown, places):
        draw_map(axis, frame, side)
        axis.set(title=f"{name} {where:.3f}" + of_unit, **limits)
    at_end = axes[len(shown) + 1]
    field(at_end, last, "eps_q", solid=[2])
    at_end.set(title=f"{name} {curve[-1, 0]:.3f}" + of_unit, **limits)
    axes[0].legend(handles=[
        matplotlib.patches.Patch(color=colour, label=label) for label, colour in COLOURS.items()
    ],
                   loc="lower right",
                   fontsize=7)
    figure.tight_layout()
    figure.savefig(options.out, dpi=90)
    print(
        f"{name} [{unit}]  {of_load} [{unit_of_load}]  points with a tangent  second-order work "
        "lost  ellipticity lost  later strain of the latter, over that of the others"
        "  by chance  by strain  rank correlation  inclination of the bands [deg]")
    for frame, where, load in zip(measured, places, loads):
        known = has_tangent(frame)
        work, ellipticity = known & lost_work(frame), known & lost_ellipticity(frame)
        compared = "".join(f"{value:8.2f}" for value in foresight(frame, last))
        print(
            f"{where:8.3f} {load:12.1f} {known.sum():10d} {work.sum():14d} {ellipticity.sum():14d} "
            f"{compared} {inclination(frame, ellipticity):14.1f}"
        )


if __name__ == "__main__":
    main()
