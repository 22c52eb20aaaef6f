# SPDX-License-Identifier: GPL-2.0-only
"""Batches of RVEs, which are advanced together."""

from __future__ import annotations

from typing import Any, Iterable, Sequence

import numpy as np

from ._arrays import Found, found_doubles, integer, integers, is_on_device, numbers
from ._library import Error, check, doubles, ffi, lib, saved_by, text, words
from .packing import Packing


def status_text(status: int) -> str:
    """Returns the text of a status of an RVE, such as "overlap too large"; "ok" for 0."""
    return text(lib.rve_status_text(integer(status, "status", 0)))


def pointer_to(found: Found) -> Any:
    return ffi.cast("double *", found.address)


class Batch:
    """RVEs that begin as copies of packings of the same dimension and contact law.

    A batch has a committed state of each RVE. :meth:`trial` begins from it, however often it is
    called; :meth:`commit` makes the last trials the committed states, :meth:`revert` drops them.
    :meth:`advance` does both in one call. The bits of an RVE depend only on its own state and
    increments, and not on the batch, the threads, and trials that were dropped.

    :param packings: one for each RVE; the same packing may occur many times
    :param options: ``format`` ("fast", "mixed" or "double"), ``arithmetic`` ("strict" or
        "relaxed"), ``device`` ("auto", "cpu" or "cuda"), ``device_number``, ``threads`` (0: the
        default of OpenMP), ``block_size``, ``skin`` [length], ``arms`` ("contact" or "lammps"),
        ``overlap_limit`` [-], ``energy`` (True: work and losses are counted).
        The default is the format "mixed" with an automatic choice of the device
    :raises Error: an option is unknown or out of range, packings have different dimensions or
        contact laws, or the device cannot be used
    :raises MemoryError: the host or the device has too little memory
    """

    def __init__(self, packings: Sequence[Packing], **options: float | str | bool):
        packings = list(packings)
        pointers = ffi.new("const rve_packing *[]", [packing._pointer for packing in packings])
        pointer = ffi.new("rve_batch **")
        check(lib.rve_batch_create(pointers, len(packings), words(options), pointer))
        self._pointer = ffi.gc(pointer[0], lib.rve_batch_free)

    def __len__(self) -> int:
        return int(lib.rve_batch_size(self._pointer))

    def __repr__(self) -> str:
        return f"<Batch of {len(self)} RVEs: {self.description}>"

    @property
    def dimension(self) -> int:
        """D: 2 for disks, 3 for spheres."""
        return int(lib.rve_batch_dimension(self._pointer))

    @property
    def description(self) -> str:
        """Device, number format and arithmetic, one line for a log."""
        return text(lib.rve_batch_description(self._pointer))

    @property
    def device_number(self) -> int | None:
        """The CUDA device of the batch by CUDA's numbering; None on CPU threads."""
        number = int(lib.rve_batch_device_number(self._pointer))
        return None if number < 0 else number

    def _out(self, out: Any, shape: tuple[int, ...]) -> tuple[Any, Found]:
        """Returns the output array and its address: the caller's own array, or a new one of NumPy.
        """
        receives = np.empty(shape) if out is None else out
        return receives, found_doubles(receives, "out", shape, self.device_number, writes=True)

    def _which(self, which: Iterable[int] | None) -> tuple[Any, int]:
        """Returns pointer and number of the selected RVEs; all RVEs without `which`."""
        if which is None:
            return ffi.NULL, len(self)
        chosen = [integer(k, "which", 0) for k in which]
        return ffi.new("size_t[]", chosen), len(chosen)

    def time_steps(self, which: Iterable[int] | None = None) -> np.ndarray:
        """Returns lower bounds of the stable DEM time steps (n) [time]. A step should be at most
        0.9 of its bound."""
        chosen, n = self._which(which)
        bounds = np.empty(n)
        check(lib.rve_time_steps(self._pointer, chosen, n, doubles(bounds)))
        return bounds

    def _move(self, call: Any, call_device: Any, increments: Any, dt: Any, substeps: Any,
              which: Iterable[int] | None, out: Any) -> tuple[Any, np.ndarray]:
        chosen, n = self._which(which)
        shape = (n, self.dimension, self.dimension)
        f = increments if is_on_device(increments) else numbers(increments, "increments", shape)
        given = found_doubles(f, "increments", shape, self.device_number, writes=False)
        times, steps = numbers(dt, "dt", (n,)), integers(substeps, "substeps", (n,), np.int32)
        stresses, receives = self._out(out, shape)
        statuses = np.empty(n, dtype=np.uint32)
        check((call_device if given.on_device or receives.on_device else call)(
            self._pointer, chosen, n, pointer_to(given), doubles(times),
            ffi.from_buffer("int32_t[]", steps), pointer_to(receives),
            ffi.from_buffer("uint32_t[]", statuses)))
        return stresses, statuses

    def trial(self,
              increments: Any,
              dt: Any,
              substeps: Any,
              which: Iterable[int] | None = None,
              out: Any = None) -> tuple[Any, np.ndarray]:
        """Deforms from the committed states: F becomes increment F in so many DEM steps.

        The arrays `increments` and `out` may each be in the memory of the batch's CUDA device, as
        arrays of any library with DLPack. They must then be float64 in C order with the full shape
        (n, D, D).

        :param increments: of the deformation gradient (n, D, D), or (D, D) for all [-]
        :param dt: DEM time step (n), or one for all [time]
        :param substeps: number of DEM steps (n), or one for all; 0 with an increment of 1 evaluates
            the present configuration
        :param which: numbers of the selected RVEs (n); default: all
        :param out: array for the stresses, float64 in C order (n, D, D) [stress]; default: a new
            one of NumPy
        :return: Cauchy stresses (n, D, D) [stress], which are `out` if it was given, and statuses
            (n), 0 for a sound RVE (:func:`status_text`); a failed RVE (:meth:`failed`) has its
            committed state
        :raises Error: an array has the wrong type, shape or memory, a time step is above the bound
            of stable steps, or a number of steps is negative; earlier trials stay
        :raises ValueError: a shape cannot be broadcast
        :raises TypeError: `substeps` has numbers that are not integers
        """
        return self._move(lib.rve_trial, lib.rve_trial_device, increments, dt, substeps, which, out)

    def advance(self,
                increments: Any,
                dt: Any,
                substeps: Any,
                which: Iterable[int] | None = None,
                out: Any = None) -> tuple[Any, np.ndarray]:
        """Makes a trial and commits it at once, for hosts that never revert; keeps no copy.
        Parameters and result are those of :meth:`trial`."""
        return self._move(lib.rve_advance, lib.rve_advance_device, increments, dt, substeps, which,
                          out)

    def commit(self) -> None:
        """Makes the last trials of all RVEs their committed states."""
        check(lib.rve_commit(self._pointer))

    def revert(self) -> None:
        """Drops the last trials of all RVEs."""
        check(lib.rve_revert(self._pointer))

    def follow_path(self,
                    path: str,
                    dt: float,
                    substeps: int,
                    calls: int,
                    quantities: Sequence[str],
                    which: Iterable[int] | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Makes element tests: each RVE follows a loading path of rates, strains and stresses,
        which a servo controls; the states are committed.

        :param path: the text of a path file (manual: fix rve, loading paths), ``"stage rate yy -0.1
            stress xx -1e5"``: one path for all, or one for each, in the order of `which`
        :param dt: DEM time step [time]
        :param substeps: DEM steps of a call; events of the path are checked after each call
        :param calls: number of calls
        :param quantities: names of the requested quantities, as in :attr:`quantities` (Q)
        :param which: numbers of the selected RVEs (n); default: all
        :return: table (calls + 1, n, Q), before the first call and after each; statuses (n). Rows
            of an RVE whose path has ended, or that failed, repeat
        :raises Error: the path cannot be read, or a quantity is unknown
        """
        chosen, n = self._which(which)
        substeps, calls = int(integers(substeps, "substeps", (), np.int32)), integer(
            calls, "calls", 0)
        table, statuses = np.empty((calls + 1, n, len(quantities))), np.empty(n, dtype=np.uint32)
        check(
            lib.rve_follow_path(self._pointer, chosen, n, path.encode("utf-8"), dt, substeps, calls,
                                " ".join(quantities).encode("utf-8"), doubles(table),
                                ffi.from_buffer("uint32_t[]", statuses)))
        return table, statuses

    @staticmethod
    def failed(statuses: np.ndarray) -> np.ndarray:
        """Returns an array of bool that is True for fatal statuses, whose RVEs kept their state."""
        return np.asarray((np.asarray(statuses) & np.uint32(lib.rve_status_fatal())) != 0)

    @property
    def quantities(self) -> list[str]:
        """Names of the quantities of an RVE."""
        d = self.dimension
        return [text(lib.rve_quantity_name(d, k)) for k in range(lib.rve_num_quantities(d))]

    def __getitem__(self, name: str) -> np.ndarray:
        """Returns a quantity of all RVEs (n), by the names of the LAMMPS command compute rve/atom:
        ``batch["p"]``. Same as :meth:`quantity`."""
        return self.quantity(name)

    def quantity(self, name: str, which: Iterable[int] | None = None, out: Any = None) -> Any:
        """Returns a quantity of these RVEs (n), with their last trial if there is one.

        :param name: one of :attr:`quantities`
        :param which: numbers of the selected RVEs; default: all
        :param out: as in :meth:`trial`, (n)
        :raises Error: the name is unknown
        """
        chosen, n = self._which(which)
        values, receives = self._out(out, (n,))
        call = lib.rve_quantity_device if receives.on_device else lib.rve_quantity
        check(call(self._pointer, name.encode(), chosen, n, pointer_to(receives)))
        return values

    def affine_stiffness(self, which: Iterable[int] | None = None, out: Any = None) -> Any:
        """Returns the stiffness of the contacts with affine motion of grains, an upper bound of the
        elastic tangent, without a DEM step.

        :param out: as in :meth:`trial`, (n, D, D, S)
        :return: (n, D, D, S): change of stress by strain, S = 3: xx, yy, xy, or S = 6: xx, yy, zz,
            xy, xz, yz; a strain xy is that of both xy and yx [stress]
        """
        chosen, n = self._which(which)
        d = self.dimension
        stiffness, receives = self._out(out, (n, d, d, d * (d + 1) // 2))
        call = lib.rve_affine_stiffness_device if receives.on_device else lib.rve_affine_stiffness
        check(call(self._pointer, chosen, n, pointer_to(receives)))
        return stiffness

    def tangents(self,
                 strain_rates: Any = None,
                 which: Iterable[int] | None = None,
                 **options: float | str) -> np.ndarray:
        """Returns tangents of the RVEs in their present state by probing; the RVEs do not change.

        :param strain_rates: present directions of straining (n, D, D), or (D, D) for all; required
            for ``kind="loading"``
        :param options: ``kind`` ("elastic" or "loading"), ``format`` (of the probed copies;
            default: that of the batch), ``probe``, ``lead``, ``spread``, ``strain_steps``,
            ``lead_steps``, ``look_steps``, ``most_steps``, ``tolerance``, ``damping``: those of the
            LAMMPS command compute rve/tangent
        :return: (n, S, S), S = 3: xx, yy, xy, or S = 6: xx, yy, zz, xy, xz, yz, of stress by
            engineering strain [stress]; NaN if none could be measured
        """
        chosen, n = self._which(which)
        d = self.dimension
        s = d * (d + 1) // 2
        rates = ffi.NULL
        if strain_rates is not None:
            kept = numbers(strain_rates, "strain_rates", (n, d, d))
            rates = doubles(kept)
        tangents, measured = np.empty((n, s, s)), np.empty(n, dtype=np.intc)
        check(
            lib.rve_tangents(self._pointer, chosen, n, words(options), rates, doubles(tangents),
                             ffi.from_buffer("int[]", measured)))
        tangents[measured == 0] = np.nan
        return tangents

    def packing(self, which: int) -> Packing:
        """Returns the packing of an RVE, with its last trial if there is one."""
        pointer = ffi.new("rve_packing **")
        check(lib.rve_batch_packing(self._pointer, integer(which, "which", 0), pointer))
        return Packing(pointer[0])

    def set_packing(self, which: int, packing: Packing) -> None:
        """Replaces the state and the trial of an RVE by a packing with the same contact law."""
        check(lib.rve_batch_set_packing(self._pointer, integer(which, "which", 0),
                                        packing._pointer))

    def save(self) -> bytes:
        """Returns the committed states, exact, for restart files and other processes."""
        return saved_by(lib.rve_save, self._pointer)

    def restore(self, saved: bytes) -> None:
        """Restores states from :meth:`save`, one for each RVE; they are committed.

        :raises Error: the bytes are damaged, of a later release, or of another number of RVEs
        """
        check(lib.rve_restore(self._pointer, ffi.from_buffer(saved), len(saved)))

    def __getstate__(self) -> object:
        raise Error("a batch cannot be pickled; save() returns its states as bytes")
