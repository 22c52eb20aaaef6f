#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws the files of in.biaxial_specimen and study.biaxial_specimen: curves and shear bands. The script prints the angle of the band and those
of Coulomb and Roscoe.

    python3 plot_biaxial_specimen.py                       curve.smooth and fields.smooth (in.biaxial_specimen writes them), and rough if they exist
    python3 plot_biaxial_specimen.py smooth                these only
    python3 plot_biaxial_specimen.py --check smooth        prints the numbers; the exit status is 0 if they are physical

The angle of a band to the least principal stress, which is horizontal, lies between 45 deg + psi/2 (Roscoe) and 45 deg + phi/2 (Coulomb), with the mobilized
angles at the peak: sin phi = (s1 - s3) / (s1 + s3), sin psi = - d eps_v / d gamma of the specimen. The angle comes from a line through the centres of the band in the
columns of points, before the deformation, its error from their scatter. Needs numpy, for pictures matplotlib.
"""

import argparse
import pathlib
import sys

import numpy as np

WINDOW = 7             # rows of a curve over which slopes are taken
WINDOW_ACROSS = 2.0    # points to each side of a band
LEAST_COLUMNS = 5      # of points, for the angle of a band


def read_fields(path):
    """The columns of a dump with one frame."""
    with open(path, encoding="utf-8") as file:
        lines = file.read().split("ITEM: ATOMS ")[1].splitlines()
    values = np.array([line.split() for line in lines[1:]], dtype=float)
    return dict(zip(lines[0].split(), values.T))


def strip_of(x, y, strain, spacing):
    """Slope and height at x = 0 of the straight strip, two points wide and across half of the width at least, that stands out most of the mean."""
    width = np.ptp(x) + spacing
    excess = strain - strain.mean()
    best = (-np.inf, 0.0, 0.0)
    for degrees in np.arange(30.0, 76.0, 2.0):
        for sign in (-1.0, 1.0):
            a = np.radians(degrees)
            along, across = np.cos(a) * x + sign * np.sin(a) * y, -sign * np.sin(a) * x + np.cos(a) * y
            for offset in np.arange(across.min(), across.max(), 0.25 * spacing):
                weight = np.clip(2.0 - np.abs(across - offset) / spacing, 0.0, 1.0)
                inside = weight > 0.0
                if not inside.any() or np.ptp(along[inside]) * np.cos(a) < 0.5 * width:
                    continue
                best = max(best, ((weight * excess).sum() / np.sqrt((weight**2).sum()), sign * np.tan(a), offset / np.cos(a)))
    return best[1:]


def band_of(x, y, strain, spacing):
    """Inclination [deg] of the shear band, its standard error [deg], and the mean strain two points across it over that of all points.

    From the strip that stands out most: in each column of points the centre of the strain above its median, two points to both sides of the band, and a line through
    these centres, again until it stays. Columns in which a plate cuts this window are left out. The scatter of the centres about the line gives the error."""
    slope, height = strip_of(x, y, strain, spacing)
    column = np.floor(x / spacing + 1e-6).astype(int)
    middle = (np.arange(column.max() + 1) + 0.5) * spacing
    excess = np.clip(strain - np.median(strain), 0.0, None)
    top = y.max() + 0.5 * spacing
    error = np.inf
    for _ in range(50):
        centre, reach = height + slope * middle, WINDOW_ACROSS * spacing * np.hypot(1.0, slope)
        above = y - centre[column]
        weight = np.clip((reach - np.abs(above)) / spacing + 0.5, 0.0, 1.0) * excess
        total = np.bincount(column, weight)
        whole = (total > 0.0) & (centre - reach > -0.25 * spacing) & (centre + reach < top + 0.25 * spacing)
        if whole.sum() < LEAST_COLUMNS:
            error = np.inf
            break
        off = np.bincount(column, weight * above)[whole] / total[whole]
        place = middle[whole] - middle[whole].mean()
        turn = (place * off).sum() / (place**2).sum()
        rest = off - off.mean() - turn * place
        error = np.sqrt((rest**2).sum() / (len(rest) - 2) / (place**2).sum()) / (1.0 + slope**2)
        height, slope = height + off.mean() - turn * middle[whole].mean(), slope + turn
        if abs(turn) < 1e-6:
            break
    inside = np.abs(y - height - slope * x) < spacing * np.hypot(1.0, slope)
    contrast = strain[inside].mean() / strain.mean() if inside.any() else 0.0
    return np.degrees(np.arctan(abs(slope))), np.degrees(error), contrast


def measured_bands(spacing=0.1, count=24, scatter=0.35):
    """Mean and standard deviation of the error of the angle [deg] for bands of known angles, 47 to 62 deg, and the root mean square of their own estimates.
    They are Gaussian with a standard deviation of one point; the strain of each point scatters by a factor."""
    draw_of = np.random.default_rng(1)
    columns = round(1.0 / spacing)
    x, y = ((axis.ravel() + 0.5) * spacing for axis in np.meshgrid(np.arange(columns), np.arange(2 * columns)))
    errors, estimates = [], []
    for _ in range(count):
        angle, height, sign = draw_of.uniform(47.0, 62.0), draw_of.uniform(0.75, 1.25), draw_of.choice([-1.0, 1.0])
        across = (y - height - sign * np.tan(np.radians(angle)) * (x - 0.5)) * np.cos(np.radians(angle)) / spacing
        strain = np.exp(-0.5 * across**2 + scatter * draw_of.standard_normal(len(x))) + 0.03 * np.exp(0.8 * draw_of.standard_normal(len(x)))
        found, error, _ = band_of(x, y, strain, spacing)
        errors.append(found - angle)
        estimates.append(error)
    return np.mean(errors), np.std(errors), np.sqrt(np.mean(np.square(estimates)))


def numbers_of(ending):
    """Of one run: what the pictures and the check say."""
    curve = np.loadtxt(f"curve.{ending}")
    axial, mobilized, volume = curve[:, 0], curve[:, 2], curve[:, 3]
    fields = read_fields(f"fields.{ending}")
    kernel = np.ones(WINDOW) / WINDOW
    smooth = np.convolve(mobilized, kernel, mode="valid")
    peak = int(np.argmax(smooth)) + WINDOW // 2
    # shear strain of the specimen: eps_1 - eps_3, with eps_3 from the volume
    shear = 2.0 * axial + volume
    lo, hi = max(0, peak - WINDOW), min(len(axial) - 1, peak + WINDOW)
    dilation = (volume[hi] - volume[lo]) / (shear[hi] - shear[lo])
    spacing = np.sqrt(1.0 * 2.0 / len(fields["x"]))
    angle, error, contrast = band_of(fields["x"] - fields["ux"], fields["y"] - fields["uy"], fields["eps_q"], spacing)
    phi, psi = np.degrees(np.arcsin(smooth.max())), np.degrees(np.arcsin(dilation))
    return {"curve": curve, "fields": fields, "peak": smooth.max(), "peak_strain": axial[peak], "end": mobilized[-2 * WINDOW:].mean(), "phi": phi, "psi": psi,
            "roscoe": 45.0 + 0.5 * psi, "coulomb": 45.0 + 0.5 * phi, "angle": angle, "error": error, "contrast": contrast, "spacing": spacing}


def say(ending, numbers):
    band = "{angle:.1f} +- {error:.1f} deg" if np.isfinite(numbers["error"]) else "about {angle:.0f} deg, which too few columns cross for a measurement,"
    print(("{}: peak (s1-s3)/(s1+s3) {peak:.3f} at {peak_strain:.3f}, {end:.3f} at the end; phi {phi:.1f} deg, psi {psi:.1f} deg; band at " + band + " with {contrast:.1f} "
           "times the mean strain (Roscoe {roscoe:.1f} deg, Coulomb {coulomb:.1f} deg)").format(ending, **numbers))


def check(ending):
    """Softens, and in a band between the angles of Roscoe and Coulomb, within twice the error of its measurement: its own estimate, or that of
    bands of known angles if that is larger."""
    numbers = numbers_of(ending)
    say(ending, numbers)
    mean, deviation, estimate = measured_bands(numbers["spacing"])
    print(f"bands of known angles: error {mean:.2f} deg in the mean, standard deviation {deviation:.2f} deg, estimated as {estimate:.2f} deg")
    tolerance = 2.0 * max(numbers["error"], deviation)
    return (abs(mean) < 0.5 * deviation and deviation < 1.0 and numbers["end"] < numbers["peak"] and numbers["contrast"] > 1.3 and numbers["psi"] > 0.0 and
            numbers["error"] < 1.5 and numbers["roscoe"] - tolerance < numbers["angle"] < numbers["coulomb"] + tolerance)


def words_of(ending):
    """Returns the words of a legend for the files of a run."""
    return {"smooth": "smooth plates", "rough": "rough plates"}.get(ending, ending.replace("_", " "))


def draw(runs, path, ratio_label, section):
    """Draws the curves of all runs, and for each run the strain in a section: section(numbers) returns x, height, strain, spacing and title."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(1, 2 + len(runs), figsize=(6.5 + 2.6 * len(runs), 3.8), width_ratios=[1.2, 1.2] + [0.9] * len(runs))
    for ending, numbers in runs.items():
        curve = numbers["curve"]
        axes[0].plot(100 * curve[:, 0], curve[:, 2], label=words_of(ending))
        axes[1].plot(100 * curve[:, 0], 100 * curve[:, 3], label=words_of(ending))
    for axis, label in zip(axes, (ratio_label, "volumetric strain, dilation positive [%]")):
        axis.set_xlabel("axial strain [%]")
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
        axis.legend(frameon=False)
    for axis, (ending, numbers) in zip(axes[2:], runs.items()):
        x, height, strain, spacing, title = section(numbers)
        marks = axis.scatter(x, height, c=strain, s=(330.0 * spacing / 2.0)**2 / 5.0, marker="s", cmap="viridis", vmin=0.0, vmax=np.quantile(strain, 0.98))
        axis.set_aspect("equal")
        axis.set_xlim(-0.3, 1.3)
        axis.set_ylim(0.0, 2.05)
        axis.set_title(words_of(ending) + title, fontsize=9)
        axis.set_axis_off()
        figure.colorbar(marks, ax=axis, shrink=0.6, label="deviatoric strain [-]")
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def section_of(numbers):
    """The whole specimen."""
    f = numbers["fields"]
    title = ": {angle:.1f}° ± {error:.1f}°" if np.isfinite(numbers["error"]) else ""
    return f["x"], f["y"], f["eps_q"], numbers["spacing"], title.format(**numbers)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("endings", nargs="*", help="of files, default: smooth and rough")
    parser.add_argument("--check", metavar="ENDING")
    parser.add_argument("--out", default="biaxial_specimen.png")
    arguments = parser.parse_args()
    if arguments.check:
        sys.exit(0 if check(arguments.check) else "not what is expected")
    endings = arguments.endings or [e for e in ("smooth", "rough") if pathlib.Path(f"curve.{e}").exists()]
    runs = {ending: numbers_of(ending) for ending in endings}
    for ending, numbers in runs.items():
        say(ending, numbers)
    draw(runs, arguments.out, "$(\\sigma_1-\\sigma_3)/(\\sigma_1+\\sigma_3)$ [-]", section_of)


if __name__ == "__main__":
    main()
