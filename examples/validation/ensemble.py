#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Runs RVEs with packings of different seeds through the tests, each test in one batch, and writes curves, their mean and their scatter.

    python3 ensemble.py                                       16 seeds, 400 grains, uniaxial, shear and biaxial to 15 %
    python3 ensemble.py --tests biaxial --seeds 100 --device cuda
    python3 ensemble.py --short                               8 seeds, 150 grains, biaxial to 5 %: seconds

Writes ensemble.<test>.csv: strain, and for q/p, p, volumetric strain, void ratio and coordination number the mean, the standard deviation and the
curve of each seed. Strains are rate times time: logarithmic, F_xy in shear.

Checks: (1) the curves of SudoDEM2D and YADE, whose packing is none of these, lie in the band of the ensemble; (2) characteristic numbers
agree with those of a separate prototype with its own eight packings; (3) an RVE has the same bits alone as in the batch. Exit status 1 if a
check fails, 2 if a run does.
"""

import math
import os

import numpy as np

import element
import harness

QUANTITIES = ("ratio", "p", "volume", "void_ratio", "coordination")
LABELS = {"ratio": "q/p [-]", "p": "p [Pa]", "volume": "volumetric strain [-]", "void_ratio": "void ratio [-]", "coordination": "coordination number [-]"}
BLOCK = 0.001          # strain over which peaks are averaged
CODE_BLOCK = 0.005     # strain over which other codes are compared
LEAST_SEEDS = 8

# A prototype that shares nothing with this package, with eight packings of its own, made by the same protocol, and a time step of 1e-4 s: mean and standard
# deviation over its packings, or None and their range. It was not validated itself: a disagreement asks which of the two is right.
OTHER_SEEDS = 8
OTHER = {
    "void ratio at 100 kPa": (0.1645, 0.003),
    "coordination number at 100 kPa": (4.35, 0.03),
    "biaxial: peak q/p": (0.487, 0.022),
    "biaxial: strain at the peak": (None, (0.023, 0.041)),
    "biaxial: largest contraction": (-0.0101, 0.0008),
    "biaxial: volumetric strain at 15 %": (0.036, 0.006),
    "biaxial: q/p from 12 to 15 %": (0.303, 0.020),
    "biaxial: void ratio at 15 %": (None, (0.195, 0.219)),
    "shear: peak q/p": (0.494, 0.020),
    "shear: p at 15 % [kPa]": (None, (220.0, 269.0)),
    "uniaxial: largest q/p": (None, (0.43, 0.48)),
    "uniaxial: p at 15 % [MPa]": (None, (1.29, 1.36)),
}
# how many standard errors of a difference, or standard deviations of a single packing, are taken for chance
SIGMAS = 3.0


class Ensemble:
    """Curves of a test: arrays by row and seed."""

    def __init__(self, path, rate):
        times, rows = [], []
        with open(path) as stream:
            lines = iter(stream)
            for line in lines:
                if line.startswith("ITEM: TIMESTEP"):
                    times.append(int(next(lines)))
                    rows.append([])
                elif not line.startswith("ITEM") and len(line.split()) == 8:
                    rows[-1].append([float(word) for word in line.split()])
        data = np.array(rows)
        self.text = rows
        self.strain = np.array(times) * rate
        p, q, e, z, fxx, fyy, fxy = np.moveaxis(data[:, :, 1:], 2, 0)
        self.ratio, self.p, self.void_ratio, self.coordination = q / p, p, e, z
        self.volume = fxx * fyy - 1.0
        self.seeds = data.shape[1]

    def blocks(self, name, width):
        """Ends and means of a quantity over pieces of strain; the piece k is (k width, (k + 1) width]."""
        piece = np.ceil(self.strain[1:] / width - 1e-6).astype(int)
        ends = np.unique(piece)
        return ends * width, np.array([getattr(self, name)[1:][piece == end].mean(axis=0) for end in ends])


def write_csv(path, ensemble, first):
    columns, names = [ensemble.strain], ["strain"]
    for name in QUANTITIES:
        values = getattr(ensemble, name)
        columns += [values.mean(axis=1), values.std(axis=1, ddof=1)] + list(values.T)
        names += [f"{name} mean", f"{name} deviation"] + [f"{name} seed {first + k}" for k in range(ensemble.seeds)]
    np.savetxt(path, np.array(columns).T, delimiter=",", header=",".join(names), comments="", fmt="%.7g")


def check_codes(check, test, ensemble, strain_end):
    """Means over pieces of strain of the other codes' curves in the band of the ensemble."""
    quantities = {"uniaxial": ("ratio", "p"), "shear": ("ratio", "p"), "biaxial": ("ratio", "volume")}[test]
    for code in ("sudodem2d", "yade"):
        curve = element.read_reference(code, "A_h0075", test)
        strain = (curve.step - 1) * element.DT * element.RATE
        curve.volume = (1.0 + curve.void_ratio) / (1.0 + element.VOID_RATIO["A_h0075"]) - 1.0
        for name in quantities:
            ends, values = ensemble.blocks(name, CODE_BLOCK)
            worst, where = 0.0, 0.0
            for end, row in zip(ends, values):
                piece = (strain > end - CODE_BLOCK) & (strain <= end)
                if end > strain_end + 1e-9 or not piece.any():
                    continue
                # a further packing differs from the mean of n by this
                spread = row.std(ddof=1) * math.sqrt(1.0 + 1.0 / len(row))
                away = abs(getattr(curve, name)[piece].mean() - row.mean()) / spread
                if away > worst:
                    worst, where = away, end
            check(worst <= SIGMAS, f"{test}: {LABELS[name]} of {code}: at most {worst:.1f} standard deviations from the mean (at {100 * where:.1f} %),"
                         f" {SIGMAS:.0f} allowed")


