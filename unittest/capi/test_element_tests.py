# SPDX-License-Identifier: GPL-2.0-only
"""The element tests of gpu_rve: prescribed quantities hold, strains are those of F, and a test
gives the same result alone and with others.

    python3 test_element_tests.py <folder of the packings of the examples>
"""

import pathlib
import sys
import unittest

import numpy as np

import gpu_rve
from gpu_rve import element_tests

PACKINGS = pathlib.Path(sys.argv.pop(1))
DISKS, SPHERES = (gpu_rve.Packing.read(PACKINGS / name) for name in ("A_h0075.rve", "S500.rve"))
# Rate, strain, and the amplitude of the servo's oscillation over the pressure in so fast a test.
CASES = ((DISKS, 0.2, 0.01, 0.05), (SPHERES, 1.0, 0.001, 0.05))
OPTIONS = {"format": "double", "device": "cpu", "threads": 1, "rows": 20}


class ElementTests(unittest.TestCase):
    def test_a_drained_test_holds_the_pressure_of_its_sides(self):
        for packing, rate, strain, tolerance in CASES:
            curves = element_tests.compression(packing,
                                               rate=rate,
                                               strain=strain,
                                               pressure=1.1e5,
                                               **OPTIONS)
            d = packing.dimension
            self.assertFalse(curves.statuses.any())
            np.testing.assert_allclose(curves.strain[:, 0],
                                       np.linspace(0, strain, 21),
                                       rtol=1e-9,
                                       atol=1e-12)
            for a in range(d - 1):
                np.testing.assert_allclose(curves.stress[10:, 0, a, a], -1.1e5, rtol=tolerance)
            self.assertLess(curves.stress[-1, 0, d - 1, d - 1], -1.5e5)

    def test_an_undrained_test_keeps_its_volume(self):
        for packing, rate, strain, tolerance in CASES:
            curves = element_tests.compression(packing,
                                               rate=rate,
                                               strain=strain,
                                               drained=False,
                                               **OPTIONS)
            np.testing.assert_allclose(curves.volumetric_strain, 0, atol=1e-10)
            np.testing.assert_allclose(curves.void_ratio, curves.void_ratio[0, 0], rtol=1e-9)
            if packing.dimension == 3:
                np.testing.assert_allclose(curves.stress[10:, 0, 0, 0],
                                           curves.stress[10:, 0, 1, 1],
                                           rtol=tolerance)

    def test_void_ratio_and_volume_agree(self):
        for packing, rate, strain, _ in CASES:
            for test in (element_tests.compression, element_tests.uniaxial, element_tests.isotropic,
                         element_tests.shear):
                curves = test(packing, rate=rate, strain=strain, **OPTIONS)
                np.testing.assert_allclose(
                    curves.volumetric_strain[:, 0],
                    np.log((1 + curves.void_ratio[:, 0]) / (1 + packing.void_ratio)),
                    atol=1e-9,
                    err_msg=test.__name__)
                np.testing.assert_allclose(curves.deformation[0, 0],
                                           np.eye(packing.dimension),
                                           atol=1e-15)

    def test_isotropic_compression_is_alike_in_all_directions(self):
        for packing, rate, strain, _ in CASES:
            curves = element_tests.isotropic(packing, rate=rate, strain=strain, **OPTIONS)
            np.testing.assert_allclose(curves.strain[-1, 0], strain, rtol=1e-9)
            f = curves.deformation[-1, 0]
            np.testing.assert_allclose(f, f[0, 0] * np.eye(packing.dimension), atol=1e-12)

    def test_sheared_planes_bear_the_pressure(self):
        for packing, rate, strain, tolerance in CASES:
            curves = element_tests.shear(packing, rate=rate, strain=strain, **OPTIONS)
            np.testing.assert_allclose(curves.stress[10:, 0, 1, 1], -1e5, rtol=tolerance)
            self.assertGreater(curves.stress[-1, 0, 0, 1], 1e4)
            self.assertEqual(curves.deformation[-1, 0, 1, 0], 0.0)

    def test_a_test_is_the_same_alone_and_among_others(self):
        loose = DISKS.copy()
        loose["friction"] = 0.2
        both = element_tests.compression([loose, DISKS],
                                         rate=0.5,
                                         strain=0.005,
                                         pressure=1e5,
                                         **OPTIONS)
        alone = element_tests.compression(DISKS,
                                          rate=0.5,
                                          strain=0.005,
                                          pressure=1e5,
                                          **{**OPTIONS, "step": 0.5})
        np.testing.assert_array_equal(both.p[:, 1], alone.p[:, 0])
        self.assertEqual(both.packings[1].save(), alone.packings[0].save())
        # Less friction gives less strength.
        self.assertLess(both.ratio[-1, 0], both.ratio[-1, 1])

    def test_wrong_values_are_named(self):
        for message, error, work in (("rate is -1", ValueError,
                                      lambda: element_tests.uniaxial(DISKS, rate=-1)),
                                     ("rows is 0", ValueError,
                                      lambda: element_tests.uniaxial(DISKS, rows=0)),
                                     ("must be fast or mixed", gpu_rve.Error,
                                      lambda: element_tests.uniaxial(DISKS, format="quad"))):
            with self.assertRaisesRegex(error, message):
                work()


if __name__ == "__main__":
    unittest.main()
