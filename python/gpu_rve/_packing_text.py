# SPDX-License-Identifier: GPL-2.0-only
"""Text of a packing file (manual: packing_file) from arrays, and the checks of these arrays."""

from __future__ import annotations

import math
from typing import Any, Callable, Mapping

import numpy as np

from ._arrays import numbers
from ._library import Error, lib, saved_by

# Keywords of the material whose statement in a packing file has another name.
STATEMENTS = {
    "kn": "normal_stiffness",
    "kt": "tangential_stiffness",
    "gamma_n": "normal_viscosity",
    "gamma_t": "tangential_viscosity",
    "hertz_kn": "hertz_stiffness",
    "mindlin_kt": "mindlin_stiffness",
    "kr": "rolling_stiffness",
    "gamma_r": "rolling_viscosity",
    "k_twist": "twisting_stiffness",
    "gamma_twist": "twisting_viscosity",
    "damping": "local_damping",
    "damping_objective": "objective_damping",
}
# Parameters that a packing file must have, without those of disks. Their default is 0, as in
# create_rve.
COMMON = ("friction", "damping", "gamma_n")
OF_LAW = {
    "hooke": ("kt", "gamma_t"),
    "hertz": ("mindlin_kt", "viscoelastic_damping", "restitution_damping", "mindlin_damping",
              "mindlin_displacement"),
}
OF_LAW["dmt"] = OF_LAW["hertz"] + ("surface_energy",)
STIFFNESS = {"hooke": "kn", "hertz": "hertz_kn", "dmt": "hertz_kn"}
# An edge of the lattice is shortened if its projection on another one exceeds this share of it, as
# in the engine.
OBLIQUE = 0.6

LARGEST = 1e30    # size of a number, as in the engine

Name = Callable[[int], str]


def require_finite(array: np.ndarray, what: str, unit: str) -> None:
    """Raises an error that names the first number that is not finite or too large."""
    wrong = np.argwhere(~(np.abs(array) <= LARGEST))
    if len(wrong):
        index = tuple(int(k) for k in wrong[0])
        raise Error(f"{what}[{', '.join(map(str, index))}] is {array[index]} [{unit}]; it must be "
                    f"finite, and at most {LARGEST:g} in size")


def given(values: Any, what: str, unit: str, shape: tuple[int, ...]) -> np.ndarray:
    """Returns an array of finite numbers of a caller, which must have this shape; -1: any."""
    array = numbers(values, what, np.shape(values))
    if array.ndim != len(shape) or any(e not in (-1, n) for n, e in zip(array.shape, shape)):
        expected = ", ".join("N" if e < 0 else str(e) for e in shape)
        raise Error(f"{what} has shape {array.shape}; it must have ({expected})")
    require_finite(array, what, unit)
    return array


def cell_matrix(cell: Any) -> np.ndarray:
    """Returns the cell matrix (D, D) of a caller, who gives it or the edges of a box [length]."""
    array = numbers(cell, "cell", np.shape(cell))
    if array.shape in ((2,), (3,)):
        array = np.diag(array)
    if array.shape not in ((2, 2), (3, 3)):
        raise Error(f"cell has shape {array.shape}; it must have (D, D), or (D) for the edges of a "
                    "box, with D = 2 for disks and 3 for spheres")
    require_finite(array, "cell", "length")
    volume = float(np.linalg.det(array))
    if not abs(volume) > 1e-12 * np.prod(np.linalg.norm(array, axis=0)):
        raise Error(f"the cell has the volume {volume:.6g} [length^{len(array)}]; the cell vectors "
                    "must be linearly independent")
    return array


def reduced_cell(cell: np.ndarray) -> np.ndarray:
    """Returns a right-handed, reduced cell matrix of the same lattice.

    The last two vectors of a left-handed cell are exchanged. Whole multiples of other vectors are
    subtracted from an oblique one. Neither changes the positions of the periodic images.
    """
    d, h = len(cell), cell.copy()
    if np.linalg.det(h) < 0.0:
        h[:, [d - 2, d - 1]] = h[:, [d - 1, d - 2]]
    for _ in range(10000):
        leans = [(h[:, a] @ h[:, b] / (h[:, b] @ h[:, b]), a, b)
                 for a in range(d)
                 for b in range(d)
                 if a != b]
        lean, a, b = max(leans, key=lambda entry: abs(entry[0]))
        if abs(lean) <= OBLIQUE:
            return h
        h[:, a] -= np.rint(lean) * h[:, b]
    raise Error(f"the cell {cell.tolist()} [length] could not be reduced: its vectors are nearly "
                "dependent")


