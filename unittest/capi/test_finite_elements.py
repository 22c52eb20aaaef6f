# SPDX-License-Identifier: GPL-2.0-only
"""The finite elements of examples/finite_elements with RVEs: equilibrium, convergence of Newton's
method, and the curve of a single RVE.

    python3 test_finite_elements.py <examples>        with gpu_rve and scikit-fem
"""

import pathlib
import sys
import unittest

import numpy as np

import gpu_rve

EXAMPLES = pathlib.Path(sys.argv.pop(1))
sys.path.insert(0, str(EXAMPLES / "finite_elements"))
import biaxial    # noqa: E402

PACKING = gpu_rve.Packing.read(EXAMPLES / "packings" / "A_h0075.rve")
PRESSURE, RATE, SUBSTEPS, STRAIN = 1e5, 0.1, 200, 2e-4
OPTIONS = {"format": "double", "device": "cpu", "threads": 2}


def consistent(specimen, f, stress):
    return specimen.consistent_tangent(f)


def run(columns, rows, increments, tangent_of=consistent, rough=False, tolerance=1e-6):
    specimen = biaxial.Specimen(PACKING, columns, rows, RATE, SUBSTEPS, rough, **OPTIONS)
    answers = [
        specimen.solve_increment(STRAIN, PRESSURE, tangent_of, tolerance, 40)
        for _ in range(increments)
    ]
    return specimen, answers


def alone(increments):
    """Returns the axial stress of one RVE with the pressure on its sides and no shear force on its
    plates; Newton's method finds its width and shear."""
    batch = gpu_rve.Batch([PACKING], **OPTIONS)
    dt, axial = STRAIN / RATE / SUBSTEPS, []

    def nominal(x):
        f = np.array([[1 + x[0], x[1]], [0, 1 - STRAIN]])
        stress = batch.trial(f, dt, SUBSTEPS)[0][0]
        return np.linalg.det(f) * stress @ np.linalg.inv(f).T

    def lack(p):
        return np.array([p[0, 0] + PRESSURE, p[0, 1]])

    for _ in range(increments):
        x = np.zeros(2)
        for _ in range(20):
            p = nominal(x)
            if np.abs(lack(p)).max() < 1e-7 * PRESSURE:
                break
            slope = np.stack([(lack(nominal(x + 1e-5 * e)) - lack(p)) / 1e-5 for e in np.eye(2)],
                             axis=1)
            x = x - np.linalg.solve(slope, lack(p))
        batch.commit()
        axial.append(-p[1, 1])
    return np.array(axial)


class FiniteElements(unittest.TestCase):
    def test_a_uniform_specimen_is_one_rve(self):
        specimen, answers = run(2, 2, 5)
        np.testing.assert_allclose([axial for _, axial in answers], alone(5), rtol=1e-5)
        # All points are alike up to the residual of the equilibrium and its effect on grains.
        for name in ("sxx", "syy", "void_ratio"):
            values = specimen.batch[name]
            self.assertLess(np.ptp(values), 5e-4 * abs(values.mean()), name)
        np.testing.assert_allclose(specimen.batch["sxx"], -PRESSURE, rtol=1e-3)

    def test_the_consistent_tangent_gains_two_digits_an_iteration_and_the_elastic_one_less_than_one(
            self):
        def factors_of(tangent):
            """Returns the ratios of residuals of successive iterations after the first one, which
            moves the plates, at 0.4 to 0.6 % of strain, where grains slide."""
            specimen = biaxial.Specimen(PACKING, 1, 2, 0.2, 300, True, **OPTIONS)
            elastic = specimen.batch.tangents()
            answers = [
                specimen.solve_increment(1e-3, PRESSURE, tangent or (lambda *_: elastic), 1e-6, 40)
                for _ in range(6)
            ]
            residuals = [residuals for residuals, _ in answers[3:]]
            # otherwise there is no second factor
            self.assertTrue(all(len(r) >= 3 for r in residuals), residuals)
            print(*(
                f"{r[0]:.1e} {r[1]:.1e} {r[2]:.1e}: order "
                f"{np.log(r[2] / r[1]) / np.log(r[1] / r[0]):.2f}"
                for r in residuals),
                  sep="\n")
            return np.concatenate([np.divide(r[1:], r[:-1]) for r in residuals])

        # The factors are 1/90 to 1/300, and 1/6 to 1/3 for the elastic tangent, which omits
        # sliding.
        self.assertLess(factors_of(consistent).max(), 1 / 50)
        self.assertGreater(factors_of(None).min(), 1 / 10)

    def test_the_elastic_tangent_finds_the_same_equilibrium(self):
        elastic = {}

        def tangent(specimen, f, stress):
            if not elastic:
                elastic["c"] = specimen.batch.tangents()
            return elastic["c"]

        _, newton = run(1, 2, 3)
        _, modified = run(1, 2, 3, tangent)
        np.testing.assert_allclose([axial for _, axial in modified], [axial for _, axial in newton],
                                   rtol=1e-5)
        self.assertGreater(sum(len(r) for r, _ in modified), sum(len(r) for r, _ in newton))

    def test_rough_plates_make_the_specimen_bulge(self):
        specimen, _ = run(2, 4, 3, rough=True)
        u = specimen.displacement
        at = lambda x, y: u[specimen.basis.nodal_dofs[
            0, np.argmin(np.hypot(specimen.mesh.p[0] - x, specimen.mesh.p[1] - y))]]
        left, right = at(0.0, 0.5 * biaxial.HEIGHT), at(biaxial.WIDTH, 0.5 * biaxial.HEIGHT)
        self.assertGreater(right - left, 1e-3 * biaxial.WIDTH * STRAIN)
        self.assertEqual(at(0.0, 0.0), 0.0)
        self.assertEqual(at(biaxial.WIDTH, biaxial.HEIGHT), 0.0)


if __name__ == "__main__":
    unittest.main()
