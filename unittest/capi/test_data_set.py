# SPDX-License-Identifier: GPL-2.0-only
"""Data sets of random strain paths: h5py reads them, batches and threads do not change them, an RVE
on a path gives their results, and invalid input is refused.

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
    """Makes a data set and returns exit status, output, and the file."""
    file = os.path.join(FOLDER, name + ".h5")
    done = subprocess.run(
        [sys.executable, SCRIPT, "--out", file, "--device", "cpu", "--digits", "float64", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        universal_newlines=True)
    return done.returncode, done.stdout, file


def arrays(file):
    with h5py.File(file) as data:
        return {name: data[name][:] for name in data if isinstance(data[name], h5py.Dataset)}


WORDS = [
    "--samples", "60", "--piece", "2e-3", "--packing", *PACKINGS, "--vary", "friction", "0.2",
    "0.6", "--seed", "7", "--contacts"
]


class Paths(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        code, cls.said, cls.file = make("paths", "--paths", "7", "--threads", "1", *WORDS)
        assert code == 0, cls.said
        cls.data = arrays(cls.file)

    def test_do_not_depend_on_batches_threads_and_parts(self):
        # Chunks have two paths: batches of three begin and end within a chunk, and batches of seven
        # end within one.
        for name, words, rows in (("batches", [
                "--paths", "7", "--batch", "3", "--threads", "2", "--chunk", "2"
        ], slice(0, 7)), ("part", ["--paths", "3", "--first", "4", "--chunk", "1"], slice(4, 7))):
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
            # A reversal is the exact opposite strain; random directions are never opposite.
            turned = np.einsum("nab,nab->n", path.rates[1:],
                               path.rates[:-1]) < -(1.0 - 1e-12) * 4e-8
            self.assertEqual(turned.sum(), self.data["reversals"][k])
            gradient = np.eye(2)
            for sample, increment in enumerate(make_data_set.exponential(path.rates), 1):
                gradient = increment @ gradient
                np.testing.assert_allclose(self.data["deformation_gradient"][k, sample],
                                           gradient,
                                           atol=1e-12)

    def test_an_rve_that_goes_a_path_has_its_stresses(self):
        # The increments follow from the numbers in the file, which are rounded; the test uses early
        # increments, before rounding matters to grains.
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
            friction = data["parameters"][
                k, list(data["parameters"].attrs["keywords"]).index("friction")]
        grains = gpu_rve.Packing.read(packing)
        grains["friction"] = friction
        batch = gpu_rve.Batch([grains], format=settings["format"], device="cpu", threads=1)
        dt = 0.5 * batch.time_steps()[0]
        diameter, density = 2.0 * grains.radii.mean(
        ), grains["density"] * grains["mass_depth"] / grains["thickness"]
        for sample in range(1, samples):
            rate = settings["inertia"] / diameter * np.sqrt(batch["p"][0] / density)
            increment = gradients[sample] @ np.linalg.inv(gradients[sample - 1])
            stress, _ = batch.advance(increment, dt, int(np.ceil(settings["strain"] / (rate * dt))))
            np.testing.assert_allclose(stress[0],
                                       self.data["stress"][k, sample],
                                       atol=1e-3 * np.abs(stress).max())

    def test_put_their_work_into_springs_motion_and_losses(self):
        change = {
            name: self.data[name] - self.data[name][:, :1]
            for name in ("work", "elastic", "kinetic", "loss_friction", "loss_damping",
                         "loss_viscous")
        }
        left = 2.0 * change["work"] - sum(change.values())
        through = np.abs(np.diff(self.data["work"], axis=1)).sum(axis=1)
        self.assertLess((np.abs(left[:, -1]) / through).max(), 1e-3)
        self.assertGreater(change["loss_friction"][:, -1].min(), 0.0)

    def test_say_how_far_they_are_from_the_first_line_on(self):
        # The output also goes through a pipe into a log.
        lines = self.said.splitlines()
        self.assertEqual(lines[0], "7 of 7 paths begin")
        self.assertTrue(any(line.startswith("7 of 7 paths, ") for line in lines), self.said)

    def test_cross_chunks(self):
        # There are more paths than the default chunk has, in batches that do not divide their
        # number.
        words = ["--samples", "2", "--seed", "7", "--packing", PACKINGS[0]]
        files = []
        for name, more in (("one_chunk", ["--chunk", "70"]), ("chunks", ["--batch", "33"])):
            code, said, file = make(name, "--paths", "70", *words, *more)
            self.assertEqual(code, 0, said)
            files.append(file)
        with h5py.File(files[1]) as data:
            self.assertEqual(data["stress"].chunks, (64, 3, 2, 2))
        one, other = map(arrays, files)
        for key, values in one.items():
            self.assertEqual(len(values), 70)
            np.testing.assert_array_equal(values, other[key], err_msg=key)

    def test_have_checksums(self):
        # One byte in the middle of a chunk changes: h5py refuses this chunk but not the others.
        code, said, file = make("torn", "--paths", "2", "--samples", "2", "--chunk", "1",
                                "--packing", PACKINGS[0])
        self.assertEqual(code, 0, said)
        with h5py.File(file) as data:
            self.assertTrue(
                all(data[name].fletcher32 for name in data
                    if isinstance(data[name], h5py.Dataset) and data[name].size))
            chunk = data["stress"].id.get_chunk_info(1)
        with open(file, "r+b") as stream:
            stream.seek(chunk.byte_offset + chunk.size // 2)
            byte = stream.read(1)[0]
            stream.seek(-1, os.SEEK_CUR)
            stream.write(bytes([byte ^ 1]))
        with h5py.File(file) as data:
            self.assertTrue(np.isfinite(data["stress"][0]).all())
            with self.assertRaises(OSError):
                data["stress"][1]

    def test_are_those_of_the_textbook_way(self):
        # The first piece follows from its random numbers by numpy tensors up to rounding, in the
        # plane and in space.
        options = make_data_set.new_parser().parse_args(
            ["--most_volume", "1", "--most_shear", "1"])    # the first draw is within the limits
        for dimension in (2, 3):
            path = make_data_set.Path(5, 11, dimension, options)
            self.assertEqual(sum(path.counts), options.samples)
            self.assertEqual(path.rates.shape, (options.samples, dimension, dimension))
            np.testing.assert_array_equal(path.directions, np.swapaxes(path.directions, 1, 2))
            np.testing.assert_allclose(make_data_set.size(path.directions),
                                       1.0,
                                       rtol=1e-15 * dimension**2)
            random = np.random.Generator(
                np.random.PCG64(np.random.SeedSequence(entropy=5, spawn_key=(11, ))))
            random.uniform(size=0)
            length = max(1, round(random.exponential(options.piece / options.strain)))
            drawn = random.normal(size=(dimension, dimension))
            deviator = 0.5 * (drawn + drawn.T) - np.trace(drawn) / dimension * np.eye(dimension)
            first = deviator / np.linalg.norm(deviator) + options.volumetric * random.normal(
            ) / np.sqrt(dimension) * np.eye(dimension)
            np.testing.assert_allclose(path.directions[0],
                                       first / np.linalg.norm(first),
                                       atol=1e-14)
            self.assertEqual(path.counts[0], length)

    def test_say_where_they_are_from(self):
        with h5py.File(self.file) as data:
            self.assertEqual(data.attrs["seed"], 7)
            self.assertEqual(data.attrs["release"], gpu_rve.release())
            self.assertTrue(data.attrs["commit"])
            self.assertEqual(data["stress"].chunks, (7, 61, 2, 2))
            self.assertEqual(data["stress"].compression, "gzip")
            settings = json.loads(data.attrs["settings"])
            self.assertEqual(settings["packing"], [os.path.basename(name) for name in PACKINGS])
            self.assertEqual([data[f"packings/{k}"].attrs["name"] for k in range(2)],
                             settings["packing"])
            self.assertEqual(settings["samples"], 60)
            self.assertEqual(list(data["fn_fabric"].attrs["components"]), ["xx", "yy", "xy"])
        np.testing.assert_array_equal(self.data["packing"], np.arange(7) % 2)
        self.assertTrue(np.all((self.data["parameters"] >= 0.2) & (self.data["parameters"] <= 0.6)))
        self.assertEqual(len(np.unique(self.data["parameters"])), 7)


class Failures(unittest.TestCase):
    def test_of_an_rve_end_its_path_and_no_other(self):
        # The compression exceeds the overlap limit.
        code, said, file = make("crushed", "--paths", "6", "--samples", "8", "--strain", "0.05",
                                "--piece", "0.1", "--volumetric", "3", "--most_volume", "0.8",
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
        for words, message in ((["--paths", "0"], "--paths is 0; it must be 1 or more"), ([
                "--chunk", "0"
        ], "--chunk is 0; it must be 1 or more"), ([
                "--reversals", "1"
        ], "it must be from 0 to below 1"), (["--vary", "fiction", "0", "1"], "fiction"), ([
                "--vary", "friction", "-1", "1"
        ], "friction"), (["--most_volume",
                          "1e-4"], "no path stays within less"), (["--packing",
                                                                   "no.rve"], "no.rve")):
            code, said, file = make("wrong", *words)
            self.assertNotEqual(code, 0, words)
            self.assertIn(message, said)
            self.assertFalse(os.path.exists(file))
            self.assertNotIn("Traceback", said)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
