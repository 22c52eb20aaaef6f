# SPDX-License-Identifier: GPL-2.0-only
"""What the element tests share: their parameters, curves and the reference data."""

import os

import numpy as np

REFERENCE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "reference")

TESTS = ("uniaxial", "shear", "biaxial")
CASES = ("A_h0075", "A_h1")
DT = 5e-5      # [s]
RATE = 0.05    # of strain [1/s]
VOID_RATIO = {"A_h0075": 0.1610414679, "A_h1": -0.0073061485}


def servo_gain(packing):
    """1/(mass of the RVE), the gain of SudoDEM2D's servo [1/kg]."""
    return 1.0 / np.sum(packing["mass"])


class Curve:
    """Rows of a test by step of the reference: step n has the forces of the configuration after n - 1 steps. Compression positive."""

    def __init__(self, step, stress, void_ratio, contacts, stretch_xx):
        self.step, self.void_ratio, self.contacts = step.astype(int), void_ratio, contacts
        xx, yy, xy, yx = stress
        self.p = 0.5 * (xx + yy)                                                         # [Pa]
        self.q = np.sqrt(0.5 * (2.0 * (0.5 * (xx - yy)) ** 2 + xy**2 + yx**2))           # [Pa]
        self.ratio = self.q / self.p
        self.stretch_xx = stretch_xx

    def strain(self, test):
        """Size of the prescribed strain: F_xy in shear, else 1 - F_yy [-]."""
        if test == "shear":
            return (self.step - 1) * DT * RATE
        return 1.0 - (1.0 - DT * RATE) ** (self.step - 1)

    def up_to(self, step):
        """The rows up to this step."""
        rows = self.step <= step
        part = object.__new__(Curve)
        part.__dict__.update({name: values[rows] for name, values in self.__dict__.items()})
        return part


def read_run(path):
    """A curve that in.element wrote."""
    data = np.loadtxt(path)
    return Curve(data[:, 9], -data[:, :4].T, data[:, 4], data[:, 5], data[:, 6])


def read_reference(code, case, test):
    data = np.loadtxt(os.path.join(REFERENCE, f"{code}.{case}.{test}.csv"), delimiter=",", skiprows=1)
    return Curve(data[:, 0], data[:, 1:5].T, data[:, 5], data[:, 6], data[:, 7])
