#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Bearing capacity factors of a rough circular footing on weightless ground, by slip lines.

    python3 slip_lines.py 20            N_q and N_c for a friction angle of 20 degrees
    python3 slip_lines.py 20 --strip    the same of a strip, for comparison with the closed form

The ground has the friction angle phi and no cohesion, and N_c = (N_q - 1)/tan(phi). The hoop stress
is the minor principal stress (Haar and von Karman; Cox, Eason & Hopkins 1961). The slip lines go from
the surface next to the footing through a fan at its edge to the axis. The width of the loaded surface
and the angle of the fan follow from the condition that the last line meets the axis where the major
principal stress is vertical (Martin 2005). Stresses are in units of the surcharge and lengths in units
of the radius; r points outwards, z down, and compression is positive.
"""

import argparse
import math


class SlipLines:
    """Points (r, z, p, psi) with p = (sigma_1 + sigma_3)/2 and the angle psi from z to sigma_1."""

    def __init__(self, phi, strip, points):
        self.phi, self.sine, self.half = phi, math.sin(phi), math.pi / 4 - phi / 2
        self.strip, self.points = strip, points

    def node(self, a, b):
        """Returns the intersection of the slip lines with dr/dz = tan(psi - half) through a and
        tan(psi + half) through b, by iteration with mean values along both."""
        sine, half, twice = self.sine, self.half, math.sin(2 * self.half)
        r, z, p, psi = ((x + y) / 2 for x, y in zip(a, b))
        for _ in range(100):
            psi_a, psi_b, p_a, p_b = (a[3] + psi) / 2, (b[3] + psi) / 2, (a[2] + p) / 2, (b[2] + p) / 2
            sin_a, cos_a = math.sin(psi_a - half), math.cos(psi_a - half)
            sin_b, cos_b = math.sin(psi_b + half), math.cos(psi_b + half)
            cross = sin_b * cos_a - sin_a * cos_b
            length_a = ((b[1] - a[1]) * sin_b - (b[0] - a[0]) * cos_b) / cross
            length_b = ((b[1] - a[1]) * sin_a - (b[0] - a[0]) * cos_a) / cross
            before = r, z, p, psi
            r, z = a[0] + length_a * sin_a, a[1] + length_a * cos_a
            hoop_a = hoop_b = 0.0    # from (sigma_r - sigma_theta)/r and tau/r in equilibrium
            if not self.strip:
                hoop_a = 4 * p_a * sine * length_a / (a[0] + r) * math.sin(psi_a) * math.sin(half)
                hoop_b = 4 * p_b * sine * length_b / (b[0] + r) * math.sin(psi_b) * math.sin(half)
            # -twice dp + 2 p sine dpsi = hoop along a, and twice dp + 2 p sine dpsi = -hoop along b
            slope_a, slope_b = 2 * p_a * sine, 2 * p_b * sine
            right_a = hoop_a - twice * a[2] + slope_a * a[3]
            right_b = -hoop_b + twice * b[2] + slope_b * b[3]
            psi = (right_a + right_b) / (slope_a + slope_b)
            p = (slope_a * psi - right_a) / twice
            if sum(abs(x - y) for x, y in zip(before, (r, z, p, psi))) < 1e-12 * p:
                break
        return r, z, p, psi

    def last_line(self, width, end):
        """Returns the points of the slip line from the edge on which psi begins with `end`."""
        sine, n = self.sine, self.points
        level = [(1 + width * k / n, 0.0, 1 / (1 - sine), math.pi / 2) for k in range(n + 1)]
        line = [level[0]]
        while len(level) > 1:    # the passive zone under the surface
            level = [self.node(a, b) for a, b in zip(level, level[1:])]
            line.append(level[0])
        for k in range(1, 2 * n + 1):    # the fan
            turn = (math.pi / 2 - end) * k / (2 * n)
            p = math.exp(2 * sine * turn / math.sin(2 * self.half)) / (1 - sine)
            new = [(1.0, 0.0, p, math.pi / 2 - turn)]
            for b in line[1:]:
                new.append(self.node(new[-1], b))
            line = new
        return line

    def solution(self):
        """Returns the last line for which r and psi of its end are zero, by Newton's method from
        the solution of a strip, or from an estimate for a circle."""
        ends = lambda unknown: self.last_line(*unknown)[-1][::3]
        norm = lambda residual: max(map(abs, residual))
        spiral = math.exp(math.pi / 2 * math.tan(self.phi)) / math.tan(self.half)
        unknown, small = (2 * spiral, 0.0) if self.strip else (0.88 * spiral, -0.4), 1e-6
        residual = ends(unknown)
        for _ in range(50):
            if norm(residual) < 1e-8:
                return self.last_line(*unknown)
            beside = ends((unknown[0] + small, unknown[1])), ends((unknown[0], unknown[1] + small))
            (a, c), (b, d) = ([(x - y) / small for x, y in zip(some, residual)] for some in beside)
            step = ((residual[1] * b - residual[0] * d) / (a * d - b * c),
                    (residual[0] * c - residual[1] * a) / (a * d - b * c))
            factor, best = min(1.0, 0.2 / norm(step)), norm(residual)
            while factor > 1e-6:    # shorter steps until the residual falls
                trial = unknown[0] + factor * step[0], unknown[1] + factor * step[1]
                residual = ends(trial)
                if norm(residual) < best:
                    break
                factor /= 2
            unknown = trial
        raise RuntimeError("the slip lines do not converge; try other --points")

    def bearing_capacity(self):
        """Returns the mean pressure: the vertical force on the last line over the area."""
        force = 0.0
        for a, b in zip(line := self.solution(), line[1:]):
            p, psi = (a[2] + b[2]) / 2, (a[3] + b[3]) / 2
            share = 1.0 if self.strip else a[0] + b[0]
            force += share * p * ((1 + self.sine * math.cos(2 * psi)) * (a[0] - b[0]) +
                                  self.sine * math.sin(2 * psi) * (b[1] - a[1]))
        return force


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("phi", type=float, help="friction angle [degrees], above 0 and up to 40")
    parser.add_argument("--strip", action="store_true")
    parser.add_argument("--points", type=int, default=20, help="of a slip line; the fan has twice as many")
    options = parser.parse_args()
    if not 0 < options.phi <= 40:
        parser.error(f"phi is {options.phi}; it must be above 0 and at most 40 degrees")
    phi = math.radians(options.phi)
    coarse, fine = (SlipLines(phi, options.strip, n).bearing_capacity()
                    for n in (options.points, 2 * options.points))
    best = fine + (fine - coarse) / 3    # the error is of second order
    print(f"N_q = {best:.3f} ({coarse:.3f}, {fine:.3f}), N_c = {(best - 1) / math.tan(phi):.3f}")


if __name__ == "__main__":
    main()
