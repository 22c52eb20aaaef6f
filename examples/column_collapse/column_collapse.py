#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws a run of in.column_collapse, or runs study.column_collapse or in.column_collapse_3d over aspect ratios: run-out and height of the deposit
next to those of experiments.

    python3 column_collapse.py --plot             points.column_collapse of in.column_collapse in the present folder: column_collapse.png
    python3 column_collapse.py                    nine ratios, two minutes of one core; column_collapse.txt
    python3 column_collapse.py --short            three ratios on a coarser grid, seconds
    python3 column_collapse.py --figure FILE.png  all of them, and a figure
    python3 column_collapse.py --friction 0.4     with another tan of the angle of friction
    python3 column_collapse.py --space            round columns in space: four ratios, four minutes of one core; column_collapse_3d.txt
    python3 column_collapse.py --space --short    two ratios on coarser grids, ten seconds; --figure as above

The exit status is 1 if a deposit is not at rest or outside of the band of experiments, 2 if a run fails or there is no lmp. The script needs numpy,
and matplotlib for --plot and --figure.

Experiments, plane columns of sand or glass beads, L0 the width and a = H0/L0:
  run-out (L - L0)/L0: 1.2 a below a = 2.3, 1.9 a^(2/3) above (Lube, Huppert, Sparks & Freundt 2005, Phys. Rev. E 72, 041301);
                       1.8 a below a = 3 (Lajeunesse, Monnier & Homsy 2005, Phys. Fluids 17, 103302)
  height at the wall:  a below 0.7, a^(1/3) above (Lajeunesse); a below 1.15, 1.1 a^(2/5) above (Lube)
and round ones, r0 the radius and a = h0/r0:
  run-out (r - r0)/r0: 1.24 a below a = 1.7, 1.6 a^(1/2) above (Lube, Huppert, Sparks & Hallworth 2004, J. Fluid Mech. 508, 175);
                       a below a = 0.74, 2 a^(1/2) above (Lajeunesse, Mangeney-Castelnau & Vilotte 2004, Phys. Fluids 16, 2371)
  height on the axis:  a below 1, 0.88 a^(1/6) above 1.7 (Lube); a below 0.74, 0.74 above (Lajeunesse)
"""

import os
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "validation"))
sys.path.insert(0, os.path.join(HERE, "..", "..", "tools"))
import dumps
import harness

WIDTH = {"mohr_coulomb": 0.1, "rve": 1.0}    # L0 of the script [m]
# ratio, law, cell over L0, points per cell along an axis
COLUMNS = [(a, "mohr_coulomb", 0.1, 2) for a in (0.4, 0.6, 1, 1.5, 2, 3, 4, 6, 8)] + [(a, "rve", 0.2, 1) for a in (1, 2)]
SHORT_COLUMNS = [(1.5, "mohr_coulomb", 0.2, 2), (4, "mohr_coulomb", 0.2, 2), (1, "rve", 0.25, 1)]
# in space: ratio, law, cell over r0, points per cell along an axis
ROUND_COLUMNS = [(0.5, "mohr_coulomb", 1 / 12, 2), (1, "mohr_coulomb", 0.1, 2), (2, "mohr_coulomb", 0.125, 2), (3, "mohr_coulomb", 0.15, 2)]
SHORT_ROUND_COLUMNS = [(1, "mohr_coulomb", 0.2, 2), (3, "mohr_coulomb", 0.25, 2)]
# Beyond the band of the two experiments. Run-outs are within it. Deposits of tall columns are up to a fifth lower at the wall, and a coarse grid
# has cells of a fifth of the width.
RUN_OUT_MARGIN, HEIGHT_MARGIN = 0.1, 0.25
# Kinetic energy over the initial potential one. The few grains of an RVE still rearrange.
AT_REST = {"mohr_coulomb": 1e-3, "rve": 5e-3}


def run_outs(a):
    """Lube's, Lajeunesse's; both are 1.9 a^(2/3) for tall columns."""
    tall = 1.9 * a ** (2 / 3)
    return np.where(a < 2.3, 1.2 * a, tall), np.where(a < 3, 1.8 * a, np.maximum(tall, 1.8 * 3 * (a / 3) ** (2 / 3)))


def heights(a):
    """Lube's, Lajeunesse's."""
    return np.where(a < 1.15, a, 1.1 * a**0.4), np.where(a < 0.7, a, a ** (1 / 3))


def round_run_outs(a):
    """Lube's, Lajeunesse's."""
    return np.where(a < 1.7, 1.24 * a, 1.6 * np.sqrt(a)), np.where(a < 0.74, a, 2 * np.sqrt(a))


def round_heights(a):
    """Lube's, Lajeunesse's; between his two regimes Lube's is the less of both."""
    return np.minimum(a, 0.88 * a ** (1 / 6)), np.minimum(a, 0.74)


