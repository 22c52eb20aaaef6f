# SPDX-License-Identifier: GPL-2.0-only
"""The example element_test.py: laboratory tests against their baseline and their paths, its files
in other programs, and its errors.

    python3 element_test.py <lmp> <examples> <folder to write in>
"""

import csv
import os
import re
import shutil
import subprocess
import sys
import unittest
from unittest import mock

import h5py
import numpy as np

LMP, EXAMPLES, FOLDER = sys.argv[1:4]
SCRIPTS = os.path.join(EXAMPLES, "element_tests")
shutil.rmtree(FOLDER, ignore_errors=True)
os.makedirs(FOLDER)


def element_test(table, *words):
    """Runs the example and returns exit status and output."""
    done = subprocess.run([
        sys.executable,
        os.path.join(SCRIPTS, "element_test.py"), "--lmp", LMP, "--device", "cpu", table, *words
    ],
                          stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT,
                          universal_newlines=True)
    return done.returncode, done.stdout


def columns(out, name):
    with open(os.path.join(out, name + ".csv"), newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    return {column: np.array([float(row[column]) for row in rows]) for column in rows[0]}


def energy_errors(said):
    """Returns the largest energy error of each test over its rows."""
    return {
        name: float(error)
        for name, error in re.findall(r"^(\w+): .* energy error (\S+)$", said, re.M)
    }


def grainlearning_reads(file, pressure, kind):
    """Returns inputs, outputs and contact parameters by the reader of GrainLearning for its neural
    networks, which otherwise uses TensorFlow."""
    others = ["tensorflow", "tensorflow.keras", "wandb", "yaml"]
    with mock.patch.dict(sys.modules, {name: mock.MagicMock() for name in others}):
        from grainlearning.rnn.preprocessor import PreprocessorTriaxialCompression
    reader = PreprocessorTriaxialCompression(raw_data=file,
                                             pressure=pressure,
                                             experiment_type=kind,
                                             train_frac=0.5,
                                             val_frac=0.25,
                                             window_size=10,
                                             window_step=1,
                                             pad_length=0,
                                             standardize_outputs=False,
                                             add_e0=False,
                                             add_pressure=True,
                                             add_experiment_type=False)
    with h5py.File(file) as data:
        return reader._merge_datasets(data)


class Laboratory(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.out = os.path.join(FOLDER, "laboratory")
        cls.code, cls.said = element_test(os.path.join(SCRIPTS, "laboratory.csv"), "--out", cls.out)

    def test_has_not_changed(self):
        self.assertEqual(self.code, 0, self.said)
        self.assertIn("9 tests, 0 that failed or differ", self.said)

    def test_each_goes_the_way_that_its_path_says(self):
        tests = {
            name: columns(self.out, name)
            for name in ("k0", "drained", "undrained", "constant_p", "constant_b")
        }
        self.assertLess(np.abs(tests["k0"]["e_x"]).max(), 1e-12)
        for name in ("k0", "drained", "undrained", "constant_p", "constant_b"):
            # strain of a step is 8e-5
            self.assertAlmostEqual(tests[name]["axial"][-1], 0.02, delta=1e-4)
        self.assertLess(np.abs(tests["undrained"]["volumetric"]).max(),
                        1e-8)    # the dump has ten digits of F
        # At this rate the servo is within 2 % of the pressure; drained tests begin with the stress
        # of the packing.
        self.assertLess(np.abs(tests["drained"]["s_xx"][5:] / -1e5 - 1.0).max(), 0.02)
        self.assertLess(np.abs(tests["constant_p"]["p"] / 1e5 - 1.0).max(), 0.02)
        s = tests["constant_b"]
        b = (s["s_yy"] - s["s_xx"]) / (s["s_zz"] - s["s_xx"])
        self.assertLess(np.abs(b[10:] - 0.5).max(), 0.05)
        # Anisotropies of contacts and forces grow along the largest compression. q/p is close to
        # 2/5 (a_c + a_n + 3/2 a_t) (Guo and Zhao 2013, Comput. Geotech. 47, 1); the test uses |f_t|
        # instead of the direction of f_t, an upper bound of its part.
        d = tests["drained"]
        ratio = d["q"][-1] / d["p"][-1]
        self.assertGreater(d["a_c"][-1], 0.1)
        self.assertGreater(d["a_n"][-1], 0.5)
        self.assertAlmostEqual(0.4 * (d["a_c"][-1] + d["a_n"][-1]) / ratio, 0.85, delta=0.15)

    def test_isotropic_stresses_are_their_goals(self):
        s = columns(self.out, "isotropic")
        # The mean stress of a step meets the goal of its end, so that the end is half a step before
        # the ramp.
        step = 2e-4
        steered = (s["time"] > 0.0) & (s["time"] < 0.04 + 0.5 * step)
        goal = np.where(steered, 1e5 + 2e5 * (s["time"] + 0.5 * step) / 0.04,
                        np.where(s["time"] > 0.0, 3e5, 1e5))
        for name in ("s_xx", "s_yy", "s_zz"):
            self.assertLess(np.abs(s[name] / -goal - 1.0).max(), 1e-3, name)

    def test_the_circle_keeps_its_radius_and_p_and_closes(self):
        s = {
            name: values[columns(self.out, "circular")["path_stage"] == 2]
            for name, values in columns(self.out, "circular").items()
        }
        normal = np.stack([s["s_xx"], s["s_yy"], s["s_zz"]])
        deviator = normal - normal.mean(axis=0)
        self.assertLess(np.abs(np.linalg.norm(deviator, axis=0) / 2.4495e4 - 1.0).max(), 0.02)
        self.assertLess(np.abs(s["p"] / 1e5 - 1.0).max(), 0.01)
        # The deviator is in the deviatoric plane, along x and across it.
        angle = np.unwrap(
            np.arctan2((deviator[1] - deviator[2]) / np.sqrt(2.0),
                       np.sqrt(1.5) * deviator[0]))
        # The stage begins with its first row and ends half a step of the path ahead.
        self.assertGreaterEqual(abs(angle[-1] - angle[0]), 2.0 * np.pi)
        self.assertAlmostEqual(abs(angle[-1] - angle[0]),
                               2.0 * np.pi,
                               delta=2.0 * np.pi * 2e-4 / 0.06)

    def test_q_goes_from_limit_to_limit(self):
        s = columns(self.out, "cyclic")
        self.assertEqual(s["path_cycles"][-1], 3.0)
        self.assertGreaterEqual(len(s["time"]), 100)
        q = 0.5 * (s["s_xx"] + s["s_yy"]) - s["s_zz"]
        turns = np.flatnonzero(np.diff(s["path_cycles"])) + 1
        self.assertEqual(len(turns), 6)
        begins = np.concatenate([[0], turns])
        for k, (first, last) in enumerate(zip(begins, turns)):    # upwards first
            limit, reached = (6e4,
                              q[first:last + 1].max()) if k % 2 == 0 else (-3e4,
                                                                           q[first:last + 1].min())
            self.assertAlmostEqual(reached, limit, delta=0.05 * 9e4)

    def test_work_is_stored_or_lost_on_every_path_at_any_time(self):
        errors = energy_errors(self.said)
        self.assertEqual(len(errors), 9)
        for name, error in errors.items():
            self.assertLess(error, 1e-3, name)

    def test_work_of_cycles_between_limits_of_strain_is_stored_or_lost(self):
        table, out = os.path.join(FOLDER, "cycles.csv"), os.path.join(FOLDER, "cycles")
        with open(table, "w", encoding="utf-8") as stream:
            stream.write("name,path,packing\ncycles,cycles," +
                         os.path.join(os.path.abspath(EXAMPLES), "packings", "S500.rve") + "\n")
        with open(os.path.join(FOLDER, "cycles.paths"), "w", encoding="utf-8") as stream:
            stream.write(
                "path cycles stage rate xy 0.1 stress xx -1e5 stress yy -1e5 stress zz -1e5 "
                "reverse strain xy -1e-3 1e-3 until cycles > 2\n"
            )
        code, said = element_test(table, "--out", out, "--update", "--without", "hdf5", "--without",
                                  "picture")
        self.assertEqual(code, 0, said)
        s = columns(out, "cycles")
        # strain of a step after which events are checked; every fifth step has a row
        step = 0.1 * 2e-4
        self.assertAlmostEqual(s["e_xy"].max(), 1e-3, delta=5 * step)
        self.assertAlmostEqual(s["e_xy"].min(), -1e-3, delta=5 * step)
        self.assertGreater(s["loss_friction"][-1], 0.5 * s["work"][-1])
        self.assertLess(energy_errors(said)["cycles"], 1e-3)

    def test_the_file_of_all_is_read_by_h5py_and_by_grainlearning(self):
        file = os.path.join(self.out, "tests.h5")
        with h5py.File(file) as data:
            self.assertEqual(list(data), ["1e+05"])
            self.assertEqual(len(data["1e+05"]), 9)
            names = list(data.attrs["outputs"])
        inputs, outputs, parameters = grainlearning_reads(file, "1e+05", "drained")
        self.assertEqual((inputs.shape, outputs.shape), ((1, 200, 6), (1, 200, 7)))
        drained = columns(self.out, "drained")
        self.assertAlmostEqual(inputs[0, -1, 2], drained["e_z"][-1], 6)
        self.assertAlmostEqual(outputs[0, -1, names.index("q")], 1e-6 * drained["q"][-1], 6)
        self.assertIn(0.1, parameters[0])    # pressure in MPa
        self.assertTrue(np.isfinite(parameters).all())

    def test_the_picture_is_drawn(self):
        with open(os.path.join(self.out, "curves.png"), "rb") as picture:
            self.assertEqual(picture.read(8), b"\x89PNG\r\n\x1a\n")


class Materials(unittest.TestCase):
    def run_changed(self, old, new, *words):
        with open(os.path.join(SCRIPTS, "materials.csv"), encoding="utf-8") as stream:
            table = stream.read()
        self.assertIn(old, table)
        file = os.path.join(FOLDER, "changed.csv")
        with open(file, "w", encoding="utf-8") as stream:
            stream.write(
                table.replace(old, new).replace("../packings", os.path.join(EXAMPLES, "packings")))
        return element_test(file, "--paths", os.path.join(SCRIPTS, "materials.paths"), "--baseline",
                            os.path.join(SCRIPTS, "materials.baseline"), *words)

    def test_have_not_changed(self):
        code, said = self.run_changed("name", "name")
        self.assertEqual(code, 0, said)
        inputs, _, parameters = grainlearning_reads(os.path.join(FOLDER, "changed.out", "tests.h5"),
                                                    "1e+05", "biaxial")
        self.assertEqual(inputs.shape, (6, 200, 3))
        with h5py.File(os.path.join(FOLDER, "changed.out", "tests.h5")) as data:
            friction = list(data.attrs["contact_params"]).index("friction")
        np.testing.assert_array_equal(parameters[:, friction], [0.2, 0.2, 0.35, 0.35, 0.5, 0.5])

    def test_a_changed_friction_is_seen(self):
        code, said = self.run_changed("A_h0075.rve,0.35,5e5", "A_h0075.rve,0.36,5e5", "--without",
                                      "hdf5", "--without", "picture")
        self.assertEqual(code, 1, said)
        self.assertRegex(
            said, r"mu035_k05: .*\n    axial differs by|mu035_k05: .*\n    volumetric differs by")
        self.assertIn("6 tests, 1 that failed or differ", said)

    def test_what_is_wrong_is_said_before_anything_runs(self):
        for old, new, message in (("mu020_k05,biaxial", "mu020_k05,triaxial",
                                   "has no path 'triaxial'; it has biaxial"),
                                  ("A_h0075.rve,0.2,5e5", "B_h0075.rve,0.2,5e5",
                                   "there is no packing"), ("friction,kn", "fricton,kn", "fricton"),
                                  ("0.2,5e5", "-0.2,5e5", "friction"), ("0.2,5e5", "much,5e5",
                                                                        "is no number"),
                                  ("mu020_k10", "mu020_k05", "is taken by a test before"),
                                  ("name,path", "name,way", "has no column path")):
            code, said = self.run_changed(old, new)
            self.assertEqual(code, 2, said)
            self.assertIn(message, said)

    def test_one_that_does_not_end_is_named(self):
        code, said = self.run_changed("name", "name", "--most", "300")
        self.assertEqual(code, 1, said)
        self.assertIn("it has not ended in 300 steps", said)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
