#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
r"""Draws the oblique impact of two equal disks: rebound over the angle of impact, closed form and
engine.

    python3 plot_contact_benchmarks.py [--test build/host/bin/engine_tests] \
        [--out oblique_impact.png]

The script runs the test, which writes both curves, and draws them. It needs matplotlib (Debian:
python3-matplotlib).
"""

import argparse
import csv
import glob
import os
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def find_test():
    """Returns the newest test program in the build folders of this source tree."""
    root = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
    found = glob.glob(os.path.join(root, "build", "*", "bin", "engine_tests"))
    if not found:
        sys.exit(
            "no build/*/bin/engine_tests: build the tests first, or name the program with --test")
    return max(found, key=os.path.getmtime)


def run_test(program):
    """Runs the test and returns rows of oblique_impact.csv as dictionaries."""
    with tempfile.TemporaryDirectory() as folder:
        environment = dict(os.environ, GPU_RVE_WRITE_CURVES=folder)
        subprocess.run(
            [program, "--gtest_filter=ObliqueImpact.ReboundFollowsTheClosedFormAtEveryAngle"],
            env=environment,
            check=True,
            stdout=subprocess.DEVNULL)
        with open(os.path.join(folder, "oblique_impact.csv"), newline="") as stream:
            return list(csv.DictReader(stream))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--test",
                        help="the program engine_tests (default: the newest in build/*/bin)")
    parser.add_argument("--out", default="oblique_impact.png")
    options = parser.parse_args()

    rows = run_test(options.test or find_test())
    figure, panels = plt.subplots(1, 2, figsize=(10, 4))
    labels = (("tangential_restitution", "tangential velocity after / before [-]"),
              ("surface_velocity_of_spin", "spin after, $r\\,\\omega / v$ [-]"))
    for axes, (column, label) in zip(panels, labels):
        for color, friction in enumerate(sorted({row["friction"] for row in rows}, key=float)):
            for source, style in (("closed form", "-"), ("engine", "o")):
                curve = [(float(row["angle_deg"]), float(row[column])) for row in rows
                         if row["friction"] == friction and row["source"] == source]
                axes.plot(*zip(*curve),
                          style,
                          color=f"C{color}",
                          markersize=4,
                          markerfacecolor="none",
                          label=f"{source}, $\\mu$ = {friction}")
        axes.set_xlabel("angle of impact from the normal [degrees]")
        axes.set_ylabel(label)
        axes.set_xlim(0, 90)
        axes.grid(alpha=0.3)
    panels[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(options.out, dpi=150)
    print("wrote", options.out)


if __name__ == "__main__":
    main()
