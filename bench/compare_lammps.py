#!/usr/bin/env python3
"""Steps per second of one RVE on one core: this engine against plain LAMMPS, side by side.

The two run in turn, so that a machine whose speed drifts treats them alike; the ratio is the median over the rounds.

    python3 bench/compare_lammps.py --bin build/host/bin --packing examples/packings/A_h0075.rve --out bench/results/lammps-ratio-<machine>.json
"""

import argparse
import datetime
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent


def run(command, **keywords):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **keywords)
    if done.returncode != 0:
        sys.exit("failed: " + " ".join(map(str, command)) + "\n" + done.stdout)
    return done.stdout


def lammps_rate(lmp, data, steps, folder):
    text = run([lmp, "-in", HERE / "in.granular_element", "-var", "data", data, "-var", "steps", str(steps), "-log", "none"],
               cwd=folder)
    match = re.search(r"Loop time of (\S+) on 1 procs for (\d+) steps", text)
    return int(match.group(2)) / float(match.group(1))


def engine_rates(bench, packing, seconds, folder):
    """{(format, substeps): steps per second} on one thread."""
    run([bench, packing, "one.json", "cpu", str(seconds), "1"], cwd=folder)
    with open(pathlib.Path(folder) / "one.json") as file:
        rows = json.load(file)["rows"]
    return {(row["case"]["format"], row["case"]["substeps"]): row["value"]
            for row in rows if row["metric"] == "rve_steps_per_second"}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", required=True, type=pathlib.Path, help="folder with lmp, lmp_plain and bench_engine")
    parser.add_argument("--packing", required=True, type=pathlib.Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=20000, help="of LAMMPS in each round")
    parser.add_argument("--seconds", type=float, default=0.5, help="of the engine in each case and round")
    parser.add_argument("--out", type=pathlib.Path)
    arguments = parser.parse_args()
    binaries, packing = arguments.bin.resolve(), arguments.packing.resolve()
    os.environ["OMP_NUM_THREADS"] = "1"

    with tempfile.TemporaryDirectory() as folder:
        data = pathlib.Path(folder) / "packing.data"
        run([binaries / "lmp", "-in", HERE / "in.export_packing", "-var", "packing", packing, "-var", "data", data,
             "-log", "none"], cwd=folder)
        lammps, engine = [], []
        for _ in range(arguments.rounds):
            lammps.append(lammps_rate(binaries / "lmp_plain", data, arguments.steps, folder))
            engine.append(engine_rates(binaries / "bench_engine", packing, arguments.seconds, folder))

    rows = [{"case": {"device": "cpu-1", "code": "lammps", "scene": "element", "dim": 2, "rves": 1, "format": "double"},
             "metric": "rve_steps_per_second", "value": statistics.median(lammps), "unit": "1/s"}]
    print(f"LAMMPS pair granular: {statistics.median(lammps):.0f} steps/s")
    for key in engine[0]:
        rates = [round_[key] for round_ in engine]
        ratio = statistics.median(a / b for a, b in zip(rates, lammps))
        case = {"device": "cpu-1", "code": "gpu_rve", "scene": "element", "dim": 2, "rves": 1, "format": key[0],
                "arithmetic": "strict", "substeps": key[1]}
        rows.append({"case": case, "metric": "rve_steps_per_second", "value": statistics.median(rates), "unit": "1/s"})
        rows.append({"case": case, "metric": "ratio_to_lammps", "value": ratio, "unit": "1"})
        print(f"{key[0]:7s} {key[1]:5d} substeps per call: {statistics.median(rates):.0f} steps/s, {ratio:.2f} times LAMMPS")
    if arguments.out:
        commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], stdout=subprocess.PIPE, text=True, cwd=HERE).stdout.strip()
        machine = next((line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), "")
        report = {"machine": machine, "date": datetime.date.today().isoformat(), "commit": commit,
                  "command": "python3 bench/compare_lammps.py " + packing.name, "rows": rows}
        arguments.out.write_text(json.dumps(report, indent=1) + "\n")


if __name__ == "__main__":
    main()
