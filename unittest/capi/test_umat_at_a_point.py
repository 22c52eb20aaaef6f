# SPDX-License-Identifier: GPL-2.0-only
"""The UMAT of examples/umat with finite strains in the driver singlepointsim, which runs UMATs of
Abaqus along paths of deformation gradients.

    python3 test_umat_at_a_point.py <examples> <librve_umat.so>

It needs gpu_rve and singlepointsim. Scenarios of the driver have zero stresses. Grains need a cell
pressure, so that the driver gets the stress relative to it, as the gauges of a triaxial cell do.
"""

import contextlib
import os
import pathlib
import sys
import unittest

import cffi
import numpy as np
from singlepointsim.sps_step import SPSStep

import gpu_rve

UMAT = str(pathlib.Path(sys.argv.pop(2)).resolve())
EXAMPLES = pathlib.Path(sys.argv.pop(1)).resolve()
os.environ["GPU_RVE_UMAT_PACKINGS"] = str(EXAMPLES / "packings")
OPTIONS = {"format": "double", "device": "cpu", "threads": 1}
PRESSURE = 1e5
PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))

ffi = cffi.FFI()
ffi.cdef(
    """void umat_(
        double *, double *, double *, double *, double *, double *, double *, double *, double *,
        double *, const double *, const double *, const double *, const double *, const double *,
        const double *, const double *, const double *, const char *, const int *, const int *,
        const int *, const int *, const double *, const int *, const double *, const double *,
        double *, const double *, const double *, const double *, const int *, const int *,
        const int *, const int *, const int *, const int *);""")
library = ffi.dlopen(UMAT)


class Umat:
    """Stands in for a UMAT compiled by f2py, and stores F and Cauchy stress of each call; a point
    has its own number in the process."""

    points = 0

    def __init__(self, packing):
        self.name = packing.ljust(80).encode()
        Umat.points += 1
        self.point = Umat.points
        self.gradients, self.stresses = [], []

    def __call__(self, stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, stran,
                 dstran, time, dtime, temp, dtemp, predef, dpred, cmname, ndi, nshr, props, coords,
                 drot, pnewdt, celent, dfgrd0, dfgrd1, *_, **__):
        def numbers(values):
            return ffi.new("double[]", [float(x) for x in np.ravel(values, order="F")])

        def whole(value):
            return ffi.new("int *", value)

        answer, state, tangent, one = numbers(stress), numbers(statev), numbers(np.zeros(
            (6, 6))), ffi.new("double *", 1.0)
        none, rest = ffi.NULL, whole(1)
        library.umat_(answer, state, tangent, none, none, none, none, none, none, none, none,
                      numbers(dstran), none, numbers([dtime]), none, none, none, none, self.name,
                      whole(ndi), whole(nshr), whole(6), whole(len(statev)), numbers(props),
                      whole(len(props)), numbers(coords), none, one, none, numbers(dfgrd0),
                      numbers(dfgrd1), whole(self.point), rest, rest, rest, rest, rest)
        assert one[0] == 1.0, "the RVE did not bear an increment"
        found = np.array(list(answer))
        self.gradients.append(dfgrd1.copy())
        self.stresses.append(found)
        return found + PRESSURE * np.array([1, 1, 1, 0, 0, 0]), np.array(list(state)), np.reshape(
            list(tangent), (6, 6), order="F")


def run(scenario, packing, displacements, dt, increments, substeps=100):
    """Returns the path of the driver after its first call, which is at rest: F (n + 1, 3, 3),
    Cauchy stresses (n + 1, 6), and the number of calls."""
    umat = Umat(packing)
    step = SPSStep(loading_scenario=scenario,
                   dtime=1.0,
                   time_max=float(increments),
                   dtime_max=1.0,
                   props=[substeps * dt, dt, 1e-6, 1],
                   nstatv=3,
                   displacements=displacements,
                   loading_direction_i=1,
                   loading_direction_j=2)
    with open(os.devnull, "w") as nothing, contextlib.redirect_stdout(nothing):
        outputs = step.loading_scenario(step, umat).run_simulation()
    f = np.concatenate([np.eye(3)[None], outputs.all_dfgrd])
    # The last call of an increment completes it.
    last = {gradient.tobytes(): stress for gradient, stress in zip(umat.gradients, umat.stresses)}
    return f, np.array([last[gradient.tobytes()] for gradient in f]), len(umat.gradients)


def by_gpu_rve(packing, f, dt, substeps=100):
    """Returns stresses of an RVE along the same path (n + 1, 6); components out of the plane of
    disks are zero."""
    batch = gpu_rve.Batch([gpu_rve.Packing.read(EXAMPLES / "packings" / f"{packing}.rve")],
                          **OPTIONS)
    d = batch.dimension
    rows = []
    for before, after in zip(np.concatenate([f[:1], f]), f):
        stress = batch.advance((after @ np.linalg.inv(before))[:d, :d], dt, substeps)[0][0]
        rows.append([stress[a, b] if max(a, b) < d else 0.0 for a, b in PLACES])
    return np.array(rows)


class SinglePoint(unittest.TestCase):
    def check_path(self, scenario, packing, displacements, dt, increments, free):
        f, stress, calls = run(scenario, packing, displacements, dt, increments)
        self.assertEqual(len(f), increments + 1)
        # With the right tangent, Newton's method ends after about two iterations, of five before
        # the driver halves its step.
        self.assertLess(calls, 3.5 * increments)
        # tolerance of the driver: 1e-3 of the stress relative to the cell pressure
        for k in free:
            np.testing.assert_allclose(stress[1:, k],
                                       -PRESSURE,
                                       atol=1e-3 * np.abs(stress[-1] + PRESSURE).max())
        # The two programs invert F by different formulas, whose results differ in the last digit.
        np.testing.assert_allclose(stress, by_gpu_rve(packing, f, dt), atol=1e-6 * PRESSURE)
        return f, stress

    def test_disks_are_compressed_in_plane_strain(self):
        f, stress = self.check_path("plane strain", "A_h0075", [-0.02], 1e-5, 40, free=(0,))
        self.assertAlmostEqual(f[-1, 1, 1], 0.98, 12)
        self.assertGreater(stress[-1, 1] / stress[-1, 0], 2.0)

    def test_spheres_are_compressed_and_sheared_under_a_cell_pressure(self):
        f, stress = self.check_path("compression torsion",
                                    "S500", [-0.02, 0.02],
                                    2e-6,
                                    20,
                                    free=(0, 2))
        self.assertAlmostEqual(f[-1, 0, 1], 0.02, 12)
        self.assertGreater(stress[-1, 3], 1e4)


if __name__ == "__main__":
    unittest.main()
