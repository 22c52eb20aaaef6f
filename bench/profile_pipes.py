#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
r"""Measures the utilization of a GPU's pipes in long calls of many RVEs, by ncu.

    python3 bench/profile_pipes.py --bin build/cuda/bin \
        --packing examples/packings/A_h0075.rve --out bench/results/profile-<machine>.json
    python3 bench/profile_pipes.py --bin build/cuda/bin \
        --packing examples/packings/S1000.rve --out bench/results/profile-<machine>-spheres.json

Each number format, and for spheres each contact law, has the utilization of each pipe, the
instructions of each pipe per RVE-step (of a warp, 32 threads), and `roof`, the throughput divided
by the utilization of the busiest pipe. bench/roofline.py compares throughputs with it.
"""

import argparse
import csv
import datetime
import os
import pathlib
import re
import subprocess
import sys

from compare_lammps import dimension_of, number_of_grains
from kernel_resources import programs

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools"))
import bench_records

HERE = pathlib.Path(__file__).resolve().parent

RVES, STEPS = {2: 9600, 3: 6000}, 100    # as in bench_engine --suite profile

PIPES = {    # name: (utilization [%], warp instructions)
    "memory on chip and first-level cache": (
        "l1tex__data_pipe_lsu_wavefronts.avg.pct_of_peak_sustained_elapsed",
        "sm__inst_executed_pipe_lsu.sum"),
    "issue of instructions": ("smsp__inst_issued.avg.pct_of_peak_sustained_active",
                              "smsp__inst_executed.sum"),
    "fp64": ("sm__pipe_fp64_cycles_active.avg.pct_of_peak_sustained_active",
             "sm__inst_executed_pipe_fp64.sum"),
    "fma": ("sm__pipe_fma_cycles_active.avg.pct_of_peak_sustained_active",
            "sm__inst_executed_pipe_fma.sum"),
    "alu": ("sm__pipe_alu_cycles_active.avg.pct_of_peak_sustained_active",
            "sm__inst_executed_pipe_alu.sum"),
    "conversions and reciprocals": ("sm__inst_executed_pipe_xu.avg.pct_of_peak_sustained_active",
                                    "sm__inst_executed_pipe_xu.sum"),
}
WAVEFRONTS, SECONDS = "l1tex__data_pipe_lsu_wavefronts.sum", "gpu__time_duration.sum"
RESIDENT = "launch__grid_size"
NANO = {
    "nsecond": 1.0, "ns": 1.0, "usecond": 1e3, "us": 1e3, "msecond": 1e6, "ms": 1e6, "second": 1e9,
    "s": 1e9
}


def profile(program, packing):
    """Returns {(program, format, arithmetic): {metric: value}} of the last long call; times are in
    nanoseconds."""
    metrics = [metric for pair in PIPES.values()
               for metric in pair] + [WAVEFRONTS, SECONDS, RESIDENT]
    command = [
        "ncu", "--clock-control", "none", "--csv", "-k", "regex:advance_", "--metrics",
        ",".join(metrics),
        str(program),
        str(packing), os.devnull, "--device", "cuda", "--suite", "profile"
    ]
    text = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout
    table = csv.DictReader(line for line in text.splitlines() if line.startswith('"'))
    kernels, names = {}, programs()
    for row in table:
        # ncu writes relaxed::advance_many<1, relaxed::FastNumbers>, or with (rve::KernelVariant)1.
        name = re.search(
            r"(relaxed)?\W*advance_[a-z_]+<(?:\([^)]*\))?(\d+),\s*(?:\w+::)*(\w+)Numbers",
            row["Kernel Name"])
        if not name:
            sys.exit(
                "profile_pipes: no program and number format in the name of a kernel, "
                f"{row['Kernel Name']}"
            )
        values = kernels.setdefault(
            (names[int(name.group(2))], name.group(3).lower(), name.group(1) or "strict"), {})
        values[row["Metric Name"]] = float(row["Metric Value"].replace(",", "")) * NANO.get(
            row["Metric Unit"], 1.0)
    return kernels


def rows_of(kernels, grains, dimension, gpu):
    rows = []
    for (program, name, arithmetic), values in kernels.items():
        case = {
            "device": gpu, "code": "gpu_rve", "scene": "element", "experiment": "profile",
            "dim": dimension, "grains": grains, "rves": RVES[dimension], "format": name,
            "arithmetic": arithmetic, "substeps": STEPS, "program": program
        }
        if dimension == 3:
            case["law"] = ("hertz mindlin/force" if "mindlinforce" in program else
                           "hertz" if "hertz" in program else "hooke")

        def add(metric, value, unit, **details):
            rows.append({
                "case": case, "metric": metric, "value": value, "unit": unit,
                **({"details": details} if details else {})
            })

        work = RVES[dimension] * STEPS
        used = {pipe: values[metric] / 100.0 for pipe, (metric, _) in PIPES.items()}
        for pipe, (_, instructions) in PIPES.items():
            add("pipe_utilization",
                used[pipe],
                "1",
                pipe=pipe,
                instructions_per_rve_step=values[instructions] / work)
        add("wavefronts_per_rve_step", values[WAVEFRONTS] / work, "1")
        busiest = max(used, key=used.get)
        rate = work / (values[SECONDS] * 1e-9)
        add("rve_steps_per_second", rate, "1/s")
        add("roof", rate / used[busiest], "1/s", bound=busiest, resident_rves=int(values[RESIDENT]))
        print(
            f"{program} {name} {arithmetic}: {1e-6 * rate:.1f} M RVE-steps/s in the kernel, "
            f"{busiest} {used[busiest]:.0%}, "
            f"roof {1e-6 * rate / used[busiest]:.0f} M, {int(values[RESIDENT])} RVEs at a time")
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", required=True, type=pathlib.Path, help="folder with bench_engine")
    parser.add_argument("--packing", required=True, type=pathlib.Path)
    parser.add_argument("--out", required=True, type=pathlib.Path)
    arguments = parser.parse_args()

    machine = subprocess.run(["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"],
                             stdout=subprocess.PIPE,
                             text=True,
                             check=True).stdout.strip().split("\n")[0]
    commit = os.environ.get("GPU_RVE_COMMIT") or subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        stdout=subprocess.PIPE,
        text=True,
        cwd=HERE,
        check=False).stdout.strip()
    kernels = profile(arguments.bin / "bench_engine", arguments.packing)
    rows = rows_of(kernels, number_of_grains(arguments.packing), dimension_of(arguments.packing),
                   machine.replace("NVIDIA ", "").split(" ")[0])
    report = {"machine": machine, "date": datetime.date.today().isoformat(), "commit": commit,
              "command": "python3 bench/profile_pipes.py", "rows": rows}
    bench_records.write(report, arguments.out)


if __name__ == "__main__":
    main()
