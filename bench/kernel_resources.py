#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Lists registers, stack and shared memory of each CUDA kernel, by cuobjdump of the CUDA toolkit.

    python3 bench/kernel_resources.py build/cuda/bin/bench_engine --out bench/results/kernels.json

The stack has spills and indexed arrays. Shared memory is the static part; the part that grows with
the number of grains is set at launch.
"""

import argparse
import datetime
import os
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tools"))
import bench_records

HERE = pathlib.Path(__file__).resolve().parent

# advance_<kernel><(rve::KernelVariant)<number>, rve::<namespace>::<Format>Numbers>
KERNEL = re.compile(r"advance_([a-z_]+)<\(rve::KernelVariant\)(\d+), rve::(\w+)::([A-Z][a-z]+)Numbers>")
USAGE = re.compile(r"REG:(\d+) STACK:(\d+) SHARED:(\d+)")


def programs():
    """Returns the names of programs in the order of the table."""
    table = (HERE.parent / "src" / "GPU_RVE" / "rve" / "engine" /
             "kernel_variants.h").read_text(encoding="utf-8")
    return [name.lower() for name in re.findall(r"^  variant\((\w+),", table, re.M)]


def kernels(text):
    """Returns rows from `cuobjdump --dump-resource-usage`, after c++filt."""
    names = programs()
    rows, arch, kernel = [], "", None
    for line in text.splitlines():
        if line.startswith("arch = "):
            arch = line.split(" = ")[1]
        if "Function " in line:
            kernel = KERNEL.search(line)
        usage = USAGE.search(line)
        if kernel and usage:
            case = {
                "code": "gpu_rve", "experiment": "kernels", "arch": arch,
                "format": kernel.group(4).lower(),
                "arithmetic": "relaxed" if kernel.group(3) == "relaxed" else "strict",
                "kernel": kernel.group(1), "program": names[int(kernel.group(2))]
            }
            rows.append({
                "case": case, "metric": "registers_per_thread", "value": int(usage.group(1)),
                "unit": "1", "details": {
                    "stack_bytes": int(usage.group(2)), "shared_bytes": int(usage.group(3))
                }
            })
            kernel = None
    order = ("arch", "format", "arithmetic", "kernel", "program")
    return sorted(rows, key=lambda row: [row["case"][key] for key in order])


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path)
    arguments = parser.parse_args()
    mangled = subprocess.run(["cuobjdump", "--dump-resource-usage", arguments.program],
                             stdout=subprocess.PIPE,
                             text=True,
                             check=True).stdout
    text = subprocess.run(["c++filt"], input=mangled, stdout=subprocess.PIPE, text=True,
                          check=True).stdout
    rows = kernels(text)
    if not rows:
        raise SystemExit(f"no kernel in {arguments.program}")
    for row in rows:
        print(*row["case"].values(), row["value"], "registers", row["details"]["stack_bytes"],
              "bytes of stack")
    if arguments.out:
        commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"],
                                stdout=subprocess.PIPE,
                                text=True,
                                cwd=HERE,
                                check=False).stdout.strip()
        program = arguments.program.name if os.path.isabs(arguments.program) else arguments.program
        report = {"date": datetime.date.today().isoformat(), "commit": commit,
                  "command": f"python3 bench/kernel_resources.py {program}", "rows": rows}
        bench_records.write(report, arguments.out)


if __name__ == "__main__":
    main()