def integers(values: Any) -> tuple[list[int], int]:
    """Returns integers n and a denominator m with n / m equal to these doubles."""
    ratios = [float(value).as_integer_ratio() for value in np.ravel(values)]
    least = max(below for _, below in ratios)    # denominators are powers of two
    return [above * (least // below) for above, below in ratios], least


def fractions_of(cell: np.ndarray, positions: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Returns fractional coordinates s 2^64 (N, D) of positions, as Python's integers from 0 to
    2^64 - 1. They are exact but for one rounding to integers."""
    d = len(cell)
    h, of_cell = integers(cell)
    all_x, of_x = integers(np.vstack([positions, origin]))
    start = all_x[-d:]
    if d == 2:
        determinant = h[0] * h[3] - h[1] * h[2]
        adjugate = [[h[3], -h[1]], [-h[2], h[0]]]
    else:
        row = [h[0:3], h[3:6], h[6:9]]
        adjugate = [[
            row[(j + 1) % 3][(i + 1) % 3] * row[(j + 2) % 3][(i + 2) % 3] -
            row[(j + 1) % 3][(i + 2) % 3] * row[(j + 2) % 3][(i + 1) % 3] for j in range(3)
        ] for i in range(3)]
        determinant = sum(row[0][k] * adjugate[k][0] for k in range(3))
    below = determinant * of_x
    result = []
    for k in range(0, len(all_x) - d, d):
        x = [all_x[k + a] - start[a] for a in range(d)]
        above = [sum(line[b] * x[b] for b in range(d)) * of_cell << 65 for line in adjugate]
        result.append([(number + below) // (2 * below) % 2**64 for number in above])
    return np.array(result, dtype=object)


def require_inside(cell: np.ndarray, positions: np.ndarray, radii: np.ndarray, origin: np.ndarray,
                   name: Name) -> None:
    """Raises an error if a centre is farther outside the cell than its radius."""
    inverse = np.linalg.inv(cell)
    s = (positions - origin) @ inverse.T
    width = 1.0 / np.linalg.norm(inverse, axis=1)
    outside = np.maximum(-s, s - 1.0) * width
    wrong = np.argwhere(outside > radii[:, None])
    if len(wrong):
        i, a = (int(k) for k in wrong[0])
        raise Error(
            f"{name(i)} is {outside[i, a]:.4g} [length] outside the cell along cell vector {a} "
            f"(fraction {s[i, a]:.4g}), as are {len(np.unique(wrong[:, 0]))} grains; the limit is "
            f"its radius, {radii[i]:.4g} [length]: check units, cell and origin, or use wrap=True "
            "(--wrap) if the program does not move grains back into its periodic cell")


def require_apart(fractions: np.ndarray, name: Name) -> None:
    """Raises an error if two centres coincide."""
    seen: dict[tuple[int, ...], int] = {}
    for i, s in enumerate(map(tuple, fractions)):
        if s in seen:
            raise Error(f"{name(seen[s])} and {name(i)} have the same position; the distance must "
                        "be above 0 [length]")
        seen[s] = i


def require_small_overlaps(contacts: Mapping[str, np.ndarray], radii: np.ndarray, limit: float,
                           name: Name) -> None:
    """Raises an error if an overlap exceeds `limit` times the smaller radius."""
    grains = contacts["grains"]
    if not len(grains):
        return
    share = contacts["overlap"] / radii[grains].min(axis=1)
    k = int(np.argmax(share))
    if share[k] > limit:
        i, j = grains[k]
        raise Error(
            f"{name(i)} and {name(j)} overlap by {contacts['overlap'][k]:.4g} [length], "
            f"{share[k]:.3g} of the smaller radius; the limit is {limit:g}, which "
            f"{np.count_nonzero(share > limit)} pairs exceed: check the cell, and that radii are "
            "not diameters")


def tangential_forces(contacts: Mapping[str, np.ndarray], radii: np.ndarray, forces: Any,
                      name: Name) -> list[tuple[int, int, np.ndarray, float]]:
    """Returns rows (first, second, tangential force on the first, contact radius) from the forces
    of a caller. The tangential force is a number along (-n_y, n_x) for disks."""
    if not isinstance(forces, Mapping) or not {"grains", "force"} <= set(forces):
        raise Error("forces must be a dictionary with the arrays 'grains' (C, 2) and 'force' (C, D)"
                    ", as Packing.contacts() returns")
    n, d = len(radii), contacts["branch"].shape[1]
    pairs = np.asarray(forces["grains"])
    if pairs.ndim != 2 or pairs.shape[1] != 2 or (pairs.size and pairs.dtype.kind not in "iu"):
        raise Error(
            f"forces['grains'] has shape {pairs.shape} and dtype {pairs.dtype}; it must have"
            " (C, 2) and integers")
    scalar = d == 2 and np.ndim(forces["force"]) == 1
    vectors = given(forces["force"], "forces['force']", "force", (len(pairs),) if scalar else
                    (len(pairs), d))
    found = {(int(i), int(j)): k for k, (i, j) in enumerate(contacts["grains"])}
    rows, seen = [], set()
    for k, (i, j) in enumerate(pairs.tolist()):
        if not (0 <= i < n and 0 <= j < n and i != j):
            raise Error(
                f"forces['grains'][{k}] is ({i}, {j}); it must be two different numbers from "
                f"0 to {n - 1}")
        at = found.get((min(i, j), max(i, j)))
        if (min(i, j), max(i, j)) in seen:
            raise Error(f"the contact of {name(i)} and {name(j)} is given twice in forces")
        seen.add((min(i, j), max(i, j)))
        if at is None:
            if np.any(vectors[k]):
                raise Error(
                    f"{name(i)} and {name(j)} have the force {np.linalg.norm(vectors[k]):.4g} "
                    "[force] and do not touch; the overlap must be above 0: the file needs all "
                    "digits of the positions, 17 for doubles")
            continue
        normal = contacts["branch"][at] * (1.0 if i < j else -1.0)
        normal = normal / np.linalg.norm(normal)
        if scalar:
            force = vectors[k:k + 1]
        elif d == 2:
            force = np.array([normal[0] * vectors[k, 1] - normal[1] * vectors[k, 0]])
        else:
            force = vectors[k] - (vectors[k] @ normal) * normal
        reduced = radii[i] * radii[j] / (radii[i] + radii[j])
        rows.append((i, j, force, math.sqrt(reduced * max(contacts["overlap"][at], 0.0))))
    return rows


def with_contact_keywords(material: Mapping[str, float | str],
                          d: int) -> Mapping[str, float | str]:
    """Returns a material whose contact is one word: keywords replace the words of LAMMPS."""
    contact = str(material.get("contact", "hooke"))
    if len(contact.split()) < 2:
        return material
    pairs = saved_by(lambda words, *space: lib.rve_contact_words(words, d, *space),
                     contact.encode()).decode().split()
    keywords = dict(zip(pairs[::2], pairs[1::2]))
    both = sorted(set(keywords) & set(material) - {"contact"})
    if both:
        raise Error(f"contact and {both[0]} exclude each other, because contact also sets {both[0]}"
                   )
    return {**material, **keywords}


def material_lines(material: Mapping[str, float | str], d: int) -> list[str]:
    """Returns the statements of a material from keywords of create_rve, with its defaults."""
    material = with_contact_keywords(material, d)
    law = str(material.get("contact", "hooke"))
    if law not in OF_LAW:
        raise Error(f"contact is '{law}'; it must be hooke, hertz or dmt")
    values: dict[str, float] = {}
    for word, value in material.items():
        if word == "contact":
            continue
        try:
            values[STATEMENTS.get(word, word)] = float(value)
        except (TypeError, ValueError):
            raise Error(f"{word} is {value!r}; it must be a number") from None
    for required in (STIFFNESS[law], "density"):
        if STATEMENTS.get(required, required) not in values:
            raise Error(
                f"the material has no {required}; it must have {STIFFNESS[law]} and density")
    defaults = dict.fromkeys(COMMON + OF_LAW[law], 0.0)
    if law == "hooke":
        defaults["kt"] = values["normal_stiffness"]
        if values.get("rolling_friction", 0.0) > 0.0:
            defaults["kr"] = values.get("tangential_stiffness", defaults["kt"])
    if d == 2:
        defaults.update(thickness=1.0, mass_depth=1.0)
    # The reader reports the first wrong number, which must be one that the caller gave.
    named = values | {
        STATEMENTS.get(word, word): value
        for word, value in defaults.items() if STATEMENTS.get(word, word) not in values
    }
    return ["material", f"  contact_law {law}"
           ] + [f"  {word} {value!r}" for word, value in named.items()]


def packing_text(cell: np.ndarray, fractions: np.ndarray, radii: np.ndarray,
                 material: Mapping[str, float | str], velocities: np.ndarray, spins: np.ndarray,
                 history: list[tuple[int, int, np.ndarray, float]]) -> str:
    """Returns the text of a packing file; `history` is that of tangential_forces()."""

    def row(values: Any) -> str:
        return " ".join(repr(float(value)) for value in np.ravel(values))

    d = len(cell)
    lines = ["gpu_rve_packing 2", f"dimension {d}", *material_lines(material, d), "cell"]
    lines += [f"  {row(line)}" for line in cell]
    lines.append(f"grains {len(radii)}")
    lines += [
        f"{i + 1} {float(radii[i])!r} {' '.join(map(str, fractions[i]))} {row(velocities[i])} "
        f"{row(spins[i])}" for i in range(len(radii))
    ]
    lines.append(f"contacts {len(history)}")
    hertz = not str(material.get("contact", "hooke")).startswith("hooke")
    for i, j, force, radius in history:
        # A line of disks has the rolling force before the contact radius.
        tail = ("" if not hertz else f" 0 {radius!r}" if d == 2 else f" {radius!r}")
        lines.append(f"{i + 1} {j + 1} {row(force)}{tail}")
    return "\n".join(lines + ["checksum none", "end", ""])
