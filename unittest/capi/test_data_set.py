"""Data sets of random strain paths: read by h5py alone, the same for any batches and threads, what an RVE answers that goes the way of a path, and what is refused.

    python3 test_data_set.py <examples> <folder to write in>
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import unittest

import gpu_rve
import h5py
import numpy as np

EXAMPLES, FOLDER = sys.argv[1:3]
SCRIPT = os.path.join(EXAMPLES, "data_sets", "make_data_set.py")
PACKINGS = [os.path.join(EXAMPLES, "packings", name) for name in ("A_h0075.rve", "A20_h0075.rve")]
sys.path.insert(0, os.path.dirname(SCRIPT))
import make_data_set  # noqa: E402
shutil.rmtree(FOLDER, ignore_errors=True)
os.makedirs(FOLDER)


def make(name, *words):
    """Exit status, what was said, and the file."""
    file = os.path.join(FOLDER, name + ".h5")
    done = subprocess.run([sys.executable, SCRIPT, "--out", file, "--device", "cpu", "--digits", "float64", *words],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True)
    return done.returncode, done.stdout, file


def arrays(file):
    with h5py.File(file) as data:
        return {name: data[name][:] for name in data if isinstance(data[name], h5py.Dataset)}


WORDS = ["--samples", "60", "--piece", "2e-3", "--packing", *PACKINGS, "--vary", "friction", "0.2", "0.6", "--seed", "7", "--contacts"]


class Paths(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        code, said, cls.file = make("paths", "--paths", "7", "--threads", "1", *WORDS)
        assert code == 0, said
        cls.data = arrays(cls.file)

    def test_do_not_depend_on_batches_threads_and_parts(self):
        for name, words, rows in (("batches", ["--paths", "7", "--batch", "3", "--threads", "2"], slice(0, 7)), ("part", ["--paths", "3", "--first", "4"], slice(4, 7))):
            code, said, file = make(name, *words, *WORDS)
            self.assertEqual(code, 0, said)
            other = arrays(file)
            self.assertEqual(set(other), set(self.data))
            for key, values in other.items():
                np.testing.assert_array_equal(values, self.data[key][rows], err_msg=f"{name} {key}")

    def test_follow_their_strains_within_limits_and_turn_back(self):
        options = make_data_set.new_parser().parse_args(WORDS)
        options.vary = [("friction", 0.2, 0.6)]
        self.assertGreater(self.data["reversals"].sum(), 5)
        for k in range(7):
            path = make_data_set.Path(7, k, 2, options)
            strain = np.cumsum(path.rates, axis=0)
            self.assertLess(np.abs(np.trace(strain, axis1=1, axis2=2)).max(), 0.005 + 1e-12)
            np.testing.assert_allclose(make_data_set.size(path.rates), 2e-4, rtol=1e-12)
            # a reversal is the opposite strain to the last digit; at random directions are never opposite
            turned = np.einsum("nab,nab->n", path.rates[1:], path.rates[:-1]) < -(1.0 - 1e-12) * 4e-8
            self.assertEqual(turned.sum(), self.data["reversals"][k])
            gradient = np.eye(2)
            for sample, increment in enumerate(make_data_set.exponential(path.rates), 1):
                gradient = increment @ gradient
                np.testing.assert_allclose(self.data["deformation_gradient"][k, sample], gradient, atol=1e-12)

    def test_an_rve_that_goes_a_path_has_its_stresses(self):
        # from what is in the file alone, in numbers that were rounded where the increments are found again; early, before rounding matters to grains
        k, samples = 3, 10
        with h5py.File(self.file) as data:
            settings = json.loads(data.attrs["settings"])
            packing = os.path.join(FOLDER, "of_file.rve")
            text = data[f"packings/{data['packing'][k]}"]
            content = text[()]
            self.assertEqual(hashlib.sha256(content).hexdigest(), text.attrs["sha256"])
            with open(packing, "wb") as stream:
                stream.write(content)
            gradients = data["deformation_gradient"][k]
            friction = data["parameters"][k, list(data["parameters"].attrs["keywords"]).index("friction")]
        grains = gpu_rve.Packing.read(packing)
        grains["friction"] = friction
        batch = gpu_rve.Batch([grains], format=settings["format"], device="cpu", threads=1)
        dt = 0.5 * batch.time_steps()[0]
        diameter, density = 2.0 * grains.radii.mean(), grains["density"] * grains["mass_depth"] / grains["thickness"]
        for sample in range(1, samples):
            rate = settings["inertia"] / diameter * np.sqrt(batch["p"][0] / density)
            increment = gradients[sample] @ np.linalg.inv(gradients[sample - 1])
            stress, _ = batch.advance(increment, dt, int(np.ceil(settings["strain"] / (rate * dt))))
            np.testing.assert_allclose(stress[0], self.data["stress"][k, sample], atol=1e-3 * np.abs(stress).max())

    def test_put_their_work_into_springs_motion_and_losses(self):
        change = {name: self.data[name] - self.data[name][:, :1] for name in ("work", "elastic", "kinetic", "loss_friction", "loss_damping", "loss_viscous")}
        left = 2.0 * change["work"] - sum(change.values())
        through = np.abs(np.diff(self.data["work"], axis=1)).sum(axis=1)
        self.assertLess((np.abs(left[:, -1]) / through).max(), 1e-3)
        self.assertGreater(change["loss_friction"][:, -1].min(), 0.0)

    def test_say_where_they_are_from(self):
        with h5py.File(self.file) as data:
            self.assertEqual(data.attrs["seed"], 7)
            self.assertEqual(data.attrs["release"], gpu_rve.release())
            self.assertTrue(data.attrs["commit"])
            self.assertEqual(data["stress"].chunks, (7, 61, 2, 2))
            self.assertEqual(data["stress"].compression, "gzip")
            self.assertEqual(list(data["fn_fabric"].attrs["components"]), ["xx", "yy", "xy"])
        np.testing.assert_array_equal(self.data["packing"], np.arange(7) % 2)
        self.assertTrue(np.all((self.data["parameters"] >= 0.2) & (self.data["parameters"] <= 0.6)))
        self.assertEqual(len(np.unique(self.data["parameters"])), 7)


class Failures(unittest.TestCase):
    def test_of_an_rve_end_its_path_and_no_other(self):
        # so much compression that grains overlap by more than their limit
        code, said, file = make("crushed", "--paths", "6", "--samples", "8", "--strain", "0.05", "--piece", "0.1", "--volumetric", "3", "--most_volume", "0.8",
                                "--most_shear", "0.5", "--inertia", "0.1")
        self.assertEqual(code, 0, said)
        data = arrays(file)
        ended = data["length"] <= 8
        self.assertTrue(ended.any(), data["length"])
        self.assertIn(f"{ended.sum()} paths that ended before", said)
        self.assertTrue((data["status"][ended] != 0).all())
        for k in range(6):
            self.assertTrue(np.isfinite(data["stress"][k, :data["length"][k]]).all())
            self.assertTrue(np.isnan(data["stress"][k, data["length"][k]:]).all())

    def test_are_said_before_anything_runs(self):
        for words, message in ((["--paths", "0"], "--paths is 0; it must be 1 or more"), (["--reversals", "1"], "it must be from 0 to below 1"),
                               (["--vary", "fiction", "0", "1"], "fiction"), (["--vary", "friction", "-1", "1"], "friction"),
                               (["--most_volume", "1e-4"], "no path stays within less"), (["--packing", "no.rve"], "no.rve")):
            code, said, file = make("wrong", *words)
            self.assertNotEqual(code, 0, words)
            self.assertIn(message, said)
            self.assertFalse(os.path.exists(file))
            self.assertNotIn("Traceback", said)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
