#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws what study.py has in its folder, as far as it is there.

    python3 plot_study.py [--dir study] [--out .] [--results ../../bench/results/footing_study-H200.json]

footing_curves.png     pressure against settlement: half and full domain, and the full domain with other grains (Figure 16 of the paper)
footing_fields.png     displacement and deviatoric strain of both domains at the end (Figures 17 and 18), with Prandtl's mechanism
footing_rves.png       void ratio, coordination number, anisotropy and inertial number of the RVEs at the end
footing_peaks.png      what the peak depends on: cells and points, packings, rates, numerics; sizes of cells also from --results
footing_times.png      wall time by parts; with runs of several ranks also their efficiency

Needs matplotlib (Debian: python3-matplotlib).
"""

import argparse
import glob
import json
import math
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from plot_footing import draw_rves, dumps, strain_and_displacement
from study import bench_records, case_keys, is_peak, read_curve

PAPER = (0.12, 186.0)    # settlement [m] and pressure [kPa] of the paper's peak
# sin phi of the RVEs, before and after their shear bands: the README of the example
SIN_PHI = {"peak": 0.46, "residual": 0.30}


def read_records(folder):
    records = {}
    for path in sorted(glob.glob(os.path.join(folder, "*.json"))):
        with open(path, encoding="utf-8") as stream:
            record = json.load(stream)
        if "curve_sha256" in record:
            records[record["name"]] = record
    return records


def half_of(records):
    """The case with the half domain: all of it, or up to 0.25 m."""
    return "half" if "half" in records else "short"


def prandtl(sin_phi, half, top):
    """Slip line of Prandtl's mechanism in weightless ground, from below the middle of a strip to the surface: wedge, log spiral, wedge."""
    phi = math.asin(sin_phi)
    steep = math.pi / 4 + phi / 2
    radius = half / math.cos(steep)    # side of the wedge below the footing, about whose far corner the spiral turns
    line = [(0.0, top - half * math.tan(steep))]
    for k in range(1, 41):
        turn = 0.5 * math.pi * k / 40
        angle = math.pi + steep + turn    # from the corner
        r = radius * math.exp(turn * math.tan(phi))
        line.append((half + r * math.cos(angle), top + r * math.sin(angle)))
    x, y = line[-1]
    line.append((x + (top - y) / math.tan(math.pi / 4 - phi / 2), top))
    return line


def save(figure, folder, name):
    figure.savefig(os.path.join(folder, name), dpi=130)
    plt.close(figure)
    print("wrote", os.path.join(folder, name))


def draw_curves(options, records):
    names = [name for name in (half_of(records), "full", "full_mirrored", "full_different") if name in records]
    if not names:
        return
    label = {"half": "half domain", "short": "half domain", "full": "full domain, one packing", "full_mirrored": "full domain, mirrored packing",
             "full_different": "full domain, packings drawn point by point"}
    figure, axes = plt.subplots(1, 2, figsize=(13, 4.8), constrained_layout=True)
    for number, name in enumerate(names):
        d, p, side = zip(*read_curve(os.path.join(options.dir, "curve." + name)))
        axes[0].plot(d, [v / 1e3 for v in p], color=f"C{number}", label=label[name], linewidth=1)
        if name.startswith("full"):
            axes[1].plot(d, [v / 1e3 for v in side], color=f"C{number}", label=label[name], linewidth=1)
    axes[0].plot(*PAPER, "k*", markersize=10, label="peak of the paper")
    axes[0].set_ylabel("pressure [kPa]")
    axes[0].set_ylim(bottom=0)
    axes[1].set_ylabel("horizontal force / width [kPa]")
    for panel in axes:
        panel.set_xlabel("settlement [m]")
        if panel.get_legend_handles_labels()[0]:
            panel.legend()
    save(figure, options.out, "footing_curves.png")


def draw_fields(options, records):
    names = [name for name in (half_of(records), "full") if name in records]
    if not names:
        return
    widths = {"half": 12.0, "short": 12.0, "full": 24.0}
    figure, axes = plt.subplots(2, len(names), figsize=(2 + 0.5 * sum(widths[name] for name in names), 10), constrained_layout=True, squeeze=False,
                                gridspec_kw={"width_ratios": [widths[name] for name in names]})
    for column, name in enumerate(names):
        frame = dumps.last_frame(os.path.join(options.dir, "fields." + name))
        strain_and_displacement(axes[:, column], frame, most_strain=0.5)
        for when, style in (("peak", "w--"), ("residual", "w:")):
            for side in (1, -1) if name == "full" else (1,):
                x, y = zip(*prandtl(SIN_PHI[when], 1.0, 8.0))
                axes[1][column].plot([side * v for v in x], y, style, linewidth=1)
        for panel in axes[:, column]:
            panel.set_title("full domain" if name == "full" else "half domain")
    save(figure, options.out, "footing_fields.png")


