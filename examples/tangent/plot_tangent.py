#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""The tangent of in.tangent along the test: a table, and tangent.png.

    python3 plot_tangent.py      (in the folder where in.tangent has run; needs python3-numpy, and python3-matplotlib for the picture)
"""

import numpy as np

COLUMNS = "strain ratio volume sliding young poisson anisotropy work_elastic least_elastic nonlinear_elastic work least acoustic angle nonlinear measured"
SOUND = 0.2    # a tangent whose C : D differs by more from the rate along D is of an RVE that rearranges under the probe


def read(path="curve.tangent"):
    rows = np.loadtxt(path, ndmin=2)
    test = dict(zip(COLUMNS.split(), rows.T))
    return {name: values[test["measured"] > 0] for name, values in test.items()}


def first_loss(test, name):
    """Strain at which a number is negative for the first time, among the tangents that are sound."""
    lost = (test[name] <= 0) & (test["nonlinear"] < SOUND)
    return test["strain"][lost][0] if lost.any() else None


def table(test):
    print("strain   q/p    sliding  E [MPa]  work2: elastic, loading, least [MPa]  acoustic [MPa^2]  normal from y [deg]")
    for k in range(4, len(test["strain"]), 5):
        t = {name: values[k] for name, values in test.items()}
        print(f"{100 * t['strain']:5.2f} %  {t['ratio']:.3f}  {t['sliding']:.3f}   {1e-6 * t['young']:6.2f}   {1e-6 * t['work_elastic']:6.2f} {1e-6 * t['work']:7.2f} {1e-6 * t['least']:7.2f}"
              f"           {1e-12 * t['acoustic']:7.2f}           {t['angle']:5.1f}")
    for name, words in (("least", "second-order work is lost along some strain"), ("acoustic", "ellipticity is lost"), ("work", "second-order work is lost along the loading")):
        strain = first_loss(test, name)
        print(f"{words}: " + (f"{100 * strain:.2f} %" if strain else "not in this test"))
    print(f"peak of q/p: {test['ratio'].max():.3f} at {100 * test['strain'][test['ratio'].argmax()]:.2f} %")


def draw(test):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    sound = test["nonlinear"] < SOUND
    strain = 100 * test["strain"]
    figure, axes = plt.subplots(1, 4, figsize=(15, 3.8), constrained_layout=True)
    axes[0].plot(strain, test["ratio"], label="q/p")
    axes[0].plot(strain, test["sliding"], label="sliding contacts")
    axes[0].set(ylim=(0, None))
    axes[1].plot(strain, 1e-6 * test["work_elastic"], label="elastic, along the loading")
    axes[1].plot(strain[sound], 1e-6 * test["work"][sound], label="loading, along the loading")
    axes[1].plot(strain[sound], 1e-6 * test["least"][sound], label="loading, least")
    axes[1].set(ylabel="second-order work [MPa]")
    axes[2].plot(strain[sound], 1e-12 * test["acoustic"][sound])
    axes[2].set(ylabel="least det of the acoustic tensor [MPa$^2$]")
    axes[3].plot(strain[sound], test["angle"][sound], ".")
    axes[3].set(ylabel="normal of the band from y [deg]", ylim=(0, 90))
    for one in axes:
        one.axhline(0, color="black", linewidth=0.6)
        loss = first_loss(test, "acoustic")
        if loss:
            one.axvline(100 * loss, color="firebrick", linestyle="--", linewidth=0.8)
        one.set(xlabel="axial strain [%]")
    for one in axes[:2]:
        one.legend()
    figure.savefig("tangent.png", dpi=100)


if __name__ == "__main__":
    test = read()
    table(test)
    draw(test)
