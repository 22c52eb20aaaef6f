# SPDX-License-Identifier: GPL-2.0-only
"""Packings of grains: the state of one RVE."""

from __future__ import annotations

import os
import pathlib
import re
import tempfile
from typing import Any, Callable, Mapping

import numpy as np

from . import _packing_text
from ._arrays import integer
from ._library import Error, check, doubles, ffi, lib, saved_by, words


def _size_words(radius: Any, grading: Any) -> dict[str, str]:
    """Returns the keyword of a recipe for radii or a grading curve of a caller."""

    def numbers(values: Any, what: str) -> str:
        try:
            return " ".join(repr(float(value)) for value in values)
        except (TypeError, ValueError):
            raise Error(f"{what} is {values!r}; it must have numbers") from None

    if (radius is None) == (grading is None):
        raise Error("radius or grading must be given, and not both")
    if grading is not None:
        points = np.asarray(grading)
        if points.ndim != 2 or points.shape[1] != 2:
            raise Error(f"grading has shape {points.shape}; it must have (n, 2): diameters and "
                        "percent passing")
        return {"grading": numbers(points.ravel().tolist(), "grading")}
    kind, *values = radius if isinstance(radius[0], str) else ("uniform", *radius)
    return {"radius": f"{kind} {numbers(values, 'radius')}"}


def grains_needed(*, shape: str = "disk", radius: Any = None, grading: Any = None) -> int:
    """Returns the number of grains that represent a distribution of sizes: at least 5 grains have
    the coarsest tenth of the mass, and a dense packing is at least 2.5 of the largest diameters
    wide.

    :param shape: "disk" or "sphere"
    :param radius: as in :meth:`Packing.create` [length]
    :param grading: as in :meth:`Packing.create`
    :raises Error: a value is out of range
    """
    grains = ffi.new("size_t *")
    check(lib.rve_grains_needed(words({"shape": shape, **_size_words(radius, grading)}), grains))
    return int(grains[0])


