#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws the first paths of a data set of make_data_set.py: shear strain and its stress ratio.

    python3 plot_data_set.py [paths.h5] [--paths 5] [--out paths.png]

The script needs h5py, numpy and matplotlib.
"""

import argparse

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", default="paths.h5")
    parser.add_argument("--paths", type=int, default=5)
    parser.add_argument("--out", default="paths.png")
    options = parser.parse_args()
    with h5py.File(options.file) as file:
        gradient, stress = file["deformation_gradient"][:options.paths], file["stress"][:options.paths]
    # compression positive; components of an isochoric direction
    strain = 0.5 * (gradient[:, :, 0, 0] - gradient[:, :, 1, 1])
    ratio = (stress[:, :, 0, 0] - stress[:, :, 1, 1]) / -(stress[:, :, 0, 0] + stress[:, :, 1, 1])
    shear = gradient[:, :, 0, 1] + gradient[:, :, 1, 0]
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
    for k in range(len(strain)):
        left.plot(100 * strain[k], 50 * shear[k], linewidth=1, label=f"path {k}")
        right.plot(100 * strain[k], ratio[k], linewidth=1)
    left.set(xlabel=r"$(\epsilon_{xx}-\epsilon_{yy})/2$ [%]", ylabel=r"$\epsilon_{xy}$ [%]", aspect="equal")
    right.set(xlabel=r"$(\epsilon_{xx}-\epsilon_{yy})/2$ [%]", ylabel=r"$(\sigma_{xx}-\sigma_{yy})/(2p)$")
    left.legend(frameon=False, fontsize=8)
    figure.savefig(options.out, dpi=90)
    print("wrote", options.out)


if __name__ == "__main__":
    main()
