# SPDX-License-Identifier: GPL-2.0-only
"""RVEs as one incremental law of all quadrature points of a host on flat arrays: the interface of
IncrSmallStrainModel of fenics-constitutive."""

from __future__ import annotations

import math
from typing import Any, Sequence

import numpy as np

from ._arrays import integer
from ._library import Error
from .batch import Batch, status_text
from .packing import Packing

HISTORY = "trial"
ROOT_TWO = math.sqrt(2.0)


class TrialFailed(Error):
    """Raised if an RVE fails in an increment; the host should try a smaller one."""


class SmallStrainModel:
    """RVEs behind the quadrature points of a host that evaluates all of them at once.

    Vectors are Mandel's: xx, yy, zz, sqrt(2) xy for disks (plane), and also sqrt(2) xz, sqrt(2) yz
    for spheres. Disks have no stress zz; it is 0.

    The class does not import the host. A host that checks types gets them by ``class
    Grains(SmallStrainModel, IncrSmallStrainModel)``, with its own word for ``constraint``: plane
    strain for disks, full for spheres.

    The history of a host cannot store grains. It has one number for each point, that of the trial
    that made the state: :meth:`evaluate` begins from the state that the number names and writes
    that of its own trial. Such a number in a later call shows that the host has accepted the trial.
    Only the committed state and the last trial can be named. A host without history calls
    :meth:`update` instead.

    :param packings: one for each point (n)
    :param substeps: DEM steps of an increment, at least 1
    :param time_scale: time of the RVEs over that of the host [-]
    :param probe: strain of the differences for the tangent [-]
    :param rotates: False: the RVE gets only the strain of an increment, as in small strains; True:
        it gets 1 + grad u, for hosts whose lengths are those at the beginning of the increment. The
        stress is Cauchy's, the tangent its derivative by a subsequent strain
    :param options: of :class:`Batch`
    """

    constraint: Any = None

    def __init__(self,
                 packings: Sequence[Packing],
                 substeps: int,
                 time_scale: float = 1.0,
                 probe: float = 1e-5,
                 rotates: bool = False,
                 **options: float | str | bool):
        self.batch = Batch(packings, **options)
        self.substeps = integer(substeps, "substeps", 1)
        self.time_scale, self.probe, self.rotates = time_scale, probe, rotates
        self.trials = 0    # number of trials of all RVEs, with those for tangents
        # Numbers of trials: the committed one, the one that may be committed, and their count.
        self._committed, self._last, self._count = 0, 0, 0
        d = self.batch.dimension
        self._pairs = [(k, k) for k in range(d)] + [(a, b) for a in range(d)
                                                    for b in range(a + 1, d)]
        # Positions of the components in a vector; disks have a zz in between.
        self._places = [0, 1, 3] if d == 2 else list(range(6))

    @property
    def geometric_dim(self) -> int:
        """D: 2 for disks, 3 for spheres."""
        return self.batch.dimension

    @property
    def stress_strain_dim(self) -> int:
        """S, the number of components of a vector: 4 for disks, 6 for spheres."""
        return 4 if self.batch.dimension == 2 else 6

    @property
    def history_dim(self) -> dict[str, int]:
        """Name and size of the history of a point, ``{"trial": 1}``."""
        return {HISTORY: 1}

    def stress(self) -> np.ndarray:
        """Returns the stresses of the committed states (n * S) [stress], with which a host begins.
        A trial that was not accepted is dropped."""
        tensors, _ = self.batch.trial(np.eye(self.batch.dimension),
                                      float(self.batch.time_steps().min()), 0)
        self.batch.revert()
        self._last = self._committed
        vectors = np.zeros((len(self.batch), self.stress_strain_dim))
        vectors[:, self._places] = self._components(tensors)
        return vectors.ravel()

    def evaluate(self, t: float, del_t: float, grad_del_u: np.ndarray, stress: np.ndarray,
                 tangent: np.ndarray | None, history: dict[str, np.ndarray] | None) -> None:
        """Makes a trial of all RVEs; overwrites stress, tangent and history.

        :param t: time of the host, which RVEs do not use
        :param del_t: of the increment [time]
        :param grad_del_u: gradient of the increment of displacement (n * D * D), in row order [-]
        :param stress: Mandel's (n * S); only an output, since RVEs store their stress [stress]
        :param tangent: derivative of the stress by the strain (n * S * S), by differences with one
            more trial for each component; None: no tangent [stress]
        :param history: dictionary with the array ``"trial"`` (n), 0 at the beginning; None for a
            host that calls :meth:`update`
        :raises TrialFailed: an RVE fails in the increment; nothing is overwritten
        :raises Error: an array has the wrong size, `del_t` is not positive, or `history` names
            another state
        """
        n, d, s = len(self.batch), self.batch.dimension, self.stress_strain_dim
        for array, name, size in ((grad_del_u, "grad_del_u", n * d * d), (stress, "stress", n * s),
                                  (tangent, "tangent", n * s * s)):
            if array is not None and array.size != size:
                raise Error(f"{name} has {array.size} numbers; for {n} points it must have {size}")
        if del_t <= 0.0:
            raise Error(f"del_t is {del_t} [time]; it must be positive")
        if history is not None:
            self._begin_from(history[HISTORY])
        dt = self.time_scale * del_t / self.substeps
        gradients = np.asarray(grad_del_u, dtype=float).reshape(n, d, d)
        if not self.rotates:
            gradients = 0.5 * (gradients + gradients.swapaxes(1, 2))
        # The trial before this one is dropped here.
        self._last = self._committed
        self._count += 1
        probed = [self._trial(self._probed(gradients, pair), dt)
                  for pair in self._pairs] if tangent is not None else []
        # The last trial is the one that may be committed.
        found = self._trial(np.eye(d) + gradients, dt)
        self._last = self._count
        stress.reshape(n, s)[:, self._places] = found
        if d == 2:
            stress.reshape(n, s)[:, 2] = 0.0
        if tangent is not None:
            matrices = tangent.reshape(n, s, s)
            matrices[...] = 0.0
            for (a, b), place, column in zip(self._pairs, self._places, probed):
                # The probe of a shear has an engineering strain of 1/sqrt(2) of Mandel's.
                matrices[:, self._places,
                         place] = (column - found) / self.probe * (1.0 if a == b else ROOT_TWO)
        if history is not None:
            history[HISTORY][...] = self._last

    def update(self) -> None:
        """Makes the last trial the committed state; without a trial nothing changes."""
        if self._last == self._committed:
            return
        self.batch.commit()
        self._committed = self._last

    def _begin_from(self, numbers: np.ndarray) -> None:
        """Commits the last trial if these numbers of states are its own."""
        first = float(numbers.flat[0])
        if np.any(numbers != first) or first not in (self._committed, self._last):
            raise Error(
                f"history '{HISTORY}' has state {first:g}" +
                (" and others" if np.any(numbers != first) else "") +
                f"; it must have the committed state {self._committed} or the last trial "
                f"{self._last}, the same for all points"
            )
        if first != self._committed:
            self.update()

    def _probed(self, gradients: np.ndarray, pair: tuple[int, int]) -> np.ndarray:
        d = self.batch.dimension
        strain = np.zeros((d, d))
        strain[pair] += 0.5 * self.probe
        strain[pair[::-1]] += 0.5 * self.probe
        return (np.eye(d) + strain) @ (
            np.eye(d) + gradients) if self.rotates else np.eye(d) + gradients + strain

    def _trial(self, increments: np.ndarray, dt: float) -> np.ndarray:
        self.trials += 1
        stresses, statuses = self.batch.trial(increments, dt, self.substeps)
        if (failed := self.batch.failed(statuses)).any():
            self.batch.revert()
            first = int(np.argmax(failed))
            raise TrialFailed(
                f"{failed.sum()} of {len(failed)} RVEs fail in the increment; RVE {first}: "
                f"{status_text(statuses[first])}"
            )
        return self._components(stresses)

    def _components(self, tensors: np.ndarray) -> np.ndarray:
        """Returns Mandel's components (n, pairs) of stresses; xy is the mean of xy and yx, which
        differ by moments of grains in motion."""
        return np.stack([
            tensors[:, a, b] if a == b else (tensors[:, a, b] + tensors[:, b, a]) / ROOT_TWO
            for a, b in self._pairs
        ],
                        axis=1)
