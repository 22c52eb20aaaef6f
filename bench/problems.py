#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
r"""Runs the examples at research size and records wall times by parts, memory, and results of the
curve.

    python3 bench/problems.py --bin build/cuda/bin --out bench/results/problems-<gpu>.json
    python3 bench/problems.py --bin build/cuda/bin --only footing/full_adaptive \
        --only triaxial_specimen --limit 200
    python3 bench/problems.py --list

All problems take about fifteen minutes on one H200. They run one after the other in copies of
their examples. --ranks N runs them on N ranks by mpirun, which is a row of its own. Rows have the logged wall times, kernels that were compiled at first use, and DEM steps.
--keep FOLDER keeps the output files. A run that takes longer than --limit seconds is ended; it and
failed runs get no row. Rows of earlier runs stay in the record.
"""

import argparse
import datetime
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools"))
import bench_records

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent

ADAPTIVE = "substeps adaptive 1e-5 1e-3 50"
FRESH = ADAPTIVE + " policy fresh"
ON_WALL = "-var law rve -var phi 28.7 -var packing ../packings/A20_h0075.rve -var cells 32"
COLUMN = '-var law rve -var h 0.05 -var ppc 2 -var grains 400 -var keywords "policy fresh"'
ROLLING = COLUMN.replace("policy fresh", "policy fresh kr 5e5 rolling_friction 0.2")
# The share of PIC is larger than by default: at the edge of a footing that has sunk by two cells,
# points would otherwise begin to move.
IN_SPACE = f'-var model rve -var h 0.1 -var grains 500 -var pic 0.05 -var keywords "{FRESH}"'
# Keys are example/name; values are script and variables.
PROBLEMS = {
    "footing/half": "study.footing -var h 0.1 -var pictures no",
    "footing/half_adaptive": f'study.footing -var h 0.1 -var pictures no -var keywords "{ADAPTIVE}"',
    "footing/full": "study.footing -var h 0.1 -var pictures no -var domain full",
    "footing/full_adaptive": f'study.footing -var h 0.1 -var pictures no -var domain full -var '
                             f'keywords "{ADAPTIVE}"',
    "footing/fast": "study.footing -var h 0.1 -var pictures no -var format fast",
    "footing/spheres": f'study.footing -var h 0.1 -var pictures no -var shape sphere -var grains 400 '
                       f'-var keywords "{FRESH}"',
    "triaxial_specimen/rough": "study.triaxial_specimen -var h 0.0625 -var grains 400 -var rate 0.1",
    "triaxial_specimen/rough_of_eight": "study.triaxial_specimen -var h 0.125 -var ppc 8 -var grains "
                                        "400 -var rate 0.1",
    "footing_3d/strip": f"in.footing_3d {IN_SPACE} -var length 8 -var shape strip",
    "footing_3d/square": f"in.footing_3d {IN_SPACE} -var length 4.6 -var shape square",
    "footing_3d/steps": f"in.footing_3d {IN_SPACE.replace(FRESH, 'policy fresh')} -var length 4.6 "
                        f"-var d_end 0.155",
    "footing_3d/steps_adaptive": f"in.footing_3d {IN_SPACE} -var length 4.6 -var d_end 0.155",
    "footing_3d/circle": f"in.footing_3d {IN_SPACE} -var length 4.6 -var shape circle",
    "biaxial_specimen/smooth": "study.biaxial_specimen -var h 0.025 -var grains 400",
    "biaxial_specimen/rough": "study.biaxial_specimen -var h 0.025 -var grains 400 -var plates rough",
    "biaxial_specimen/smooth_fine": "study.biaxial_specimen -var h 0.0125 -var grains 400",
    "retaining_wall/active": f"study.retaining_wall {ON_WALL} -var way 0.03",
    "retaining_wall/passive": f"study.retaining_wall {ON_WALL} -var move passive -var way 0.1",
    "column_collapse/rve_1": f"study.column_collapse {COLUMN} -var a 1",
    "column_collapse/rve_2": f"study.column_collapse {COLUMN} -var a 2 -var k0 0.6",
    "column_collapse/rolling_1": f"study.column_collapse {ROLLING} -var a 1",
    "column_collapse/rolling_2": f"study.column_collapse {ROLLING} -var a 2 -var k0 0.6",
    "column_collapse/round_1": "in.column_collapse_3d -var a 1 -var h 0.05",
    "slope/45_20_80": "study.slope -var n 80 -var waves 120 -var first 6.464 -var last 22.62",
}

