# SPDX-License-Identifier: GPL-2.0-only
"""Packings of other programs: readers of files, and the cut of a periodic core from a box with
walls.

The readers return :class:`Grains`, and :meth:`Grains.packing` makes a packing of them. An error
names the file and the line. The command ``tools/import_packing.py`` does both.
"""

from __future__ import annotations

import dataclasses
import math
import os
import pathlib
import re
from typing import Any, Iterable, Mapping, Sequence

import numpy as np

from . import _packing_text
from ._library import Error
from .packing import Packing

AXES = "xyz"
# A comment that begins with one of these words names the columns of a table.
FIRST_NAMES = ("id", "x", "i", "id1")
# Share of the mean overlap above which the rounding of coordinates changes contact forces.
LEAST_DIGITS = 1e-3


@dataclasses.dataclass(frozen=True)
class Grains:
    """N disks (D = 2) or spheres (D = 3) of a file, in the order of their ids."""

    cell: np.ndarray
    """Cell matrix (D, D); its columns are the cell vectors [length]."""
    origin: np.ndarray
    """Corner of the cell (D) [length]."""
    positions: np.ndarray
    """Centres (N, D) [length]."""
    radii: np.ndarray
    """Radii (N) [length]."""
    ids: np.ndarray
    """Ids of the grains in the file (N)."""
    walls: tuple[bool, ...] = ()
    """True for each axis along which the box is not periodic (D)."""
    wrap: bool = False
    """True if grains may be in any periodic image."""
    densities: np.ndarray | None = None
    """Densities of spheres (N) [mass/length^3], if the file has them."""
    rounding: float = 0.0
    """Rounding error of coordinates by the number of digits in the file [length]."""
    forces: dict[str, np.ndarray] | None = None
    """Contacts with tangential forces, as :meth:`gpu_rve.Packing.from_arrays` takes them."""

    def packing(self,
                material: Mapping[str, float | str],
                *,
                wrap: bool = False,
                overlap_limit: float = 0.5) -> Packing:
        """Makes a packing of grains at rest, by :meth:`gpu_rve.Packing.from_arrays`. Messages have
        the ids of the file. The density may come from the file.

        :raises Error: the box has walls, densities differ, or an error of ``from_arrays``
        """
        axes = [axis for axis, wall in zip(AXES, self.walls) if wall]
        if axes:
            raise Error(f"the box is not periodic along {', '.join(axes)}; a packing must be "
                        "periodic: give its cell (--cell), or cut a core (cut_core, --core)")
        if self.densities is not None and "density" not in material:
            low, high = self.densities.min(), self.densities.max()
            if high - low > 1e-9 * high:
                raise Error(f"the grains have densities from {low:.6g} to {high:.6g} "
                            "[mass/length^3]; a packing has one: give density")
            material = {**material, "density": float(self.densities[0])}
        return Packing._from_arrays(self.cell, self.positions, self.radii, material, self.forces,
                                    self.origin, None, None, wrap or self.wrap, overlap_limit,
                                    lambda i: f"grain {self.ids[i]}")

    def scaled(self, factor: float) -> Grains:
        """Returns the grains with all lengths multiplied, for files with another unit. Densities of
        the file are dropped."""
        return dataclasses.replace(self,
                                   cell=factor * self.cell,
                                   origin=factor * self.origin,
                                   positions=factor * self.positions,
                                   radii=factor * self.radii,
                                   rounding=factor * self.rounding,
                                   densities=None)

    def with_forces(self, contacts: Mapping[str, np.ndarray]) -> Grains:
        """Returns the grains with the contacts of :func:`read_contacts`."""
        index = {int(name): k for k, name in enumerate(self.ids)}
        pairs = np.empty((len(contacts["ids"]), 2), dtype=int)
        for k, pair in enumerate(contacts["ids"]):
            for end in (0, 1):
                if int(pair[end]) not in index:
                    raise Error(f"a contact of grains {pair[0]} and {pair[1]} has a force, and no "
                                f"grain has the id {pair[end]}")
                pairs[k, end] = index[int(pair[end])]
        return dataclasses.replace(self, forces={"grains": pairs, "force": contacts["force"]})