def round_deposit(frame, radius, h, ppc):
    """Run-out, height on the axis and farthest point over r0. A hundredth of the points, which runs ahead one by one, is not part of the deposit."""
    r, z = np.hypot(frame["x"], frame["y"]) / radius, frame["z"] / radius
    return np.quantile(r, 0.99) - 1, z[r < h].max() + 0.5 * h / ppc, r.max() - 1


def deposit(frame, width, h, ppc):
    """Run-out and height at the wall over L0: the deposit ends where the first gap of two widths of a point is."""
    x, y = frame["x"] / width, frame["y"] / width
    along = np.sort(x)
    gaps = np.flatnonzero(np.diff(along) > 2 * h / ppc)
    front = along[gaps[0] if gaps.size else -1] + 0.5 * h / ppc
    return front - 1, y[x < h].max() + 0.5 * h / ppc


def round_collapse(options, a, law, h, ppc):
    name = f"{law}_3d_{a:g}"
    harness.run_lmp(options, "in.column_collapse_3d", name, a=a, law=law, h=h, ppc=ppc, friction=options.friction)
    frames = list(dumps.frames(os.path.join(options.dir, f"points.{name}")))
    last = frames[-1]
    kinetic = 0.5 * np.mean(last["vx"] ** 2 + last["vy"] ** 2 + last["vz"] ** 2)
    far, high, farthest = round_deposit(last, WIDTH[law], h, ppc)
    return {"a": a, "law": law, "run_out": far, "height": high, "farthest": farthest, "energy": kinetic / (0.5 * 9.81 * a * WIDTH[law]), "frames": frames}


def collapse(options, a, law, h, ppc):
    """Low columns have as many cells over their height as others over their width."""
    name = f"{law}_{a:g}"
    h = min(h, h * a)
    harness.run_lmp(options, "study.column_collapse", name, a=a, law=law, h=h, ppc=ppc, friction=options.friction)
    frames = list(dumps.frames(os.path.join(options.dir, f"points.{name}")))
    last = frames[-1]
    potential = 0.5 * 9.81 * a * WIDTH[law]    # per mass
    kinetic = 0.5 * np.mean(last["vx"] ** 2 + last["vy"] ** 2)
    far, high = deposit(last, WIDTH[law], h, ppc)
    return {"a": a, "law": law, "run_out": far, "height": high, "energy": kinetic / potential, "frames": frames}


