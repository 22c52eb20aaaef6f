#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Converts a reference packing to a packing file of GPU_RVE.

usage: import_reference_packing.py <case>.csv <output>.rve [friction [local_damping]]

<case>.csv has id, radius, x, y, and <case>.json has H, h, kn, ... in SI units. Mass is per unit
depth; velocities and tangential forces are zero. Positions become fractional coordinates by exact
rational arithmetic, rounded once to 2^-64 of the cell. The script uses only Python's standard
library.
"""

import csv
import json
import math
import os
import sys
from fractions import Fraction


def fractional_coordinates(x, y, cell):
    """Returns two integers s 2^64 for a position [m] and a cell matrix whose columns are the cell
    vectors [m]."""
    (hxx, hxy), (hyx, hyy) = [[Fraction(component) for component in row] for row in cell]
    determinant = hxx * hyy - hxy * hyx
    s = ((hyy * x - hxy * y) / determinant, (hxx * y - hyx * x) / determinant)
    return [round((component - math.floor(component)) * 2**64) % 2**64 for component in s]


def checksum(lines):
    """Returns the checksum of a packing file: FNV-1a, 64 bits, over its statements without
    comments, with one blank between two words."""
    sum = 0xcbf29ce484222325
    for words in (line.split("#")[0].split() for line in lines):
        for byte in (" ".join(words) + "\n").encode() if words else b"":
            sum = (sum ^ byte) * 0x100000001b3 % 2**64
    return f"{sum:016x}"


def convert(csv_path, output_path, friction, local_damping):
    with open(os.path.splitext(csv_path)[0] + ".json") as file:
        case = json.load(file)
    with open(csv_path, newline="") as file:
        grains = [(float(row["radius"]), Fraction(float(row["x"])), Fraction(float(row["y"])))
                  for row in csv.DictReader(file)]
    material = [
        ("normal_stiffness", case["kn"], "force/length"),
        ("tangential_stiffness", case["kt"], "force/length"),
        ("friction", friction, "-"),
        ("density", case["rho"], "mass/length^3"),
        ("local_damping", local_damping, "-"),
        ("normal_viscosity", 0.0, "force time/length"),
        ("tangential_viscosity", 0.0, "force time/length"),
        ("thickness", case["h"], "length"),
        ("mass_depth", 1.0, "length"),
    ]
    lines = [
        "# Packing of one RVE (GPU_RVE): plane disks in a periodic cell, x = H s. SI units.",
        f"# {len(grains)} disks, {case['p0'] / 1000:g} kPa, void ratio {case['void_ratio']:.4f}, "
        "prepared without"
        f" friction by {case['code']}, seed {case['seed']}",
        "gpu_rve_packing 1",
        "",
        "material",
    ]
    lines += [f"  {name} {float(value)!r}    # [{unit}]" for name, value, unit in material]
    lines += ["", "# rows of H; its columns are the cell vectors [length]", "cell"]
    lines += [f"  {float(row[0])!r} {float(row[1])!r}" for row in case["H"]]
    lines += [
        "", f"grains {len(grains)}",
        "# id, radius [length], s_x 2^64, s_y 2^64 [-], peculiar velocity c_x, c_y [length/time], "
        "spin [1/time]"
    ]
    for index, (radius, x, y) in enumerate(grains):
        s = fractional_coordinates(x, y, case["H"])
        lines.append(f"{index + 1} {radius!r} {s[0]} {s[1]} 0 0 0")
    lines += ["", "contacts 0"]
    lines += [f"checksum {checksum(lines)}", "end"]

    temporary = output_path + ".part"
    with open(temporary, "w") as file:
        file.write("\n".join(lines) + "\n")
    os.replace(temporary, output_path)


if __name__ == "__main__":
    if not 3 <= len(sys.argv) <= 5:
        sys.exit(__doc__)
    convert(sys.argv[1], sys.argv[2],
            friction=float(sys.argv[3]) if len(sys.argv) > 3 else 0.5,
            local_damping=float(sys.argv[4]) if len(sys.argv) > 4 else 0.3)
