# SPDX-License-Identifier: GPL-2.0-only
"""gpu-rve-check tests the installed library: it prepares a small packing, compresses it, compares
trials with committed states, and a GPU with the CPU. Without a GPU it prints why none is used."""

import sys

import numpy as np

from . import Batch, Error, Packing, api_version, release


def gpu_obstacle(packing: Packing) -> str:
    """Returns the reason why RVEs of this packing cannot run on a GPU; empty if they can."""
    try:
        Batch([packing], device="cuda")
    except Error as error:
        return str(error)
    return ""


def main() -> int:
    print(f"gpu_rve {release()}, interface {'.'.join(map(str, api_version()))}")
    packing = Packing.create(shape="disk",
                             grains=60,
                             seed=1,
                             radius=(0.0025, 0.005),
                             kn=1e6,
                             friction=0.5,
                             density=2650.0,
                             damping=0.3,
                             thickness=0.075,
                             mass_depth=0.075,
                             pressure=1e5)
    batch = Batch([packing] * 4)
    print(batch)
    dt = 0.5 * batch.time_steps().min()
    increments = np.eye(2) - 1e-4 * np.arange(4)[:, None, None] * np.eye(2)
    first, _ = batch.trial(increments, dt, 200)
    again, statuses = batch.trial(increments, dt, 200)
    batch.commit()
    p = batch["p"]
    if batch.device_number is None:
        print("no GPU:", gpu_obstacle(packing))
    elif not np.array_equal(first, Batch([packing] * 4, device="cpu").trial(increments, dt, 200)[0]):
        print("NOT in order: stresses of the GPU differ from those of the CPU")
        return 1
    print("mean stress after 0 to 0.03 % of compression:", ", ".join(f"{x:.4g}" for x in p))
    sound = np.array_equal(first, again) and not statuses.any() and bool(np.all(np.diff(p) > 0))
    print("in order"
          if sound else "NOT in order: trials differ, or pressure does not grow with compression")
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
