#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Pressure over settlement of footings in space and in the plane, and the shape factors that follow.

    python3 plot_footing_3d.py                     of the curves of model mohr_coulomb that are there
    python3 plot_footing_3d.py --model rve
    python3 plot_footing_3d.py --model tresca      of runs without friction and surcharge (README.md): pressure over cohesion beside N_c
    python3 plot_footing_3d.py --check             says by its exit status whether the order of the shapes is physical

A bearing capacity here is the mean pressure over the last quarter of the settlement. Where the fields of the square are there, too, the strain in
its plane of symmetry is drawn beside the curves. Needs numpy, for pictures matplotlib.
"""

import argparse
import pathlib
import sys

import numpy as np

SHAPES = ("strip", "circle", "square")
# pressure over cohesion of Tresca's ground: Prandtl; Eason & Shield 1960 (Z. Angew. Math. Phys. 11, 33), rough circle
TRESCA = {"strip": 2.0 + np.pi, "circle": 6.05}


def capacities(model):
    """{shape: (curve, capacity [Pa])}"""
    found = {}
    for shape in SHAPES:
        path = pathlib.Path(f"curve.{model}_{shape}")
        if path.exists():
            curve = np.loadtxt(path)
            found[shape] = curve, curve[curve[:, 0] > 0.75 * curve[-1, 0], 1].mean()
    return found


def draw_strain(figure, axis, path):
    """Deviatoric strain of the points nearest to the plane y = 0, where they are at the end."""
    from matplotlib.colors import LogNorm
    with open(path, encoding="utf-8") as file:
        names = next(line for line in file if line.startswith("ITEM: ATOMS")).split()[2:]
        points = dict(zip(names, np.loadtxt(file).T))
    before = points["y"] - points["uy"]
    near = before < 1.5 * before.min()
    size = 2.0 * before.min()    # of a cell
    inches = axis.get_window_extent().width / figure.dpi
    width = 72.0 * inches * size / np.ptp(points["x"][near])
    painted = axis.scatter(points["x"][near], points["z"][near], c=np.maximum(points["eps_q"][near], 1e-3), s=width**2, marker="s", linewidths=0,
                           norm=LogNorm(1e-3, 1.0), cmap="cividis")
    figure.colorbar(painted, ax=axis, label="deviatoric strain under the square [-]", shrink=0.8)
    axis.set_aspect("equal")
    axis.set_xlabel("x [m]")
    axis.set_ylabel("z [m]")


def formulas(phi):
    """Of a strip under a surcharge of one, and shape factors of a square, by the friction angle [degrees]."""
    angle = np.radians(phi)
    passive = np.tan(np.pi / 4 + angle / 2)**2
    return {"N_q (Prandtl, Reissner)": np.exp(np.pi * np.tan(angle)) * passive, "s_q Vesic": 1.0 + np.tan(angle), "s_q Meyerhof": 1.0 + 0.1 * passive}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", default="mohr_coulomb", help="mohr_coulomb, rve or tresca")
    parser.add_argument("--cohesion", type=float, default=10000.0, help="of Tresca's ground [Pa]")
    parser.add_argument("--phi", type=float, default=20.0, help="friction angle of the formulas [degrees]")
    parser.add_argument("--surcharge", type=float, default=20000.0, help="[Pa]")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--out", default="footing_3d.png")
    arguments = parser.parse_args()

    found = capacities(arguments.model)
    if not found:
        sys.exit(f"there is no curve.{arguments.model}_*: run in.footing_3d")
    if arguments.model == "tresca":
        ratios = {shape: capacity / arguments.cohesion / TRESCA[shape] for shape, (_, capacity) in found.items() if shape in TRESCA}
        for shape, ratio in ratios.items():
            print(f"{shape}: N_c {ratio * TRESCA[shape]:.2f}, {ratio:.3f} of the closed form, {TRESCA[shape]:.2f}")
        # With 8.5 cells in the half width, at 0.1 m/s, the strip has 0.984 and the circle 0.958. An edge half a cell further out would add 6 and 12 %.
        within = ratios.keys() >= TRESCA.keys() and 0.95 < ratios["strip"] < 1.02 and 0.93 < ratios["circle"] < 1.02
        sys.exit(0 if within or not arguments.check else "not what is expected")
    for shape, (_, capacity) in found.items():
        factor = f", shape factor {capacity / found['strip'][1]:.2f}" if "strip" in found and shape != "strip" else ""
        print(f"{shape}: {capacity / 1000.0:.1f} kPa, {capacity / arguments.surcharge:.2f} times the surcharge{factor}")
    for name, value in formulas(arguments.phi).items():
        print(f"{name}: {value:.2f}")

    if arguments.check:
        strip = found["strip"][1] / arguments.surcharge / formulas(arguments.phi)["N_q (Prandtl, Reissner)"]
        square = found["square"][1] / found["strip"][1]
        # not associated flow: below Prandtl's; the factor of the square is about that of handbooks
        sys.exit(0 if 0.85 < strip < 1.0 and 1.1 < square < 1.45 else "not what is expected")

    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    fields = pathlib.Path(f"fields.{arguments.model}_square")
    if fields.exists():
        figure, (axis, beside) = plt.subplots(1, 2, figsize=(10.4, 3.8), layout="constrained")
        draw_strain(figure, beside, fields)
    else:
        figure, axis = plt.subplots(figsize=(5.2, 3.6), layout="constrained")
    for shape, (curve, _) in found.items():
        axis.plot(curve[:, 0], curve[:, 1] / arguments.surcharge, label=shape)
    if arguments.model == "mohr_coulomb":
        axis.axhline(formulas(arguments.phi)["N_q (Prandtl, Reissner)"], color="gray", linestyle=":", label="strip, closed form")
    axis.set_xlabel("settlement [m]")
    axis.set_ylabel("pressure / surcharge [-]")
    axis.grid(alpha=0.3)
    axis.legend(frameon=False)
    figure.savefig(arguments.out, dpi=110)


if __name__ == "__main__":
    main()
