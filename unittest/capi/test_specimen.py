# SPDX-License-Identifier: GPL-2.0-only
"""The biaxial specimen of examples/finite_elements by finite elements and by the material point
method, with the same grains.

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
STRAIN, INCREMENTS, RATE, SUBSTEPS, PRESSURE, CELL = 5e-4, 20, 0.1, 300, 1e5, 0.0125
# each increment is relative to the present height
STRAINS = -np.log1p(-STRAIN) * np.arange(1, INCREMENTS + 1)


def by_finite_elements():
    """Runs one element, since a specimen between smooth plates is uniform."""
    specimen = biaxial.Specimen(gpu_rve.Packing.read(PACKING),
                                1,
                                1,
                                RATE,
                                SUBSTEPS,
                                format="double",
                                device="cpu")
    return np.array([
        specimen.solve_increment(STRAIN, PRESSURE, lambda s, f, stress: s.consistent_tangent(f),
                                 1e-4, 40)[1] for _ in range(INCREMENTS)
    ])


def by_material_points(rate=RATE, cell=CELL):
    with tempfile.TemporaryDirectory() as folder:
        # The run ends slightly after the last strain of the comparison.
        subprocess.run([
            LMP, "-in", EXAMPLES / "finite_elements" / "in.specimen", "-var", "packing", PACKING,
            "-var", "rate",
            str(rate), "-var", "h",
            str(cell), "-var", "strain",
            str(STRAIN * (INCREMENTS + 1)), "-screen", "none"
        ],
                       cwd=folder,
                       check=True)
        return biaxial.at_strains(pathlib.Path(folder) / "curve.specimen", STRAINS)


class Specimen(unittest.TestCase):
    def test_finite_elements_and_material_points_find_the_same_curve(self):
        elements, points = by_finite_elements(), by_material_points()
        self.assertGreater(elements[-1], 2.1 * PRESSURE)
        difference = np.abs(points / elements - 1)
        print(
            f"finite elements and material points: {100 * difference[0]:.3f} % at first, "
            f"{100 * difference.max():.3f} % at most up to 1 % of strain"
        )
        slower, finer = (np.abs(by_material_points(**change) / points - 1).max()
                         for change in ({"rate": RATE / 2}, {"cell": CELL / 2}))
        print(f"half the rate {100 * slower:.3f} %, half the cells {100 * finer:.3f} %")
        # The error is of first order in the rate and of second order in the cell; the remaining
        # error is one change plus a third of the other. The nominal stress of an increment is
        # Cauchy's times a lateral stretch, 0.02 % at the end. The sum is below one per mille.
        self.assertLess(slower, 5e-4)
        self.assertLess(finer, 5e-4)
        # difference in one increment, before errors accumulate
        self.assertLess(difference[0], 2e-4)
        self.assertLess(difference.max(), 1e-3)


if __name__ == "__main__":
    unittest.main()