# ---- text ----


def _lines(file: str | os.PathLike) -> list[str]:
    """Returns the lines of a text file, without a byte-order mark, with any line ends."""
    try:
        content = pathlib.Path(file).read_bytes()
    except OSError as error:
        raise Error(f"cannot read {file}: {error.strerror}") from None
    if b"\0" in content:
        raise Error(f"{file} has a byte 0; it must be plain text, not binary or UTF-16")
    text = content.decode("utf-8-sig", errors="replace")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _words(line: str) -> list[str]:
    """Returns the words of a line in lower case, without separators; at least one."""
    return re.split(r"[\s,;]+", line.strip().lower())


class _Table:
    """Rows of words with names of columns, and the lines from which they are."""

    def __init__(self, file: str | os.PathLike, names: Sequence[str]):
        self.file, self.names = file, list(names)
        self.rows: list[list[str]] = []
        self.lines: list[int] = []

    def add(self, row: list[str], line: int) -> None:
        if len(row) != len(self.names):
            raise Error(f"{self.file}:{line}: the line has {len(row)} values; it must have "
                        f"{len(self.names)}: {' '.join(self.names)} (numbers must have a decimal "
                        "point)")
        self.rows.append(row)
        self.lines.append(line)

    def find(self, *names: str) -> str | None:
        """Returns the first of these names that is a column."""
        return next((name for name in names if name in self.names), None)

    def words(self, name: str) -> list[str]:
        k = self.names.index(name)
        return [row[k] for row in self.rows]

    def numbers(self, name: str, unit: str = "") -> np.ndarray:
        """Returns a column of finite numbers."""
        words = self.words(name)
        values = np.empty(len(words))
        for k, word in enumerate(words):
            try:
                values[k] = float(word)
            except ValueError:
                raise Error(f"{self.file}:{self.lines[k]}: {name} is '{word}'; it must be a number "
                            "with a decimal point, without a unit") from None
            if not math.isfinite(values[k]):
                raise Error(f"{self.file}:{self.lines[k]}: {name} is {word}{unit}; it must be "
                            "finite")
        return values

    def integers(self, name: str) -> np.ndarray:
        values = self.numbers(name)
        wrong = np.flatnonzero(values != np.floor(values))
        if len(wrong):
            raise Error(f"{self.file}:{self.lines[wrong[0]]}: {name} is "
                        f"'{self.words(name)[wrong[0]]}'; it must be an integer")
        return values.astype(int)

    def rounding(self, name: str, values: np.ndarray) -> float:
        """Returns the rounding error of a column by its number of digits."""
        digits = max(
            (len(re.sub(r"[eE].*|[^0-9]", "", word).lstrip("0")) for word in self.words(name)),
            default=0)
        largest = np.abs(values).max(initial=0.0)
        if largest == 0.0:
            return 0.0
        return float(0.5 * 10.0**(math.floor(math.log10(largest)) + 1 - digits))


