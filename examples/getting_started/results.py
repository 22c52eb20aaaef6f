#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""What the two runs of Getting started say in numbers.

    python3 results.py      (in the folder where in.element and in.problem have run)
"""

import math

import numpy as np


def read_dump(path):
    """The last frame of a LAMMPS text dump, as {column name: array}."""
    lines = open(path).read().splitlines()
    begin = max(number for number, line in enumerate(lines) if line.startswith("ITEM: ATOMS"))
    rows = np.array([line.split() for line in lines[begin + 1:]], dtype=float)
    return dict(zip(lines[begin].split()[2:], rows.T))


def degrees(ratio):
    """Mobilized friction angle: its sine is q/p."""
    return math.degrees(math.asin(ratio))


def passive(ratio, side):
    """Rankine's passive pressure: the largest principal stress at failure where the least one is `side`."""
    return side * (1 + ratio) / (1 - ratio)


def main():
    strain, side, _, ratio, volume = np.loadtxt("curve.element").T[:5]
    peak = ratio.argmax()
    residual = ratio[strain > 0.06].mean()
    print(f"element: the servo holds the sides at {side.mean() / 1000:.1f} kPa on average")
    print(f"element: peak     q/p {ratio[peak]:.3f} at a strain of {100 * strain[peak]:.1f} %, friction angle {degrees(ratio[peak]):.1f} degrees")
    print(f"element: residual q/p {residual:.3f} beyond a strain of 6 %, friction angle {degrees(residual):.1f} degrees")
    print(f"element: volume {100 * volume.min():+.1f} % at the least, {100 * volume[-1]:+.1f} % at the end")

    moved, pressure = np.loadtxt("curve.problem").T
    peak_pressure = pressure.argmax()
    print(f"wall: {pressure[0] / 1000:.1f} kPa at the beginning")
    print(f"wall: largest {pressure[peak_pressure] / 1000:.0f} kPa at {moved[peak_pressure]:.3f} m; Rankine with the peak friction {passive(ratio[peak], 100):.0f} kPa")
    print(f"wall: {pressure[moved > 0.12].mean() / 1000:.0f} kPa on average beyond 0.12 m; Rankine with the residual friction {passive(residual, 100):.0f} kPa")

    fields = read_dump("fields.problem")
    ground = fields["type"] == 1
    band, rest = ground & (fields["eps_q"] > 0.1), ground & (fields["eps_q"] < 0.02)
    for name, points in ("in the band", band), ("elsewhere", rest):
        print(f"points {name}: {points.sum()}, void ratio {fields['void_ratio'][points].mean():.3f}, coordination number {fields['coordination'][points].mean():.2f}")


if __name__ == "__main__":
    main()
