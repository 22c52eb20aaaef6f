#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Runs the three tests with different numbers of threads and compares curves and final states byte by byte.

    python3 thread_count.py                     with a GPU: 1, 32, 128, 256 and 1024 threads per block, and the CPU
                                                without: 1 and 2 threads of the CPU engine
    python3 thread_count.py --short             2,000 steps instead of 30,000
    python3 thread_count.py --formats fast mixed double --device cuda

GPU_RVE_REQUIRE_CUDA=1 makes it an error if there is no GPU. A control run, whose strain rate differs by 1e-9, must give other bytes.
Exit status 1 if bytes differ that must not, 2 if a run fails.
"""

import hashlib
import os
import re
import sys
import time

import element
import harness
from packing_file import read_packing

BLOCKS = (1, 32, 128, 256, 1024)
THREADS = (1, 2)
# CPU threads share the RVEs of a batch: four equal ones, of which the last is compared
CPU_RVES = 4
SUBSTEPS = 100    # DEM steps per call


def device_of(options, name):
    """What fix rve said it runs on."""
    with open(os.path.join(options.dir, f"log.{name}")) as log:
        found = re.findall(r"^fix rve grains: (.*, strict.*)$", log.read(), re.MULTILINE)
    if not found:
        sys.exit(f"log.{name} does not name the device")
    return found[0]


def read_bytes(options, name, steps):
    content = b""
    for path in (f"curve.{name}", f"state.{name}.{steps}"):
        with open(os.path.join(options.dir, path), "rb") as stream:
            content += stream.read()
    return content


def main():
    parser = harness.new_parser(__doc__, "2,000 steps")
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")
    parser.add_argument("--formats", nargs="+", choices=("fast", "mixed", "double"), default=["mixed"])
    parser.add_argument("--tests", nargs="+", choices=element.TESTS, default=list(element.TESTS))
    parser.add_argument("--packing", default=os.path.join(harness.PACKINGS, "A_h0075.rve"))
    options = harness.parse_arguments(parser, __file__)
    steps = 2000 if options.short else 30000
    packing = os.path.abspath(options.packing)
    common = dict(packing=packing, steps=steps, substeps=SUBSTEPS, every=SUBSTEPS, gain=repr(float(element.servo_gain(read_packing(packing)))))

    def run(name, **variables):
        begin = time.monotonic()
        harness.run_lmp(options, "in.element", name, **common, **variables)
        return read_bytes(options, name, steps), time.monotonic() - begin

    harness.run_lmp(options, "in.element", "probe", **{**common, "steps": SUBSTEPS}, device=options.device)
    device = device_of(options, "probe")
    on_gpu = "CPU thread" not in device
    if on_gpu:
        print(f"GPU: {device.split(',')[0]}; threads per block {', '.join(map(str, BLOCKS))}, and the CPU")
        settings = [(f"{block} threads", dict(device="cuda", block=block)) for block in BLOCKS] + [("CPU", dict(device="cpu"))]
    else:
        print(f"no GPU; CPU engine with {' and '.join(map(str, THREADS))} threads, {CPU_RVES} RVEs")
        settings = [(f"{threads} CPU thread{'s' * (threads > 1)}", dict(device="cpu", threads=threads, rves=CPU_RVES)) for threads in THREADS]
    print(f"{steps} steps, {SUBSTEPS} per call, {os.path.basename(packing)}\n")

    check = harness.Checks()
    for format in options.formats:
        for test in options.tests:
            first = None
            for label, variables in settings:
                name = f"{test}.{format}.{label.replace(' ', '_')}"
                content, seconds = run(name, test=test, format=format, **variables)
                if "threads" in variables and f"{variables['threads']} CPU thread" not in device_of(options, name):
                    check(False, f"{name} ran with {device_of(options, name)}")
                first = first or content
                digest = hashlib.sha256(content).hexdigest()[:16]
                check(content == first, f"{test:9} {format:7}{label:15}{len(content)} bytes, SHA-256 {digest}..., {seconds:.1f} s")
            rate = repr(element.RATE * (1.0 + 1e-9))
            control, _ = run(f"{test}.{format}.control", test=test, format=format, rate=rate, **settings[-1][1])
            check(control != first, f"{test:9} {format:7}control: a strain rate of {rate} gives other bytes")
    check.exit()


if __name__ == "__main__":
    main()