def _grains(table: _Table,
            columns: Sequence[str],
            cell: np.ndarray | None,
            origin: Any,
            shape: str | None,
            walls: Sequence[bool],
            wrap: bool = False,
            scaled: bool = False) -> Grains:
    """Returns the grains of a table with these columns of coordinates, radius or diameter, and id
    (optional). The cell and origin may have one dimension more than the grains; without a cell it
    is the bounding box, which has walls. Scaled coordinates are fractions of the cell."""
    if not table.rows:
        raise Error(f"{table.file} has no grains")
    dimension = len(columns)
    values = [table.numbers(name, "" if scaled else " [length]") for name in columns]
    if shape not in (None, "disk", "sphere"):
        raise Error(f"shape is '{shape}'; it must be disk or sphere")
    flat = dimension == 2 or bool(np.ptp(values[2]) == 0.0)
    if cell is not None and len(cell) == 2:
        shape = shape or "disk"
    d = {"disk": 2, "sphere": 3, None: 2 if flat else 3}[shape]
    if d == 2 and not flat:
        raise Error(f"z of the grains in {table.file} is from {values[2].min():.6g} to "
                    f"{values[2].max():.6g} [length]; disks must have the same z")
    if d > dimension or (cell is not None and d > len(cell)):
        raise Error(f"{table.file} has no z of the grains or of the cell; spheres need it")
    x = np.stack(values[:d], axis=1)
    rounding = max(table.rounding(name, column) for name, column in zip(columns[:d], values))

    of_size = table.find("radius", "r", "diameter", "d")
    if of_size is None:
        raise Error(f"{table.file} has no column radius or diameter; its columns are "
                    f"{' '.join(table.names)}")
    radii = table.numbers(of_size, " [length]") * (0.5 if of_size[0] == "d" else 1.0)
    wrong = np.flatnonzero(radii <= 0.0)
    if len(wrong):
        k = int(wrong[0])
        raise Error(f"{table.file}:{table.lines[k]}: {of_size} is {table.words(of_size)[k]} "
                    "[length]; it must be greater than 0")
    ids = table.integers("id") if "id" in table.names else np.arange(1, len(x) + 1)
    order = np.argsort(ids, kind="stable")
    twice = np.flatnonzero(np.diff(ids[order]) == 0)
    if len(twice):
        k = int(order[twice[0] + 1])
        raise Error(f"{table.file}:{table.lines[k]}: grain {ids[k]} is given twice")
    densities = None
    if d == 3 and "density" in table.names:
        densities = table.numbers("density")[order]

    if cell is None:
        low, high = (x - radii[:, None]).min(axis=0), (x + radii[:, None]).max(axis=0)
        cell, origin, walls = np.diag(high - low), low, (True,) * d
    else:
        if d == 2 and len(cell) == 3 and np.any(cell[2, :2]):
            raise Error(
                f"the cell of {table.file} has vectors a and b with a component z; those of "
                "disks must be in the plane of x and y")
        cell, walls = cell[:d, :d], tuple(walls[:d]) or (False,) * d
        origin = np.zeros(d) if origin is None else np.asarray(origin, dtype=float)[:d]
        if scaled:
            x = origin + x @ cell.T
            rounding *= float(np.abs(cell).sum(axis=1).max())
    return Grains(cell, origin, x[order], radii[order], ids[order], walls, wrap, densities,
                  rounding)


# ---- readers ----


def kind_of(file: str | os.PathLike) -> str:
    """Returns the kind of a file by its first lines: "data" or "dump" (LAMMPS), "yade" or "csv".
    """
    head = _lines(file)[:60]
    if head[0].startswith("ITEM:"):
        return "dump"
    if any(line.split("#")[0].split()[1:] in (["atoms"], ["atom", "types"]) for line in head):
        return "data"
    names = [_words(line.lstrip("#")) for line in head if line.startswith("#")]
    first = next((line for line in head if line.strip() and not line.startswith("#")), "")
    if any(words[0] in FIRST_NAMES and words != "x y z r".split() for words in names):
        return "csv"
    try:
        [float(word) for word in first.split()]
    except ValueError:
        return "csv"
    return "yade"


