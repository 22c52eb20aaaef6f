#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
r"""Compares throughputs on a GPU with the roof of bench/profile_pipes.py and names their bounds.

    python3 bench/roofline.py bench/results/profile-H200.json \
        bench/results/engine-H200-full.json
    python3 bench/roofline.py bench/results/profile-H200-spheres.json \
        bench/results/engine-H200-spheres-full.json

Each row rve_steps_per_second of the second file gets a row roofline_fraction, which replaces a
previous one. Roofs depend on the number format and the contact law. They count grain-steps, since
the work on chip of a step is proportional to the grains.
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools"))
import bench_records

NEARLY_FULL = 0.65    # utilization of a pipe; barriers prevent more
FEW_STEPS = 25    # steps of a call below which its other work matters


def grains_in_registers(case):
    """Returns the largest number of grains in registers of a block (block_shape in cuda_kernels.h):
    one per thread, or two spheres per thread if threads have enough registers."""
    threads = case["threads"] if isinstance(case.get("threads"), int) else 1024
    if case["dim"] == 2:
        return threads
    return 2 * (threads if case["format"] == "fast" else min(threads, 512))


def bound(case, fraction, roof):
    """Returns the bound of the speed of a case; doc/src/dev_gpu_kernels.rst has the criteria."""
    if case["grains"] > grains_in_registers(case):
        return "grains that are not in registers"
    if fraction >= NEARLY_FULL:
        return roof["details"]["bound"]
    if case.get("feature", "plain") not in ("plain", "long_answer"):
        return "a program with more arithmetic, or work of one thread in each step"
    if case["rves"] < roof["details"]["resident_rves"] or case.get("launches", 1) == case["rves"]:
        return "latency: fewer RVEs at a time than the device holds"
    if case["substeps"] <= FEW_STEPS:
        return "loading and storing RVEs, and the host"
    return "latency: barriers and phases of a step"


def kind(case):
    """Returns the key of a roof: format, arithmetic and contact law."""
    return case["format"], case["arithmetic"], case.get("law", "hooke")


def main():
    profile, path = (pathlib.Path(word) for word in sys.argv[1:])
    roofs = {kind(row["case"]): row
             for row in bench_records.read(profile)["rows"] if row["metric"] == "roof"}
    report = bench_records.read(path)
    rows = []
    for row in report["rows"]:
        case = row["case"]
        if row["metric"] != "roofline_fraction":
            rows.append(row)
        # Roofs are for steps with friction and, for spheres, without rolling resistance.
        if row["metric"] == "rve_steps_per_second" and case.get(
                "feature") != "frictionless" and kind(case) in roofs:
            roof = roofs[kind(case)]
            fraction = row["value"] * case["grains"] / (roof["value"] * roof["case"]["grains"])
            rows.append({
                "case": case, "metric": "roofline_fraction", "value": fraction, "unit": "1",
                "details": {"bound": bound({**case, **row.get("details", {})}, fraction, roof)}
            })
    report["rows"] = rows
    report["roof"] = profile.name
    bench_records.write(report, path)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
