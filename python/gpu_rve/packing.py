# SPDX-License-Identifier: GPL-2.0-only
"""Packings of grains: the state of one RVE."""

from __future__ import annotations

import os
from typing import Any, Callable

import numpy as np

from ._arrays import integer
from ._library import check, doubles, ffi, lib, saved_by, words


class Packing:
    """A periodic packing of disks (dimension 2) or spheres (dimension 3).

    :meth:`read`, :meth:`create` and :meth:`Batch.packing` make packings. Parameters of the material
    are read and set by their keywords, those of the LAMMPS command create_rve:
    ``packing["friction"] = 0.3``. An unknown keyword or a value out of range raises :class:`Error`.
    Pickling keeps the exact state.

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
    def create(cls, *, radius: tuple[float, float], **recipe: float | str) -> Packing:
        """Prepares a packing by compressing a loose cloud to a pressure, on one CPU thread, in
        seconds to minutes.

        :param radius: smallest and largest radius; uniform between them [length]
        :param recipe: ``shape`` ("disk" or "sphere"), ``grains``, ``seed``, ``pressure`` [stress],
            ``k0`` (a number [-], or "rest": the ratio at zero lateral strain), ``void_ratio``,
            ``void_ratio_tolerance``, ``friction_prep``, ``damping_prep``, ``tolerance``,
            ``contact`` ("hooke", "hertz", "dmt"), ``format``, ``device``, ``threads``, and the
            parameters of the material: ``kn``, ``kt`` [force/length], ``friction``, ``density``
            [mass/length^3], ``damping``, ...; those of the LAMMPS command create_rve
        :raises Error: a keyword is unknown or missing, a value is out of range, or the packing
            cannot be prepared
        """
        pointer = ffi.new("rve_packing **")
        recipe = {**recipe, "radius_min": radius[0], "radius_max": radius[1]}
        check(lib.rve_packing_create(words(recipe), pointer))
        return cls(pointer[0])

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
