# SPDX-License-Identifier: GPL-2.0-only
"""Reading packing files of fix rve, and the contacts in them."""

import math

import numpy as np


def read_packing(path):
    """A packing file of fix rve, as a dictionary of arrays; grains in the order of their ids, fractions times 2^64."""
    material, cell, grains, contacts, section = {}, [], {}, [], None
    with open(path) as stream:
        for line in stream:
            words = line.split("#")[0].split()
            if not words:
                continue
            if words[0] in ("material", "cell", "deformation", "servo_velocity_gradient", "grains", "contacts", "checksum", "end"):
                section = words[0]
            elif section == "material":
                material[words[0]] = float(words[1])
            elif section == "cell":
                cell.append([float(word) for word in words])
            elif section == "grains":
                grains[int(words[0])] = words[1:]
            elif section == "contacts":
                contacts.append((*sorted(int(word) - 1 for word in words[:2]), float(words[2])))
    rows = [grains[k] for k in sorted(grains)]
    radius = np.array([float(row[0]) for row in rows])
    return {
        "material": material,
        "cell": np.array(cell[:2]),
        "radius": radius,                                                                # [m]
        "fraction": np.array([[int(row[1]), int(row[2])] for row in rows], dtype=np.uint64),
        "velocity": np.array([[float(row[3]), float(row[4])] for row in rows]),          # peculiar [m/s]
        "spin": np.array([float(row[5]) for row in rows]),                               # [1/s]
        "tangential_force": {(i, j): force for i, j, force in contacts},                 # on i < j, along (-n_y, n_x) [N]
        "mass": material["density"] * math.pi * radius**2 * material["mass_depth"],      # [kg]
    }


def nearest_image(first, second):
    """Fractions of the shortest branches from first to second: the difference of unsigned integers wraps."""
    return (second - first).view(np.int64) * 2.0**-64


def contacts_of(packing):
    """Pairs i < j that touch, their branches [m] and overlaps [m]; all pairs are tried."""
    i, j = np.triu_indices(len(packing["radius"]), k=1)
    branch = nearest_image(packing["fraction"][i], packing["fraction"][j]) @ packing["cell"].T
    overlap = packing["radius"][i] + packing["radius"][j] - np.hypot(branch[:, 0], branch[:, 1])
    touch = overlap > 0.0
    return i[touch], j[touch], branch[touch], overlap[touch]
