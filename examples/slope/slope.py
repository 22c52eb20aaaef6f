#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws a run of in.slope, or runs study.slope for several slopes: the weight at which they fail, against limit analysis with log spirals.

    python3 slope.py --plot [--beta 45] [--phi 20]    curve.slope and fields.slope of in.slope in the present folder: slope.png, and the weight at failure
    python3 slope.py                    six slopes on two grids, two minutes of one core; slope.txt
    python3 slope.py --short            two slopes on the coarse grid, seconds
    python3 slope.py --figure FILE.png  all of them, and a figure

A slope has failed where it moves RATE times as fast, per increase of gamma H/c, as in the first third of the loading: the settlement of its crest in
study.slope, the largest displacement in in.slope. The exit status is 1 if a slope fails outside of its tolerance, 2 if a run fails or there is no
lmp. The script needs numpy, and matplotlib for --plot and --figure.
"""

import os
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "validation"))
sys.path.insert(0, os.path.join(HERE, "..", "..", "tools"))
import dumps
import harness

RATE = 4.0
# beta, phi = psi [degrees]
SLOPES = ((30, 10), (45, 10), (45, 20), (60, 20), (90, 20), (90, 0))
SHORT_SLOPES = ((45, 20), (90, 0))
COARSE, FINE = 10, 20    # cells over the height
# The closed form is an upper bound for associated flow, a few per cent above the failing weight at most. A grid makes the mechanism about a cell thick,
# which adds some per cent where the ground is frictional. Flat and frictionless ground yields gradually, and RATE finds its beginning.
LOW, HIGH = 0.9, 1.1


def log_spiral(beta, phi):
    """gamma H/c of a slope with a level top that a rigid wedge over a log spiral through the toe fails at: the upper bound of Chen 1975 (Limit
    Analysis and Soil Plasticity, chapter 9), least of all spirals. phi = 0 is Taylor's circle through the toe."""
    b, t = np.radians(beta), np.tan(np.radians(max(phi, 1e-3)))
    start, end = np.meshgrid(np.radians(np.linspace(1, 89, 353)), np.radians(np.linspace(20, 150, 521)), indexing="ij")
    with np.errstate(all="ignore"):
        turn = end - start
        growth = np.exp(turn * t)
        height = np.sin(end) * growth - np.sin(start)
        length = np.sin(turn) / np.sin(end) - np.sin(end + b) / (np.sin(end) * np.sin(b)) * height
        spiral = ((3 * t * np.cos(end) + np.sin(end)) * growth**3 - 3 * t * np.cos(start) - np.sin(start)) / (3 * (1 + 9 * t**2))
        above = length * (2 * np.cos(start) - length) * np.sin(start) / 6
        face = growth * (np.sin(turn) - length * np.sin(end)) * (np.cos(start) - length + np.cos(end) * growth) / 6
        number = height * (growth**2 - 1) / (2 * t) / (spiral - above - face)
    number[~((turn > 0) & (length > 0) & (height > 0) & (number > 0))] = np.inf
    return number.min()


def failure(curve):
    """Returns gamma H/c where the movement has become RATE times as fast."""
    number, settlement = curve[:, 0], curve[:, 1]
    middle = 0.5 * (number[1:] + number[:-1])
    rate = np.diff(settlement) / np.diff(number)
    usual = np.median(rate[: len(rate) // 3])
    fails = np.flatnonzero(rate > RATE * usual)
    if not fails.size:
        return np.inf
    k = fails[0]
    if k == 0:
        return middle[0]
    share = (RATE * usual - rate[k - 1]) / (rate[k] - rate[k - 1])
    return middle[k - 1] + share * (middle[k] - middle[k - 1])


def run(options, beta, phi, n):
    name = f"{beta}_{phi}_{n}"
    bound = log_spiral(beta, phi)
    harness.run_lmp(options, "study.slope", name, beta=beta, phi=phi, psi=phi, n=n, first=0.4 * bound, last=1.4 * bound, waves=options.waves)
    curve = np.loadtxt(os.path.join(options.dir, f"curve.{name}"))
    return {"beta": beta, "phi": phi, "n": n, "bound": bound, "number": failure(curve), "curve": curve, "fields": os.path.join(options.dir, f"fields.{name}")}


def draw(path, results):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(12, 3.8), constrained_layout=True, width_ratios=(1, 1.5))
    for one in results:
        if one["n"] != max(two["n"] for two in results):
            continue
        line, = axes[0].semilogy(one["curve"][:, 0] / one["bound"], one["curve"][:, 1], label=f"{one['beta']}°, φ = {one['phi']}°")
        axes[0].plot(one["number"] / one["bound"], np.interp(one["number"], one["curve"][:, 0], one["curve"][:, 1]), "o", color=line.get_color())
    axes[0].axvline(1, color="black", linewidth=0.8)
    axes[0].set(xlabel="γH/c over that of the log spiral", ylabel="settlement of the crest / H", ylim=(1e-5, 1))
    axes[0].legend(frameon=False, fontsize=8)
    shown = [one for one in results if (one["beta"], one["phi"]) == (45, 20)][-1]
    last = list(dumps.frames(shown["fields"]))[-1]
    points = axes[1].scatter(last["x"], last["y"], c=last["eps_p"], s=8, marker="s", vmin=0, vmax=0.3, cmap="viridis")
    figure.colorbar(points, ax=axes[1], label="plastic strain")
    axes[1].set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title="45°, φ = 20°, after the failure")
    figure.savefig(path, dpi=80)


