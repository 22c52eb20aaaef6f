#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
r"""Compares the speed of this engine with plain LAMMPS for RVEs of disks or spheres.

The result is RVE-steps per second on one core, on all cores, and on a GPU. LAMMPS has one RVE per
core, as it would have one per MPI rank; since RVEs are independent, the ranks are separate
processes that start together. The two codes run in turn, so that a drift of the machine's speed
affects both; the ratio is the median over the rounds. LAMMPS has the contact law, time step and
shear rate of the engine. Spheres run with linear springs and with the law of Hertz and Mindlin,
which stores displacements or forces.

    python3 bench/compare_lammps.py --bin build/host/bin \
        --packing examples/packings/A_h0075.rve --out bench/results/lammps-ratio-<machine>.json
    python3 bench/compare_lammps.py --bin build/host/bin --rves-per-core 1 \
        --packing examples/packings/S1000.rve --out bench/results/lammps-ratio-spheres-cpu.json
    python3 bench/compare_lammps.py --bin build/cuda/bin --gpu 9600 ...    (9600 RVEs on the GPU
    too)

The CPU ratios compare the engine with LAMMPS on one core and on all cores; those of a GPU are
relative to LAMMPS on all cores.
"""

import argparse
import datetime
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools"))
import bench_records

HERE = pathlib.Path(__file__).resolve().parent


def run(command, copies=1, **keywords):
    """Starts several copies of a command together and returns their outputs."""
    running = [
        subprocess.Popen(list(map(str, command)),
                         stdout=subprocess.PIPE,
                         stderr=subprocess.STDOUT,
                         text=True,
                         **keywords) for _ in range(copies)
    ]
    outputs = [process.communicate()[0] for process in running]
    for process, output in zip(running, outputs):
        if process.returncode != 0:
            sys.exit("failed: " + " ".join(map(str, command)) + "\n" + output)
    return outputs


def lammps_rate(lmp, data, steps, cores, folder, dimension, law, conditions):
    """Returns the steps of all RVEs per second, from the speed that LAMMPS reports for each."""
    normal, tangential = {
        "hooke": ("hooke", "linear_history"), "hertz": ("hertz", "mindlin"),
        "hertz mindlin/force": ("hertz", "mindlin/force")
    }[law]
    contacts = (f"{normal} {conditions['normal_stiffness']} 0.0 tangential {tangential} "
                f"{conditions['tangential_stiffness']} 0.0 0.5 damping velocity")
    command = [
        lmp, "-in", HERE / "in.granular_element", "-var", "data", data, "-var", "steps", steps,
        "-var", "dimension", dimension, "-var", "contacts", contacts, "-var", "rate",
        conditions["strain_rate"], "-var", "dt", conditions["time_step"], "-log", "none"
    ]
    loops = [
        re.search(r"Loop time of (\S+) on 1 procs for (\d+) steps", text)
        for text in run(command, cores, cwd=folder)
    ]
    return sum(int(loop.group(2)) / float(loop.group(1)) for loop in loops)


def engine_rates(bench, packing, device, seconds, rves, folder):
    """Returns {law: {(format, arithmetic, substeps): RVE-steps per second}} and {law: conditions
    for LAMMPS}.

    On a CPU one RVE runs on one thread and more RVEs on all threads.
    """
    # All threads of the host serve a GPU; the CPU engine gets their number.
    environment = {
        name: value
        for name, value in os.environ.items() if device == "cpu" or name != "OMP_NUM_THREADS"
    }
    run([
        bench, packing, "rates.json", "--device", device, "--suite", "core", "--seconds", seconds,
        "--rves", rves
    ],
        cwd=folder,
        env=environment)
    rates, conditions = {}, {}
    for row in bench_records.read(pathlib.Path(folder) / "rates.json")["rows"]:
        case = row["case"]
        if row["metric"] == "rve_steps_per_second":
            law = case.get("law", "hooke")
            rates.setdefault(law, {})[case["format"], case["arithmetic"],
                                      case["substeps"]] = row["value"]
            conditions[law] = row["details"]
    return rates, conditions


def measure(arguments, data, packing, dimension, cores, folder):
    """Runs rounds of both codes and returns {law: [rates of LAMMPS]} and, per device, [{law: rates
    of the engine}]."""
    lammps, engine, gpu = {}, [], []
    rves = 1 if cores == 1 else arguments.rves_per_core * cores
    for _ in range(arguments.rounds):
        rates, conditions = engine_rates(arguments.bin / "bench_engine", packing, "cpu",
                                         arguments.seconds, rves, folder)
        engine.append(rates)
        for law, of_law in conditions.items():
            lammps.setdefault(law, []).append(
                lammps_rate(arguments.lammps or arguments.bin / "lmp_plain", data, arguments.steps, cores, folder,
                            dimension, law, of_law))
        if arguments.gpu and cores == arguments.cores:
            gpu.append(
                engine_rates(arguments.bin / "bench_engine", packing, "cuda", arguments.seconds,
                             arguments.gpu, folder)[0])
    return lammps, [(device_name(cores), rves, engine)
                    ] + ([("gpu", arguments.gpu, gpu)] if gpu else [])


def device_name(cores):
    return "cpu-1" if cores == 1 else "cpu-all"


