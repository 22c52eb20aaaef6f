#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws curve.press, curve.continue and, if it exists, curve.whole: restart.png. The script needs numpy and matplotlib."""

import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

figure, axes = plt.subplots(figsize=(6, 4), constrained_layout=True)
for ending, words, style in (("whole", "one run", "k-"), ("press", "first half", "o"), ("continue", "continued", "s")):
    if os.path.exists(f"curve.{ending}"):
        rows = np.loadtxt(f"curve.{ending}")
        axes.plot(1e3 * rows[:, 1], rows[:, 2] / 1e3, style, label=words, fillstyle="none", markersize=4)
axes.set(xlabel="settlement [mm]", ylabel="pressure below the plate [kPa]")
axes.legend(frameon=False)
figure.savefig("restart.png", dpi=90)
print("wrote restart.png")
