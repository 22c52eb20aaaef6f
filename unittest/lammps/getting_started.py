#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Runs the scripts of the manual's front page and of Getting started, and continues them from their
restart files.

    getting_started.py --lmp <lmp> --examples <examples/getting_started>

log.4Feb25.results has the numbers of the page, which results.py must print. The test also checks
statements of the page: the servo holds the sides. The wall begins with the pressure of the ground.
Its largest pressure is between Rankine's with the residual and with the peak friction of the
element test, and its final pressure is that with the residual friction. The band is looser than the
rest, and a continued run gives the numbers of the whole one.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile

failed = []


def check(holds, what):
    print("ok  " if holds else "FAIL", what)
    if not holds:
        failed.append(what)


def rows(path):
    return [line.split() for line in open(path) if not line.startswith("#")]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--lmp", required=True)
    parser.add_argument("--examples", required=True)
    options = parser.parse_args()
    scripts = [
        "in.first", "in.element", "in.element_continued", "in.problem", "in.problem_continued"
    ]

    with tempfile.TemporaryDirectory(prefix="getting_started.") as work:
        for name in scripts + ["results.py", "plot.py"]:
            shutil.copy(os.path.join(options.examples, name), work)
        for script in scripts:
            run = subprocess.run([options.lmp, "-in", script],
                                 cwd=work,
                                 stdout=subprocess.PIPE,
                                 stderr=subprocess.STDOUT,
                                 text=True,
                                 errors="replace")
            check(run.returncode == 0 and "Total wall time" in run.stdout,
                  f"{script} runs to its end")
            if run.returncode != 0:
                print(run.stdout[-2000:])

        for scene in ("element", "problem"):
            whole, continued = (rows(os.path.join(work, f"curve.{name}"))
                                for name in (scene, scene + "_continued"))
            # The first row belongs to the step of the restart file, with the forces of its state.
            tail = continued[1:]
            check(
                len(tail) > 50 and whole[-len(tail):] == tail,
                f"{scene}: {len(tail)} rows of the continued run are those of the whole one")

        said = subprocess.run([sys.executable, "results.py"],
                              cwd=work,
                              stdout=subprocess.PIPE,
                              text=True).stdout
        print(said, end="")
        with open(os.path.join(options.examples, "log.4Feb25.results")) as record:
            check(said == record.read(), "these are the numbers of the page")

        element = [[float(word) for word in row]
                   for row in rows(os.path.join(work, "curve.element"))]
        problem = [[float(word) for word in row]
                   for row in rows(os.path.join(work, "curve.problem"))]
        side = sum(row[1] for row in element) / len(element)
        check(
            abs(side - 1e5) < 500.0,
            f"the servo holds the sides at 100 kPa within 0.5 % on average: {side:.0f} Pa")
        peak = max(row[3] for row in element)
        late = [row[3] for row in element if row[0] > 0.06]
        residual = sum(late) / len(late)
        least, largest = (1e5 * (1 + ratio) / (1 - ratio) for ratio in (residual, peak))
        begin, top = problem[0][1], max(row[1] for row in problem)
        last = [row[1] for row in problem if row[0] > 0.12]
        end = sum(last) / len(last)
        check(
            abs(begin - 1e5) < 500.0,
            f"the wall begins with the pressure of the ground: {begin:.0f} Pa")
        check(
            least < top < largest,
            f"the largest pressure, {top:.0f} Pa, is between Rankine's with residual and peak "
            f"friction, {least:.0f} and {largest:.0f} Pa"
        )
        # The residual friction of one packing is a mean over fluctuations of a tenth.
        check(
            abs(end - least) < 0.1 * least,
            f"the pressure at the end, {end:.0f} Pa, is Rankine's with residual friction within a "
            "tenth"
        )
        voids = {
            line.split(":")[0]: float(line.split("void ratio ")[1].split(",")[0])
            for line in said.splitlines() if line.startswith("points")
        }
        check(voids["points in the band"] > voids["points elsewhere"] + 0.02,
              "the grains in the band are looser")

        try:
            import matplotlib  # noqa: F401
        except ImportError:
            print("no matplotlib: the pictures are not drawn")
        else:
            subprocess.run([sys.executable, "plot.py"], cwd=work, check=True)
            check(
                all(
                    os.path.getsize(os.path.join(work, name)) > 10000
                    for name in ("element.png", "problem.png")), "the pictures are drawn")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