def numbers(test, ensemble):
    """Characteristic numbers of the test, by seed."""
    ends, ratio = ensemble.blocks("ratio", BLOCK)
    last = ensemble.strain[-1]
    found = {}
    if test == "biaxial":
        found["void ratio at 100 kPa"] = ensemble.void_ratio[0]
        found["coordination number at 100 kPa"] = ensemble.coordination[0]
        found["biaxial: strain at the peak"] = ends[ratio.argmax(axis=0)] - 0.5 * BLOCK
        found["biaxial: largest contraction"] = ensemble.volume.min(axis=0)
    found[f"{test}: {'largest' if test == 'uniaxial' else 'peak'} q/p"] = ratio.max(axis=0)
    if last > 0.1499:
        if test == "biaxial":
            found["biaxial: q/p from 12 to 15 %"] = ratio[ends > 0.12 + 1e-9].mean(axis=0)
            found["biaxial: volumetric strain at 15 %"] = ensemble.volume[-1]
            found["biaxial: void ratio at 15 %"] = ensemble.void_ratio[-1]
        else:
            unit, size = ("MPa", 1e6) if test == "uniaxial" else ("kPa", 1e3)
            found[f"{test}: p at 15 % [{unit}]"] = ensemble.p[-1] / size
    return found


def check_numbers(check, found):
    print(f"\n      {'':38}{'mean':>9}{'deviation':>11}{'least':>9}{'most':>9}    prototype")
    for name, values in found.items():
        mean, deviation = values.mean(), values.std(ddof=1)
        other, spread = OTHER[name]
        if other is None:
            passed, text = spread[0] <= mean <= spread[1], f"{spread[0]:g} to {spread[1]:g}"
        else:
            error = math.sqrt(deviation**2 / len(values) + spread**2 / OTHER_SEEDS)
            passed, text = abs(mean - other) <= SIGMAS * error, f"{other:g} +- {spread:g}: {abs(mean - other) / error:.1f} standard errors"
        check(passed, f"{name:38}{mean:9.4g}{deviation:11.2g}{values.min():9.4g}{values.max():9.4g}    {text}")


