#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Measures what a wide grading costs: packings whose grading curve is a straight line from d/ratio to
d in the logarithm of the diameter, sheared on one CPU thread. The table is in doc/src/howto_grading.rst.

    python3 bench/grading_cost.py disk 1 3 5 10 --grains 1000
    python3 bench/grading_cost.py sphere 1 3 5 6.5 --grains 1000
"""

import argparse
import time

import numpy as np

import gpu_rve

PRESSURE, DENSITY, LARGEST, STEPS = 1e5, 2650.0, 0.01, 2000


def packing(shape, ratio, grains):
    """Returns a packing with an overlap of about 1e-3 diameters, and the grains that it needs."""
    curve = [(LARGEST / max(ratio, 1.001), 0), (LARGEST, 100)]
    depth = 1.0 if shape == "disk" else LARGEST
    made = gpu_rve.Packing.create(shape=shape, grains=grains, grading=curve, pressure=PRESSURE,
                                  kn=1e3 * PRESSURE * depth, friction=0.5, density=DENSITY,
                                  damping=0.3)
    return made, gpu_rve.grains_needed(shape=shape, grading=curve)


def shear(made):
    """Returns seconds per step, and the DEM time step over d50 (density/pressure)^0.5."""
    batch = gpu_rve.Batch([made], format="mixed", device="cpu", threads=1)
    dt = 0.5 * batch.time_steps()[0]
    unit = made.d50 * (DENSITY / PRESSURE)**0.5
    rate = 1e-3 / unit    # inertial number 1e-3
    increment = np.eye(made.dimension)[None]
    increment[0, 0, -1] = rate * dt * STEPS
    seconds = []
    for _ in range(4):
        start = time.perf_counter()
        batch.advance(increment, dt, STEPS)
        seconds.append((time.perf_counter() - start) / STEPS)
    return min(seconds), dt / unit


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("shape", choices=["disk", "sphere"])
    parser.add_argument("ratios", type=float, nargs="+")
    parser.add_argument("--grains", type=int, default=1000)
    options = parser.parse_args()
    reference = None
    print("ratio, of the grains, grains needed, void ratio, us per grain and step, "
          "dt / (d50 sqrt(rho/p)), cost of a strain with the needed grains")
    for ratio in options.ratios:
        begin = time.perf_counter()
        made, needed = packing(options.shape, ratio, options.grains)
        prepared = time.perf_counter() - begin
        seconds, dt = shear(made)
        cost = seconds / options.grains * needed / dt
        reference = reference or cost
        print(f"{ratio:g}, {made.radii.max() / made.radii.min():.2f}, {needed}, "
              f"{made.void_ratio:.4f}, {1e6 * seconds / options.grains:.3f}, {dt:.3g}, "
              f"{cost / reference:.1f} (prepared in {prepared:.0f} s)", flush=True)


if __name__ == "__main__":
    main()
