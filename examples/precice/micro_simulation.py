# SPDX-License-Identifier: GPL-2.0-only
"""RVEs of grains as micro simulations of preCICE's Micro Manager: one behind each vertex of a macro mesh, all of a rank in one batch.

    micro-manager-precice micro-manager-config.json

Reads the rows of the displacement gradient at the end of the time step, grad u = F - 1 with respect to the beginning of the coupling, and writes the rows of
Cauchy's stress, tension positive. Strains may be finite.

The Micro Manager solves one simulation after the other. Here a solve only notes what its RVE is to do; the first one whose answer is read lets the whole rank
advance in one call of librve, on all CPU threads or a GPU.
"""

from __future__ import annotations

import dataclasses
import math
import pathlib
from typing import Any, Iterator

import numpy as np
from micro_manager import MicroSimulationInterface

import gpu_rve

# ---- settings ----
PACKING = pathlib.Path(__file__).resolve().parent.parent / "packings" / "A_h0075.rve"
OPTIONS: dict[str, Any] = {"format": "mixed"}    # of gpu_rve.Batch
TIME_RATIO = 1.0    # time of the RVEs for a unit of the macro time: sets their strain rate
STEP = 0.5          # DEM time step over the bound of the stable ones


@dataclasses.dataclass(frozen=True)
class State:
    """A checkpoint: grains, and F since the beginning. Exact, and can be pickled for other ranks."""

    packing: gpu_rve.Packing
    gradient: np.ndarray


class Rank:
    """The RVEs of this process."""

    def __init__(self) -> None:
        self.members: list[MicroSimulation] = []
        self.waiting: list[MicroSimulation] = []
        self.batch: gpu_rve.Batch | None = None
        self.largest_step = 0.0
        self.calls = 0

    def settle(self) -> None:
        """All that wait advance together."""
        if not self.waiting:
            return
        waiting, self.waiting = self.waiting, []
        for sim in waiting:
            sim.waits = False
        batch = self._batch_with(waiting)
        durations = [TIME_RATIO * sim.dt for sim in waiting]
        steps = [max(1, math.ceil(duration / self.largest_step)) for duration in durations]
        increments = np.stack([sim.target @ np.linalg.inv(sim.gradient) for sim in waiting])
        stresses, statuses = batch.advance(increments, np.divide(durations, steps), steps, which=[sim.place for sim in waiting])
        self.calls += 1
        for sim, stress, status, failed in zip(waiting, stresses, statuses, batch.failed(statuses)):
            sim.failure = gpu_rve.status_text(status) if failed else ""
            if not failed:
                sim.gradient = sim.target
            sim.answer.update({f"Stress-{i + 1}": row for i, row in enumerate(stress)})
        for sim in waiting:
            if sim.failure:
                raise RuntimeError(f"the RVE of micro simulation {sim.get_global_id()} did not bear its increment: {sim.failure}")

    def _batch_with(self, sims: list[MicroSimulation]) -> gpu_rve.Batch:
        """The batch, in which these have their places and their states."""
        if self.batch is None or any(sim.place < 0 for sim in sims):
            self.batch = gpu_rve.Batch([sim.packing() for sim in self.members], **OPTIONS)
            for place, sim in enumerate(self.members):
                sim.place, sim.loaded = place, None
            if self.largest_step == 0.0:
                self.largest_step = STEP * float(self.batch.time_steps().min())
        for sim in sims:
            if sim.loaded is not None:
                self.batch.set_packing(sim.place, sim.loaded)
                sim.loaded = None
        return self.batch


RANK = Rank()


class Answer(dict):
    """What a solve returns: a dictionary whose content comes when it is read first."""

    def __missing__(self, name: str) -> Any:
        RANK.settle()
        if not dict.__contains__(self, name):
            raise KeyError(f"there is no {name}; there are {', '.join(self)}")
        return dict.__getitem__(self, name)

    def __iter__(self) -> Iterator[str]:
        RANK.settle()
        return super().__iter__()

    def __len__(self) -> int:
        RANK.settle()
        return super().__len__()

    def __contains__(self, name: object) -> bool:
        RANK.settle()
        return super().__contains__(name)

    def keys(self) -> Any:
        RANK.settle()
        return super().keys()

    def values(self) -> Any:
        RANK.settle()
        return super().values()

    def items(self) -> Any:
        RANK.settle()
        return super().items()

    def get(self, name: str, default: Any = None) -> Any:
        RANK.settle()
        return super().get(name, default)

    def __reduce__(self) -> Any:
        RANK.settle()
        return dict, (dict(self),)


class MicroSimulation(MicroSimulationInterface):
    """One RVE."""

    def __init__(self, sim_id: int) -> None:
        self._id = sim_id
        self.place = -1    # in the batch of the rank
        self.loaded: gpu_rve.Packing | None = gpu_rve.Packing.read(PACKING)    # a state that the batch does not have yet
        self.gradient = np.eye(self.loaded.dimension)
        self.target = self.gradient
        self.dt = 0.0
        self.failure = ""
        self.waits = False
        self.answer = Answer()
        RANK.members.append(self)

    def solve(self, macro_data: dict, dt: float) -> dict:
        if self.waits:
            RANK.settle()
        d = len(self.gradient)
        self.target = np.eye(d) + np.stack([np.asarray(macro_data[f"Displacement-Gradient-{i + 1}"], dtype=float) for i in range(d)])
        self.dt = dt
        self.answer = Answer()
        self.waits = True
        RANK.waiting.append(self)
        return self.answer

    def packing(self) -> gpu_rve.Packing:
        """The grains as they are."""
        if self.loaded is not None:
            return self.loaded
        assert RANK.batch is not None
        return RANK.batch.packing(self.place)

    def get_state(self) -> State:
        RANK.settle()
        return State(self.packing(), self.gradient)

    def set_state(self, state: State) -> None:
        if self.waits:
            RANK.settle()
        self.loaded, self.gradient = state.packing, state.gradient

    def get_global_id(self) -> int:
        return self._id

    def set_global_id(self, global_id: int) -> None:
        self._id = global_id

    def destroy(self) -> None:
        RANK.waiting = [sim for sim in RANK.waiting if sim is not self]
        if self in RANK.members:
            # the others keep their places until the batch is made anew
            RANK.members.remove(self)
            if RANK.batch is not None:
                for sim in RANK.members:
                    sim.loaded = sim.packing()
                    sim.place = -1
                RANK.batch = None
