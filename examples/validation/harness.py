# SPDX-License-Identifier: GPL-2.0-only
"""What the comparisons share: the command line, running lmp, and checks that decide the exit status."""

import argparse
import glob
import os
import shutil
import subprocess
import sys

VALIDATION = os.path.dirname(os.path.abspath(__file__))
REPOSITORY = os.path.dirname(os.path.dirname(VALIDATION))
PACKINGS = os.path.join(REPOSITORY, "examples", "packings")


def new_parser(doc, short=None, figure=False):
    """The options that every comparison has; `short` says what its short form is, `figure` that it draws one."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lmp", help="LAMMPS executable with the package (default: the newest of build/*/bin/lmp, or lmp on the PATH)")
    parser.add_argument("--dir", help="folder where the runs write (default: out/<name of the script> beside harness.py)")
    if short:
        parser.add_argument("--short", action="store_true", help=short)
    if figure:
        parser.add_argument("--figure", metavar="FILE.png", help="draw a figure into this file (needs matplotlib); not with --short")
    return parser


def parse_arguments(parser, script):
    """Parses the command line and prepares executable and folders of the runs of this script."""
    options = parser.parse_args()
    if getattr(options, "short", False) and getattr(options, "figure", None):
        parser.error("--figure needs the whole comparison, not --short")
    options.lmp = find_lmp(options.lmp)
    options.scripts = os.path.dirname(os.path.abspath(script))
    name = os.path.splitext(os.path.basename(script))[0]
    options.dir = os.path.abspath(options.dir or os.path.join(VALIDATION, "out", name))
    os.makedirs(options.dir, exist_ok=True)
    return options


def find_lmp(given, option="--lmp"):
    """The executable to run, `given` by this option or None; ends the script with status 2 if there is none."""
    built = glob.glob(os.path.join(REPOSITORY, "build", "*", "bin", "lmp"))
    lmp = shutil.which(given or max(built, key=os.path.getmtime, default="lmp"))
    if not lmp:
        print(f"no executable {given or 'in build/*/bin/lmp or on the PATH'}: build the package (README.md of the repository), or give one with {option}")
        sys.exit(2)
    return os.path.abspath(lmp)


def run_lmp(options, script, name, **variables):
    """Runs an input script of the comparison, which ends its files in `name`; a run that fails ends the comparison with status 2."""
    command = [options.lmp, "-in", os.path.join(options.scripts, script), "-screen", "none", "-log", f"log.{name}", "-var", "out", name]
    for key, value in variables.items():
        command += ["-var", key] + [str(word) for word in (value if isinstance(value, (list, tuple)) else [value])]
    # one process needs no daemon of Open MPI, which takes longer to start than most runs here
    environment = dict(os.environ, OMPI_MCA_ess_singleton_isolated="1")
    # results do not depend on the number of threads, the load of the machine does; 0: as OpenMP decides
    threads = getattr(options, "threads", 1)
    if threads > 0:
        environment["OMP_NUM_THREADS"] = str(threads)
    if subprocess.run(command, cwd=options.dir, env=environment).returncode == 0:
        return
    print("failed:", " ".join(command), "\nin", options.dir)
    log = os.path.join(options.dir, f"log.{name}")
    if os.path.exists(log):
        with open(log) as stream:
            print("".join(stream.readlines()[-5:]), end="")
    sys.exit(2)


class Checks:
    """Collects statements that must hold and prints each."""

    def __init__(self):
        self.failures = 0

    def __call__(self, holds, what):
        print("pass " if holds else "FAIL ", what, flush=True)
        self.failures += not holds

    def between(self, low, value, high, what):
        self(low <= value <= high, f"{what}: {value:.4g}, allowed {low:.4g} to {high:.4g}")

    def exit(self):
        print("all checks passed" if not self.failures else f"{self.failures} checks failed")
        sys.exit(1 if self.failures else 0)
