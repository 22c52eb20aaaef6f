# SPDX-License-Identifier: GPL-2.0-only
"""Prints hashes of stresses and states of short runs on the CPU, of disks and spheres in all number
formats, to compare two copies of librve.

    python3 batch_bits.py <folder of packings>
"""

import hashlib
import pathlib
import sys

import numpy as np

import gpu_rve

for name in ("A_h0075.rve", "S500.rve"):
    packing = gpu_rve.Packing.read(pathlib.Path(sys.argv[1]) / name)
    for number_format in ("fast", "mixed", "double"):
        batch = gpu_rve.Batch([packing] * 3, format=number_format, device="cpu", energy=True)
        dim = batch.dimension
        increment = np.eye(dim)
        increment[0, 1], increment[1, 1] = 1e-3, 1 - 1e-3
        for _ in range(3):
            stresses, statuses = batch.advance(increment, 0.5 * batch.time_steps().min(), 100)
        assert not statuses.any(), statuses
        digest = hashlib.sha256(stresses.tobytes() + batch.save()).hexdigest()
        print(name, number_format, digest, stresses[0, 1, 1])