def draw(path, ensembles):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    panels = [(test, name) for test in ensembles for name in (("ratio", "volume") if test == "biaxial" else ("ratio", "p"))]
    figure, axes = plt.subplots(2, len(ensembles), figsize=(4.4 * len(ensembles), 6.4), squeeze=False)
    for k, (test, name) in enumerate(panels):
        ax, ensemble = axes[k % 2, k // 2], ensembles[test]
        values, strain = getattr(ensemble, name), 100 * ensemble.strain
        mean, deviation = values.mean(axis=1), values.std(axis=1, ddof=1)
        ax.plot(strain, values, color="0.75", lw=0.4)
        ax.fill_between(strain, mean - deviation, mean + deviation, color="tab:blue", alpha=0.25, lw=0, label="one standard deviation")
        ax.plot(strain, mean, color="tab:blue", lw=1.6, label=f"mean of {ensemble.seeds} packings")
        for code, style in (("sudodem2d", "--"), ("yade", ":")):
            curve = element.read_reference(code, "A_h0075", test)
            curve.volume = (1.0 + curve.void_ratio) / (1.0 + element.VOID_RATIO["A_h0075"]) - 1.0
            ax.plot(100 * (curve.step - 1) * element.DT * element.RATE, getattr(curve, name), "k" + style, lw=0.9,
                    label={"sudodem2d": "SudoDEM2D", "yade": "YADE"}[code] + ", A_h0075")
        ax.set_title(f"{test}: {LABELS[name]}", fontsize=10)
        ax.set_xlabel("shear strain [%]" if test == "shear" else "axial strain [%]")
        ax.set_xlim(0, strain[-1])
    axes[0, 0].legend(fontsize=7, loc="lower right")
    figure.tight_layout()
    figure.savefig(path, dpi=75)


def main():
    parser = harness.new_parser(__doc__, "8 seeds, 150 grains, biaxial to 5 %%; characteristic numbers are printed, not checked", figure=True)
    parser.add_argument("--tests", nargs="+", choices=element.TESTS, default=list(element.TESTS))
    parser.add_argument("--seeds", type=int, default=16, help="number of RVEs, at least 8")
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--grains", type=int, default=400)
    parser.add_argument("--strain", type=float, default=0.15)
    parser.add_argument("--format", choices=("fast", "mixed", "double"), default="mixed")
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")
    parser.add_argument("--threads", type=int, default=0, help="CPU threads (0: as OpenMP decides)")
    parser.add_argument("--reuse", action="store_true", help="take packings and curves that are in the folder already")
    options = harness.parse_arguments(parser, __file__)
    if options.short:
        options.tests, options.seeds, options.grains, options.strain = ["biaxial"], 8, 150, 0.05
    if options.seeds < LEAST_SEEDS:
        parser.error(f"--seeds is {options.seeds}; a mean and a scatter need at least {LEAST_SEEDS}")
    if options.first < 0 or options.grains < 50 or not 0.005 <= options.strain <= 0.2:
        parser.error("--first must be at least 0, --grains at least 50, --strain from 0.005 to 0.2")
    check = harness.Checks()
    rate = element.DT * 10 * element.RATE    # strain per LAMMPS step of in.ensemble
    common = dict(grains=options.grains, format=options.format, device=options.device, threads=options.threads, strain=options.strain,
                  rows=round(options.strain / 0.0002))

    ensembles, found = {}, {}
    for k, test in enumerate(options.tests):
        path = os.path.join(options.dir, "curves." + test)
        if not (options.reuse and os.path.exists(path)):
            have = all(os.path.exists(os.path.join(options.dir, f"packing.{options.first + n}.rve")) for n in range(options.seeds))
            make = "no" if k > 0 or (options.reuse and have) else "yes"
            harness.run_lmp(options, "in.ensemble", test, test=test, seeds=options.seeds, first=options.first, make=make, **common)
        ensembles[test] = ensemble = Ensemble(path, rate)
        write_csv(os.path.join(options.dir, f"ensemble.{test}.csv"), ensemble, options.first)
        found.update(numbers(test, ensemble))
        check_codes(check, test, ensemble, options.strain)

    test = options.tests[-1]
    harness.run_lmp(options, "in.ensemble", "alone", test=test, seeds=1, first=options.first + 1, make="no", **common)
    alone = Ensemble(os.path.join(options.dir, "curves.alone"), rate)
    same = [row[1][1:] for row in ensembles[test].text] == [row[0][1:] for row in alone.text]
    check(same, f"{test}: seed {options.first + 1} alone has the curve that it has in the batch of {options.seeds}, digit by digit")

    if options.short:
        print(f"\n{'':38}{'mean':>9}{'deviation':>11}")
        for name, values in found.items():
            print(f"{name:38}{values.mean():9.4g}{values.std(ddof=1):11.2g}")
    else:
        check_numbers(check, found)
    if options.figure:
        draw(options.figure, ensembles)
    check.exit()


if __name__ == "__main__":
    main()
