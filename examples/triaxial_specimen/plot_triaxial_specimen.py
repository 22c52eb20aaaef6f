#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws the files of in.triaxial_specimen and study.triaxial_specimen: curves, and the deviatoric strain in the middle plane.

    python3 plot_triaxial_specimen.py                      curve.rough and fields.rough (in.triaxial_specimen writes them), and smooth if they exist
    python3 plot_triaxial_specimen.py rough                these only
    python3 plot_triaxial_specimen.py --check rough smooth prints the numbers; the exit status is 0 if they are physical

Needs numpy, for pictures matplotlib.
"""

import argparse
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "biaxial_specimen"))
from plot_biaxial_specimen import WINDOW, draw, read_fields  # noqa: E402


def numbers_of(ending):
    """Of one run: what the pictures and the check say."""
    curve = np.loadtxt(f"curve.{ending}")
    fields = read_fields(f"fields.{ending}")
    ratio = np.convolve(curve[:, 2], np.ones(WINDOW) / WINDOW, mode="valid")
    # radial displacement of the outermost points: at the ends, and halfway up
    x, y, z = (fields[name] for name in "xyz")
    radial = ((x - fields["ux"] - 0.5) * fields["ux"] + (y - fields["uy"] - 0.5) * fields["uy"])
    outer = np.maximum(np.abs(x - fields["ux"] - 0.5), np.abs(y - fields["uy"] - 0.5))
    outer = outer > outer.max() - 1e-6
    height = z - fields["uz"]
    ends = outer & ((height < height.min() + 1e-6) | (height > height.max() - 1e-6))
    middle = outer & (np.abs(height - 0.5 * (height.min() + height.max())) < 0.26 * np.ptp(height))
    return {"curve": curve, "fields": fields, "peak": ratio.max(), "end": curve[-2 * WINDOW:, 2].mean(), "volume": curve[-1, 3],
            "bulge": radial[middle].mean() / radial[ends].mean()}


def say(ending, numbers):
    print("{}: peak q/p {peak:.3f}, {end:.3f} at the end, volumetric strain {volume:.4f}; outward displacement halfway up over that at the ends {bulge:.2f}".format(ending, **numbers))


def check(rough, smooth):
    """Both soften and dilate; ends that are held make the specimen stronger, and it bulges; between smooth plates it hardly does."""
    r, s = numbers_of(rough), numbers_of(smooth)
    say(rough, r)
    say(smooth, s)
    # 6 sin phi / (3 - sin phi) between phi of 24 deg (loose) and 42 deg (dense)
    strengths = all(0.94 < n["peak"] < 1.73 and n["end"] < n["peak"] and n["volume"] > 0.0 for n in (r, s))
    return strengths and r["peak"] > s["peak"] and r["bulge"] > 1.5 and abs(s["bulge"] - 1.0) < 0.5 * (r["bulge"] - 1.0)


def section_of(numbers):
    """The plane of points nearest to the middle."""
    f = numbers["fields"]
    y = f["y"] - f["uy"]
    plane = np.abs(y - y[np.argmin(np.abs(y - 0.5))]) < 1e-6
    return f["x"][plane], f["z"][plane], f["eps_q"][plane], np.cbrt(2.0 / len(y)), ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("endings", nargs="*", help="of files, default: rough and smooth")
    parser.add_argument("--check", nargs=2, metavar=("ROUGH", "SMOOTH"))
    parser.add_argument("--out", default="triaxial_specimen.png")
    arguments = parser.parse_args()
    if arguments.check:
        sys.exit(0 if check(*arguments.check) else "not what is expected")
    endings = arguments.endings or [e for e in ("rough", "smooth") if pathlib.Path(f"curve.{e}").exists()]
    runs = {ending: numbers_of(ending) for ending in endings}
    for ending, numbers in runs.items():
        say(ending, numbers)
    draw(runs, arguments.out, "q/p [-]", section_of)


if __name__ == "__main__":
    main()
