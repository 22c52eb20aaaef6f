# SPDX-License-Identifier: GPL-2.0-only
"""Pictures of packings, by Matplotlib."""

from __future__ import annotations

from typing import Any

import numpy as np

from .packing import Packing


def grains(packing: Packing, axes: Any = None, forces: bool = True) -> Any:
    """Draws the disks of a packing in its cell, and contact forces as lines with a proportional
    width.

    :param axes: axes of Matplotlib; default: those of a new figure
    :param forces: False: no contact forces
    :return: the axes
    :raises ValueError: the packing has spheres
    """
    import matplotlib.pyplot as plt
    from matplotlib.collections import EllipseCollection

    if packing.dimension != 2:
        raise ValueError(
            "grains() draws disks only, but the packing has spheres; use force_chains()")
    if axes is None:
        _, axes = plt.subplots(figsize=(6, 6))
    x, size = packing.positions, 2.0 * packing.radii
    axes.add_collection(
        EllipseCollection(size,
                          size,
                          np.zeros_like(size),
                          units="xy",
                          offsets=x,
                          transOffset=axes.transData,
                          facecolor="0.88",
                          edgecolor="0.6",
                          linewidth=0.4))
    if forces:
        force_chains(packing, axes)
    else:
        _draw_cell(packing, axes)
        _frame(axes)
    return axes


def force_chains(packing: Packing, axes: Any = None) -> Any:
    """Draws contact forces of a packing in the cell, as lines from center to center with a
    proportional width, for disks and spheres.

    :param axes: axes of Matplotlib, for spheres of a projection "3d"; default: axes of a new
        figure
    :return: the axes, for spheres those of a projection "3d"
    """
    import matplotlib.pyplot as plt
    from matplotlib.collections import LineCollection

    d = packing.dimension
    if axes is None:
        axes = plt.figure(figsize=(6, 6)).add_subplot(projection="3d" if d == 3 else None)
    contacts = packing.contacts()
    begin = packing.positions[contacts["grains"][:, 0]]
    size = np.linalg.norm(contacts["force"], axis=1)
    lines = np.stack([begin, begin + contacts["branch"]], axis=1)
    widths = 2.0 * size / max(float(size.mean()) if size.size else 0.0, 1e-300)
    if d == 3:
        from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]

        axes.add_collection3d(
            Line3DCollection(lines, linewidths=0.5 * widths, color="tab:red", capstyle="round"))
    else:
        axes.add_collection(
            LineCollection(list(lines), linewidths=widths, color="tab:red", capstyle="round"))
    _draw_cell(packing, axes)
    _frame(axes)
    return axes


def _draw_cell(packing: Packing, axes: Any) -> None:
    d = packing.dimension
    corners = np.array(np.meshgrid(*[[0, 1]] * d, indexing="ij")).reshape(d, -1).T
    for k, first in enumerate(corners):
        for second in corners[k + 1:]:
            if np.abs(first - second).sum() == 1:
                axes.plot(*(np.stack([first, second]) @ packing.cell.T).T,
                          color="0.4",
                          linewidth=0.8)


def _frame(axes: Any) -> None:
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()
