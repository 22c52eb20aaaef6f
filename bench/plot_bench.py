#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws results of bench_engine: throughput over RVEs, substeps per call, grains per RVE, and
threads per block.

    python3 bench/plot_bench.py bench/results/engine-H200.json [--out doc/src/figures]

The files are performance_rves.png, performance_substeps.png, performance_grains.png and
performance_block_size.png, for spheres performance_spheres_rves.png and so on. Experiments that are
not in the file are omitted. The script needs numpy and matplotlib (Debian: python3-numpy,
python3-matplotlib).
"""

import argparse
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools"))
import bench_records

LABELS = {("fast", "relaxed"): "fast, relaxed", ("fast", "strict"): "fast",
          ("mixed", "strict"): "mixed", ("mixed", "relaxed"): "mixed, relaxed",
          ("double", "strict"): "double"}
STYLES = dict(zip(LABELS, ("o-", "s-", "^-", "D-", "v-")))


def curves(report, experiment, key, metric="rve_steps_per_second"):
    """Returns {(format, arithmetic): (values of the key, results)} in the order of the key, without
    the automatic choice of threads."""
    points = {}
    for row in report["rows"]:
        case = row["case"]
        if case.get("experiment") == experiment and row["metric"] == metric and case.get(
                key) != "auto":
            points.setdefault((case["format"], case["arithmetic"]), []).append(
                (case[key], row["value"]))
    return {kind: np.array(sorted(rows)).T for kind, rows in points.items()}


def automatic(report, experiment):
    """Returns {(format, arithmetic): result with the block size that the engine chooses}."""
    return {(row["case"]["format"], row["case"]["arithmetic"]): row["value"]
            for row in report["rows"] if row["case"].get("experiment") == experiment
            and row["metric"] == "rve_steps_per_second" and row["case"].get("threads") == "auto"}


def start(report, xlabel, ylabel):
    figure, axes = plt.subplots(figsize=(6.0, 3.8), constrained_layout=True)
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    axes.set_title(report.get("machine", ""), fontsize=9)
    axes.grid(True, which="major", alpha=0.3)
    return figure, axes


def draw(axes, all_curves, scale):
    for kind, (x, y) in all_curves.items():
        axes.plot(x, scale * y, STYLES[kind], markersize=4, label=LABELS[kind])
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize=8)


def plot_rves(report):
    figure, axes = start(report, "RVEs", "million RVE-steps per second")
    draw(axes, curves(report, "rves", "rves"), 1e-6)
    axes.set_xscale("log")
    return figure


def plot_substeps(report):
    figure, axes = start(report, "DEM steps per call", "million RVE-steps per second")
    draw(axes, curves(report, "substeps", "substeps"), 1e-6)
    axes.set_xscale("log")
    return figure


def plot_grains(report):
    figure, axes = start(report, "grains per RVE", "billion grain-steps per second")
    draw(axes, curves(report, "grains", "grains", "grain_steps_per_second"), 1e-9)
    axes.set_xscale("log")
    return figure


def plot_block_size(report):
    figure, axes = start(report, "threads per block", "million RVE-steps per second")
    draw(axes, curves(report, "block_size", "threads"), 1e-6)
    for kind, rate in automatic(report, "block_size").items():
        axes.axhline(1e-6 * rate, linestyle=":", linewidth=1.0, color="gray")
        axes.annotate(f"automatic, {LABELS[kind]}", (1.0, 1e-6 * rate),
                      xycoords=("axes fraction", "data"),
                      fontsize=7,
                      ha="right",
                      va="bottom",
                      color="gray")
    axes.set_xticks(range(0, 1025, 128))
    return figure


PLOTS = {
    "rves": plot_rves, "substeps": plot_substeps, "grains": plot_grains,
    "block_size": plot_block_size
}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("result", type=pathlib.Path)
    parser.add_argument(
        "--out",
        type=pathlib.Path,
        default=pathlib.Path(__file__).resolve().parents[1] / "doc" / "src" / "figures")
    arguments = parser.parse_args()
    report = bench_records.read(arguments.result)
    arguments.out.mkdir(parents=True, exist_ok=True)
    there = {row["case"].get("experiment") for row in report["rows"]}
    prefix = "performance_spheres" if any(
        row["case"].get("dim") == 3 for row in report["rows"]) else "performance"
    for experiment, plot in PLOTS.items():
        if experiment not in there:
            print(f"no experiment {experiment} in {arguments.result.name}")
            continue
        plot(report).savefig(arguments.out / f"{prefix}_{experiment}.png", dpi=130)
        print(f"{prefix}_{experiment}.png")


if __name__ == "__main__":
    main()