def plot(beta, phi, path="slope.png"):
    """Draws the files of in.slope in the present folder and prints the weight at failure."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import plot_fields

    curve, frame = np.loadtxt("curve.slope"), dumps.last_frame("fields.slope")
    # at first the ground settles from its in-situ stress
    number, bound = failure(curve[len(curve) // 10:]), log_spiral(beta, phi)
    print(f"failure at gamma H/c = {number:.2f}, log spiral {bound:.2f}, ratio {number / bound:.2f}")
    figure, axes = plt.subplots(1, 2, figsize=(11, 3.8), constrained_layout=True, width_ratios=(1, 1.4))
    axes[0].semilogy(curve[1:, 0], curve[1:, 1])
    axes[0].plot(number, np.interp(number, *curve.T), "o", color="C0", label=f"failure, γH/c = {number:.1f}")
    axes[0].axvline(bound, color="black", linewidth=0.8, label=f"log spiral, γH/c = {bound:.1f}")
    axes[0].set(xlabel="γH/c", ylabel="largest displacement / H")
    axes[0].legend(frameon=False)
    plot_fields.field(axes[1], frame, "eps_q", cmap="viridis")
    figure.savefig(path, dpi=90)
    print("wrote", path)


def main():
    parser = harness.new_parser(__doc__, short="two slopes on the coarse grid", figure=True)
    parser.add_argument("--waves", type=float, default=120, help="duration of the loading, in times that a wave takes along the ground (default: 120)")
    parser.add_argument("--plot", action="store_true", help="draw curve.slope and fields.slope of in.slope")
    parser.add_argument("--beta", type=float, default=45, help="angle of the slope of --plot [degrees]")
    parser.add_argument("--phi", type=float, default=20, help="friction angle of the slope of --plot [degrees]")
    plotted = parser.parse_args()
    if plotted.plot:
        plot(plotted.beta, plotted.phi)
        return
    options = harness.parse_arguments(parser, __file__)
    slopes, grids = (SHORT_SLOPES, (COARSE,)) if options.short else (SLOPES, (COARSE, FINE))
    results = [run(options, beta, phi, n) for beta, phi in slopes for n in grids]
    table = "# beta  phi   n   gamma H/c   log spiral   ratio\n" + "".join(
        f"{one['beta']:6g} {one['phi']:4g} {one['n']:3d} {one['number']:11.3f} {one['bound']:12.3f} {one['number'] / one['bound']:7.3f}\n" for one in results)
    print(table, end="")
    with open(os.path.join(options.dir, "slope.txt"), "w", encoding="utf-8") as out:
        out.write(table)
    check = harness.Checks()
    # Chen's own numbers
    for beta, phi, bound in ((45, 20, 16.16), (60, 20, 10.39), (90, 0, 3.83)):
        check.between(0.995 * bound, log_spiral(beta, phi), 1.005 * bound, f"log spiral of {beta} degrees, phi = {phi} degrees")
    for one in results:
        check.between(LOW, one["number"] / one["bound"], HIGH, f"{one['beta']} degrees, phi = {one['phi']} degrees, {one['n']} cells: over limit analysis")
    if options.figure:
        draw(options.figure, results)
    check.exit()


if __name__ == "__main__":
    main()
