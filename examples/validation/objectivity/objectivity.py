#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Objectivity: a rigid rotation of an RVE turns its stress and changes nothing else.

    python3 objectivity.py [--lmp path] [--short] [--figure FILE.png]

Packings at 20 kPa and 100 kPa are rotated with the lever arms of this package and with those of LAMMPS' granular styles; a sheared packing
is rotated to follow its stress tensor. Prints a table; exit status 1 if a check fails, 2 if a run does.
"""

import os
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import harness

RATE = 10.0    # [rad/s]


def spinning(source, target):
    """Copies a packing file with the spin of all grains set to RATE: the mean field does not drive spins, (23) of the paper."""
    in_grains = False
    with open(source) as lines, open(target, "w") as copy:
        for line in lines:
            words = line.split()
            if words and not line.startswith("#"):
                if in_grains and len(words) == 7 and words[0].isdigit():
                    line = " ".join(words[:6] + [repr(RATE)]) + "\n"
                else:
                    in_grains = words[0] == "grains"
                if words[0] == "checksum":
                    line = "checksum none\n"
            copy.write(line)


class Rotation:
    """Turns, pressure [Pa], deviatoric stress [Pa] and stress tensor [Pa] of one run."""

    def __init__(self, options, packing, arms, turns, name):
        harness.run_lmp(options, "in.rotation", name, packing=packing, arms=arms, turns=turns, rate=RATE)
        columns = np.loadtxt(os.path.join(options.dir, "rotation." + name)).T
        self.turns, self.p, self.q, sxx, syy, sxy, self.z = columns
        self.stress = np.array([[sxx, sxy], [sxy, syy]]).transpose(2, 0, 1)

    def drift(self):
        """Relative change of the pressure over the run."""
        return self.p[-1] / self.p[0] - 1.0

    def largest_change(self):
        return np.abs(self.p / self.p[0] - 1.0).max()

    def tensor_error(self):
        """Largest component of sigma - R sigma_0 R^T at any angle, over p."""
        first = 2.0 * np.pi * (self.turns - self.turns[0])
        r = np.array([[np.cos(first), -np.sin(first)], [np.sin(first), np.cos(first)]]).transpose(2, 0, 1)
        return np.abs(self.stress - r @ self.stress[0] @ r.transpose(0, 2, 1)).max() / self.p[0]

    def direction(self):
        """Direction of the largest tension (smallest compression) [degrees], continuous."""
        doubled = np.arctan2(2.0 * self.stress[:, 0, 1], self.stress[:, 0, 0] - self.stress[:, 1, 1])
        return np.degrees(0.5 * np.unwrap(doubled))


def draw(options, at20, at100, sheared):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.4))
    for axis, runs, title in ((axes[0], at20, "20 kPa"), (axes[1], at100, "100 kPa")):
        axis.plot(runs["lammps"].turns, runs["lammps"].p / 1e3, color="firebrick", label="arms of LAMMPS")
        axis.plot(runs["contact"].turns, runs["contact"].p / 1e3, color="k", label=r"arms $r - \delta/2$")
        axis.set(title=title, xlabel="turns", ylabel="p [kPa]")
        axis.legend(fontsize=8)
    axes[2].plot(360 * sheared.turns, sheared.stress[:, 0, 0] / 1e3, label=r"$\sigma_{xx}$")
    axes[2].plot(360 * sheared.turns, sheared.stress[:, 1, 1] / 1e3, label=r"$\sigma_{yy}$")
    axes[2].plot(360 * sheared.turns, sheared.stress[:, 0, 1] / 1e3, label=r"$\sigma_{xy}$")
    first, angle = sheared.stress[0], 2 * np.pi * (sheared.turns - sheared.turns[0])
    c, s = np.cos(angle), np.sin(angle)
    for expected in (c * c * first[0, 0] - 2 * c * s * first[0, 1] + s * s * first[1, 1],
                     s * s * first[0, 0] + 2 * c * s * first[0, 1] + c * c * first[1, 1],
                     c * s * (first[0, 0] - first[1, 1]) + (c * c - s * s) * first[0, 1]):
        axes[2].plot(360 * sheared.turns[::4], expected[::4] / 1e3, "k.", ms=2.5)
    axes[2].set(title="sheared packing", xlabel="angle [degrees]", ylabel="stress [kPa]", xticks=[0, 90, 180, 270, 360])
    axes[2].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(options.figure, dpi=100)


def main():
    options = harness.parse_arguments(harness.new_parser(__doc__, "a part that takes seconds", figure=True), __file__)
    check = harness.Checks()

    harness.run_lmp(options, "in.shear", "shear", packing=os.path.join(harness.PACKINGS, "A_h0075.rve"), sheared="sheared.rve")
    sources = {"20": os.path.join(harness.PACKINGS, "A20_h0075.rve"), "100": os.path.join(harness.PACKINGS, "A_h0075.rve"),
               "sheared": os.path.join(options.dir, "sheared.rve")}
    packing = {name: os.path.join(options.dir, f"spinning.{name}.rve") for name in sources}
    for name, source in sources.items():
        spinning(source, packing[name])

    turns = {"20": 1} if options.short else {"20": 1, "100": 10}
    runs = {name: {arms: Rotation(options, packing[name], arms, turns[name], f"{name}.{arms}") for arms in ("contact", "lammps")}
            for name in turns}
    sheared = Rotation(options, packing["sheared"], "contact", 0.25 if options.short else 1, "sheared")

    print(f"{'packing':>9} {'arms':>8} {'turns':>6} {'p before [Pa]':>14} {'p after [Pa]':>13} {'change':>10} {'largest':>10} {'Z':>6} {'Z after':>8}")
    for name, pair in runs.items():
        for arms, run in pair.items():
            print(f"{name + ' kPa':>9} {arms:>8} {turns[name]:>6} {run.p[0]:14.1f} {run.p[-1]:13.1f} {run.drift():+10.1e} "
                  f"{run.largest_change():10.1e} {run.z[0]:6.3f} {run.z[-1]:8.3f}")
    print(f"sheared: q/p {sheared.q[0] / sheared.p[0]:.3f}, turned by {360 * sheared.turns[-1]:.0f} degrees: direction of its stress by "
          f"{sheared.direction()[-1] - sheared.direction()[0]:.3f}; largest |sigma - R sigma_0 R^T| {sheared.tensor_error():.1e} p; "
          f"p by {sheared.drift():+.1e}, q by {sheared.q[-1] / sheared.q[0] - 1:+.1e}")

    # Arms that add up to the branch see no slip. What is left: the cell breathes by 8e-7 of its
    # area along each chord, 5 Pa at the bulk modulus of 6 MPa.
    for name, pair in runs.items():
        check.between(0.0, pair["contact"].largest_change(), 1e-4, f"{name} kPa, arms r - delta/2: largest change of p at any angle")
        check.between(-1e-4, pair["contact"].drift(), 1e-4, f"{name} kPa, arms r - delta/2: change of p after {turns[name]} turns")
    # the control: a slip of W delta per time adds up to the Coulomb limit, the sooner the larger the overlap
    check.between(0.02, runs["20"]["lammps"].drift(), 0.08, "20 kPa, arms of LAMMPS: p drifts within one turn")
    if not options.short:
        check.between(0.5, runs["100"]["lammps"].drift(), 1.2, "100 kPa, arms of LAMMPS: p drifts within ten turns")
    check.between(0.0, sheared.tensor_error(), 1e-4, "sheared packing: |sigma - R sigma_0 R^T|/p")
    if options.figure:
        draw(options, runs["20"], runs["100"], sheared)
    check.exit()


if __name__ == "__main__":
    main()
