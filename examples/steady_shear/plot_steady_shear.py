#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Steady shear of in.steady_shear against friction: a table, and steady_shear.png.

    python3 plot_steady_shear.py      (in the folder where in.steady_shear has run; needs python3-numpy, and python3-matplotlib for the picture)
"""

import numpy as np

# Chialvo, Sun and Sundaresan, Phys. Rev. E 85, 021305 (2012): equal spheres of the same law in simple shear, quasi-static limit
CHIALVO = np.array([[0, 0.105, 0.636], [0.1, 0.268, 0.613], [0.3, 0.357, 0.596], [0.5, 0.382, 0.587], [1, 0.405, 0.581]])


def read():
    """Shear strain, frictions of the RVEs, and by strain, RVE and quantity: p, shear stress / p, solid fraction, contacts of a sphere that bears load."""
    words = open("shear.rves").read().split()
    seeds = words.index("seeds")
    frictions = np.repeat([float(word) for word in words[1:seeds]], int(words[seeds + 1]))
    strain, frames = [], []
    with open("shear.dump") as dump:
        for line in dump:
            if line.startswith("ITEM: TIMESTEP"):
                strain.append(1e-3 * int(next(dump)))    # 0.1 % in a step
            elif line.startswith("ITEM: ATOMS"):
                rows = np.array([next(dump).split() for _ in frictions], dtype=float)
                if strain[-1] == 0:    # before the first mean
                    strain.pop()
                    continue
                frames.append(np.stack([rows[:, 1], rows[:, 3] / rows[:, 1], 1 / (1 + rows[:, 4]), rows[:, 5]], axis=1))
    return np.array(strain), frictions, np.array(frames)


def means(strain, frictions, frames):
    """Rows of friction, RVEs, and of each number the mean over the second half of the strain and over the seeds, and the scatter of the seeds."""
    steady = frames[strain > 0.5 * strain[-1]].mean(axis=0)
    rows = []
    for mu in np.unique(frictions):
        seeds = steady[frictions == mu]
        scatter = seeds.std(axis=0, ddof=1) if len(seeds) > 1 else np.zeros(seeds.shape[1])
        rows.append([mu, len(seeds), *np.stack([seeds.mean(axis=0), scatter], axis=1).ravel()])
    return np.array(rows)


def draw(strain, frictions, frames, rows):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 4, figsize=(15, 3.8), constrained_layout=True)
    for number, mu in enumerate(np.unique(frictions)):
        for curve in frames[:, frictions == mu, 1].T:
            axes[0].plot(strain, curve, color=f"C{number}", linewidth=0.8)
        axes[0].plot([], [], color=f"C{number}", label=f"friction {mu:g}")
    axes[0].set(xlabel="shear strain", ylabel="shear stress / p", ylim=(0, None))
    axes[0].legend(loc="lower right")
    for one, column, label in ((axes[1], 4, "shear stress / p"), (axes[2], 6, "solid fraction"), (axes[3], 8, "contacts of a sphere that bears load")):
        one.errorbar(rows[:, 0], rows[:, column], rows[:, column + 1], fmt="o-", markersize=4, capsize=2, label="these RVEs")
        if column < 8:
            one.plot(CHIALVO[:, 0], CHIALVO[:, column // 2 - 1], "s", color="firebrick", fillstyle="none", label="Chialvo et al. (2012)")
            one.legend()
        one.set(xlabel="friction", ylabel=label)
    figure.savefig("steady_shear.png", dpi=120)


if __name__ == "__main__":
    strain, frictions, frames = read()
    rows = means(strain, frictions, frames)
    print(f"means from {0.5 * strain[-1]:g} to {strain[-1]:g} of shear, and scatter of the seeds")
    print("friction  RVEs  shear stress / p    solid fraction      contacts           p [kPa]")
    for mu, count, p, d_p, ratio, d_ratio, solid, d_solid, contacts, d_contacts in rows:
        print(f"{mu:8.2f}  {count:4.0f}  {ratio:.3f} +- {d_ratio:.3f}     {solid:.4f} +- {d_solid:.4f}    {contacts:.2f} +- {d_contacts:.2f}     {1e-3 * p:.1f}")
    draw(strain, frictions, frames, rows)
