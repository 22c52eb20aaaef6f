# SPDX-License-Identifier: GPL-2.0-only
"""RVEs of grains behind the points of any continuum code.

An RVE is a periodic packing of disks or spheres that is simulated by the discrete element method.
Deformed by an increment of the deformation gradient, it returns its Cauchy stress. A :class:`Batch`
has many RVEs and advances them together, on CPU threads or on a GPU.

Units are consistent, those of the packings. Stresses and strains are positive in tension
(extension). Errors raise :class:`Error`, whose text names the value, its unit and the allowed
range.
"""

from . import element_tests
from ._library import Error, api_version, release
from .batch import Batch, status_text
from .packing import Packing, grains_needed
from .small_strain import SmallStrainModel, TrialFailed

__all__ = [
    "Batch", "Error", "Packing", "SmallStrainModel", "TrialFailed", "api_version", "element_tests",
    "grains_needed", "release", "status_text"
]
__version__ = release()
