# SPDX-License-Identifier: GPL-2.0-only
"""The UMAT of examples/umat in the finite-element program OOFEM: the bits of gpu_rve at each point,
and the curve of a single RVE.

    python3 test_umat_in_oofem.py <examples> <librve_umat.so>        with gpu_rve and oofem
"""

import os
import pathlib
import sys
import tempfile
import unittest

import numpy as np

import gpu_rve

UMAT = str(pathlib.Path(sys.argv.pop(2)).resolve())
EXAMPLES = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(EXAMPLES / "umat"))
import specimen    # noqa: E402

os.environ["GPU_RVE_UMAT_PACKINGS"] = str(EXAMPLES / "packings")
OPTIONS = {"format": "double", "device": "cpu", "threads": 1}
PRESSURE, STRAIN, INCREMENTS, SUBSTEPS = 1e5, 2e-4, 4, 100
DT = {"A_h0075": 1e-5, "S500": 2e-6}


def matrices(strains, d):
    """Returns 1 + strain for rows 11, 22, 33, 12, 13, 23 with engineering shear, as in the UMAT (n,
    D, D)."""
    f = np.tile(np.eye(3), (len(strains), 1, 1))
    for k, (row, column) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        part = strains[:, k] if k < 3 else 0.5 * strains[:, k]
        f[:, row, column] += part
        if k >= 3:
            f[:, column, row] += part
    return f[:, :d, :d]


def alone():
    """Returns axial stresses of one RVE of disks with the pressure on its sides and no shear
    stress, in small increments by Newton's method."""
    batch = gpu_rve.Batch([gpu_rve.Packing.read(EXAMPLES / "packings" / "A_h0075.rve")], **OPTIONS)
    axial = []
    for increment in range(INCREMENTS + 1):
        moved = STRAIN if increment > 0 else 0.0

        def stress_at(x):
            return batch.trial([[1 + x[0], 0.5 * x[1]], [0.5 * x[1], 1 - moved]], DT["A_h0075"],
                               SUBSTEPS)[0][0]

        def lack(stress):
            return np.array([stress[0, 0] + PRESSURE, stress[0, 1]])

        x = np.zeros(2)
        stress = stress_at(x)
        for _ in range(20):
            if np.abs(lack(stress)).max() < 1e-7 * PRESSURE:
                break
            slope = np.stack(
                [(lack(stress_at(x + 1e-5 * e)) - lack(stress)) / 1e-5 for e in np.eye(2)], axis=1)
            x = x - np.linalg.solve(slope, lack(stress))
            stress = stress_at(x)
        batch.commit()
        axial.append(-stress[1, 1])
    return np.array(axial)


class Oofem(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)

    def run_specimen(self, packing, **options):
        dt = DT[packing]
        text = specimen.deck(packing == "S500",
                             UMAT,
                             packing, [SUBSTEPS * dt, dt, 1e-5, 0],
                             PRESSURE,
                             STRAIN * INCREMENTS,
                             INCREMENTS,
                             tolerance=1e-6,
                             **options)
        analysis = specimen.Analysis(text)
        for _ in range(INCREMENTS + 1):
            analysis.step()
            yield analysis

    def test_points_have_the_bits_of_gpu_rve_and_the_sides_bear_the_pressure(self):
        for name in ("A_h0075", "S500"):
            batch, strains = None, 0.0
            for analysis in self.run_specimen(name, cells=1):
                if batch is None:
                    packing = gpu_rve.Packing.read(EXAMPLES / "packings" / f"{name}.rve")
                    batch = gpu_rve.Batch([packing] * len(analysis.strains), **OPTIONS)
                increments = matrices(analysis.strains - strains, batch.dimension)
                stress, _ = batch.advance(increments, DT[name], SUBSTEPS)
                strains = analysis.strains
                found = analysis.stresses
                for k, (row, column) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
                    if max(row, column) < batch.dimension:
                        np.testing.assert_array_equal(found[:, k], stress[:, row, column],
                                                      f"{name} {k}")
                # an equilibrium to the tolerance of Newton's iterations
                for side in range(batch.dimension - 1):
                    self.assertAlmostEqual(found[:, side].mean() / -PRESSURE, 1.0, 4)

    def test_a_uniform_specimen_is_one_rve(self):
        axial = [
            -analysis.stresses[:, 1].mean() for analysis in self.run_specimen("A_h0075", cells=2)
        ]
        # The left side is held straight, so that a slightly anisotropic packing has a small shear
        # stress.
        np.testing.assert_allclose(axial, alone(), rtol=1e-4)


if __name__ == "__main__":
    unittest.main()
