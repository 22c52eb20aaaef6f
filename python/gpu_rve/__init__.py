# SPDX-License-Identifier: GPL-2.0-only
"""RVEs of grains behind the points of any continuum code.

An RVE is a periodic packing of disks or spheres, simulated by the discrete element method: deformed by an increment of the deformation gradient it
answers with its Cauchy stress. A :class:`Batch` has many of them and advances them together, on CPU threads or on a GPU.

Units are consistent, those of the packings. Stresses and strains are tension (extension) positive. What is wrong raises :class:`Error`, whose text
names the value, its unit and the allowed range.
"""

from . import element_tests
from ._library import Error, api_version, release
from .batch import Batch, status_text
from .packing import Packing
from .small_strain import SmallStrainModel, TrialFailed

__all__ = ["Batch", "Error", "Packing", "SmallStrainModel", "TrialFailed", "api_version", "element_tests", "release", "status_text"]
__version__ = release()
