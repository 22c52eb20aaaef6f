#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Runs study.footing in many variants, one after another, and writes what they show as rows of bench/results.

    python3 study.py --list                                    the cases, and the groups that they belong to
    python3 study.py --lmp <lmp> --cases half,full             two of them, at the paper's scale
    python3 study.py --lmp <lmp> --cases ranks --mpi "mpirun --bind-to none -np {ranks}"
    python3 study.py --lmp <lmp> --cases half,cpu --stop 200   their first 200 steps
    python3 study.py --json study.json                         all results that are there, without a run

Runs write to the folder --dir, with a record <case>.json each. A case that has a record is not repeated, so that a study can be made in
pieces; one that was stopped half-way is begun anew. What follows -- goes to every run (-- -var h 0.5 -var grains 60: small). --json collects
all records of the folder: peak, its settlement, plateau, asymmetry, wall time by parts, RVE-steps per second; for cases that differ in
the number of ranks whether curve and fields have the same bits, and their efficiency; for others the change of the peak.

Exit status 1 if a run failed or bits differ. Needs no module besides the standard library and tools/bench_records.py.
"""

import argparse
import datetime
import glob
import hashlib
import json
import math
import os
import re
import shlex
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "tools"))
import bench_records

PLATEAU_FROM = 0.45    # settlement [m]
EARLY = 0.05           # settlement up to which the horizontal force shows what the grains prefer [m]
PAPER_PEAK = 186e3     # [Pa]
BAND = 0.2             # deviatoric strain above which a point is in a shear band
REST = 0.01            # and below which little has happened to it


class Case:
    """A run of study.footing: its variables, and what it is compared with."""

    def __init__(self, name, groups, variables="", ranks=1, base=None, what=""):
        self.name, self.groups, self.ranks, self.base, self.what = name, groups.split(), ranks, base, what
        self.variables = dict(zip(*[iter(shlex.split(variables))] * 2))


def cases():
    """All cases; `base` is the case whose peak, wall time or bits they are compared with."""
    short = "d_end 0.25"    # beyond the peak
    adaptive = "substeps adaptive 1e-5 1e-3"
    made = [
        # the paper's two runs, and what makes the full domain asymmetric
        Case("half", "paper", "frames 12"),
        Case("full", "paper asymmetry", "domain full frames 12"),
        Case("full_mirrored", "asymmetry", "domain full ground mirrored frames 12", base="full", what="mirror image in the left half"),
        Case("full_different", "asymmetry", "domain full ground different frames 12", base="full", what="grains drawn point by point"),
        # what the peak depends on
        Case("short", "peak grid knobs", short, what="the half domain up to 0.25 m"),
    ]
    peak = [
        ("seed_1", "seed 1", "another packing, seed 1"), ("seed_2", "seed 2", "another packing, seed 2"), ("seed_3", "seed 3", "another packing, seed 3"),
        ("different", "ground different", "grains drawn point by point"),
        ("slow", "speed 0.05", "half the speed"), ("slower", "speed 0.025", "a quarter of the speed"),
        ("wide", "half 2 d_end 0.4", "footing twice as wide: its edge counts half"),
        ("flip", "pic 0", "no PIC"), ("damped", "damping 0.05", "local damping of 0.05 on the grid"),
        ("looser_0.02", "prep 0.02", "looser packing: friction 0.02 in preparation"), ("looser_0.05", "prep 0.05", "looser packing: 0.05"),
        ("looser", "prep 0.1", "looser packing: 0.1"), ("thick", "thickness 1 d_end 0.4", "disks of 1 m: soft grains"),
        ("thick_loose", "thickness 1 prep 0.2 d_end 0.4", "soft grains, looser packing"),
        ("grains_800", "grains 800", "twice the grains"),
    ]
    made += [Case(name, "peak", f"{short} {words}", base="short", what=what) for name, words, what in peak]
    # cells, and points in a cell, all with 400 grains
    made += [Case(f"h_{h}", "grid", f"{short} h {h} grains 400", base="short", what=f"cells of {h} m") for h in ("0.5", "0.25", "0.2", "0.05")]
    made += [Case(f"h_{h}_points_4", "grid", f"{short} h {h} points 4 grains 400", base="short", what=f"cells of {h} m, four points each")
             for h in ("0.5", "0.25", "0.2", "0.1")]
    # what is saved, and what it costs
    knobs = [
        ("adaptive", f"keywords '{adaptive}'"),
        ("adaptive_coarse", "keywords 'substeps adaptive 1e-4 1e-3'"),
        ("quiescent", "keywords 'quiescent 1e-6'"),
        ("quiescent_coarse", "keywords 'quiescent 2e-5'"),
        ("adaptive_50", f"keywords '{adaptive} 50'"),
        ("adaptive_10", f"keywords '{adaptive} 10'"),
        ("adaptive_quiescent", f"keywords '{adaptive} 10 quiescent 2e-5'"),
        ("fast", "format fast"), ("double", "format double"), ("draft", "preset draft"), ("standard", "preset standard"),
    ]
    made += [Case(name, "knobs", f"{short} {words}", base="short", what=words) for name, words in knobs]
    # what differs in the seventh digit of the friction of grains, and no more: how far peaks of the same ground lie apart
    made.append(Case("full_short", "full_twins", f"{short} domain full", what="the full domain up to 0.25 m"))
    few = {("", 50): "adaptive_50", ("", 10): "adaptive_10", ("full_", 50): "full_adaptive_short", ("full_", 10): "full_adaptive_10_short"}
    for most in (50, 10):
        made.append(Case(few["full_", most], "full_twins", f"{short} domain full keywords '{adaptive} {most}'", base="full_short",
                         what=f"adaptive substeps, at most {most}"))
    for full, number, words, fixed in (("", 6, short, "short"), ("full_", 4, f"{short} domain full", "full_short")):
        for k in range(1, number + 1):
            friction = f"mu 0.500000{k}"
            made.append(Case(f"{full}twin_{k}", f"{full}twins", f"{words} {friction}", base=fixed, what=friction))
            for most, name in ((50, "adaptive_twin"), (10, "adaptive_10_twin")):
                made.append(Case(f"{full}{name}_{k}", f"{full}twins", f"{words} {friction} keywords '{adaptive} {most}'", base=few[full, most],
                                 what=f"{friction}, adaptive substeps, at most {most}"))
    made += [
        Case("half_adaptive", "adaptive_whole", f"keywords '{adaptive} 50'", base="half", what="adaptive substeps, at most 50"),
        Case("full_adaptive", "adaptive_whole", f"domain full keywords '{adaptive} 50'", base="full", what="adaptive substeps, at most 50"),
        Case("half_quiescent", "quiescent_whole", "keywords 'quiescent 2e-5'", base="half", what="RVEs skipped up to a strain of 2e-5"),
        Case("full_quiescent", "quiescent_whole", "domain full keywords 'quiescent 2e-5'", base="full", what="RVEs skipped up to a strain of 2e-5"),
        Case("cpu", "cpu", "device cpu", base="half", what="all CPU cores, no GPU"),
    ]
    # several ranks: the full footing, and a domain that grows with them
    for ranks in (1, 2, 4, 8):
        end = "d_end 0.25"    # 3000 steps
        made.append(Case(f"strong_{ranks}", "ranks strong", f"domain full {end}", ranks, "strong_1", f"full domain, {ranks} ranks"))
        made.append(Case(f"weak_{ranks}", "ranks weak", f"length {24 * ranks} {end}", ranks, "weak_1", f"{24 * ranks} m of half domain, {ranks} ranks"))
        made.append(Case(f"adaptive_{ranks}", "ranks uneven", f"domain full {end} keywords '{adaptive}'", ranks, "adaptive_1",
                         f"full domain, {adaptive}, {ranks} ranks"))
    return made


# ---------------------------------------------------------------- what a run wrote


def read_curve(path):
    """Rows (settlement [m], pressure [Pa], horizontal force / width [Pa])."""
    with open(path) as stream:
        return [tuple(map(float, line.split())) for line in stream if line.strip() and not line.startswith("#")]


def mean_between(curve, begin, end, column=1):
    """Mean of a column over a range of settlement: area below the curve."""
    rows = [row for row in curve if begin <= row[0] <= end]
    area = sum(0.5 * (a[column] + b[column]) * (b[0] - a[0]) for a, b in zip(rows, rows[1:]))
    return area / (rows[-1][0] - rows[0][0]) if len(rows) > 1 and rows[-1][0] > rows[0][0] else float("nan")


def read_fields(path):
    """The columns of the last frame of a LAMMPS text dump, by name."""
    names, rows = [], []
    with open(path) as stream:
        for line in stream:
            if line.startswith("ITEM: ATOMS"):
                names, rows, reading = line.split()[2:], [], True
            elif line.startswith("ITEM:"):
                reading = False
            elif names and reading:
                rows.append(line.split())
    return {name: [float(row[k]) for row in rows] for k, name in enumerate(names)}


def asymmetry(curve, fields):
    """Of a full domain: what a symmetric solution would have as 0, or 1 for the ratio."""
    early = [row for row in curve if 0.0 < row[0] <= EARLY]
    result = {
        "horizontal_over_vertical_early": sum(abs(row[2]) for row in early) / max(sum(row[1] for row in early), 1e-300),
        "horizontal_over_vertical": sum(abs(row[2]) for row in curve) / max(sum(row[1] for row in curve), 1e-300),
    }
    if "ux" not in fields:
        return result
    # points are named by where they were, in micrometres
    where = {}
    for kind, x, y, ux, uy in zip(*(fields[name] for name in ("type", "x", "y", "ux", "uy"))):
        if kind == 1:
            where[round(1e6 * (x - ux)), round(1e6 * (y - uy))] = (ux, uy)
    pairs = [(right, where[-x, y]) for (x, y), right in where.items() if x > 0 and (-x, y) in where]
    if not pairs:
        return result
    size = [math.hypot(*right) for right, _ in pairs], [math.hypot(*left) for _, left in pairs]
    difference = sum((right[0] + left[0])**2 + (right[1] - left[1])**2 for right, left in pairs)
    total = sum(s * s for side in size for s in side)
    result["right_over_left_displacement"] = sum(size[0]) / max(sum(size[1]), 1e-300)
    result["displacement_asymmetry"] = math.sqrt(difference / max(total, 1e-300))    # 1 if one half rests
    return result


def grains_where(fields):
    """What RVEs say in shear bands and where little has happened, at the end: means over points, of inertial numbers the median."""
    if "void_ratio" not in fields:
        return {}
    result = {}
    soil = [k for k, kind in enumerate(fields["type"]) if kind == 1]
    for where, chosen in (("band", [k for k in soil if fields["eps_q"][k] > BAND]), ("rest", [k for k in soil if fields["eps_q"][k] < REST])):
        result[where + "_points"] = len(chosen)
        if chosen:
            for name in ("void_ratio", "coordination", "anisotropy", "sliding"):
                result[f"{where}_{name}"] = sum(fields[name][k] for k in chosen) / len(chosen)
            result[where + "_inertial"] = sorted(fields["inertial"][k] for k in chosen)[len(chosen) // 2]
    return result


def read_log(path):
    """Wall times by parts [s], DEM steps, steps, numbers of points, device and warnings, from a log of LAMMPS."""
    with open(path) as stream:
        text = stream.read()

    def number(pattern, default=None):
        found = re.findall(pattern, text, re.M)
        return float(found[-1]) if found else default

    if "Total wall time" not in text:
        raise ValueError(f"{path} has no end")
    hours, minutes, seconds = map(int, re.findall(r"^Total wall time: (\d+):(\d+):(\d+)", text, re.M)[-1])
    row = r"\s*\|\s*[\d.e+-]*\s*\|\s*([\d.e+-]+)\s*\|"
    task = {name: number(rf"^{name} {row}", 0.0) for name in ("Pair", "Neigh", "Comm", "Output", "Modify")}
    loop = number(r"^Loop time of (\S+) on")
    rve = number(r"^RVEs: (\S+) s of wall time", 0.0)
    other = number(r"^Other\s*\|[^|]*\|\s*([\d.e+-]+)\s*\|", 0.0)
    steps = number(r"^Loop time of .* for (\d+) steps")
    parts = {
        "rve_s": rve,
        # fix mpm without its RVEs, with fix print, store/state and balance, and with waiting for slower ranks
        "mpm_s": max(task["Modify"] - rve, 0.0),
        "lammps_s": task["Pair"] + task["Neigh"] + task["Comm"] + other,
        "output_s": task["Output"],
    }
    # what fix mpm itself knows of it is finer
    names = ("rve_s", "mpm_s", "transfers_s", "lammps_s", "output_s")
    known = re.findall(r"^fix mpm \S+: wall time .*: RVE (\S+), MPM (\S+), transfers (\S+), LAMMPS (\S+), output (\S+)$", text, re.M)
    if known:
        parts = {name: 1e-3 * float(value) * steps for name, value in zip(names, known[-1])}
    device = re.findall(r"^fix rve grains: (?!\d+ RVEs)(.*)$", text, re.M)
    return {
        "total_s": 3600.0 * hours + 60.0 * minutes + seconds,
        "loop_s": loop,
        "rve_call_s": rve,    # of the slowest rank, with transfers
        **parts,
        "steps": steps,
        "dem_steps": number(r"^RVEs: .* (\d+) DEM steps"),
        "rves": number(r"^(\d+) atoms in group ground"),
        "ranks": number(r"^Loop time of \S+ on (\d+) procs"),
        "imbalance": number(r"^Ranks: .* (\S+) after the last balance"),
        "device": device[0] if device else "",
        "warnings": len(re.findall(r"^WARNING", text, re.M)),
    }


def file_hash(path):
    with open(path, "rb") as stream:
        return hashlib.sha256(stream.read()).hexdigest()


# ---------------------------------------------------------------- runs and their records


def shell(*command):
    try:
        return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=HERE, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as stream:
        cpu = next((line.split(":", 1)[1].strip() for line in stream if line.startswith("model name")), "CPU")
    gpus = [line for line in shell("nvidia-smi", "--query-gpu=name", "--format=csv,noheader").split("\n") if line]
    return ", ".join(([f"{len(gpus)} {gpus[0]}"] if gpus else []) + [f"{len(os.sched_getaffinity(0))} cores of {cpu}"])


def run(options, case):
    """Runs a case and writes its record, that of the run with the median loop time; False if it failed."""
    name = case.name + (f".stop{options.stop}" if options.stop else "")
    record = os.path.join(options.dir, name + ".json")
    if os.path.exists(record) and not options.again:
        print(f"{name}: is there already")
        return True
    runs = [run_once(options, case, name) for _ in range(options.repeat)]
    if not all(runs):
        return False
    made = sorted(runs, key=lambda one: one["log"]["loop_s"])[options.repeat // 2]
    with open(record + ".part", "w", encoding="utf-8") as stream:
        json.dump(made, stream, indent=1)
    os.replace(record + ".part", record)
    return True


def run_once(options, case, name):
    """Runs a case once and returns its record; None if it failed."""
    variables = dict(case.variables)
    if options.stop:
        variables["stop"] = str(options.stop)
    words = list(options.words)
    for key, value in variables.items():
        if key not in words:
            words += ["-var", key, value]
    front = shlex.split(options.mpi.format(ranks=case.ranks)) if case.ranks > 1 or options.mpi_always else []
    command = front + [os.path.abspath(options.lmp), "-in", os.path.join(HERE, "study.footing")] + words
    told = " ".join(front + ["lmp", "-in", "study.footing"] + [shlex.quote(word) for word in words])
    print(f"{name}: {told}", flush=True)
    with open(os.path.join(options.dir, "screen." + name), "w") as screen:
        status = subprocess.run(command + ["-var", "out", name, "-log", "log." + name], cwd=options.dir, stdout=screen, stderr=subprocess.STDOUT).returncode
    if status != 0:
        with open(os.path.join(options.dir, "screen." + name)) as screen:
            print("".join(screen.readlines()[-8:]), f"{name}: FAILED with status {status}", sep="\n")
        return None
    there = {kind: os.path.join(options.dir, kind + "." + name) for kind in ("curve", "fields", "log")}
    curve, fields = read_curve(there["curve"]), read_fields(there["fields"])
    pressure, settlement = max((row[1], row[0]) for row in curve)
    soil = [k for k, kind in enumerate(fields["type"]) if kind == 1]
    made = {
        "name": name, "what": case.what, "base": case.base and case.base + name[len(case.name):], "groups": case.groups, "variables": variables,
        "words": options.words, "command": told, "machine": options.machine or machine(), "date": datetime.date.today().isoformat(),
        "commit": os.environ.get("GPU_RVE_COMMIT") or shell("git", "rev-parse", "--short", "HEAD"),
        "peak_pressure_pa": pressure, "settlement_at_peak_m": settlement, "settlement_reached_m": curve[-1][0],
        "log": read_log(there["log"]), "curve_sha256": file_hash(there["curve"]), "fields_sha256": file_hash(there["fields"]),
        "largest_eps_q": max(fields["eps_q"][k] for k in soil), "grains": grains_where(fields),
    }
    if curve[-1][0] > PLATEAU_FROM + 0.05:
        made["plateau_pressure_pa"] = mean_between(curve, PLATEAU_FROM, curve[-1][0])
    if variables.get("domain") == "full":
        made["asymmetry"] = asymmetry(curve, fields)
    print(f"{name}: peak {pressure / 1e3:.1f} kPa at {settlement:.3f} m; {made['log']['loop_s']:.1f} s", flush=True)
    return made


# ---------------------------------------------------------------- rows


def case_keys(record):
    variables, log = record["variables"], record["log"]
    words = record["words"]
    given = {words[k + 1]: words[k + 2] for k, word in enumerate(words[:-2]) if word == "-var"}

    def value(key, default):
        return given.get(key, variables.get(key, default))

    h = float(value("h", "0.5"))
    device = "cpu-" + re.sub(r" .*", "", log["device"]) if "CPU" in log["device"] else re.sub(r"^.*(H\d+|A\d+).*$", r"\1", log["device"])
    return {"device": device, "code": "gpu_rve", "scene": "footing_" + value("domain", "half"), "dim": 2,
            "grains": int(value("grains", "400" if h <= 0.1 else "150")), "rves": int(log["rves"]), "format": value("format", "mixed"),
            "arithmetic": "strict", "cell_size": h, "ranks": int(log["ranks"]), "name": record["name"], "what": record["what"]}


def is_peak(record):
    """Whether the largest pressure of a run is a peak, and not just the end of a rise."""
    return record["settlement_at_peak_m"] < 0.98 * record["settlement_reached_m"]


def rows_of(record, records):
    """The rows of one case; those that compare it need the records of the others."""
    key, log = case_keys(record), record["log"]
    details = {"command": record["command"], "machine": record["machine"], "date": record["date"], "commit": record["commit"], "steps": log["steps"], "warnings": log["warnings"]}
    rows = []

    def row(metric, value, unit):
        if value is not None and value == value:
            rows.append({"case": key, "metric": metric, "value": value, "unit": unit, "details": details})

    whole = is_peak(record)
    if whole:
        row("peak_pressure_pa", record["peak_pressure_pa"], "Pa")
        row("settlement_at_peak_m", record["settlement_at_peak_m"], "m")
        row("peak_over_paper", record["peak_pressure_pa"] / PAPER_PEAK, "-")
    row("settlement_reached_m", record["settlement_reached_m"], "m")
    row("plateau_pressure_pa", record.get("plateau_pressure_pa"), "Pa")
    for name, value in record.get("asymmetry", {}).items():
        row(name, value, "-")
    for name, value in record.get("grains", {}).items():
        row(name, value, "-")
    row("wall_s", log["total_s"], "s")
    for part in ("loop", "rve", "mpm", "transfers", "lammps", "output"):
        row(f"wall_{part}_s", log.get(f"{part}_s"), "s")
    if log["dem_steps"]:
        row("dem_steps", log["dem_steps"], "-")
        row("rve_steps_per_second", log["dem_steps"] / log["loop_s"], "1/s")
        row("rve_steps_per_second_of_rves", log["dem_steps"] / log["rve_call_s"], "1/s")
    row("imbalance", log["imbalance"], "-")
    base = records.get(record["base"])
    if not base or base is record:
        return rows
    if "ranks" not in record["groups"]:
        if whole and is_peak(base):
            row("peak_change", record["peak_pressure_pa"] / base["peak_pressure_pa"] - 1.0, "-")
        row("time_over_base", log["loop_s"] / log["steps"] / (base["log"]["loop_s"] / base["log"]["steps"]), "-")
        return rows

    def per_step(some, part):
        return some["log"][part] / some["log"]["steps"]

    same_points = log["rves"] == base["log"]["rves"]
    name = "strong_efficiency" if same_points else "weak_efficiency"
    share = log["ranks"] / base["log"]["ranks"] * base["log"]["rves"] / log["rves"]
    for part, whose in (("loop_s", "loop"), ("rve_call_s", "rve")):
        row(f"{name}_{whose}", per_step(base, part) / per_step(record, part) / share, "-")
    if same_points:
        same = all(record[kind] == base[kind] for kind in ("curve_sha256", "fields_sha256"))
        row("same_bits", int(same), "-")
    return rows


def collect(options):
    """Writes all records as rows; returns the names of cases whose bits differ."""
    records = {}
    for path in sorted(glob.glob(os.path.join(options.dir, "*.json"))):
        with open(path, encoding="utf-8") as stream:
            record = json.load(stream)
        if "curve_sha256" in record:
            records[record["name"]] = record
    rows = [row for record in records.values() for row in rows_of(record, records)]
    wrong = [row["case"]["name"] for row in rows if row["metric"] == "same_bits" and not row["value"]]
    if options.json:
        report = {key: "; ".join(dict.fromkeys(record[key] for record in records.values())) for key in ("machine", "date", "commit")}
        report.update(command="python3 study.py; each row has the command of its run", rows=rows)
        bench_records.write(report, options.json)
        print("wrote", options.json)
    print(f"\n{'case':28}{'RVEs':>7}{'ranks':>6}{'peak [kPa]':>12}{'at [m]':>8}{'to [m]':>8}{'loop [s]':>10}{'RVEs':>8}{'MPM':>8}{'rest':>8}")
    for record in records.values():
        log = record["log"]
        print(f"{record['name']:28}{log['rves']:7.0f}{log['ranks']:6.0f}{record['peak_pressure_pa'] / 1e3:12.1f}{record['settlement_at_peak_m']:8.3f}"
              f"{record['settlement_reached_m']:8.3f}{log['loop_s']:10.1f}{log['rve_s']:8.1f}{log['mpm_s']:8.1f}"
              f"{log.get('transfers_s', 0.0) + log['lammps_s'] + log['output_s']:8.1f}")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lmp", help="the LAMMPS executable with the package in it; without it nothing is run")
    parser.add_argument("--cases", default="", help="names of cases or groups, with commas between")
    parser.add_argument("--stop", type=int, default=0, help="end every run after so many steps")
    parser.add_argument("--again", action="store_true", help="also cases that have a record")
    parser.add_argument("--repeat", type=int, default=1, help="run each case so often; the record has the median of the loop times")
    parser.add_argument("--mpi", default="mpirun --bind-to none -np {ranks}", help="what goes in front of lmp for several ranks")
    parser.add_argument("--mpi-always", action="store_true", help="also for one")
    parser.add_argument("--dir", default="study", help="where runs write")
    parser.add_argument("--json", help="write the rows of all records in the folder")
    parser.add_argument("--machine", help="what the records say; found out if not given")
    parser.add_argument("--list", action="store_true", help="print the cases")
    parser.add_argument("words", nargs="*", help="for every run, after --")
    options = parser.parse_args()

    all_cases = cases()
    if options.list:
        for case in all_cases:
            words = " ".join(f"-var {key} {shlex.quote(value)}" for key, value in case.variables.items())
            print(f"{case.name:20} {','.join(case.groups):20} {case.ranks} rank{'s' if case.ranks > 1 else ' '}  {words}")
        return 0
    # the paper's scale, unless said otherwise
    for case in all_cases:
        case.variables.setdefault("h", "0.1")
    wanted = [word for word in options.cases.split(",") if word]
    known = {name for case in all_cases for name in [case.name, *case.groups]}
    for word in wanted:
        if word not in known:
            print(f"there is no case or group {word}; --list shows them")
            return 1
    os.makedirs(options.dir, exist_ok=True)
    chosen = [case for case in all_cases if case.name in wanted or set(case.groups) & set(wanted)] if options.lmp else []
    if options.lmp and not os.access(options.lmp, os.X_OK):
        print(f"no executable {options.lmp}")
        return 1
    failed = [case.name for case in chosen if not run(options, case)]
    wrong = collect(options)
    if failed:
        print("failed:", ", ".join(failed))
    if wrong:
        print("other bits than with one rank:", ", ".join(wrong))
    return 1 if failed or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
