#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
r"""Measures how much longer the first run of a scene on a GPU takes, while its kernels are compiled.

    python3 bench/first_run.py --lmp build/cuda/bin/lmp --out bench/results/first-run-<gpu>.json

Each scene runs twice: with an empty kernel cache, and with a cache that has all optimized kernels.
Both must print the same numbers. A row has both wall times of the process, and the kernels that were
compiled. --cores N limits the runs to the first N cores. --only NAME selects scenes.
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

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Packings: radii, stiffness and the rest of the material.
SIZES = "seed 1 radius uniform 0.0025 0.005 density 2650 damping 0.3 pressure 1e5"
SPRINGS = "kn 1e6 friction 0.5"
ROLLING = SPRINGS + " kr 2.5e5 rolling_friction 0.1"
DISKS = f"grains 400 thickness 0.075 {SIZES} "
SPHERES = f"shape sphere grains 500 {SIZES} "
HERTZ = "contact hertz/material 7e9 0 0.2 tangential mindlin NULL 0 0.5"
FORCE = "contact hertz/material 7e9 0 0.2 tangential mindlin/force NULL 0 0.5"

STRAIN = "drive velocity_gradient yy -0.05"
SERVO = STRAIN + " servo xx -1e5"
# Scene: dimension, packing, number of RVEs, keywords of fix rve, and optionally the number of steps.
# In disks_exchange the optimized kernel replaces the first one during the run.
ELEMENTS = {
    "disks_exchange": (2, DISKS + SPRINGS + " gamma_n 0.1", 24, STRAIN, 30000),
    "disks": (2, DISKS + SPRINGS, 24, STRAIN),
    "disks_many": (2, DISKS + SPRINGS, 1000, STRAIN),
    "disks_servo": (2, DISKS + SPRINGS, 24, SERVO),
    "disks_damped": (2, DISKS + SPRINGS + " gamma_n 0.1", 24, STRAIN),
    "disks_rolling": (2, DISKS + ROLLING, 24, STRAIN),
    "disks_energy": (2, DISKS + SPRINGS, 24, STRAIN + " energy yes"),
    "disks_double": (2, DISKS + SPRINGS, 24, STRAIN + " format double"),
    "spheres": (3, SPHERES + SPRINGS, 24, STRAIN),
    "spheres_many": (3, SPHERES + SPRINGS, 1000, STRAIN),
    "spheres_servo": (3, SPHERES + SPRINGS, 24, SERVO),
    "spheres_rolling": (3, SPHERES + ROLLING, 24, STRAIN),
    "hertz": (3, SPHERES + HERTZ, 24, STRAIN),
    "hertz_many": (3, SPHERES + HERTZ, 1000, STRAIN),
    "hertz_servo": (3, SPHERES + HERTZ, 24, SERVO),
    "hertz_force": (3, SPHERES + FORCE, 24, STRAIN),
    "hertz_energy": (3, SPHERES + HERTZ, 24, STRAIN + " energy yes"),
}
SCRIPT = """units si
dimension {dimension}
boundary p p p
atom_style sphere
atom_modify map array sort 0 0.0
region box block 0 {count} 0 1 -0.5 0.5
create_box 1 box
lattice {lattice} 1
create_atoms 1 region box
comm_modify cutoff 0.5
timestep 1e-3
fix grains all rve packing.rve {keywords} device cuda
compute rve all rve/atom p q void_ratio
compute sum all reduce sum c_rve[1] c_rve[2] c_rve[3]
thermo 100
thermo_style custom step c_sum[1] c_sum[2] c_sum[3]
thermo_modify format float %.17g
run {steps}
"""
# Scene: example and arguments of lmp.
EXAMPLES = {
    "adaptive": ("footing", 'study.footing -var h 0.25 -var pictures no -var d_end 0.02 -var keywords '
                 '"substeps adaptive 1e-5 1e-3 50" -var device cuda'),
    "in_situ": ("footing_3d", "in.footing_3d -var model rve -var h 0.5 -var d_end 0.02 -var device cuda"),
    "tangent": ("tangent", "in.tangent -var strain 0.002"),
}

TABLE_ROW = re.compile(r"^ *\d+(?: +[-+.e\d]+)+ *$", re.M)
COMPILED = re.compile(r"compiled rve::(\S+?)<rve::KernelVariant::(\w+), rve::(\w+)Numbers> .* in (\S+) s")


def timed(command, folder, cache, limit=200):
    """Returns the wall time of a command and its output."""
    environment = dict(os.environ, GPU_RVE_KERNEL_CACHE=str(cache), GPU_RVE_REQUIRE_CUDA="1")
    start = time.monotonic()
    with open(folder / "output", "w", encoding="utf-8") as output:
        status = subprocess.run(["timeout", "-k", "5", str(limit), *command], cwd=folder,
                                env=environment, stdout=output, stderr=subprocess.STDOUT,
                                check=False).returncode
    seconds = time.monotonic() - start
    text = (folder / "output").read_text(encoding="utf-8", errors="replace")
    if status != 0:
        raise RuntimeError("\n".join([f"status {status}: {command}", *text.splitlines()[-12:]]))
    return seconds, text


def prepare(name, lmp, folder):
    """Fills the folder of a scene and returns its command."""
    if name in EXAMPLES:
        example, arguments = EXAMPLES[name]
        shutil.copytree(ROOT / "examples" / "packings", folder / "packings")
        shutil.copytree(ROOT / "examples" / example, folder / example)
        return [lmp, "-log", "none", "-in", *shlex.split(arguments)], folder / example
    dimension, packing, count, keywords, *steps = ELEMENTS[name]
    (folder / "in.packing").write_text(
        f"units si\ndimension {dimension}\ncreate_rve packing.rve {packing} device cpu\n")
    (folder / "in.scene").write_text(
        SCRIPT.format(dimension=dimension, count=count, keywords=keywords,
                      steps=steps[0] if steps else 400,
                      lattice="sq" if dimension == 2 else "sc"))
    timed([lmp, "-log", "none", "-in", "in.packing"], folder, folder / "cache")
    return [lmp, "-log", "none", "-in", "in.scene"], folder


def measure(name, lmp):
    """Returns the row of a scene."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        command, work = prepare(name, lmp, folder)
        cache = folder / "kernels"
        if name in EXAMPLES:    # its packing is made before the runs that are compared
            timed(command, work, folder / "cache")
        cache.mkdir(mode=0o700)
        cold, log = timed(command, work, cache)
        full = folder / "full"
        full.mkdir(mode=0o700)
        for kernel, variant, numbers, _ in COMPILED.findall(log):
            subprocess.run([lmp.parent / "bench_kernels", "--program", variant, "--format",
                            numbers.lower(), "--kernel", kernel, "--cache", full],
                           stdout=subprocess.DEVNULL, check=True)
        warm, other = timed(command, work, full)
        if TABLE_ROW.findall(log) != TABLE_ROW.findall(other) or "ompiled" in other:
            raise RuntimeError(f"{name}: other numbers, or kernels that were compiled again")
    compiled = [{"kernel": kernel, "variant": variant, "format": numbers.lower(),
                 "seconds": float(seconds)}
                for kernel, variant, numbers, seconds in COMPILED.findall(log)]
    print(f"{name}: {cold:.1f} s, {warm:.1f} s warm;",
          *(f"{one['kernel']} {one['variant']} {one['format']} {one['seconds']} s," for one in compiled),
          flush=True)
    return {
        "case": {"scene": name},
        "metric": "first_run_longer_by",
        "value": round(cold - warm, 2),
        "unit": "s",
        "details": {"cold_s": round(cold, 2), "warm_s": round(warm, 2), "compiled": compiled}
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lmp", type=pathlib.Path, required=True)
    parser.add_argument("--out", type=pathlib.Path, required=True)
    parser.add_argument("--only", action="append", help="a scene")
    parser.add_argument("--cores", type=int, help="cores of the runs")
    arguments = parser.parse_args()
    if arguments.cores:
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[-arguments.cores:])
    chosen = [name for name in [*ELEMENTS, *EXAMPLES]
              if not arguments.only or name in arguments.only]
    record = {
        "command": "python3 bench/first_run.py",
        "date": datetime.date.today().isoformat(),
        "commit": os.environ.get("GPU_RVE_COMMIT", ""),
        "machine": f"{len(os.sched_getaffinity(0))} CPU threads",
        "rows": []
    }
    failed = False
    for name in chosen:
        try:
            record["rows"].append(measure(name, arguments.lmp.resolve()))
        except RuntimeError as error:
            print(name, "FAILED:", error, flush=True)
            failed = True
    bench_records.write(record, arguments.out)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
