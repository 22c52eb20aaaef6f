#!/usr/bin/env python3
"""Curves of the biaxial specimen, its shear bands, and their angle beside those of Coulomb and Roscoe.

    python3 plot_biaxial_specimen.py                       of curve.smooth and fields.smooth, and of rough where they are
    python3 plot_biaxial_specimen.py --check smooth        prints the numbers and says by its exit status whether they are physical

The angle of a band to the least principal stress, which is horizontal, lies between 45 deg + psi/2 (Roscoe) and 45 deg + phi/2 (Coulomb), with the mobilized
angles at the peak: sin phi = (s1 - s3) / (s1 + s3), sin psi = - d eps_v / d gamma of the specimen. Needs numpy, for pictures matplotlib.
"""

import argparse
import pathlib
import sys

import numpy as np

WINDOW = 7    # rows of a curve over which slopes are taken


def read_fields(path):
    """The columns of a dump with one frame."""
    with open(path, encoding="utf-8") as file:
        lines = file.read().split("ITEM: ATOMS ")[1].splitlines()
    values = np.array([line.split() for line in lines[1:]], dtype=float)
    return dict(zip(lines[0].split(), values.T))


def band_angle(x, y, strain, spacing):
    """Inclination [deg] of the straight strip, two points wide, with the largest mean strain, and this mean over that of all points.
    Strips that cross less than half of the width do not count."""
    width = x.max() - x.min()
    best = (0.0, 0.0)
    for degrees in np.arange(30.0, 76.0, 1.0):
        for sign in (-1.0, 1.0):
            a = np.radians(degrees)
            along, across = np.cos(a) * x + sign * np.sin(a) * y, -sign * np.sin(a) * x + np.cos(a) * y
            for offset in np.arange(across.min(), across.max(), 0.5 * spacing):
                inside = np.abs(across - offset) < spacing
                if inside.any() and np.ptp(along[inside]) * np.cos(a) > 0.5 * width:
                    best = max(best, (strain[inside].mean(), degrees))
    return best[1], best[0] / strain.mean()


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
    angle, contrast = band_angle(fields["x"] - fields["ux"], fields["y"] - fields["uy"], fields["eps_q"], spacing)
    phi, psi = np.degrees(np.arcsin(smooth.max())), np.degrees(np.arcsin(dilation))
    return {"curve": curve, "fields": fields, "peak": smooth.max(), "peak_strain": axial[peak], "end": mobilized[-2 * WINDOW:].mean(), "phi": phi, "psi": psi,
            "roscoe": 45.0 + 0.5 * psi, "coulomb": 45.0 + 0.5 * phi, "angle": angle, "contrast": contrast, "spacing": spacing}


def say(ending, numbers):
    print("{}: peak (s1-s3)/(s1+s3) {peak:.3f} at {peak_strain:.3f}, {end:.3f} at the end; phi {phi:.1f} deg, psi {psi:.1f} deg; band at {angle:.0f} deg with {contrast:.1f} "
          "times the mean strain (Roscoe {roscoe:.1f} deg, Coulomb {coulomb:.1f} deg)".format(ending, **numbers))


def check(ending):
    """Softens, and in a band between the angles of Roscoe and Coulomb, within what a band two points wide leaves open."""
    numbers = numbers_of(ending)
    say(ending, numbers)
    # a strip of two points over the width of the specimen
    tolerance = np.degrees(2.0 * numbers["spacing"])
    return (numbers["end"] < numbers["peak"] and numbers["contrast"] > 1.3 and numbers["psi"] > 0.0 and
            numbers["roscoe"] - tolerance < numbers["angle"] < numbers["coulomb"] + tolerance)


def draw(runs, path, ratio_label, section):
    """Curves of all runs, and of each the strain in a section: section(numbers) is x, height, strain, spacing and title."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(1, 2 + len(runs), figsize=(6.5 + 2.6 * len(runs), 3.8), width_ratios=[1.2, 1.2] + [0.9] * len(runs))
    for ending, numbers in runs.items():
        curve = numbers["curve"]
        axes[0].plot(100 * curve[:, 0], curve[:, 2], label=ending)
        axes[1].plot(100 * curve[:, 0], 100 * curve[:, 3], label=ending)
    for axis, label in zip(axes, (ratio_label, "volumetric strain, dilation positive [%]")):
        axis.set_xlabel("axial strain [%]")
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
        axis.legend(frameon=False)
    for axis, (ending, numbers) in zip(axes[2:], runs.items()):
        x, height, strain, spacing, title = section(numbers)
        marks = axis.scatter(x, height, c=strain, s=(330.0 * spacing / 2.0)**2 / 5.0, marker="s", cmap="inferno", vmin=0.0, vmax=np.quantile(strain, 0.98))
        axis.set_aspect("equal")
        axis.set_xlim(-0.3, 1.3)
        axis.set_ylim(0.0, 2.05)
        axis.set_title(ending + title, fontsize=9)
        axis.set_axis_off()
        figure.colorbar(marks, ax=axis, shrink=0.6, label="deviatoric strain [-]")
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def section_of(numbers):
    """The whole specimen."""
    f = numbers["fields"]
    return f["x"], f["y"], f["eps_q"], numbers["spacing"], ": {:.0f}°".format(numbers["angle"])


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
