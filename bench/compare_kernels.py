#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
r"""Compares the arithmetic of kernels that NVRTC compiled at run time with those of nvcc.

Every function must have the same floating point operations on the same numbers in the same order.
The comparison uses texts (PTX), before ptxas. Compilers may move independent operations and repeat
a comparison or a conversion; neither changes a number.

    bench_kernels --capability 90 --program Plain --format fast --kernel advance_many \
        --keep /tmp/kernels
    python3 bench/compare_kernels.py \
        build/cuda/src/GPU_RVE/CMakeFiles/rve_cuda.dir/programs/cuda_Plain_Fast.cu.o \
        /tmp/kernels/*.ptx

The object must have text (CMAKE_CUDA_ARCHITECTURES without -real). CUOBJDUMP names the cuobjdump of
the CUDA toolkit. The exit status is 1 if the numbers of sums, products, quotients or roots differ.
"""

import argparse
import collections
import os
import pathlib
import re
import subprocess

FUNCTION = re.compile(r"\.(?:entry|func)[^{;]*?(_Z\w+)\s*\([^{;]*?\)[^{;]*?\{", re.S)
ROUNDED = ("add", "sub", "mul", "fma", "div", "sqrt", "rsqrt", "rcp")
OPERATION = re.compile(
    r"(?:@!?%p\d+ )?"
    r"((?:add|sub|mul|fma|div|sqrt|rsqrt|rcp|neg|abs|min|max|setp|selp|cvt|copysign)\.\S+)"
    r"\s+(.*);"
)


def functions(text):
    """Returns the bodies of functions by name."""
    found = {}
    for match in FUNCTION.finditer(text):
        depth, end = 1, match.end()
        while depth > 0:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        found[match[1]] = text[match.end() : end]
    return found


def operations(body):
    """Returns each operation with its operands, numbered by appearance, since registers have other
    names in the other text."""
    numbers, found = {}, []
    for line in body.splitlines():
        match = OPERATION.match(line.strip())
        if not match or not re.search(r"%fd?\d", match[2]):
            continue
        operands = re.sub(
            r"%(fd?)\d+",
            lambda register: numbers.setdefault(register[0], f"{register[1]}{len(numbers)}"),
            match[2])
        found.append(match[1] + " " + re.sub(r"%(p|r|rd|rs)\d+", r"%\1", operands))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("object", type=pathlib.Path)
    parser.add_argument("text", type=pathlib.Path, nargs="+")
    arguments = parser.parse_args()
    dumped = subprocess.run(
        [os.environ.get("CUOBJDUMP", "cuobjdump"), "--dump-ptx", arguments.object],
        stdout=subprocess.PIPE,
        text=True,
        check=True)
    ahead = functions(dumped.stdout)
    if not ahead:
        raise SystemExit(f"{arguments.object} has no text")
    failed = False
    for path in arguments.text:
        later = functions(path.read_text(encoding="utf-8"))
        if not later:
            raise SystemExit(f"{path} has no function")
        verdicts = collections.Counter()
        for name, body in later.items():
            if name not in ahead:
                raise SystemExit(f"{path}: {name} is not in {arguments.object}")
            first, second = operations(ahead[name]), operations(body)
            kinds = [
                collections.Counter(kind for kind in (operation.split()[0] for operation in all)
                                    if kind.split(".")[0] in ROUNDED) for all in (first, second)
            ]
            verdict = "the same" if first == second else "in another order" if kinds[0] == kinds[
                1] else "different"
            verdicts[verdict] += 1
            if verdict != "the same":
                print(f"  {verdict}: {name}, {len(first)} and {len(second)} operations")
            failed = failed or verdict == "different"
        print(path.name + ": " + ", ".join(f"{count} functions {verdict}"
                                           for verdict, count in verdicts.items()))
    raise SystemExit(1 if failed else 0)


if __name__ == "__main__":
    main()