PARTS = re.compile(
    r"fix mpm \S+: wall time (\S+) s; per step \[ms\]: RVE (\S+), MPM (\S+), transfers (\S+), "
    r"LAMMPS (\S+), output (\S+)"
)
RVES = re.compile(r"fix rve \S+: (\d+) RVEs with (\d+) grains, (\S+) MB")
LOOP = re.compile(r"Loop time of \S+ on (\d+) procs for (\d+) steps with (\d+) atoms")
COMPILED = re.compile(r"compiled \S+.* for sm_\d+ in (\S+) s")
DEM_STEPS = re.compile(r"RVEs: \S+ s of wall time, (\d+) DEM steps")
CARD = re.compile(r"fix mpm \S+: NVIDIA (\S+)")


def curve_of(folder):
    """Returns the only curve in a folder: columns by name, the row of the largest second column,
    and the last row."""
    curves = sorted(folder.glob("curve.*"))
    if len(curves) != 1:
        return {}
    lines = curves[0].read_text(encoding="utf-8").splitlines()
    rows = [[float(word) for word in line.split()] for line in lines
            if line.strip() and not line.startswith("#")]
    if not rows or len(rows[0]) < 2:
        return {}
    return {
        "curve": lines[0].lstrip("# "), "curve_peak": max(rows, key=lambda row: row[1]),
        "curve_end": rows[-1]
    }


def row_of(name, arguments, log, seconds, folder):
    """Returns a row of the record; None if the log has no wall time."""
    parts = PARTS.findall(log)
    if not parts:
        return None
    # A run may have several parts, whose times are added.
    wall = sum(float(piece[0]) for piece in parts)
    steps = [int(loop[1]) for loop in LOOP.findall(log)]
    details = {
        "process_s": round(seconds, 1), "steps": sum(steps[-len(parts):]), "ms_per_step": dict(
            zip(("rve", "mpm", "transfers", "lammps", "output"), map(float, parts[-1][1:])))
    }
    case = {
        "example": name.split("/")[0], "name": name.split("/")[1], "command": "lmp -in " + arguments
    }
    card = CARD.search(log)
    if card:
        case["device"] = card[1]
    rves = RVES.search(log)
    if rves:
        case["rves"] = int(rves[1])
        details |= {"grains_in_all": int(rves[2]), "device_megabytes": float(rves[3])}
    else:
        details["atoms"] = int(LOOP.findall(log)[-1][2])
    compiled = [float(some) for some in COMPILED.findall(log)]
    if compiled:
        details["seconds_of_compilation"] = round(sum(compiled), 1)
    dem = DEM_STEPS.search(log)
    if dem:
        details["dem_steps"] = int(dem[1])
    return {
        "case": case, "metric": "wall_time", "value": round(wall, 2), "unit": "s",
        "details": details | curve_of(folder)
    }