def peaks_of_grids(options, records):
    """Peaks [kPa] against cells [m] for one and four points in a cell, of the records and of the reports that --results names."""
    peaks = {"1": {}, "4": {}}
    for path in options.results:
        for row in bench_records.read(path)["rows"]:
            name = row["case"]["name"]
            if row["metric"] == "peak_pressure_pa" and row["case"]["grains"] == 400 and (name == "short" or name.startswith("h_")):
                peaks["4" if name.endswith("points_4") else "1"][row["case"]["cell_size"]] = row["value"] / 1e3
    for record in records.values():
        if record["name"] == "short" or "grid" in record["groups"]:
            peaks[record["variables"].get("points", "1")][case_keys(record)["cell_size"]] = record["peak_pressure_pa"] / 1e3
    return peaks


def draw_peaks(options, records):
    base = records.get("short")
    if not base:
        return
    figure, axes = plt.subplots(1, 2, figsize=(14, 5.5), constrained_layout=True)
    peaks = peaks_of_grids(options, records)
    for points, style in (("1", "o-"), ("4", "s-")):
        some = sorted(peaks[points].items())
        if some:
            axes[0].plot(*zip(*some), style, label=f"{points} point{'s' if points > '1' else ''} in a cell")
    axes[0].axhline(PAPER[1], color="grey", linestyle=":", label="the paper, 0.1 m")
    axes[0].set_xlim(left=0)
    axes[0].set_xlabel("cells [m]")
    axes[0].set_ylabel("peak [kPa]")
    axes[0].legend()
    others = [(r["peak_pressure_pa"] / 1e3, r["what"] or name, is_peak(r))
              for name, r in records.items() if ("peak" in r["groups"] or "knobs" in r["groups"]) and r is not base]
    if others:
        others.sort()
        for row, (peak, _, full) in enumerate(others):
            axes[1].plot(peak, row, "ko" if full else "k>", fillstyle="full" if full else "none")
        axes[1].set_yticks(range(len(others)), [what for _, what, _ in others], fontsize=8)
        axes[1].axvline(base["peak_pressure_pa"] / 1e3, color="black", linewidth=1, label="half domain as it is")
        axes[1].axvline(PAPER[1], color="grey", linestyle=":", label="the paper")
        axes[1].axvspan(0.85 * PAPER[1], 1.15 * PAPER[1], color="grey", alpha=0.15, linewidth=0, label="15 % about it")
        axes[1].set_xlabel("peak [kPa] (open: still rising at the end)")
        axes[1].grid(axis="y", linewidth=0.3)
        axes[1].legend(fontsize=8)
    save(figure, options.out, "footing_peaks.png")


def draw_times(options, records):
    whole = [name for name in ("half", "half_adaptive", "half_quiescent", "full", "full_adaptive", "full_quiescent", "cpu") if name in records]
    rank_groups = [(group, sorted((r for r in records.values() if group in r["groups"] and r["base"] in records), key=lambda r: r["log"]["ranks"]))
                   for group in ("strong", "weak", "uneven")]
    rank_groups = [(group, some) for group, some in rank_groups if len(some) > 1]
    if not whole and not rank_groups:
        return
    panels = 2 if rank_groups else 1
    figure, axes = plt.subplots(1, panels, figsize=(6.5 * panels, 4.5 if rank_groups else 1.2 + 0.4 * len(whole)), constrained_layout=True, squeeze=False)
    axes = axes[0]
    left = [0.0] * len(whole)
    for part, label in (("rve_s", "RVEs"), ("mpm_s", "MPM"), ("transfers_s", "transfers"), ("lammps_s", "LAMMPS"), ("output_s", "output")):
        values = [records[name]["log"].get(part, 0.0) for name in whole]
        axes[0].barh(whole, values, left=left, label=label)
        left = [a + b for a, b in zip(left, values)]
    axes[0].set_xlabel("wall time [s]")
    if whole:
        axes[0].legend()
    if rank_groups:
        draw_efficiency(axes[1], records, rank_groups)
    save(figure, options.out, "footing_times.png")


def draw_efficiency(panel, records, rank_groups):
    """Wall time per step and point against that of one rank, for each group of cases (name, records by ranks)."""
    for group, some in rank_groups:
        for part, style in (("rve_call_s", "o-"), ("loop_s", "s:")):
            first = records[some[0]["base"]]["log"]
            efficiency = [first[part] / first["steps"] / (r["log"][part] / r["log"]["steps"]) / (r["log"]["ranks"] / first["ranks"] * first["rves"] / r["log"]["rves"])
                          for r in some]
            panel.plot([r["log"]["ranks"] for r in some], efficiency, style, label=f"{group}, {'RVEs' if part == 'rve_call_s' else 'all'}")
    panel.axhline(0.9, color="grey", linestyle=":")
    panel.set_ylim(0, 1.1)
    panel.set_xlabel("ranks, one GPU each")
    panel.set_ylabel("efficiency")
    panel.legend()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dir", default="study", help="the folder of study.py")
    parser.add_argument("--out", default=".", help="where pictures go")
    parser.add_argument("--results", nargs="*", default=[], help="reports of study.py --json whose sizes of cells are drawn, too")
    options = parser.parse_args()
    records = read_records(options.dir)
    draw_curves(options, records)
    draw_fields(options, records)
    if half_of(records) in records:
        draw_rves(dumps.last_frame(os.path.join(options.dir, "fields." + half_of(records))), os.path.join(options.out, "footing_rves.png"), (0.0, 9.0, 2.5, 8.75))
    draw_peaks(options, records)
    draw_times(options, records)


if __name__ == "__main__":
    main()
