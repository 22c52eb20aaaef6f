#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Converts grains of another program to a packing file of GPU_RVE (manual: howto_import).

    import_packing.py grains.data grains.rve kn 1e6 friction 0.5 density 2650 damping 0.3

Reads LAMMPS data files and text dumps, YADE's lines `x y z r`, and CSV files with the columns id,
x, y, z and radius or diameter. Words after the two files are the material, by the keywords of
create_rve. The script needs the Python package gpu_rve.
"""

import argparse
import sys

import numpy as np

import gpu_rve
from gpu_rve import importing


def matrix(numbers):
    """Returns edges of a box, or a matrix from its rows."""
    return np.reshape(numbers, {4: (2, 2), 9: (3, 3)}.get(len(numbers), -1))


def material_of(words):
    if len(words) % 2:
        raise gpu_rve.Error(f"the material keyword {words[-1]} has no value")
    return dict(zip(words[::2], words[1::2]))


def new_parser():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("packing", help="packing file to write")
    parser.add_argument("material", nargs="*", help="keyword and value, as kn 1e6")
    parser.add_argument("--kind",
                        choices=("data", "dump", "yade", "csv"),
                        help="default: by content")
    parser.add_argument("--shape",
                        choices=("disk", "sphere"),
                        help="default: disks if z is constant")
    parser.add_argument("--cell",
                        type=float,
                        nargs="+",
                        help="edges of a box, or the rows of H (its columns are the cell vectors)")
    parser.add_argument("--origin", type=float, nargs="+", help="corner of the cell")
    parser.add_argument("--step", type=int, help="step of a dump; default: the last one")
    parser.add_argument("--walls", help="axes with walls of a data file, as z or xyz")
    parser.add_argument(
        "--core",
        type=float,
        nargs="+",
        help="cut a core at these distances from the walls: one, or one for each axis")
    parser.add_argument("--forces", help="file with tangential forces of contacts")
    parser.add_argument("--forces-on",
                        choices=("first", "second"),
                        default="first",
                        help="grain of a contact on which these forces act (YADE: second)")
    parser.add_argument("--scale", type=float, default=1.0, help="factor of all lengths")
    parser.add_argument("--wrap", action="store_true", help="grains may be in any periodic image")
    parser.add_argument("--overlap-limit",
                        type=float,
                        default=0.5,
                        help="largest overlap over the smaller radius (default 0.5)")
    return parser


def main(arguments=None):
    options = new_parser().parse_args(arguments)
    kind = options.kind or importing.kind_of(options.file)
    reader, allowed = {
        "data": (importing.read_lammps_data, ("shape", "walls")),
        "dump": (importing.read_lammps_dump, ("shape", "step")),
        "yade": (importing.read_yade, ("shape", "cell", "origin")),
        "csv": (importing.read_csv, ("shape", "cell", "origin")),
    }[kind]
    given = {
        name: getattr(options, name)
        for name in ("shape", "walls", "step", "cell", "origin")
        if getattr(options, name) is not None
    }
    for name in given:
        if name not in allowed:
            raise gpu_rve.Error(f"--{name} is not an option of {kind} files; it must be omitted")
    if "cell" in given:
        given["cell"] = matrix(given["cell"])
    grains = reader(options.file, **given)
    if options.forces:
        grains = grains.with_forces(
            importing.read_contacts(options.forces, second=options.forces_on == "second"))
    if options.scale != 1.0:
        grains = grains.scaled(options.scale)
    if options.core:
        grains, report = importing.cut_core(
            grains, np.array(options.core if len(options.core) > 1 else options.core[0]))
        print(report)
    packing = grains.packing(material_of(options.material),
                             wrap=options.wrap,
                             overlap_limit=options.overlap_limit)
    print(importing.summary(packing, grains.rounding))
    packing.write(options.packing)


if __name__ == "__main__":
    try:
        main()
    except gpu_rve.Error as error:
        sys.exit(f"ERROR: {error}")