def draw(path, results, in_space):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    a = np.array([one["a"] for one in results])
    laws_drawn = (("mohr_coulomb", "o", "Mohr-Coulomb"), ("rve", "s", "RVEs of 100 disks"))
    line = np.geomspace(0.8 * a.min(), 1.2 * a.max(), 200)
    figure, axes = plt.subplots(1, 3, figsize=(14, 3.8), constrained_layout=True, width_ratios=(1, 1, 1.5))
    year = 2004 if in_space else 2005
    labels = {"run_out": r"$(r_\infty - r_0)/r_0$", "height": r"$h_\infty/r_0$"} if in_space else \
        {"run_out": r"$(L_\infty - L_0)/L_0$", "height": r"$H_\infty/L_0$"}
    ratio = "$h_0/r_0$" if in_space else "$H_0/L_0$"
    for panel, (name, laws) in zip(axes, zip(("run_out", "height"), (round_run_outs, round_heights) if in_space else (run_outs, heights))):
        lube, lajeunesse = laws(line)
        panel.plot(line, lube, "k-", label=f"Lube et al. {year}")
        panel.plot(line, lajeunesse, "k--", label=f"Lajeunesse et al. {year}")
        for law, marker, words in laws_drawn:
            some = [one for one in results if one["law"] == law]
            if not some:
                continue
            panel.plot([one["a"] for one in some], [one[name] for one in some], marker, label=words)
        scale = "linear" if in_space else "log"
        panel.set(xscale=scale, yscale=scale, xlabel=ratio, ylabel=labels[name])
    axes[0].legend(frameon=False)
    shown = min(results, key=lambda one: abs(one["a"] - 2))
    width, last = WIDTH[shown["law"]], shown["frames"][-1]

    def place(frame):
        """In space by the distance from the axis."""
        if in_space:
            return np.hypot(frame["x"], frame["y"]) / width, frame["z"] / width
        return frame["x"] / width, frame["y"] / width

    falling = shown["frames"][1 if in_space else len(shown["frames"]) // 8]
    for frame, color in ((shown["frames"][0], "0.85"), (falling, "0.6")):
        axes[2].plot(*place(frame), ".", color=color, markersize=2, zorder=0 if in_space else 2)
    points = axes[2].scatter(*place(last), c=last["eps_q"], s=3, vmin=0, vmax=5, cmap="viridis")
    figure.colorbar(points, ax=axes[2], label="deviatoric strain")
    axes[2].set(aspect="equal", xlabel="$r/r_0$" if in_space else "$x/L_0$", ylabel="$z/r_0$" if in_space else "$y/L_0$",
                title=f"{ratio} = {shown['a']:g}: at first, falling, at rest")
    figure.savefig(path, dpi=80)


def plot(path="column_collapse.png"):
    """Draws the points of in.column_collapse in the present folder, and prints run-out and height."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    frames = list(dumps.frames("points.column_collapse"))
    first, last = frames[0], frames[-1]
    h = dumps.spacing(first)
    a = np.ptp(first["y"]) + h    # the width is 1 m
    far, high = deposit(last, 1.0, h, 1)
    print(f"a = {a:.3g}: run-out {far:.2f} (Lube {run_outs(a)[0]:.2f}, Lajeunesse {run_outs(a)[1]:.2f}), "
          f"height at the wall {high:.2f} (Lajeunesse {heights(a)[1]:.2f}, Lube {heights(a)[0]:.2f})")
    figure, axes = plt.subplots(1, 1, figsize=(8, 3.4), constrained_layout=True)
    length = 1.1 * (1.0 + run_outs(a)[1])
    side = (0.85 * 72 * 6.3 * h / length)**2
    axes.scatter(first["x"], first["y"], s=side, marker="s", color="0.9", label="before the collapse")
    points = axes.scatter(last["x"], last["y"], c=last["eps_q"], s=side, marker="s", vmin=0, vmax=np.quantile(last["eps_q"], 0.9), cmap="viridis")
    figure.colorbar(points, ax=axes, label="deviatoric strain", shrink=0.8)
    for value, words, style in zip(run_outs(a), ("Lube et al. 2005", "Lajeunesse et al. 2005"), ("-", "--")):
        axes.axvline(1 + value, color="black", linewidth=0.8, linestyle=style, label=words)
    axes.set(aspect="equal", xlabel="$x/L_0$", ylabel="$y/L_0$", xlim=(0, length), ylim=(0, 1.1 * a))
    axes.legend(fontsize=8, markerscale=0.6)
    figure.savefig(path, dpi=100)
    print("wrote", path)


def main():
    parser = harness.new_parser(__doc__, short="three ratios on a coarser grid", figure=True)
    parser.add_argument("--space", action="store_true", help="round columns in space")
    parser.add_argument("--friction", type=float, default=0.6, help="tan of the angle of friction (default: 0.6)")
    parser.add_argument("--plot", action="store_true", help="draw points.column_collapse of in.column_collapse")
    if parser.parse_args().plot:
        plot()
        return
    options = harness.parse_arguments(parser, __file__)
    if options.space:
        columns, run, far_laws, high_laws = SHORT_ROUND_COLUMNS if options.short else ROUND_COLUMNS, round_collapse, round_run_outs, round_heights
    else:
        columns, run, far_laws, high_laws = SHORT_COLUMNS if options.short else COLUMNS, collapse, run_outs, heights
    results = [run(options, *column) for column in columns]
    rows = [f"{one['law']:13} {one['a']:6g} {one['run_out']:8.3f} {far_laws(one['a'])[0]:8.3f} {far_laws(one['a'])[1]:8.3f} "
            f"{one['height']:8.3f} {high_laws(one['a'])[1]:8.3f} {high_laws(one['a'])[0]:8.3f} {one['energy']:9.1e}"
            + (f" {one['farthest']:8.3f}" if options.space else "") for one in results]
    table = ("# law         h0/r0  run-out and experiments      height and experiments   energy   farthest\n" if options.space else
             "# law         H0/L0  run-out and experiments      height and experiments   energy\n") + "\n".join(rows) + "\n"
    print(table, end="")
    with open(os.path.join(options.dir, "column_collapse_3d.txt" if options.space else "column_collapse.txt"), "w", encoding="utf-8") as out:
        out.write(table)
    check = harness.Checks()
    for one in results:
        a = one["a"]
        check(one["energy"] < AT_REST[one["law"]], f"{one['law']}, a = {a:g}, is at rest: {one['energy']:.1e} of the energy it had")
        for name, laws, margin in (("run_out", far_laws, RUN_OUT_MARGIN), ("height", high_laws, HEIGHT_MARGIN)):
            # disks that roll freely make no heap as high as sand's
            if (one["law"], name) == ("rve", "height"):
                continue
            low, high = sorted(float(value) for value in laws(a))
            check.between((1 - margin) * low, one[name], (1 + margin) * high, f"{name.replace('_', '-')} of {one['law']}, a = {a:g}")
    if options.figure:
        draw(options.figure, results, options.space)
    check.exit()


if __name__ == "__main__":
    main()
