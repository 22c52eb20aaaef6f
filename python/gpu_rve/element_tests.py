# SPDX-License-Identifier: GPL-2.0-only
"""Element tests: laboratory tests of RVEs as functions that return arrays.

Each takes one packing or several, which are tested together; columns of the arrays are packings.
Batch.follow_path() runs any other path.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Sequence

import numpy as np

from ._arrays import integer
from .batch import Batch
from .packing import Packing


@dataclasses.dataclass(frozen=True)
class Curves:
    """Results of a test: arrays (rows + 1, n) of n packings. The first row is the state before the
    test.

    Strains are logarithms of stretches. Stresses and strains are positive in tension (extension),
    except `strain`, `p` and `q`.
    """

    strain: np.ndarray
    """Applied strain: axial compression, volumetric compression, or the shear strain [-]."""
    p: np.ndarray
    """Mean stress, compression positive [stress]."""
    q: np.ndarray
    """Deviatoric stress, as of the LAMMPS command compute rve/atom [stress]."""
    volumetric_strain: np.ndarray
    """Logarithmic volumetric strain, extension positive [-]."""
    void_ratio: np.ndarray
    """Volume of voids over volume of grains [-]."""
    coordination: np.ndarray
    """Mean number of contacts of a grain [-]."""
    stress: np.ndarray
    """Cauchy stress (rows + 1, n, D, D), tension positive [stress]."""
    deformation: np.ndarray
    """Deformation gradient since the beginning of the test (rows + 1, n, D, D) [-]."""
    statuses: np.ndarray
    """Statuses (n), 0 for a sound RVE (:func:`gpu_rve.status_text`); the rows of a failed RVE
    repeat its last state."""
    packings: tuple[Packing, ...]
    """The RVEs at the end (n)."""

    @property
    def ratio(self) -> np.ndarray:
        """Stress ratio q/p (rows + 1, n) [-]."""
        return self.q / self.p


AXES = "xyz"


def _run(
    packings: Packing | Sequence[Packing],
    rates: str,
    strain: float,
    rate: float,
    rows: int,
    step: float,
    options: dict[str, float | str | bool],
    pressures: Sequence[float] | None = None
) -> tuple[Batch, np.ndarray, dict[str, np.ndarray], np.ndarray]:
    """Runs all packings along a path; `{p}` in `rates` is the pressure of each. Returns the batch,
    F since the beginning, quantities and statuses."""
    for name, value in (("strain", strain), ("rate", rate), ("step", step)):
        if not (value > 0.0 and math.isfinite(value)):
            raise ValueError(f"{name} is {value}; it must be positive")
    rows = integer(rows, "rows")
    if rows < 1:
        raise ValueError(f"rows is {rows}; it must be at least 1")
    batch = Batch([packings] if isinstance(packings, Packing) else packings, **options)
    d = batch.dimension
    duration = strain / rate / rows
    substeps = math.ceil(duration / (step * batch.time_steps().min()))
    # This event never occurs: the number of rows ends the test.
    stage = f"stage {rates} until time > {2.0 * strain / rate!r} "
    path = stage if pressures is None else "".join(
        f"path {k + 1} " + stage.replace("{p}", repr(-p)) for k, p in enumerate(pressures))
    tensor = [f"{AXES[a]}{AXES[b]}" for a in range(d) for b in range(d)]
    names = ["p", "q", "void_ratio", "coordination"] + ["s" + ab for ab in tensor
                                                        ] + ["def_" + ab for ab in tensor]
    table, statuses = batch.follow_path(path, duration / substeps, substeps, rows, names)
    values = dict(zip(names, np.moveaxis(table, 2, 0)))
    stress = table[:, :, 4:4 + d * d].reshape(rows + 1, -1, d, d)
    f = table[:, :, 4 + d * d:].reshape(rows + 1, -1, d, d)
    values["stress"] = stress
    return batch, f @ np.linalg.inv(f[0]), values, statuses


def _curves(batch: Batch, f: np.ndarray, values: dict[str, np.ndarray], statuses: np.ndarray,
            strain: np.ndarray) -> Curves:
    return Curves(strain=strain + 0.0,    # 0 instead of -0
                  p=values["p"],
                  q=values["q"],
                  volumetric_strain=np.log(np.linalg.det(f)),
                  void_ratio=values["void_ratio"],
                  coordination=values["coordination"],
                  stress=values["stress"],
                  deformation=f,
                  statuses=statuses,
                  packings=tuple(batch.packing(k) for k in range(len(batch))))


def _pressures(packings: Packing | Sequence[Packing], pressure: float | None,
               options: dict[str, float | str | bool]) -> list[float]:
    """Returns the pressure of each test: the given one, or the mean stress of each packing."""
    many = [packings] if isinstance(packings, Packing) else list(packings)
    if pressure is not None:
        return [pressure] * len(many)
    return [float(p) for p in Batch(many, **options)["p"]]


def compression(packings: Packing | Sequence[Packing],
                *,
                strain: float = 0.05,
                rate: float = 0.05,
                pressure: float | None = None,
                drained: bool = True,
                rows: int = 200,
                step: float = 0.5,
                **options: float | str | bool) -> Curves:
    """Makes biaxial compression of disks along y, or triaxial compression of spheres along z.

    :param packings: one, or several (n)
    :param strain: final axial compression [-]
    :param rate: axial [1/time]
    :param pressure: on the sides [stress]; default: the mean stress of each packing
    :param drained: True: the sides have the pressure; False: the volume is constant, and the sides
        of spheres have equal stresses
    :param rows: number of rows of the arrays after the first one
    :param step: DEM time step over the bound of stable steps [-], at most 0.9
    :param options: those of :class:`gpu_rve.Batch`
    :raises ValueError: `strain`, `rate`, `step` or `rows` is not positive
    :raises Error: an option, or the pressure, is refused
    """
    first = packings if isinstance(packings, Packing) else packings[0]
    axis = AXES[first.dimension - 1]
    sides = AXES[:first.dimension - 1]
    if drained:
        rates = f"rate {axis}{axis} {-rate!r} " + " ".join(f"stress {a}{a} {{p}}" for a in sides)
    else:
        rates = f"rate {axis}{axis} {-rate!r} rate volume 0" + (" stress xx-yy 0"
                                                                if first.dimension == 3 else "")
    answer = _run(packings, rates, strain, rate, rows, step, options,
                  _pressures(packings, pressure, options) if drained else None)
    return _curves(*answer, -np.log(answer[1][:, :, -1, -1]))


def uniaxial(packings: Packing | Sequence[Packing],
             *,
             strain: float = 0.05,
             rate: float = 0.05,
             rows: int = 200,
             step: float = 0.5,
             **options: float | str | bool) -> Curves:
    """Makes compression along y (disks) or z (spheres) with fixed sides, as in an oedometer.
    Parameters are those of :func:`compression`."""
    first = packings if isinstance(packings, Packing) else packings[0]
    axis = AXES[first.dimension - 1]
    answer = _run(packings, f"rate {axis}{axis} {-rate!r}", strain, rate, rows, step, options)
    return _curves(*answer, -np.log(answer[1][:, :, -1, -1]))


def isotropic(packings: Packing | Sequence[Packing],
              *,
              strain: float = 0.02,
              rate: float = 0.05,
              rows: int = 200,
              step: float = 0.5,
              **options: float | str | bool) -> Curves:
    """Makes equal compression in all directions. `strain` and `rate` are those of the volume; other
    parameters are those of :func:`compression`."""
    first = packings if isinstance(packings, Packing) else packings[0]
    each = -rate / first.dimension
    rates = " ".join(f"rate {a}{a} {each!r}" for a in AXES[:first.dimension])
    answer = _run(packings, rates, strain, rate, rows, step, options)
    return _curves(*answer, -np.log(np.linalg.det(answer[1])))


def shear(packings: Packing | Sequence[Packing],
          *,
          strain: float = 0.1,
          rate: float = 0.1,
          pressure: float | None = None,
          drained: bool = True,
          rows: int = 200,
          step: float = 0.5,
          **options: float | str | bool) -> Curves:
    """Makes simple shear along x of planes with the normal y.

    :param pressure: on these planes [stress]; default: the mean stress of each packing. Other
        directions do not move.
    :param drained: True: the planes have the pressure; False: only shear occurs

    The other parameters are those of :func:`compression`; `strain` and `rate` are those of L_xy.
    """
    rates = f"rate xy {rate!r}" + (" stress yy {p}" if drained else "")
    answer = _run(packings, rates, strain, rate, rows, step, options,
                  _pressures(packings, pressure, options) if drained else None)
    f = answer[1]
    return _curves(*answer, f[:, :, 0, 1] / f[:, :, 1, 1])