class Packing:
    """A periodic packing of disks (dimension 2) or spheres (dimension 3).

    :meth:`read`, :meth:`create`, :meth:`from_arrays` and :meth:`Batch.packing` make packings.
    Parameters of the material are read and set by their keywords, those of the LAMMPS command
    create_rve: ``packing["friction"] = 0.3``. An unknown keyword or a value out of range raises
    :class:`Error`. Pickling keeps the exact state.

    Arrays have N grains, C contacts and the dimension D. They are copies: changes of an array
    do not change the packing.
    """

    def __init__(self, pointer: Any):
        self._pointer = ffi.gc(pointer, lib.rve_packing_free)

    @classmethod
    def read(cls, file: str | os.PathLike) -> Packing:
        """Reads a packing file.

        :raises Error: the file cannot be read, or is not a valid packing file
        """
        pointer = ffi.new("rve_packing **")
        check(lib.rve_packing_read(os.fsencode(file), pointer))
        return cls(pointer[0])

    @classmethod
    def create(cls, *, radius: Any = None, grading: Any = None, **recipe: float | str) -> Packing:
        """Prepares a packing by compressing a loose cloud to a pressure, on one CPU thread, in
        seconds to minutes.

        :param radius: smallest and largest radius, uniform between them by number; or
            ("lognormal", median, sigma, smallest, largest), or ("power_law", exponent, smallest,
            largest) [length]
        :param grading: instead of ``radius`` points (n, 2) of a grading curve: diameters [length]
            and percent passing by mass, log-linear between the points. The last percentage is 100.
            If the first one is above 0, the fines below the first diameter are cut off.
            :func:`grains_needed` returns the number of grains that the curve needs
        :param recipe: ``shape`` ("disk" or "sphere"), ``grains``, ``seed``, ``pressure`` [stress],
            ``k0`` (a number [-], or "rest": the ratio at zero lateral strain), ``void_ratio``,
            ``void_ratio_tolerance``, ``friction_prep``, ``damping_prep``, ``tolerance``,
            ``contact`` ("hooke", "hertz", "dmt", or the words of LAMMPS, as
            "hertz/material 7e10 0 0.25 tangential mindlin NULL 0 0.5"), ``format``, ``device``,
            ``threads``, and the parameters of the material: ``kn``, ``kt`` [force/length],
            ``friction``, ``density`` [mass/length^3], ``damping``, ...; those of the LAMMPS command
            create_rve
        :raises Error: a keyword is unknown or missing, a value is out of range, the ratio of
            largest to smallest grain is too large, or the packing cannot be prepared
        """
        pointer = ffi.new("rve_packing **")
        check(lib.rve_packing_create(words({**_size_words(radius, grading), **recipe}), pointer))
        return cls(pointer[0])

    @classmethod
    def from_arrays(cls,
                    cell: Any,
                    positions: Any,
                    radii: Any,
                    material: Mapping[str, float | str],
                    forces: Mapping[str, Any] | None = None,
                    *,
                    origin: Any = None,
                    velocities: Any = None,
                    spins: Any = None,
                    wrap: bool = False,
                    overlap_limit: float = 0.5) -> Packing:
        """Makes a packing of grains from elsewhere. The normal forces follow from the positions.

        A left-handed or oblique cell is replaced by a right-handed, reduced cell of the same
        lattice; grains do not turn.

        :param cell: cell matrix (D, D) whose columns are the cell vectors, or the edges (D) of a
            box; D is 2 for disks and 3 for spheres [length]
        :param positions: centres (N, D) [length]
        :param radii: (N) [length]
        :param material: ``kn``, ``density``, ``friction``, ``contact``, ...: keywords and defaults
            of the LAMMPS command create_rve; ``contact`` may have the words of LAMMPS, as
            "hertz/material 7e10 0 0.25 tangential mindlin NULL 0 0.5"
        :param forces: contacts with a tangential force, as :meth:`contacts` returns: ``grains``
            (C, 2), numbers from 0, and ``force`` (C, D) on the first grain [force]. Only the part
            across the normal counts. For disks ``force`` may also have numbers (C) along
            (-n_y, n_x), with n from the first to the second grain. Default: no tangential forces
        :param origin: corner of the cell (D) [length]; default: 0
        :param velocities: peculiar (N, D) [length/time]; default: 0
        :param spins: (N), of spheres (N, 3) [1/time]; default: 0
        :param wrap: True: grains may be in any periodic image; False: a centre may be outside the
            cell by at most its radius
        :param overlap_limit: largest overlap over the smaller radius [-]
        :raises Error: a number is not finite, a shape is wrong, a radius is not positive, a grain
            is outside the cell, an overlap is above the limit, a tangential force belongs to grains
            that do not touch, the cell is too narrow, the mean velocity is not 0, or a parameter of
            the material is unknown or out of range
        """
        return cls._from_arrays(cell, positions, radii, material, forces, origin, velocities, spins,
                                wrap, overlap_limit, lambda i: f"grain {i} (counted from 0)")

    @classmethod
    def _from_arrays(cls, cell: Any, positions: Any, radii: Any, material: Mapping[str, Any],
                     forces: Any, origin: Any, velocities: Any, spins: Any, wrap: bool,
                     overlap_limit: float, name: Callable[[int], str]) -> Packing:
        """Does the work of :meth:`from_arrays`; `name` returns the name of a grain in messages."""
        text, seen = _packing_text, _packing_text.cell_matrix(cell)
        h, d = text.reduced_cell(seen), len(seen)
        x = text.given(positions, "positions", "length", (-1, d))
        n = len(x)
        r = text.given(radii, "radii", "length", (n,))
        if n == 0:
            raise Error("positions has 0 grains; it must have at least 1")
        if r.min() <= 0.0:
            i = int(np.argmin(r))
            raise Error(f"the radius of {name(i)} is {r[i]} [length]; it must be greater than 0")
        corner = text.given(np.zeros(d) if origin is None else origin, "origin", "length", (d,))
        v = text.given(
            np.zeros((n, d)) if velocities is None else velocities, "velocities", "length/time",
            (n, d))
        of_spins = (n,) if d == 2 else (n, 3)
        w = text.given(np.zeros(of_spins) if spins is None else spins, "spins", "1/time", of_spins)
        if not wrap:
            text.require_inside(seen, x, r, corner, name)
        s = text.fractions_of(h, x, corner)
        text.require_apart(s, name)

        def packing(history: list) -> Packing:
            with tempfile.TemporaryDirectory() as folder:
                file = pathlib.Path(folder) / "packing"
                file.write_text(text.packing_text(h, s, r, material, v, w, history))
                try:
                    return cls.read(file)
                except Error as error:
                    # The message begins with the name of the temporary file, often with a line.
                    message = re.sub(r"^(:\d+)?:? *", "", str(error).replace(str(file), "", 1))
                    raise Error(f"the packing {message}" if message.startswith("has ") else message
                               ) from None

        made = packing([])
        contacts = made.contacts()
        text.require_small_overlaps(contacts, r, overlap_limit, name)
        if forces is None:
            return made
        return packing(text.tangential_forces(contacts, r, forces, name))

    @classmethod
    def read_library(cls, file: str | os.PathLike) -> list[Packing]:
        """Returns all packings of a library in its order, or the one of a packing file.

        :raises Error: the file cannot be read, or is not valid
        """
        count = ffi.new("size_t *")
        check(lib.rve_library_read(os.fsencode(file), ffi.NULL, 0, count))
        pointers = ffi.new("rve_packing *[]", count[0])
        check(lib.rve_library_read(os.fsencode(file), pointers, len(pointers), count))
        return [cls(pointer) for pointer in pointers]

    def image(self, number: int) -> Packing:
        """Returns the same grains in a mirror or rotated by right angles: 0 to 7 for disks, 0 to 47
        for spheres; 0 is the packing itself."""
        pointer = ffi.new("rve_packing **")
        check(lib.rve_packing_image(self._pointer, integer(number, "number"), pointer))
        return Packing(pointer[0])

    def copy(self) -> Packing:
        """Returns an independent packing with the same state to the bit."""
        pointer = ffi.new("rve_packing **")
        check(lib.rve_packing_copy(self._pointer, pointer))
        return Packing(pointer[0])

    def write(self, file: str | os.PathLike) -> None:
        """Writes a packing file, completely or not at all."""
        check(lib.rve_packing_write(self._pointer, os.fsencode(file)))

    def save(self) -> bytes:
        """Returns the exact state as bytes, with counters, energies and the list of pairs, which a
        packing file does not have."""
        return saved_by(lib.rve_packing_save, self._pointer)

    @classmethod
    def restore(cls, saved: bytes) -> Packing:
        """Restores a packing from :meth:`save`.

        :raises Error: the bytes are damaged or of a later release
        """
        pointer = ffi.new("rve_packing **")
        check(lib.rve_packing_restore(ffi.from_buffer(saved), len(saved), pointer))
        return cls(pointer[0])

    def __reduce__(self) -> tuple[Callable[[bytes], Packing], tuple[bytes]]:
        return Packing.restore, (self.save(),)

    def __getitem__(self, keyword: str) -> float:
        value = ffi.new("double *")
        check(lib.rve_packing_parameter(self._pointer, keyword.encode(), value))
        return float(value[0])

    def __setitem__(self, keyword: str, value: float) -> None:
        check(lib.rve_packing_set_parameter(self._pointer, keyword.encode(), float(value)))

    def __repr__(self) -> str:
        grains = "disks" if self.dimension == 2 else "spheres"
        return f"<Packing of {self.grains} {grains}, void ratio {self.void_ratio:.4f}>"

    @property
    def dimension(self) -> int:
        """2: disks, 3: spheres."""
        return int(lib.rve_packing_dimension(self._pointer))

    @property
    def grains(self) -> int:
        """N, the number of grains."""
        return int(lib.rve_packing_grains(self._pointer))

    @property
    def void_ratio(self) -> float:
        """Volume of the cell over that of the grains minus one [-]."""
        return float(lib.rve_packing_void_ratio(self._pointer))

    def diameter_passing(self, percent: float) -> float:
        """Returns the smallest diameter for which the grains up to this diameter have at least
        this percentage of the mass of all grains [length].

        :param percent: 0 to 100
        """
        diameter = ffi.new("double *")
        check(lib.rve_packing_diameter(self._pointer, float(percent), diameter))
        return float(diameter[0])

    @property
    def d10(self) -> float:
        """Diameter at 10 percent passing by mass [length]."""
        return self.diameter_passing(10.0)

    @property
    def d50(self) -> float:
        """Diameter at 50 percent passing by mass [length]."""
        return self.diameter_passing(50.0)

    @property
    def d60(self) -> float:
        """Diameter at 60 percent passing by mass [length]."""
        return self.diameter_passing(60.0)

    @property
    def uniformity(self) -> float:
        """Coefficient of uniformity d60/d10 [-]."""
        return self.d60 / self.d10

    def _array(self, name: bytes, *shape: int) -> np.ndarray:
        array = np.empty(shape)
        check(lib.rve_packing_array(self._pointer, name, doubles(array), array.size))
        return array

    @property
    def cell(self) -> np.ndarray:
        """Cell matrix H (D, D); its columns are the cell vectors [length]."""
        return self._array(b"cell", self.dimension, self.dimension)

    @property
    def deformation(self) -> np.ndarray:
        """Deformation gradient F (D, D) since the packing was made [-]."""
        return self._array(b"deformation", self.dimension, self.dimension)

    @property
    def radii(self) -> np.ndarray:
        """Radii (N) [length]."""
        return self._array(b"radius", self.grains)

    @property
    def positions(self) -> np.ndarray:
        """Positions of the centers (N, D) in the cell at the origin [length]."""
        return self._array(b"position", self.grains, self.dimension)

    @property
    def velocities(self) -> np.ndarray:
        """Peculiar velocities (N, D), without the mean field L x [length/time]."""
        return self._array(b"velocity", self.grains, self.dimension)

    @property
    def spins(self) -> np.ndarray:
        """Spins (N), counter-clockwise; for spheres vectors (N, 3) [1/time]."""
        return self._array(b"spin", self.grains, *((3,) if self.dimension == 3 else ()))

    def contacts(self) -> dict[str, np.ndarray]:
        """Returns the C contacts between grains with the forces of their springs.

        :return: ``grains`` (C, 2) ids from 0, the smaller one first; ``branch`` (C, D) from the
            first grain to the second [length]; ``overlap`` (C) [length]; ``normal_force`` (C),
            repulsion positive [force]; ``force`` (C, D) on the first grain [force]; ``sliding`` (C)
            bool
        """
        d = self.dimension
        rows = ffi.new("size_t *")
        check(lib.rve_packing_contacts(self._pointer, rows))
        table = np.empty((rows[0], lib.rve_contact_columns(d)))
        check(lib.rve_packing_contact_table(self._pointer, doubles(table), table.size))
        return {
            "grains": table[:, :2].astype(int),
            "branch": table[:, 2:2 + d].copy(),
            "overlap": table[:, 2 + d].copy(),
            "normal_force": table[:, 3 + d].copy(),
            "force": table[:, 4 + d:4 + 2 * d].copy(),
            "sliding": table[:, 4 + 2 * d] > 0.5,
        }
