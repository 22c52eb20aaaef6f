#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
r"""Measures the MPM passes of an axisymmetric step compared with a plane step of the same points.

    python3 bench/axisymmetric_cost.py --bin build/host/bin --out bench/results/axisymmetric-cpu.json

Both run in turn on one CPU thread, and each wall time is the least of several runs. Row by row the
record has the times per point and step and their ratio. RVEs have a timer of their own, so that
their rows are times of the passes alone. The times of constitutive laws include the law, which is
that in space for axisymmetric points. GPU_RVE_COMMIT names the commit.
"""

import argparse
import datetime
import itertools
import os
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tools"))
import bench_records

LAWS = {
    "rve": "rve grains",
    "elastic": "elastic 2e7 0.3 density 2000",
    "mohr_coulomb": "mohr_coulomb 2e7 0.3 5e3 25 0 density 2000",
}
# scheme, shape functions, dilation
METHODS = [("musl", "gimp", "point"), ("usavg", "cpgimp", "point"), ("usavg", "cpgimp", "cell")]
PARTS = re.compile(r"fix mpm soil: wall time .* MPM (\S+), transfers")
POINTS = re.compile(r"Loop time of \S+ on 1 procs for \d+ steps with (\d+) atoms")


def nanoseconds(program, folder, law, method, axisymmetric):
    """Runs in a folder and returns the wall time of the MPM passes per point and step [ns], and the number of points."""
    scheme, shape, dilation = method
    words = {
        "axisymmetric": axisymmetric, "law": law, "model": LAWS[law], "scheme": scheme,
        "shape": shape, "dilation": dilation, "cells": "16" if law == "rve" else "64",
        "steps": "100" if law == "rve" else "400"
    }
    command = [str(program), "-in", str(HERE / "in.axisymmetric_cost"), "-log", "none"]
    for name, value in words.items():
        command += ["-var", name, value]
    log = subprocess.run(command,
                         cwd=folder,
                         stdout=subprocess.PIPE,
                         env=os.environ | {"OMP_NUM_THREADS": "1"},
                         text=True,
                         check=True).stdout
    points = int(POINTS.search(log)[1])
    return 1e6 * float(PARTS.search(log)[1]) / points, points


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, required=True, help="folder of lmp")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="the record")
    parser.add_argument("--runs", type=int, default=5, help="of each case")
    options = parser.parse_args()
    program = (options.bin / "lmp").resolve()
    rows = []
    scratch = tempfile.TemporaryDirectory()
    folder = scratch.name
    for law, method in itertools.product(LAWS, METHODS):
        best = {"no": float("inf"), "yes": float("inf")}
        for _ in range(options.runs):
            for axisymmetric in best:
                time, points = nanoseconds(program, folder, law, method, axisymmetric)
                best[axisymmetric] = min(best[axisymmetric], time)
        case = {
            "experiment": "axisymmetric_cost", "device": "cpu", "threads": 1, "law": law,
            "points": points, "scheme": method[0], "shape": method[1], "dilation": method[2]
        }
        ratio = best["yes"] / best["no"]
        print(f"{law}, {' '.join(method)}: plane {best['no']:.1f} ns, axisymmetric "
              f"{best['yes']:.1f} ns, ratio {ratio:.3f}", flush=True)
        for metric, value, unit in (("plane", best["no"], "ns/point/step"),
                                    ("axisymmetric", best["yes"], "ns/point/step"),
                                    ("ratio", ratio, "1")):
            rows.append({"case": case, "metric": metric, "value": value, "unit": unit})
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        machine = next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    bench_records.write(
        {
            "machine": machine, "date": datetime.date.today().isoformat(),
            "commit": os.environ.get("GPU_RVE_COMMIT", ""),
            "command": "bench/axisymmetric_cost.py --bin build/host/bin", "rows": rows
        }, options.out)


if __name__ == "__main__":
    main()