def _lammps_box(words: Sequence[str], rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns cell matrix and origin of a box of a dump, in any of LAMMPS' three forms."""
    if list(words[:2]) == ["abc", "origin"]:
        return rows[:, :3].T, rows[:, 3]
    xy, xz, yz = rows[:, 2] if list(words[:3]) == ["xy", "xz", "yz"] else (0.0, 0.0, 0.0)
    low = rows[:, 0] - [min(0.0, xy, xz, xy + xz), min(0.0, yz), 0.0]
    high = rows[:, 1] - [max(0.0, xy, xz, xy + xz), max(0.0, yz), 0.0]
    width = high - low
    return np.array([[width[0], xy, xz], [0.0, width[1], yz], [0.0, 0.0, width[2]]]), low


def _floats(words: Sequence[str], count: int, file: str | os.PathLike, line: int) -> list[float]:
    """Returns so many finite numbers of a line that must have no other words."""
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        raise Error(f"{file}:{line}: found '{' '.join(words)}' where {count} finite number"
                    f"{'s were' if count > 1 else ' was'} expected")
    return values


def read_lammps_data(file: str | os.PathLike,
                     *,
                     shape: str | None = None,
                     walls: str = "") -> Grains:
    """Reads a LAMMPS data file with *atom_style sphere*, in an orthogonal, triclinic or general
    triclinic box.

    :param shape: "disk" or "sphere"; default: disks if all grains have the same z
    :param walls: axes along which the box is not periodic, such as "z" or "xyz"; the file does not
        have them
    """
    if not set(walls) <= set(AXES):
        raise Error(f"walls is '{walls}'; it must have letters of {AXES}")
    lines = _lines(file)
    low, high, vectors = np.zeros(3), np.zeros(3), np.zeros((3, 3))
    tilt, general = [0.0, 0.0, 0.0], False
    origin = np.zeros(3)
    start, count = 1, 0
    for start, line in enumerate(lines[1:], 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        if words[0][0].isalpha():
            break
        end, number = words[-2:], start + 1
        if words[1:] == ["atoms"]:
            count = int(_floats(words[:1], 1, file, number)[0])
        elif end in [[f"{a}lo", f"{a}hi"] for a in AXES]:
            a = AXES.index(end[0][0])
            low[a], high[a] = _floats(words[:-2], 2, file, number)
        elif words[-3:] == ["xy", "xz", "yz"]:
            tilt = _floats(words[:-3], 3, file, number)
        elif words[-1] in ("avec", "bvec", "cvec"):
            general = True
            vectors[:, "abc".index(words[-1][0])] = _floats(words[:-1], 3, file, number)
        elif end == ["abc", "origin"]:
            origin = np.array(_floats(words[:-2], 3, file, number))
    cell = vectors
    if not general:
        xy, xz, yz = tilt
        origin, width = low, high - low
        cell = np.array([[width[0], xy, xz], [0.0, width[1], yz], [0.0, 0.0, width[2]]])
    section, style, table = "", "", _Table(file, [])
    for number, line in enumerate(lines[start:], start + 1):
        text, _, comment = line.partition("#")
        words = text.split()
        if not words:
            continue
        if words[0][0].isalpha():
            section, style = " ".join(words), comment.strip()
            if section == "Atoms" and re.split(r"[\s:]", style)[0] not in ("", "sphere"):
                raise Error(f"{file}:{number}: the atoms have the style {style}; it must be sphere")
        elif section == "Atoms":
            if not table.names:
                table.names = "id type diameter density x y z".split()
                if len(words) == 10:
                    table.names += ["image_x", "image_y", "image_z"]
            table.add(words, number)
    if len(table.rows) != count:
        raise Error(f"{file} has {len(table.rows)} lines of atoms; it must have {count}")
    return _grains(table, AXES, cell, origin, shape, [a in walls for a in AXES])


def _frames(file: str | os.PathLike) -> Iterable[dict[str, Any]]:
    """Yields step, box, names, first line and lines of the frames of a text dump of LAMMPS."""
    lines = _lines(file)
    if not lines[0].startswith("ITEM:"):
        raise Error(f"{file} is no text dump of LAMMPS: it must begin with ITEM:")

    def row(k: int, count: int = 1) -> list[float]:
        if k >= len(lines):
            raise Error(f"{file} ends within a frame")
        return _floats(lines[k].split(), count, file, k + 1)

    frame: dict[str, Any] = {}
    k = 0
    while k < len(lines):
        words = lines[k].split()
        if not words:
            k += 1
            continue
        if words[0] != "ITEM:" or len(words) < 2:
            raise Error(f"{file}:{k + 1}: found '{lines[k][:40]}' where ITEM: was expected")
        k += 1
        if words[1:] == ["TIMESTEP"]:
            frame["step"] = int(row(k)[0])
            k += 1
        elif words[1:3] == ["NUMBER", "OF"]:
            frame["count"] = int(row(k)[0])
            k += 1
        elif words[1:3] == ["BOX", "BOUNDS"]:
            width = {"abc": 4, "xy": 3}.get(words[3] if len(words) > 3 else "", 2)
            frame["box"] = _lammps_box(words[3:], np.array([row(k + a, width) for a in range(3)]))
            frame["walls"] = [word != "pp" for word in words[-3:]]
            k += 3
        elif words[1] in ("UNITS", "TIME"):
            k += 1
        else:
            count = frame.get("count", 0)
            if sum(bool(line.strip()) for line in lines[k:k + count]) < count:
                raise Error(f"{file} ends within the {count} lines of a frame that begin in line "
                            f"{k + 1}")
            yield {**frame, "names": words[2:], "first": k + 1, "lines": lines[k:k + count]}
            k += count


def _frame(file: str | os.PathLike, step: int | None) -> dict[str, Any]:
    """Returns the frame of a step, or the last one."""
    steps = []
    for frame in _frames(file):
        steps.append(frame.get("step"))
        if step is not None and frame.get("step") == step:
            return frame
    if not steps or step is not None:
        raise Error(f"{file} has no frame" + (f" of step {step}; its steps are from {steps[0]} to "
                                              f"{steps[-1]}" if steps else ""))
    return frame


def _of_frame(file: str | os.PathLike, frame: Mapping[str, Any]) -> _Table:
    table = _Table(file, frame["names"])
    for number, line in enumerate(frame["lines"], frame["first"]):
        table.add(line.split(), number)
    return table


def read_lammps_dump(file: str | os.PathLike,
                     *,
                     shape: str | None = None,
                     step: int | None = None) -> Grains:
    """Reads a text dump of LAMMPS (*dump custom*) with the columns id, radius or diameter, and x y
    z, xu yu zu, xs ys zs or xsu ysu zsu, in any box.

    :param shape: "disk" or "sphere"; default: disks if all grains have the same z
    :param step: step of the frame; default: the last frame
    """
    frame = _frame(file, step)
    if "box" not in frame:
        raise Error(f"{file} has no box; it must be a dump custom")
    table = _of_frame(file, frame)
    for suffix in ("", "u", "s", "su"):
        names = [axis + suffix for axis in AXES]
        if set(names[:2]) <= set(table.names):
            break
    else:
        raise Error(f"{file} has no columns x y z; its columns are {' '.join(table.names)}")
    cell, origin = frame["box"]
    columns = [name for name in names if name in table.names]
    return _grains(table, columns, cell, origin, shape, frame["walls"], "u" in suffix, "s"
                   in suffix)


def read_yade(file: str | os.PathLike,
              *,
              cell: Any = None,
              origin: Any = None,
              shape: str | None = None) -> Grains:
    """Reads lines ``x y z r`` of spheres, as YADE's ``export.text`` and ``SpherePack.save`` write
    them. The latter gives the cell in a line ``##PERIODIC::``.

    :param cell: as in :meth:`gpu_rve.Packing.from_arrays`; default: that of the file, or a box with
        walls that touches the outer grains
    :param origin: corner of the cell (D) [length]; default: 0
    :param shape: "disk" or "sphere"; default: disks if all grains have the same z
    """
    table, periodic = _Table(file, "x y z r".split()), None
    for number, line in enumerate(_lines(file), 1):
        words = line.split()
        if words[:1] == ["##PERIODIC::"]:
            periodic = _floats(words[1:], 3, file, number)
        elif words[:1] == ["#format"] and words[1:] != ["x_y_z_r"]:
            raise Error(f"{file}:{number}: the format is {' '.join(words[1:])}; it must be x_y_z_r")
        elif words and not words[0].startswith("#"):
            if len(words) == 5:
                if _floats(words[4:], 1, file, number)[0] >= 0:
                    raise Error(f"{file}:{number}: the grain belongs to clump {words[4]}; grains "
                                "must be single spheres")
                words = words[:4]
            table.add(words, number)
    matrix = None if cell is None and periodic is None else _packing_text.cell_matrix(
        periodic if cell is None else cell)
    return _grains(table, AXES, matrix, origin, shape, (), cell is None and periodic is not None)


def read_csv(file: str | os.PathLike,
             *,
             cell: Any = None,
             origin: Any = None,
             shape: str | None = None) -> Grains:
    """Reads a table whose first line names the columns: x, y, z (spheres), radius (r) or diameter
    (d), and id (optional). Other columns are ignored. Values are separated by commas, semicolons,
    tabs or blanks. Names may be followed by a unit in brackets, as in ``x [m]``.

    Parameters are those of :func:`read_yade`.
    """
    table = _csv(file)
    axes = [axis for axis in AXES if axis in table.names]
    if axes[:2] != ["x", "y"]:
        raise Error(f"{file} has no columns x and y; its columns are {' '.join(table.names)}: the "
                    "first line must name them")
    matrix = None if cell is None else _packing_text.cell_matrix(cell)
    return _grains(table, axes, matrix, origin, shape, ())


def _csv(file: str | os.PathLike) -> _Table:
    table, separator = None, ""
    for number, line in enumerate(_lines(file), 1):
        if not line.strip() or (line.startswith("#") and table is not None):
            continue
        if table is None:
            # write_rve begins a table of contacts with comments, the last of which has the names.
            text = line.lstrip("#").strip()
            if line.startswith("#") and _words(text)[0] not in FIRST_NAMES:
                continue
            separator = next((mark for mark in ";\t," if mark in text), "")
            names = text.split(separator or None)
            names = [re.sub(r"\s*[\[(].*$", "", name.strip().strip('"')).lower() for name in names]
            if any(not name for name in names) or len(set(names)) < len(names):
                raise Error(f"{file}:{number}: the names of columns are {' '.join(names)}; each "
                            "column must have its own name")
            table = _Table(file, names)
        else:
            table.add([word.strip() for word in line.split(separator or None)], number)
    if table is None:
        raise Error(f"{file} is empty")
    return table


def read_contacts(file: str | os.PathLike, *, second: bool = False) -> dict[str, np.ndarray]:
    """Reads tangential forces of contacts: a CSV file with names of columns, a text dump of LAMMPS
    (*dump local*, last frame) or the file name.contacts of write_rve.

    The columns are the ids i and j (or id1 and id2) of the grains, and a force on the first one:
    ft_x, ft_y, ft_z (also f_t_x, ...), or the whole force force_x, force_y, force_z; for disks also
    the number f_t along (-n_y, n_x), with n from i to j.

    :param second: True: forces act on the second grain, as the shear forces of YADE
    :return: ``ids`` (C, 2), ``force`` (C, D) or (C) [force], for :meth:`Grains.with_forces`
    """
    is_dump = _lines(file)[0].startswith("ITEM:")
    table = _of_frame(file, _frame(file, None)) if is_dump else _csv(file)
    ids = next((pair for pair in (("i", "j"), ("id1", "id2")) if set(pair) <= set(table.names)),
               None)
    of_force = next((names for prefix in ("ft_", "f_t_", "force_")
                     if len(names := [prefix + a for a in AXES if prefix + a in table.names]) >= 2),
                    [name for name in ("f_t",) if name in table.names])
    if ids is None or not of_force:
        raise Error(f"{file} has the columns {' '.join(table.names)}; it must have i and j (or id1 "
                    "and id2), and ft_x, ft_y, ft_z, or force_x, force_y, force_z, or f_t")
    force = np.stack([table.numbers(name, " [force]") for name in of_force], axis=1)
    return {
        "ids": np.stack([table.integers(name) for name in ids], axis=1),
        "force": (-1.0 if second else 1.0) * (force[:, 0] if len(of_force) == 1 else force),
    }


# ---- a core of a box with walls ----


@dataclasses.dataclass(frozen=True)
class CoreReport:
    """What :func:`cut_core` keeps and loses."""

    grains: int
    """Grains of the box."""
    outside: int
    """Grains whose centre is outside the core."""
    removed: int
    """Grains of the core that were removed because they overlap across its new periodic faces."""
    contacts: int
    """Contacts of the box."""
    kept: int
    """Contacts that the core keeps, with their forces."""
    new: int
    """Contacts across the new periodic faces, which have no history."""
    void_ratio_before: float
    """Void ratio of the core before grains were removed [-]."""
    void_ratio: float
    """Void ratio of the core [-]."""

    def __str__(self) -> str:
        return (f"core: {self.grains - self.outside - self.removed} of {self.grains} grains; "
                f"{self.outside} are outside it, {self.removed} were removed at its faces\n"
                f"core: {self.kept} of {self.contacts} contacts, {self.new} new ones across its "
                f"faces; void ratio {self.void_ratio_before:.4f}, after the removal "
                f"{self.void_ratio:.4f}")


def _touching(cell: np.ndarray, origin: np.ndarray, x: np.ndarray,
              radii: np.ndarray) -> dict[str, np.ndarray]:
    """Returns all contacts of grains in a periodic cell, however large their overlaps are."""
    packing = Packing._from_arrays(cell, x, radii, {
        "kn": 1.0,
        "density": 1.0
    }, None, origin, None, None, True, math.inf, lambda i: f"grain {i} of the core")
    return packing.contacts()


def cut_core(grains: Grains,
             margin: Any,
             *,
             seam_overlap: float = 0.1) -> tuple[Grains, CoreReport]:
    """Cuts a periodic core from a box with walls, along the axes of :attr:`Grains.walls`, or along
    all axes if there are none.

    The core keeps the grains whose centres are in it. Grains that overlap across its new periodic
    faces are removed, those with the most such overlaps first. So the core loses contacts and
    tangential forces at these faces and is looser there; it must be compressed before use.

    :param margin: distance of the core from the outer grains along each axis with walls (one
        number, one for each of the D axes, or (D, 2) for low and high faces) [length]
    :param seam_overlap: largest overlap across a new face over the smaller radius [-]
    :return: the core and what was lost
    :raises Error: the cell vectors along walls are not along the axes, or too few grains are left
    """
    d = len(grains.cell)
    walls = grains.walls if any(grains.walls) else (True,) * d
    axes = [a for a in range(d) if walls[a]]
    distance = np.asarray(margin, dtype=float)
    if distance.shape not in ((), (d,), (d, 2)):
        raise Error(
            f"margin has shape {distance.shape}; it must be a number, or have ({d}) or ({d}, "
            "2)")
    distance = np.broadcast_to(distance[:, None] if distance.ndim == 1 else distance, (d, 2))
    _packing_text.require_finite(distance, "margin", "length")
    h, origin, x, r = grains.cell.copy(), grains.origin.copy(), grains.positions, grains.radii
    for a in axes:
        across = np.delete(h[a], a), np.delete(h[:, a], a)
        if np.any(across[0]) or np.any(across[1]):
            raise Error(
                f"cell vector {a} is {h[:, a].tolist()} [length]; a core can be cut only if "
                f"it is along {AXES[a]} and the others are normal to it")
    low, high = (x - r[:, None]).min(axis=0), (x + r[:, None]).max(axis=0)
    inside = np.ones(len(x), dtype=bool)
    core, corner = h.copy(), origin.copy()
    for a in axes:
        begin, end = low[a] + distance[a, 0], high[a] - distance[a, 1]
        if not end > begin:
            raise Error(f"the margins along {AXES[a]} are {distance[a, 0]:.6g} and "
                        f"{distance[a, 1]:.6g} [length]; their sum must be below the extent of the "
                        f"grains, {high[a] - low[a]:.6g}")
        inside &= (x[:, a] >= begin) & (x[:, a] < end)
        core[a, a], corner[a] = end - begin, begin
        h[a, a], origin[a] = high[a] - low[a] + 4.0 * r.max(), low[a]    # no contact across walls
    before = _touching(h, origin, x, r)
    chosen = np.flatnonzero(inside)
    if not len(chosen):
        raise Error(f"no grain is within the margins {distance[axes].tolist()} [length]")

    def of_faces(chosen: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Returns contacts of these grains, and which of them cross a new face."""
        found = _touching(core, corner, x[chosen], r[chosen])
        i, j = chosen[found["grains"]].T
        offset = np.abs(found["branch"] - (x[j] - x[i]))[:, axes]
        return found, np.any(offset > 0.5 * np.diag(core)[axes], axis=1)

    found, crosses = of_faces(chosen)
    share = found["overlap"] / r[chosen][found["grains"]].min(axis=1)
    deep = found["grains"][crosses & (share > seam_overlap)]
    gone: set[int] = set()
    while len(deep):
        counts = np.bincount(deep.ravel(), minlength=len(chosen))
        worst = np.flatnonzero(counts == counts.max())
        smallest = int(worst[np.argmin(r[chosen][worst])])
        gone.add(smallest)
        deep = deep[np.all(deep != smallest, axis=1)]
    left = np.delete(chosen, sorted(gone))
    found, crosses = of_faces(left)
    old = {tuple(pair) for pair in before["grains"].tolist()}
    kept = [tuple(pair) in old for pair in left[found["grains"]].tolist()]
    kept_contacts = np.array(kept, dtype=bool) & ~crosses

    forces = None
    if grains.forces is not None:
        index = np.full(len(x), -1)
        index[left] = np.arange(len(left))
        pairs = index[grains.forces["grains"]]
        still = {tuple(pair) for pair in found["grains"][kept_contacts].tolist()}
        keep = np.array([(min(i, j), max(i, j)) in still for i, j in pairs.tolist()], dtype=bool)
        forces = {"grains": pairs[keep], "force": grains.forces["force"][keep]}
    volume = abs(float(np.linalg.det(core)))

    def void_ratio(radii: np.ndarray) -> float:
        solid = np.pi * np.sum(radii**2) if d == 2 else 4.0 / 3.0 * np.pi * np.sum(radii**3)
        return volume / float(solid) - 1.0

    report = CoreReport(len(x),
                        len(x) - len(chosen), len(gone), len(before["overlap"]),
                        int(kept_contacts.sum()), int(crosses.sum()), void_ratio(r[chosen]),
                        void_ratio(r[left]))
    return dataclasses.replace(
        grains,
        cell=core,
        origin=corner,
        positions=x[left],
        radii=r[left],
        ids=grains.ids[left],
        walls=(False,) * d,
        densities=None if grains.densities is None else grains.densities[left],
        forces=forces), report


# ---- summary ----


def summary(packing: Packing, rounding: float = 0.0) -> str:
    """Returns a few lines about a packing: contacts, overlaps and stress of its springs.

    :param rounding: rounding error of the coordinates in the file (:attr:`Grains.rounding`)
    """
    d, contacts, radii = packing.dimension, packing.contacts(), packing.radii
    count = len(contacts["overlap"])
    lines = [
        f"{packing.grains} {'disks' if d == 2 else 'spheres'}, void ratio "
        f"{packing.void_ratio:.5f}, {count} contacts, {2 * count / packing.grains:.3f} per grain"
    ]
    if not count:
        return lines[0]
    smaller = radii[contacts["grains"]].min(axis=1)
    share = contacts["overlap"] / smaller
    volume = float(np.linalg.det(packing.cell)) * (packing["thickness"] if d == 2 else 1.0)
    stress = np.einsum("ca,cb->ab", contacts["force"], contacts["branch"]) / volume
    p = -float(np.trace(stress)) / d
    deviator = 0.5 * (stress + stress.T) + p * np.eye(d)
    q = math.sqrt((0.5 if d == 2 else 1.5) * float(np.sum(deviator**2)))
    names = [
        f"{AXES[a]}{AXES[b]} {0.5 * (stress[a, b] + stress[b, a]):.6g}" for a in range(d)
        for b in range(a, d)
    ]
    lines += [
        f"overlap over the smaller radius: mean {share.mean():.3g}, largest {share.max():.3g}",
        f"stress [stress], tension positive: {', '.join(names)}; p {p:.6g}, q {q:.6g}",
        f"{int(contacts['sliding'].sum())} contacts slide"
    ]
    if rounding > LEAST_DIGITS * contacts["overlap"].mean():
        lines.append(
            f"WARNING: coordinates are rounded to {rounding:.2g} [length], "
            f"{rounding / contacts['overlap'].mean():.2g} of the mean overlap; contact forces are "
            "wrong by about that: write all digits (LAMMPS: dump_modify format float %.17g)")
    return "\n".join(lines)