def run(name, program, ranks, device, limit, keep):
    """Runs a problem and returns a row, or None if it failed."""
    example = name.split("/")[0]
    arguments = PROBLEMS[name] + f" -var device {device}"
    front = ["mpirun", "--bind-to", "none", "-np", str(ranks)] if ranks > 1 else []
    with tempfile.TemporaryDirectory() as scratch:
        work = pathlib.Path(scratch) / example
        # The packings are in the neighbouring folder.
        shutil.copytree(ROOT / "examples" / "packings", pathlib.Path(scratch) / "packings")
        shutil.copytree(ROOT / "examples" / example, work)
        for old in [*work.glob("curve.*"), *work.glob("fields.*"), *work.glob("points.*")]:
            old.unlink()
        start = time.monotonic()
        with open(work / "problem.log", "w", encoding="utf-8") as output:
            try:
                command = [*front, program, "-in", *shlex.split(arguments), "-log", "none"]
                status = subprocess.run(command,
                                        cwd=work,
                                        stdout=output,
                                        stderr=subprocess.STDOUT,
                                        timeout=limit,
                                        check=False).returncode
            except subprocess.TimeoutExpired:
                status = f"longer than {limit} s"
        seconds = time.monotonic() - start
        log = (work / "problem.log").read_text(encoding="utf-8", errors="replace")
        if keep:
            into = keep / name.replace("/", "_")
            into.mkdir(parents=True, exist_ok=True)
            for file in [
                    work / "problem.log", *work.glob("curve.*"), *work.glob("fields.*"),
                    *work.glob("points.*")
            ]:
                shutil.copy(file, into)
        if status != 0:
            print(f"{name}: ended with {status}", *log.splitlines()[-3:], sep="\n  ", flush=True)
            return None
        row = row_of(name, arguments, log, seconds, work)
        if row and ranks > 1:
            row["case"]["ranks"] = ranks
        return row


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, help="folder of lmp")
    parser.add_argument("--out",
                        type=pathlib.Path,
                        help="the record; rows of the same problem and card are replaced")
    parser.add_argument("--only",
                        action="append",
                        help="a problem, or an example with all of its problems")
    parser.add_argument("--device", default="cuda", choices=("cuda", "cpu"))
    parser.add_argument("--ranks", type=int, default=1, help="MPI ranks")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds of one run")
    parser.add_argument("--keep", type=pathlib.Path, help="a folder for logs, curves and fields")
    parser.add_argument("--list", action="store_true", help="their names, and nothing is run")
    arguments = parser.parse_args()
    chosen = [
        name for name in PROBLEMS
        if not arguments.only or any(name == some or name.split("/")[0] == some
                                     for some in arguments.only)
    ]
    unknown = [
        some for some in arguments.only or []
        if not any(name == some or name.split("/")[0] == some for name in PROBLEMS)
    ]
    if unknown:
        parser.error("there is no problem " + ", ".join(unknown) + "; --list has their names")
    if arguments.list:
        for name in chosen:
            print(f"{name}: lmp -in {PROBLEMS[name]}")
        return 0
    if not arguments.bin or not arguments.out:
        parser.error("--bin and --out are needed")
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"],
                            cwd=ROOT,
                            stdout=subprocess.PIPE,
                            text=True,
                            check=False).stdout.strip()
    record = {"command": "bench/problems.py; each row has its own", "rows": []}
    if arguments.out.exists():
        record = bench_records.read(arguments.out)
    failed = False
    for name in chosen:
        row = run(name, (arguments.bin / "lmp").resolve(), arguments.ranks, arguments.device,
                  arguments.limit, arguments.keep)
        if not row:
            failed = True
            continue
        row["case"]["commit"] = commit or os.environ.get("GPU_RVE_COMMIT", "")
        details = row["details"]
        print(f"{name}: {row['value']} s,",
              ", ".join(f"{part} {ms}" for part, ms in details["ms_per_step"].items()),
              "ms of a step",
              flush=True)
        same = lambda other, case=row["case"]: all(other["case"].get(key) == case.get(key)
                                                   for key in ("example", "name", "device", "ranks"))
        record["rows"] = [other for other in record["rows"] if not same(other)] + [row]
        record["date"] = datetime.date.today().isoformat()
        record["commit"] = row["case"]["commit"]
        record["machine"] = f"{row['case'].get('device', 'CPU')}, {os.cpu_count()} CPU threads"
        bench_records.write(record, arguments.out)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
