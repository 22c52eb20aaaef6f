"""Batches of RVEs, which are advanced together."""

from __future__ import annotations

from typing import Iterable, Sequence

import numpy as np

from ._library import Error, check, doubles, ffi, lib, text, words
from .packing import Packing


def status_text(status: int) -> str:
    """Words for a status of an RVE: "overlap too large"; "ok" for 0."""
    return text(lib.rve_status_text(int(status)))


class Batch:
    """RVEs that begin as copies of packings, all of disks or all of spheres.

    A batch has a committed state of each RVE. :meth:`trial` begins from it, however often it is called; :meth:`commit` makes the last trials the
    committed states, :meth:`revert` forgets them. :meth:`advance` is both in one. The bits of an RVE depend on its own state and increments alone:
    not on the batch, the threads, nor on trials that were forgotten.

    :param packings: one for each RVE; the same one may come many times
    :param options: ``format`` ("fast", "mixed" or "double"), ``arithmetic`` ("strict" or "relaxed"), ``device`` ("auto", "cpu" or "cuda"),
        ``device_number``, ``threads`` (0: as OpenMP decides), ``block_size``, ``skin`` [length], ``overlap_limit`` [-], ``energy`` (True: work and
        losses are counted)
    """

    def __init__(self, packings: Sequence[Packing], **options):
        packings = list(packings)
        pointers = ffi.new("const rve_packing *[]", [packing._pointer for packing in packings])
        pointer = ffi.new("rve_batch **")
        check(lib.rve_batch_create(pointers, len(packings), words(options), pointer))
        self._pointer = ffi.gc(pointer[0], lib.rve_batch_free)

    def __len__(self) -> int:
        return lib.rve_batch_size(self._pointer)

    def __repr__(self) -> str:
        return f"<Batch of {len(self)} RVEs: {self.description}>"

    @property
    def dimension(self) -> int:
        """D: 2 for disks, 3 for spheres."""
        return lib.rve_batch_dimension(self._pointer)

    @property
    def description(self) -> str:
        """Device, number format, arithmetic: a line for a log."""
        return text(lib.rve_batch_description(self._pointer))

    def _which(self, which):
        """Pointer and number of those that are meant; all without `which`."""
        if which is None:
            return ffi.NULL, len(self)
        numbers = np.ascontiguousarray(which, dtype=np.uintp).reshape(-1)
        return ffi.new("size_t[]", numbers.tolist()), numbers.size

    def time_steps(self, which: Iterable[int] | None = None) -> np.ndarray:
        """Lower bounds of the stable DEM time steps (n) [time]; a step should be at most 0.9 of it."""
        numbers, n = self._which(which)
        bounds = np.empty(n)
        check(lib.rve_time_steps(self._pointer, numbers, n, doubles(bounds)))
        return bounds

    def _move(self, call, increments, dt, substeps, which):
        numbers, n = self._which(which)
        d = self.dimension
        increments = np.ascontiguousarray(np.broadcast_to(np.asarray(increments, dtype=float), (n, d, d)))
        dt = np.ascontiguousarray(np.broadcast_to(np.asarray(dt, dtype=float), (n,)))
        steps = np.ascontiguousarray(np.broadcast_to(np.asarray(substeps, dtype=np.int32), (n,)))
        stresses, statuses = np.empty((n, d, d)), np.empty(n, dtype=np.uint32)
        check(call(self._pointer, numbers, n, doubles(increments), doubles(dt), ffi.from_buffer("int32_t[]", steps), doubles(stresses),
                   ffi.from_buffer("uint32_t[]", statuses)))
        return stresses, statuses

    def trial(self, increments, dt, substeps, which: Iterable[int] | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Deforms from the committed states: F becomes increment F in so many DEM steps.

        :param increments: of the deformation gradient (n, D, D), or (D, D) for all [-]
        :param dt: DEM time step (n), or one for all [time]
        :param substeps: number of DEM steps (n), or one for all; 0 with an increment of 1 evaluates the configuration as it is
        :param which: numbers of the RVEs that are meant (n); all without
        :return: Cauchy stresses (n, D, D) [stress], and statuses (n), 0 for a sound RVE (:func:`status_text`); one that failed
            (:meth:`failed`) has its committed state
        """
        return self._move(lib.rve_trial, increments, dt, substeps, which)

    def advance(self, increments, dt, substeps, which: Iterable[int] | None = None) -> tuple[np.ndarray, np.ndarray]:
        """A trial that is committed at once, for hosts that never go back; keeps no copy. Parameters and answer as of :meth:`trial`."""
        return self._move(lib.rve_advance, increments, dt, substeps, which)

    def commit(self) -> None:
        """The last trials of all RVEs become their committed states."""
        check(lib.rve_commit(self._pointer))

    def revert(self) -> None:
        """The last trials of all RVEs are forgotten."""
        check(lib.rve_revert(self._pointer))

    @staticmethod
    def failed(statuses: np.ndarray) -> np.ndarray:
        """Which of these statuses are fatal: their RVEs stayed as they were."""
        return (np.asarray(statuses) & np.uint32(lib.rve_status_fatal())) != 0

    @property
    def quantities(self) -> list[str]:
        """Names of what there is of each RVE."""
        d = self.dimension
        return [text(lib.rve_quantity_name(d, k)) for k in range(lib.rve_num_quantities(d))]

    def __getitem__(self, name: str) -> np.ndarray:
        """A quantity of all RVEs (n), by the names of the LAMMPS command compute rve/atom: ``batch["p"]``."""
        return self.quantity(name)

    def quantity(self, name: str, which: Iterable[int] | None = None) -> np.ndarray:
        """A quantity of these RVEs (n), with their last trial if there is one."""
        numbers, n = self._which(which)
        values = np.empty(n)
        check(lib.rve_quantity(self._pointer, name.encode(), numbers, n, doubles(values)))
        return values

    def affine_stiffness(self, which: Iterable[int] | None = None) -> np.ndarray:
        """Stiffness of the contacts with grains that move affinely: an upper bound of the elastic tangent, without a DEM step.

        :return: (n, D, D, S): change of stress by strain, S = 3: xx, yy, xy, or S = 6: xx, yy, zz, xy, xz, yz; a strain xy is that of both xy and yx [stress]
        """
        numbers, n = self._which(which)
        d = self.dimension
        stiffness = np.empty((n, d, d, d * (d + 1) // 2))
        check(lib.rve_affine_stiffness(self._pointer, numbers, n, doubles(stiffness)))
        return stiffness

    def tangents(self, strain_rates=None, which: Iterable[int] | None = None, **options) -> np.ndarray:
        """Tangents of the RVEs as they are, by probing; the RVEs are not changed.

        :param strain_rates: present directions of straining (n, D, D), or (D, D) for all; needed with ``kind="loading"``
        :param options: ``kind`` ("elastic" or "loading"), ``probe``, ``lead``, ``spread``, ``strain_steps``, ``lead_steps``, ``look_steps``,
            ``most_steps``, ``tolerance``, ``damping``: those of the LAMMPS command compute rve/tangent
        :return: (n, S, S), S = 3: xx, yy, xy, or S = 6: xx, yy, zz, xy, xz, yz, of stress by engineering strain [stress]; NaN where none could be measured
        """
        numbers, n = self._which(which)
        d = self.dimension
        s = d * (d + 1) // 2
        rates = ffi.NULL
        if strain_rates is not None:
            kept = np.ascontiguousarray(np.broadcast_to(np.asarray(strain_rates, dtype=float), (n, d, d)))
            rates = doubles(kept)
        tangents, measured = np.empty((n, s, s)), np.empty(n, dtype=np.intc)
        check(lib.rve_tangents(self._pointer, numbers, n, words(options), rates, doubles(tangents), ffi.from_buffer("int[]", measured)))
        tangents[measured == 0] = np.nan
        return tangents

    def packing(self, which: int) -> Packing:
        """An RVE as it is, with its last trial if there is one."""
        pointer = ffi.new("rve_packing **")
        check(lib.rve_batch_packing(self._pointer, which, pointer))
        return Packing(pointer[0])

    def set_packing(self, which: int, packing: Packing) -> None:
        """Replaces an RVE; what it was is gone."""
        check(lib.rve_batch_set_packing(self._pointer, which, packing._pointer))

    def save(self) -> bytes:
        """The committed states, exact, for restart files and other processes."""
        size = ffi.new("size_t *")
        check(lib.rve_save(self._pointer, ffi.NULL, 0, size))
        buffer = bytearray(size[0])
        check(lib.rve_save(self._pointer, ffi.from_buffer(buffer), len(buffer), size))
        return bytes(buffer)

    def restore(self, saved: bytes) -> None:
        """Takes states that :meth:`save` gave, as many as there are RVEs; they are committed."""
        check(lib.rve_restore(self._pointer, ffi.from_buffer(saved), len(saved)))

    def __getstate__(self):
        raise Error("a batch cannot be pickled; save() gives its states as bytes")
