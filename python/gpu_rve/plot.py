"""Pictures of packings, by Matplotlib."""

from __future__ import annotations

import numpy as np

from .packing import Packing


def grains(packing: Packing, axes=None, forces: bool = True):
    """The grains of a packing of disks in its cell, and the forces between them as lines as thick as they are large.

    :return: the axes
    """
    import matplotlib.pyplot as plt
    from matplotlib.collections import EllipseCollection, LineCollection

    if packing.dimension != 2:
        raise ValueError("grains() draws disks; the packing is of spheres")
    if axes is None:
        _, axes = plt.subplots(figsize=(6, 6))
    x, size = packing.positions, 2.0 * packing.radii
    axes.add_collection(EllipseCollection(size, size, np.zeros_like(size), units="xy", offsets=x, transOffset=axes.transData, facecolor="0.88",
                                          edgecolor="0.6", linewidth=0.4))
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) @ packing.cell.T
    axes.plot(*corners.T, color="0.4", linewidth=0.8)
    if forces:
        contacts = packing.contacts()
        begin = x[contacts["grains"][:, 0]]
        size = np.linalg.norm(contacts["force"], axis=1)
        axes.add_collection(LineCollection(np.stack([begin, begin + contacts["branch"]], axis=1),
                                           linewidths=2.0 * size / max(size.mean(), 1e-300), color="tab:red", capstyle="round"))
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_axis_off()
    return axes
