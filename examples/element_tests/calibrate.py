#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""GrainLearning finds the friction and the stiffness of grains from a biaxial test, with element_test.py as its model.

    python3 calibrate.py

The observation is a test that was made here, with a friction and a stiffness that GrainLearning does not see: so one knows what it should find. Each iteration of
its Bayesian filter asks for the tests of all samples of the parameters, which run as one batch. Exits with 0 if both parameters are found within --tolerance.

Needs grainlearning (PyPI), gpu_rve and lmp.
"""

import argparse
import os
import sys
import tempfile

import element_test
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
PATHS = os.path.join(HERE, "materials.paths")
PACKING = os.path.join("..", "packings", "A_h0075.rve")
NAMES = ["friction", "kn"]
LEAST, MOST = [0.1, 4e5], [0.7, 2e6]    # of the parameters [-], [force/length]
TRUTH = [0.42, 8e5]
STRAINS = np.linspace(2e-4, 8e-3, 40)    # at which a test is observed


def observed(parameters, options):
    """q/100 kPa, and the volumetric strain in thousandths, at STRAINS, for each row of parameters (n, 2, 40)."""
    tests = [element_test.Test(f"sample{k}", "biaxial", PACKING, {"friction": mu, "kn": stiffness, "kt": stiffness})
             for k, (mu, stiffness) in enumerate(parameters)]
    with tempfile.TemporaryDirectory() as out:
        element_test.run(tests, HERE, PATHS, out, options)
    rows = []
    for test in tests:
        if test.problem:
            raise element_test.Failure(f"friction {test.material['friction']}, kn {test.material['kn']}: {test.problem}")
        shear = test.columns["path_stage"] == 2
        strain, volume = (test.columns[name][shear] - test.columns[name][shear][0] for name in ("axial", "volumetric"))
        rows.append([np.interp(STRAINS, strain, test.columns["q"][shear]) / 1e5, np.interp(STRAINS, strain, volume) * 1e3])
    return np.array(rows)


def calibrate(options):
    """Friction and stiffness as GrainLearning finds them: those of the most probable sample of its last iteration, and the mean of the distribution."""
    from grainlearning import BayesianCalibration
    from grainlearning.dynamic_systems import DynamicSystem

    def run_samples(calibration):
        calibration.system.set_sim_data(observed(calibration.system.param_data, options))

    calibration = BayesianCalibration.from_dict({
        "num_iter": options.iterations, "callback": run_samples, "save_fig": -1,
        "system": {"system_type": DynamicSystem, "param_names": NAMES, "param_min": LEAST, "param_max": MOST, "num_samples": options.samples,
                   "obs_names": ["q", "volumetric"], "ctrl_name": "axial", "ctrl_data": STRAINS, "obs_data": observed([TRUTH], options)[0],
                   "sim_name": "biaxial", "sigma_tol": 1e-6},
        "inference": {"Bayes_filter": {"ess_target": 0.3, "scale_cov_with_max": True}, "sampling": {"max_num_components": 1, "n_init": 1, "random_state": 0, "slice_sampling": True}}})
    np.random.seed(0)
    calibration.run()
    system = calibration.system
    best = calibration.inference.param_data_list[calibration.num_iter - 1][int(np.argmax(calibration.inference.posterior))]
    return best, system.estimated_params[-1]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=16, help="tests of an iteration (default: 16)")
    parser.add_argument("--iterations", type=int, default=5, help="(default: 5)")
    parser.add_argument("--tolerance", type=float, default=0.03, help="of the mean, over the true value (default: 0.03)")
    element_test.add_run_options(parser)
    options = parser.parse_args()
    try:
        import grainlearning    # noqa: F401
    except ImportError:
        print("calibrate: there is no module grainlearning (pip install grainlearning)")
        sys.exit(2)
    try:
        best, mean = calibrate(options)
    except element_test.Failure as problem:
        print(f"calibrate: {problem}")
        sys.exit(2)
    found = True
    for name, truth, one, average in zip(NAMES, TRUTH, best, mean):
        error = abs(average / truth - 1.0)
        found = found and error <= options.tolerance
        print(f"{name}: true {truth:.4g}, found {average:.4g} (best sample {one:.4g}), {100 * error:.1f} %")
    print(f"{options.iterations} iterations of {options.samples} tests: {'found' if found else 'NOT found'} within {100 * options.tolerance:g} %")
    sys.exit(0 if found else 1)


if __name__ == "__main__":
    main()
