#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws cyclic_shear.txt, which cyclic_shear.py writes: cyclic_shear.png. The script needs numpy and matplotlib."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

rows = np.loadtxt("cyclic_shear.txt")
count = rows.shape[1] // 2
figure, axes = plt.subplots(figsize=(6, 4), constrained_layout=True)
axes.plot(100 * rows[:, :count], rows[:, count:] / 1e3, linewidth=0.8, color="0.7")
axes.plot(100 * rows[:, :count].mean(axis=1), rows[:, count:].mean(axis=1) / 1e3, label="mean of 4 RVEs")
for limit in (-25, 25):
    axes.axhline(limit, color="black", linewidth=0.8, linestyle=":")
axes.set(xlabel="shear strain [%]", ylabel="shear stress [kPa]")
axes.legend(frameon=False)
figure.savefig("cyclic_shear.png", dpi=90)
print("wrote cyclic_shear.png")
