"""One specimen by two methods: the biaxial specimen of examples/finite_elements by finite elements and by the material point method, with the same grains.

    python3 test_specimen.py <examples> <lmp>        with gpu_rve and scikit-fem
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import gpu_rve

LMP = pathlib.Path(sys.argv.pop(2)).resolve()
EXAMPLES = pathlib.Path(sys.argv.pop(1)).resolve()
sys.path.insert(0, str(EXAMPLES / "finite_elements"))
import biaxial    # noqa: E402

PACKING = EXAMPLES / "packings" / "A_h0075.rve"
STRAIN, INCREMENTS, RATE, SUBSTEPS, PRESSURE = 5e-4, 6, 0.1, 300, 1e5


class Specimen(unittest.TestCase):
    def test_finite_elements_and_material_points_find_the_same_curve(self):
        specimen = biaxial.Specimen(gpu_rve.Packing.read(PACKING), 1, 1, RATE, SUBSTEPS, format="double", device="cpu")
        axial = [specimen.solve_increment(STRAIN, PRESSURE, lambda s, f, stress: s.consistent_tangent(f), 1e-5, 40)[1]
                 for _ in range(INCREMENTS)]
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([LMP, "-in", EXAMPLES / "finite_elements" / "in.specimen", "-var", "packing", PACKING,
                            "-var", "strain", str(STRAIN * (INCREMENTS + 1)), "-screen", "none"], cwd=folder, check=True)
            points = biaxial.at_strains(pathlib.Path(folder) / "curve.specimen", -np.log1p(-STRAIN) * np.arange(1, INCREMENTS + 1))
        # 0.02 %; a cell of half the size makes 0.05 % of difference, half the rate 0.02 %
        np.testing.assert_allclose(points, axial, rtol=1e-3)
        self.assertGreater(axial[-1], 1.3 * PRESSURE)


if __name__ == "__main__":
    unittest.main()
