#!/usr/bin/env python3
"""Registers, stack (spills and arrays that are indexed) and shared memory of each CUDA kernel in a program, by cuobjdump of the CUDA toolkit.

    python3 bench/kernel_resources.py build/cuda/bin/bench_engine --out bench/results/kernels.json

Shared memory is the static part; what grows with the number of grains is given at launch.
"""

import argparse
import datetime
import json
import os
import pathlib
import re
import subprocess

HERE = pathlib.Path(__file__).resolve().parent

# mangled: advance_<kernel><<Format>Format, General>, or with Frictionless<<Format>Format> or Rolling<<Format>Format>, relaxed ones in
# a namespace of their own
FUNCTION = re.compile(r"Function (\S*?)\d+advance_([a-z_]+)INS\w*?_\d+((?:Frictionless|Rolling)?)(?:IN\w*?_\d+)?([A-Z][a-z]+)FormatEE*Lb([01])E")
USAGE = re.compile(r"REG:(\d+) STACK:(\d+) SHARED:(\d+)")


def kernels(text):
    """Rows of `cuobjdump --dump-resource-usage`."""
    rows, arch, name = [], "", None
    for line in text.splitlines():
        if line.startswith("arch = "):
            arch = line.split(" = ")[1]
        name = FUNCTION.search(line) or name
        usage = USAGE.search(line)
        if name and usage:
            case = {"code": "gpu_rve", "experiment": "kernels", "arch": arch, "format": name.group(4).lower(),
                    "arithmetic": "relaxed" if "relaxed" in name.group(1) else "strict", "kernel": name.group(2),
                    "program": name.group(3).lower() or ("general" if name.group(5) == "1" else "plain")}
            rows.append({"case": case, "metric": "registers_per_thread", "value": int(usage.group(1)), "unit": "1",
                         "details": {"stack_bytes": int(usage.group(2)), "shared_bytes": int(usage.group(3))}})
            name = None
    order = ("arch", "format", "arithmetic", "kernel", "program")
    return sorted(rows, key=lambda row: [row["case"][key] for key in order])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path)
    arguments = parser.parse_args()
    text = subprocess.run(["cuobjdump", "--dump-resource-usage", arguments.program], stdout=subprocess.PIPE, text=True, check=True).stdout
    rows = kernels(text)
    if not rows:
        raise SystemExit(f"no kernel in {arguments.program}")
    for row in rows:
        print(*row["case"].values(), row["value"], "registers", row["details"]["stack_bytes"], "bytes of stack")
    if arguments.out:
        commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], stdout=subprocess.PIPE, text=True, cwd=HERE, check=False).stdout.strip()
        program = arguments.program.name if os.path.isabs(arguments.program) else arguments.program
        report = {"date": datetime.date.today().isoformat(), "commit": commit,
                  "command": f"python3 bench/kernel_resources.py {program}", "rows": rows}
        arguments.out.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
