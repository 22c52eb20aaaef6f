#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Runs in.random_footing for several correlation lengths and seeds, and for uniform ground, and prints the statistics of the bearing capacity.

    python3 ensemble.py --lmp <lmp>                              5 lengths and uniform ground, 8 seeds each; 14 minutes of CPU time
    python3 ensemble.py --lmp <lmp> --seeds 16 --jobs 4          more of them, four at a time
    python3 ensemble.py --lmp <lmp> --dir full --jobs 1 -- -var h 0.1 -var grains 400 -var device cuda     full size on a GPU

What follows -- goes to every run. Curves and the table ensemble.csv are written to the folder --dir; a run whose curve is there already is
not repeated, so that an ensemble can be continued. The bearing capacity is the largest pressure, averaged over 0.01 m of settlement, up
to the end of the run (0.3 m). The exit status is 0 only if all runs came to their end.
"""

import argparse
import concurrent.futures
import csv
import math
import os
import statistics
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
WINDOW = 0.01    # of settlement, over which the pressure is averaged [m]


def read_curve(path):
    """Rows (settlement [m], pressure [Pa], horizontal force / width [Pa])."""
    with open(path) as stream:
        return [tuple(map(float, line.split())) for line in stream if line.strip() and not line.startswith("#")]


def capacity(curve):
    """Largest mean pressure over a window of settlement [Pa], the settlement there [m], and |horizontal| / vertical force there."""
    best = (0.0, 0.0, 0.0)
    for first, (begin, _, _) in enumerate(curve):
        window = [row for row in curve[first:] if row[0] < begin + WINDOW]
        if begin + WINDOW > curve[-1][0]:
            break
        settlement, pressure, side = (statistics.fmean(column) for column in zip(*window))
        if pressure > best[0]:
            best = (pressure, settlement, abs(side) / pressure)
    return best


def table(rows):
    """{length or 'uniform': (number, mean [Pa], its standard error [Pa], coefficient of variation, its standard error)}"""
    result = {}
    for length in dict.fromkeys(row["length"] for row in rows):
        values = [float(row["capacity_pa"]) for row in rows if row["length"] == length]
        n, mean = len(values), statistics.fmean(values)
        if n < 2:
            continue
        deviation = statistics.stdev(values)
        variation = deviation / mean
        # of a normal sample: sd(s) = s / sqrt(2 (n-1)), Kendall & Stuart, The Advanced Theory of Statistics, vol. 1
        result[length] = (n, mean, deviation / math.sqrt(n), variation,
                          variation * math.sqrt(1.0 / (2.0 * (n - 1)) + variation**2 / n))
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lmp", default="lmp")
    parser.add_argument("--dir", default="ensemble")
    parser.add_argument("--lengths", type=float, nargs="+", default=[0.5, 1.0, 2.0, 4.0, 8.0], help="correlation lengths [m]")
    parser.add_argument("--seeds", type=int, default=8, help="number of realizations of each")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="runs at the same time, one CPU thread each if several")
    parser.add_argument("words", nargs="*", help="for every run, after --")
    options = parser.parse_args()
    os.makedirs(options.dir, exist_ok=True)

    def lmp(*words):
        environment = dict(os.environ)
        if options.jobs > 1:
            environment["OMP_NUM_THREADS"] = "1"
        command = [options.lmp, "-in", os.path.join(HERE, "in.random_footing"), "-log", "none", *words, *options.words]
        return subprocess.run(command, cwd=options.dir, env=environment, capture_output=True, text=True)

    made = lmp("-var", "ground", "library")    # before several runs want it
    if made.returncode:
        sys.exit(made.stdout[-2000:] + made.stderr[-2000:])

    def run(case):
        length, seed = case
        name = f"{length}.{seed}"
        path = os.path.join(options.dir, f"curve.{name}")
        words = ["-var", "ground", "uniform"] if length == "uniform" else ["-var", "ground", "field", "-var", "length", str(length)]
        done = os.path.exists(path + ".done")
        if not done:
            result = lmp(*words, "-var", "seed", str(seed), "-var", "out", name)
            if result.returncode:
                return case, None, result.stdout[-500:]
            open(path + ".done", "w").close()
        return case, capacity(read_curve(path)), ""

    cases = [(length, seed) for length in ["uniform", *options.lengths] for seed in range(1, options.seeds + 1)]
    rows, failed = [], 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for (length, seed), found, message in pool.map(run, cases):
            if found is None:
                failed += 1
                print(f"length {length}, seed {seed}: the run failed\n{message}", flush=True)
                continue
            rows.append({"length": str(length), "seed": seed, "capacity_pa": f"{found[0]:.6g}", "settlement_m": f"{found[1]:.4g}",
                         "side_ratio": f"{found[2]:.3g}"})
            print(f"length {length}, seed {seed}: {found[0] / 1000:.1f} kPa at {found[1]:.3f} m", flush=True)
    with open(os.path.join(options.dir, "ensemble.csv"), "w", newline="") as stream:
        writer = csv.DictWriter(stream, ["length", "seed", "capacity_pa", "settlement_m", "side_ratio"])
        writer.writeheader()
        writer.writerows(rows)

    print("\nlength [m]   runs   mean capacity [kPa]   coefficient of variation")
    for length, (n, mean, mean_error, variation, variation_error) in table(rows).items():
        print(f"{length:>10}   {n:4d}   {mean / 1000:7.1f} +- {mean_error / 1000:4.1f}       {variation:7.3f} +- {variation_error:.3f}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
