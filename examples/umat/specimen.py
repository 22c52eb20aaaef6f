#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""A specimen of grains in OOFEM, a finite-element program of others, whose Abaqus interface calls rve_umat.cpp at its integration points.

    python3 specimen.py             plane strain, disks: four quadrilaterals, 1 % of compression in 20 increments, 40 seconds
    python3 specimen.py --spheres   triaxial compression, spheres: a brick, 0.2 % in 8 increments, a quarter of a minute

The sides bear a constant pressure, a smooth plate compresses the specimen from above. OOFEM's Newton iterations take the consistent tangent that the UMAT
gives. Needs the packages oofem and numpy, and librve_umat.so (README.md).
"""

import argparse
import os
import pathlib

import numpy as np
import oofem

PACKINGS = pathlib.Path(__file__).resolve().parent.parent / "packings"
# where OOFEM has the components 11, 22, 33, 12, 13, 23
ORDER = [0, 1, 2, 5, 4, 3]


def deck(spheres, umat, packing, properties, pressure, strain, increments, cells=2, tolerance=1e-4):
    """The text of OOFEM's input: a unit square of cells x cells, or one unit cube, on three smooth plates."""
    n = 1 if spheres else cells
    ticks = range(n + 1)
    nodes = [(x / n, y / n, z) for z in ((0, 1) if spheres else (0,)) for y in ticks for x in ticks]
    at = {place: k + 1 for k, place in enumerate(nodes)}

    def where(axis, value):
        return [k for place, k in at.items() if place[axis] == value]

    def corners(i, j, z):
        return [at[((i + a) / n, (j + b) / n, z)] for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]

    def words(numbers):
        return f"{len(numbers)} " + " ".join(map(str, numbers))

    if spheres:
        elements = ["lspace 1 nodes " + words(corners(0, 0, 1) + corners(0, 0, 0))]
        axis, load, sides = 2, "ConstantSurfaceLoad", [("elementboundaries", [1, 4], 0), ("elementboundaries", [1, 5], 1)]
    else:
        elements = [f"quad1planestrain {j * n + i + 1} nodes " + words(corners(i, j, 0)) for j in range(n) for i in range(n)]
        right = [word for j in range(n) for word in ((j + 1) * n, 2)]    # the second edge of the last element of a row
        axis, load, sides = 1, "ConstantEdgeLoad", [("elementedges", right, 0)]
    held = [k for k in range(3 if spheres else 2)]
    conditions, sets = [], [f"Set 1 elementranges {{(1 {len(elements)})}}"]

    def add(condition, members):
        sets.append(f"Set {len(sets) + 1} {members}")
        name, rest = condition
        conditions.append(f"{name} {len(conditions) + 1} {rest} set {len(sets)}")

    for a in held:
        add(("BoundaryCondition", f"loadTimeFunction 1 dofs 1 {a + 1} values 1 0"), "nodes " + words(where(a, 0)))
    add(("BoundaryCondition", f"loadTimeFunction 1 dofs 1 {axis + 1} values 1 {-strain / increments!r}"), "nodes " + words(where(axis, 1)))
    for kind, members, a in sides:
        components = [-pressure if b == a else 0.0 for b in held]
        add((load, f"loadType 3 loadTimeFunction 2 components {words(components)}"), f"{kind} {words(members)}")
    parts = ["specimen.out", "Specimen of grains",
             # in the first step, at time 0, the loads come and nothing moves
             f"NonLinearStatic nsteps {increments + 1} rtolv {tolerance!r} maxiter 20 controlmode 1 stiffMode 0 smtype 1 nmodules 0",
             "domain 3d" if spheres else "domain PlaneStrain", "OutputManager",
             f"ndofman {len(nodes)} nelem {len(elements)} ncrosssect 1 nmat 1 nbc {len(conditions)} nic 0 nltf 2 nset {len(sets)}"]
    parts += [f"node {k + 1} coords 3 {x!r} {y!r} {z!r}" for k, (x, y, z) in enumerate(nodes)]
    parts += elements
    parts += ["simplecs 1 thick 1.0 material 1 set 1",
              f'abaqususermaterial 1 d 2000 numstate 3 properties {words(properties)} umat "{umat}" name "{packing}"']
    parts += conditions
    parts += [f"PiecewiseLinFunction 1 t 2 0 {increments} f(t) 2 0 {increments}",
              # loads of OOFEM's NonLinearStatic are added from step to step: this one comes once
              f"PiecewiseLinFunction 2 t 3 0 0.5 {increments} f(t) 3 1 0 0"]
    return "\n".join(parts + sets) + "\n"


