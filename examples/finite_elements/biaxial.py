#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""A biaxial specimen of grains by finite elements: an implicit solver of scikit-fem with an RVE behind each quadrature point.

    python3 biaxial.py                         1 % of compression in 20 increments, half a minute on two cores
    python3 biaxial.py --tangent elastic       with the elastic tangent by probing at the beginning, in place of Newton's own
    python3 biaxial.py --rough                 grains do not slide on the plates: the specimen bulges

Quadrilaterals of eight nodes with four points each (Guo and Zhao 2014, Int. J. Numer. Methods Eng. 99, 789), in plane strain of disks. The specimen of 50 by
100 mm stands on a plate, its sides bear a constant pressure, and a plate compresses it from above. The equilibrium of an increment is found
from the committed states of all RVEs: each iteration is one trial, and four more for the derivatives of the stress; the last one is accepted when forces are in
balance. All points are one law, gpu_rve.SmallStrainModel, on the flat arrays of programs that ask for all of them at once. Needs the packages gpu_rve, scikit-fem and numpy.
"""

import argparse
import pathlib
import time

import numpy as np
import skfem
from skfem.helpers import grad

import gpu_rve

WIDTH, HEIGHT = 0.05, 0.1    # [m]
PLANE = [0, 1, 3]    # xx, yy, sqrt(2) xy of Mandel's vectors; disks have no zz
ROOT_TWO = np.sqrt(2.0)


class Specimen:
    """Finite elements and the RVEs of their points. Lengths are those of the configuration at the beginning of an increment."""

    def __init__(self, packing, columns, rows, rate, substeps, rough=False, **options):
        mesh = skfem.MeshQuad.init_tensor(np.linspace(0, WIDTH, columns + 1), np.linspace(0, HEIGHT, rows + 1))
        self.mesh = mesh.with_boundaries({"bottom": lambda x: x[1] < 1e-9, "top": lambda x: x[1] > HEIGHT - 1e-9,
                                          "sides": lambda x: (x[0] < 1e-9) | (x[0] > WIDTH - 1e-9)})
        self.element = skfem.ElementVector(skfem.ElementQuadS2())
        self.basis = skfem.Basis(self.mesh, self.element, intorder=3)
        self.sides = skfem.FacetBasis(self.mesh, self.element, facets="sides", intorder=3)
        self.points = self.basis.X.shape[1] * self.mesh.nelements
        # so many DEM steps for an increment of axial strain at this rate; lengths are those at its beginning
        self.model = gpu_rve.SmallStrainModel([packing] * self.points, substeps, rotates=True, **options)
        self.batch = self.model.batch
        self.rate = rate
        self.displacement = self.basis.zeros()
        self.history = {name: np.zeros(self.points * length) for name, length in self.model.history_dim.items()}
        self.top = self.basis.get_dofs("top").all("u^2")
        self.held = np.concatenate([self.basis.get_dofs("bottom").all("u^2"), self.top])
        if rough:
            self.held = np.concatenate([self.held] + [self.basis.get_dofs(plate).all("u^1") for plate in ("bottom", "top")])
        else:    # one node of the bottom keeps the specimen where it is
            middle = np.argmin(np.hypot(self.mesh.p[0] - 0.5 * WIDTH, self.mesh.p[1]))
            self.held = np.concatenate([self.held, self.basis.nodal_dofs[:1, middle]])

    def increments(self, u):
        """1 + grad u at all points (n, 2, 2), of a displacement since the beginning of the increment."""
        g = np.asarray(self.basis.interpolate(u).grad)    # (2, 2, elements, points)
        return np.moveaxis(g.reshape(2, 2, -1), 2, 0) + np.eye(2)

    def evaluate(self, f, tangent=None):
        """Stresses of a trial from the accepted states, Mandel's (n, 4); what the law would remember of it is kept until the trial is accepted."""
        stress = np.zeros(self.points * 4)
        self.tried = {name: values.copy() for name, values in self.history.items()}
        self.model.evaluate(0.0, self.increment, (f - np.eye(2)).ravel(), stress, tangent, self.tried)
        return stress.reshape(-1, 4)

    def stresses(self, f):
        """Cauchy's (n, 2, 2); none if an RVE does not bear this."""
        try:
            xx, yy, _, xy = self.evaluate(f).T
        except gpu_rve.TrialFailed:
            return None
        return np.stack([np.stack([xx, xy / ROOT_TWO]), np.stack([xy / ROOT_TWO, yy])]).transpose(2, 0, 1)

    def consistent_tangent(self, f):
        """Derivative of the trial's stress by engineering strain (n, 3, 3)."""
        tangent = np.zeros(self.points * 16)
        self.evaluate(f, tangent)
        to_shear = np.array([1.0, 1.0, ROOT_TWO])
        return tangent.reshape(-1, 4, 4)[:, PLANE][:, :, PLANE] / np.outer(to_shear, to_shear)

    def fields(self, values):
        """Numbers at points as scikit-fem has them: (..., elements, points)."""
        return np.moveaxis(values, 0, -1).reshape(*values.shape[1:], self.mesh.nelements, -1)

    def forces(self, f, stress, pressure):
        """Internal forces minus those of the pressure on the sides: P : grad v with P = J sigma F^-T, and a pressure on the sides as they were."""
        first = np.einsum("n,nij,nkj->nik", np.linalg.det(f), stress, np.linalg.inv(f))

        @skfem.LinearForm
        def inner(v, w):
            return np.einsum("ij...,ij...->...", w["first"], grad(v))

        @skfem.LinearForm
        def outer(v, w):
            return -pressure * np.einsum("i...,i...->...", w.n, v)

        return inner.assemble(self.basis, first=self.fields(first)), outer.assemble(self.sides)

    def stiffness(self, tangent, stress):
        """Of the increment: C : D, and what a rotation and a stretch of the present stress add."""
        c, s = self.fields(tangent), self.fields(stress)

        @skfem.BilinearForm
        def form(u, v, w):
            l = grad(u)
            d = 0.5 * (l + np.swapaxes(l, 0, 1))
            spin = l - d
            strain = np.stack([d[0, 0], d[1, 1], 2 * d[0, 1]])
            rate = np.einsum("ab...,b...->a...", w["c"], strain)
            rate = np.stack([np.stack([rate[0], rate[2]]), np.stack([rate[2], rate[1]])])
            times = lambda a, b: np.einsum("ik...,kj...->ij...", a, b)
            nominal = (rate + times(spin, w["s"]) - times(w["s"], spin) + w["s"] * (l[0, 0] + l[1, 1])
                       - times(w["s"], np.swapaxes(l, 0, 1)))
            return np.einsum("ij...,ij...->...", nominal, grad(v))

        return form.assemble(self.basis, c=c, s=s)

    def balance(self, u, pressure):
        """Increments, stresses, forces out of balance, their size over that of the pressure's, and inner forces, at a displacement."""
        f = self.increments(u)
        stress = self.stresses(f)
        if stress is None:
            return f, None, None, np.inf, None
        inner, outer = self.forces(f, stress, pressure)
        lack = outer - inner
        return f, stress, lack, np.linalg.norm(np.delete(lack, self.held)) / np.linalg.norm(outer), inner

    def solve_increment(self, strain, pressure, tangent_of, tolerance, most):
        """Newton's iterations; returns the residuals over the forces of the pressure, and the axial stress. A step that makes the residual grow is
        halved: stresses of grains have kinks where contacts begin to slide."""
        self.increment = strain / self.rate
        u, plates = self.basis.zeros(), self.basis.zeros()
        plates[self.top] = -strain * HEIGHT
        f, stress, lack, _, _ = self.balance(u, pressure)
        residuals = []
        while not residuals or residuals[-1] > tolerance:
            if len(residuals) > most:
                raise RuntimeError("no equilibrium: " + ", ".join(f"{r:.1e}" for r in residuals))
            k = self.stiffness(tangent_of(self, f, stress), stress)
            change = skfem.solve(*skfem.condense(k, lack, x=plates if not residuals else self.basis.zeros(), D=self.held))
            for halvings in range(8):
                found = self.balance(u + 0.5**halvings * change, pressure)
                # the first step moves the plates, and is taken as a whole
                if found[3] < (residuals[-1] if residuals else np.inf):
                    break
            else:
                raise RuntimeError("no step lessens the residual of " + ", ".join(f"{r:.1e}" for r in residuals))
            u = u + 0.5**halvings * change
            f, stress, lack, residual, inner = found
            residuals.append(residual)
        # the last trial is that of the equilibrium: with this history the next one begins from it
        self.history = self.tried
        self.displacement += u
        return residuals, -np.sum(inner[self.top]) / WIDTH


