#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Strength of packings against the rolling friction of their grains: biaxial compression of the same packings.

    python3 rolling.py                       8 packings of 400 grains, nine coefficients, to 15 %: five minutes
    python3 rolling.py --short               8 packings of 150 grains, two coefficients, to 3 %: seconds
    python3 rolling.py --figure FILE.png

Prints a table of means and standard deviations over the packings. All coefficients have the same packings, so that differences between
coefficients are differences packing by packing.

Checks: (1) peak and residual q/p rise with the coefficient, and dilation with them; (2) they end to rise where contacts slide before they roll;
(3) a coefficient of 1e-4 changes q/p by no more than its share before the packing is chaotic; (4) the limit makes the strength, not the stiffness
of the spring. Exit status 1 if a check fails, 2 if a run does.
"""

import math
import os

import numpy as np

import element
import ensemble
import harness

COEFFICIENTS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
# A contact of equal grains of radius r carries the moment mu r f_n by friction before it slides, and mu_r r/2 f_n before it rolls: with the
# friction of 0.5 here, little can be gained beyond a coefficient of 1.
TINY = 1e-4
RESIDUAL = 0.12    # strain from which a residual value is a mean
STIFFNESS = 1e6    # of kn, kt and kr [N/m]
LAST_RISE = 0.05   # share of the rise that is taken for none
SIGMAS = 3.0       # standard errors of a mean difference that are taken for chance


class Biaxial:
    """The test with one coefficient: quantities by packing."""

    def __init__(self, options, coefficient, make=False, stiffness=STIFFNESS):
        name = f"{coefficient:g}.{stiffness:g}"
        harness.run_lmp(options, "in.ensemble", name, test="biaxial", seeds=options.seeds, grains=options.grains, strain=options.strain,
                        rows=round(options.strain / 0.0002), make="yes" if make else "no", device=options.device,
                        keywords=f"kr {stiffness:g} rolling_friction {coefficient:g}")
        self.curves = curves = ensemble.Ensemble(os.path.join(options.dir, "curves." + name), element.DT * 10 * element.RATE)
        ends, ratio = curves.blocks("ratio", ensemble.BLOCK)
        self.peak = ratio.max(axis=0)
        self.residual = ratio[ends > min(RESIDUAL, 0.8 * options.strain) + 1e-9].mean(axis=0)
        self.volume, self.void_ratio, self.coordination = curves.volume[-1], curves.void_ratio[-1], curves.coordination[-1]


def angle(ratio):
    """Friction angle [degrees]: q/p is its sine in the plane."""
    return math.degrees(math.asin(ratio.mean()))


def print_table(results):
    print(f"{'mu_r':>6}{'peak q/p':>16}{'angle':>7}{'residual q/p':>18}{'angle':>7}{'volume [%]':>16}{'void ratio':>18}{'Z':>7}")
    for coefficient, t in results.items():
        print(f"{coefficient:6g}" + text(t.peak, 16) + f"{angle(t.peak):7.1f}" + text(t.residual, 18) + f"{angle(t.residual):7.1f}"
              + text(100 * t.volume, 16, 2) + text(t.void_ratio, 18) + f"{t.coordination.mean():7.2f}")


def text(values, width, digits=3):
    return f"{values.mean():.{digits}f} +- {values.std(ddof=1):.{digits}f}".rjust(width)


def change(name, results, low, high):
    """Mean change of a quantity from one coefficient to another, packing by packing, and its standard error."""
    difference = getattr(results[high], name) - getattr(results[low], name)
    return difference.mean(), difference.std(ddof=1) / math.sqrt(len(difference))


def check_rise(check, name, results, low, high):
    mean, error = change(name, results, low, high)
    check(mean > SIGMAS * error, f"{name} rises by {mean:.4f} from mu_r {low:g} to {high:g}: {mean / error:.1f} standard errors, more than {SIGMAS:.0f} asked")


def check_same(check, what, name, results, low, high):
    mean, error = change(name, results, low, high)
    check(abs(mean) <= SIGMAS * error, f"{name} changes by {mean:.4f}, {abs(mean) / error:.1f} standard errors, {what}: {SIGMAS:.0f} allowed")


def draw(path, results):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 4))
    for (coefficient, test), color in zip(results.items(), plt.cm.viridis(np.linspace(0.0, 0.95, len(results)))):
        strain = 100 * test.curves.strain
        left.plot(strain, test.curves.ratio.mean(axis=1), color=color, lw=1, label=f"{coefficient:g}")
        middle.plot(strain, 100 * test.curves.volume.mean(axis=1), color=color, lw=1)
    left.set(xlabel="axial strain [%]", ylabel="q/p [-]", xlim=(0, strain[-1]), ylim=(0, None), title="mean of the packings")
    left.legend(title="$\\mu_r$", fontsize=8, ncol=3, loc="lower right")
    middle.set(xlabel="axial strain [%]", ylabel="volumetric strain, dilation positive [%]", xlim=(0, strain[-1]), title="mean of the packings")
    places = range(len(results))
    for name, marker in (("peak", "o"), ("residual", "s")):
        values = [getattr(test, name) for test in results.values()]
        right.errorbar(places, [v.mean() for v in values], [v.std(ddof=1) for v in values], fmt=marker + "-", ms=4, capsize=2, label=name)
    right.set(xlabel="rolling friction coefficient [-]", ylabel="q/p [-], sine of the friction angle", ylim=(0, None), title="bars: scatter of packings")
    right.set_xticks(places, [f"{c:g}" for c in results])
    right.legend(loc="lower right")
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def main():
    parser = harness.new_parser(__doc__, "8 packings of 150 grains, coefficients 0 and 0.2, to 3 %%", figure=True)
    parser.add_argument("--seeds", type=int, default=8, help="number of packings")
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")
    parser.add_argument("--threads", type=int, default=0, help="CPU threads (0: as OpenMP decides)")
    options = harness.parse_arguments(parser, __file__)
    options.grains, options.strain, coefficients = 400, 0.15, COEFFICIENTS
    if options.short:
        options.grains, options.strain, coefficients = 150, 0.03, (0.0, 0.2)
    check = harness.Checks()

    results = {c: Biaxial(options, c, make=c == coefficients[0]) for c in coefficients}
    print_table(results)
    print()
    if options.short:
        check_rise(check, "peak", results, 0.0, 0.2)
    else:
        for low, high in ((0.0, 0.02), (0.02, 0.05), (0.05, 0.1), (0.1, 0.2), (0.2, 0.5)):
            check_rise(check, "peak", results, low, high)
        for low, high in ((0.0, 0.2), (0.2, 1.0)):
            check_rise(check, "residual", results, low, high)
        check_rise(check, "volume", results, 0.0, 0.2)
        for name in ("peak", "residual"):
            rise, last = change(name, results, 0.0, 2.0)[0], change(name, results, 2.0, 5.0)[0]
            check(abs(last) <= LAST_RISE * rise, f"{name} changes by {last:.4f} from mu_r 2 to 5, {last / rise:.1%} of what it rises to 2; {LAST_RISE:.0%} allowed")
        # the spring decides how soon the limit is reached
        for factor in (0.25, 4.0):
            other = {**results, "other": Biaxial(options, 0.1, stiffness=factor * STIFFNESS)}
            check_same(check, f"with {factor:g} times the stiffness, mu_r 0.1", "residual", other, 0.1, "other")
    tiny = Biaxial(options, TINY)
    early = tiny.curves.strain <= 0.01
    difference = np.abs(tiny.curves.ratio - results[0.0].curves.ratio)[early].max()
    check(0.0 < difference <= 10 * TINY, f"mu_r {TINY:g} changes q/p by {difference:.1e} at most up to 1 % of strain, {10 * TINY:g} allowed and more than 0 asked")
    if options.figure:
        draw(options.figure, results)
    check.exit()


if __name__ == "__main__":
    main()
