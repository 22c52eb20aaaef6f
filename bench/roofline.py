#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""What throughputs on a GPU are of the roof that bench/profile_pipes.py has found for their number format and contact law, and what bounds each of
them.

    python3 bench/roofline.py bench/results/profile-H200.json bench/results/engine-H200-full.json
    python3 bench/roofline.py bench/results/profile-H200-spheres.json bench/results/engine-H200-spheres-full.json

Adds a row roofline_fraction behind each row rve_steps_per_second of the second file, in place of what was there. The roof is one for grain-steps: the
work on chip of a step is in proportion to the grains.
"""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools"))
import bench_records

NEARLY_FULL = 0.65            # of a pipe: blocks wait for each other at barriers
FEW_STEPS = 25                # of a call, whose other work then matters


def grains_in_registers(case):
    """Of a block, at most (block_shape in cuda_kernels.h): one in a thread, of spheres two, where threads have enough of them."""
    threads = case["threads"] if isinstance(case.get("threads"), int) else 1024
    if case["dim"] == 2:
        return threads
    return 2 * (threads if case["format"] == "fast" else min(threads, 512))


def bound(case, fraction, roof):
    """What keeps a case from being quicker; doc/src/performance.rst says how that is known."""
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
    """What a roof is for."""
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
        # the roofs are those of steps with friction, of spheres without resistance to rolling
        if row["metric"] == "rve_steps_per_second" and case.get("feature") != "frictionless" and kind(case) in roofs:
            roof = roofs[kind(case)]
            fraction = row["value"] * case["grains"] / (roof["value"] * roof["case"]["grains"])
            rows.append({"case": case, "metric": "roofline_fraction", "value": fraction, "unit": "1",
                         "details": {"bound": bound({**case, **row.get("details", {})}, fraction, roof)}})
    report["rows"] = rows
    report["roof"] = profile.name
    bench_records.write(report, path)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