def at_strains(file, strains):
    """Axial stresses of a curve at these strains, between its rows by straight lines."""
    curve = np.loadtxt(file, delimiter=",", skiprows=1)
    return np.interp(strains, curve[:, 0], curve[:, 1])


def main():
    folder = pathlib.Path(__file__).resolve().parent
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--packing", default=folder.parent / "packings" / "A_h0075.rve")
    parser.add_argument("--columns", type=int, default=2)
    parser.add_argument("--rows", type=int, default=4)
    parser.add_argument("--increments", type=int, default=20)
    parser.add_argument("--strain", type=float, default=0.01, help="axial, at the end [-]")
    parser.add_argument("--rate", type=float, default=0.1, help="axial, of the RVEs [1/s]")
    parser.add_argument("--substeps", type=int, default=300, help="DEM steps of an increment")
    parser.add_argument("--pressure", type=float, default=1e5, help="on the sides [Pa]")
    parser.add_argument("--rough", action="store_true", help="grains do not slide on the plates")
    parser.add_argument("--tangent", choices=("consistent", "elastic"), default="consistent")
    parser.add_argument("--tolerance", type=float, default=1e-4, help="out of balance over the forces of the pressure [-]")
    parser.add_argument("--out", default="curve.csv")
    parser.add_argument("--compare", help="a curve of the same specimen by the material point method (in.specimen)")
    arguments = parser.parse_args()

    packing = gpu_rve.Packing.read(arguments.packing)
    specimen = Specimen(packing, arguments.columns, arguments.rows, arguments.rate, arguments.substeps, arguments.rough, format="double")
    print(specimen.batch)
    increment = arguments.strain / arguments.increments
    bound = specimen.batch.time_steps().min()
    dt = increment / arguments.rate / arguments.substeps
    if dt > 0.9 * bound:
        raise SystemExit(f"the DEM time step would be {dt:.3g} s; it must be at most {0.9 * bound:.3g} s: use more --substeps or a larger --rate")
    if arguments.tangent == "consistent":
        tangent_of = lambda s, f, stress: s.consistent_tangent(f)
    else:
        elastic = specimen.batch.tangents()
        tangent_of = lambda s, f, stress: elastic
    rows, begin = [], time.perf_counter()
    for k in range(arguments.increments):
        residuals, axial = specimen.solve_increment(increment, arguments.pressure, tangent_of, arguments.tolerance, 40)
        strain = (k + 1) * increment
        rows.append((strain, axial, len(residuals)))
        print(f"{k + 1:4d}  strain {strain:.4f}  axial stress {axial:11.1f} Pa  residuals " + " ".join(f"{r:.1e}" for r in residuals), flush=True)
    np.savetxt(arguments.out, rows, delimiter=",", header="axial strain [-],axial stress [Pa],iterations", comments="")
    if arguments.compare:
        # each increment is one of the height as it is
        strains, axial = -np.log1p(-increment) * np.arange(1, len(rows) + 1), np.array(rows)[:, 1]
        other = at_strains(arguments.compare, strains)
        print("axial stress by the material point method over that by finite elements, minus one:")
        for strain, difference in zip(strains, other / axial - 1):
            print(f"      strain {strain:.4f}  {100 * difference:+.2f} %")
    print(f"{specimen.model.trials} trials of {specimen.points} RVEs, {time.perf_counter() - begin:.1f} s")


if __name__ == "__main__":
    main()