class Analysis:
    """An analysis that OOFEM makes step by step."""

    def __init__(self, text, file="specimen.in"):
        pathlib.Path(file).write_text(text, encoding="utf-8")
        self.problem = oofem.InstanciateProblem(oofem.OOFEMTXTDataReader(str(file)), oofem.problemMode.processor, 0, None, False)
        self.problem.init()
        self.problem.initMetaStepAttributes(self.problem.giveMetaStep(1))
        domain = self.problem.giveDomain(1)
        self.elements = [domain.giveElement(k + 1) for k in range(domain.giveNumberOfElements())]

    def step(self):
        self.problem.preInitializeNextStep()
        self.problem.giveNextStep()
        step = self.problem.giveCurrentStep(False)
        self.problem.initializeYourself(step)
        self.problem.solveYourselfAt(step)
        self.problem.updateYourself(step)
        self.problem.terminate(step)

    def at_points(self, kind):
        """A tensor at all integration points, as UMAT orders its components (n, 6)."""
        rows = []
        for element in self.elements:
            rule = element.giveDefaultIntegrationRulePtr()
            for k in range(rule.giveNumberOfIntegrationPoints()):
                values = oofem.FloatArray()
                element.giveIPValue(values, rule.getIntegrationPoint(k), kind, self.problem.giveCurrentStep(False))
                rows.append([values[i] for i in ORDER])
        return np.array(rows)

    @property
    def strains(self):
        """Shear strains are engineering strains."""
        return self.at_points(oofem.InternalStateType.IST_StrainTensor)

    @property
    def stresses(self):
        """Tension positive."""
        return self.at_points(oofem.InternalStateType.IST_StressTensor)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--spheres", action="store_true")
    parser.add_argument("--umat", default="./librve_umat.so")
    parser.add_argument("--pressure", type=float, default=1e5, help="on the sides [Pa]")
    parser.add_argument("--rate", type=float, help="axial strain rate of the RVEs [1/s]; default 0.1, of spheres 1")
    parser.add_argument("--strain", type=float, help="axial, at the end [-]; default 0.01, of spheres 0.002")
    parser.add_argument("--increments", type=int, help="default 20, of spheres 8")
    parser.add_argument("--out", default="curve.csv")
    arguments = parser.parse_args()

    packing, largest_step, axis, rate, strain, increments = ("S500", 2e-6, 2, 1.0, 0.002, 8) if arguments.spheres else ("A_h0075", 1e-5, 1, 0.1, 0.01, 20)
    rate, strain, increments = arguments.rate or rate, arguments.strain or strain, arguments.increments or increments
    os.environ.setdefault("GPU_RVE_UMAT_PACKINGS", str(PACKINGS))
    # a unit of OOFEM's time is an increment
    properties = [strain / increments / rate, largest_step, 1e-5, 0]
    analysis = Analysis(deck(arguments.spheres, arguments.umat, packing, properties, arguments.pressure, strain, increments))
    rows = []
    for _ in range(increments + 1):
        analysis.step()
        rows.append((-analysis.strains[:, axis].mean(), -analysis.stresses[:, axis].mean()))
    np.savetxt(arguments.out, rows, delimiter=",", header="axial strain [-],axial stress [Pa]", comments="")
    for row in rows:
        print("strain %.4f  axial stress %9.1f Pa" % row)


if __name__ == "__main__":
    main()