def rows_of(grains, dimension, cores, lammps, engines):
    common = {"scene": "element", "dim": dimension, "grains": grains, "threads": cores}

    def row(case, metric, value, unit):
        return {"case": {**common, **case}, "metric": metric, "value": value, "unit": unit}

    rows = []
    for law, rates_of_lammps in lammps.items():
        of_law = {"law": law} if dimension == 3 else {}
        rows.append(
            row(
                {
                    "device": device_name(cores), "code": "lammps", "rves": cores,
                    "format": "double", **of_law
                }, "rve_steps_per_second", statistics.median(rates_of_lammps), "1/s"))
        print(
            f"{cores} cores: LAMMPS pair granular {law} {statistics.median(rates_of_lammps):.0f} "
            "RVE-steps/s"
        )
        for device, rves, rounds in engines:
            for name, arithmetic, substeps in rounds[0][law]:
                rates = [round_[law][name, arithmetic, substeps] for round_ in rounds]
                ratio = statistics.median(a / b for a, b in zip(rates, rates_of_lammps))
                case = {
                    "device": device, "code": "gpu_rve", "rves": rves, "format": name,
                    "arithmetic": arithmetic, "substeps": substeps, **of_law
                }
                if device == "gpu":
                    case["threads"] = "auto"
                rows.append(row(case, "rve_steps_per_second", statistics.median(rates), "1/s"))
                rows.append(row(case, "ratio_to_lammps", ratio, "1"))
                print(
                    f"  {device:7s} {name:7s} {arithmetic:8s} {substeps:5d} substeps per call: "
                    f"{statistics.median(rates):.0f} RVE-steps/s, "
                    f"{ratio:.2f} times LAMMPS")
    return rows


def number_of_grains(packing):
    return int(
        re.search(r"^grains\s+(\d+)", packing.read_text(encoding="utf-8"), re.MULTILINE).group(1))


def dimension_of(packing):
    stated = re.search(r"^dimension\s+(\d)", packing.read_text(encoding="utf-8"), re.MULTILINE)
    return int(stated.group(1)) if stated else 2


def machine(with_gpu):
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        name = next((line.split(":", 1)[1].strip()
                     for line in file if line.startswith("model name")), "CPU")
    gpu = ""
    if with_gpu:
        gpu = subprocess.run(["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"],
                             stdout=subprocess.PIPE,
                             text=True,
                             check=False).stdout.strip().split("\n")[0] + ", "
    return f"{gpu}{name}, {os.cpu_count()} CPU threads"


def command_line():
    words = (pathlib.Path(word).name if os.path.isabs(word) else word for word in sys.argv[1:])
    return " ".join(["python3 bench/compare_lammps.py", *words])


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin",
                        required=True,
                        type=pathlib.Path,
                        help="folder with lmp, lmp_plain and bench_engine")
    parser.add_argument("--lammps",
                        type=pathlib.Path,
                        help="another LAMMPS instead of lmp_plain, for example with other flags")
    parser.add_argument("--flags", help="compiler flags of LAMMPS, for the record")
    parser.add_argument("--packing", required=True, type=pathlib.Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--steps", type=int, default=20000, help="of LAMMPS in each round")
    parser.add_argument("--seconds",
                        type=float,
                        default=0.5,
                        help="of the engine in each case and round")
    parser.add_argument("--cores",
                        type=int,
                        default=len(os.sched_getaffinity(0)),
                        help="that `all` means")
    parser.add_argument("--rves-per-core", type=int, default=8, help="of the engine on all cores")
    parser.add_argument("--gpu",
                        type=int,
                        default=0,
                        metavar="RVES",
                        help="the engine on the GPU as well, with so many RVEs")
    parser.add_argument("--out", type=pathlib.Path)
    arguments = parser.parse_args()
    arguments.bin = arguments.bin.resolve()
    arguments.lammps = arguments.lammps and arguments.lammps.resolve()
    packing = arguments.packing.resolve()
    dimension = dimension_of(packing)
    os.environ["OMP_NUM_THREADS"] = "1"    # for LAMMPS; bench_engine sets its threads itself

    rows = []
    with tempfile.TemporaryDirectory() as folder:
        data = pathlib.Path(folder) / "packing.data"
        run([
            arguments.bin / "lmp", "-in", HERE / "in.export_packing", "-var", "packing", packing,
            "-var", "data", data, "-log", "none"
        ],
            cwd=folder)
        for cores in sorted({1, arguments.cores}):
            rows += rows_of(number_of_grains(packing), dimension, cores,
                            *measure(arguments, data, packing, dimension, cores, folder))
    if arguments.flags:
        for row in rows:
            if row["case"]["code"] == "lammps":
                row["details"] = {"compiler_flags": arguments.flags}

    if arguments.out:
        commit = os.environ.get("GPU_RVE_COMMIT") or subprocess.run(
            ["git", "rev-parse", "--short", "HEAD"],
            stdout=subprocess.PIPE,
            text=True,
            cwd=HERE,
            check=False).stdout.strip()
        report = {
            "machine": machine(arguments.gpu), "date": datetime.date.today().isoformat(),
            "commit": commit, "command": command_line(), "rows": rows
        }
        bench_records.write(report, arguments.out)


if __name__ == "__main__":
    main()
