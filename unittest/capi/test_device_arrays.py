# SPDX-License-Identifier: GPL-2.0-only
"""Arrays in the memory of a GPU by DLPack, with each installed library of PyTorch and CuPy.

    python3 test_device_arrays.py <folder of the packings of the examples>

GPU_RVE_LIBRARY names the library, which is built with CUDA. Without a GPU or without both libraries
the test is skipped (77), or fails with GPU_RVE_REQUIRE_CUDA=1.
"""

import os
import pathlib
import sys
import unittest

import numpy as np

import gpu_rve

PACKINGS = pathlib.Path(sys.argv.pop(1))
DISKS, SPHERES = (gpu_rve.Packing.read(PACKINGS / name) for name in ("A_h0075.rve", "S500.rve"))
DT = {2: 2e-5, 3: 2e-6}
COUNT = 3


def batch_of(packing, device="cuda"):
    return gpu_rve.Batch([packing] * COUNT, format="mixed", device=device)


def increments(dimension, n, seed):
    return np.eye(dimension) + 1e-4 * np.random.default_rng(seed).uniform(
        -1, 1, (n, dimension, dimension))


class DeviceArrays:
    """Tests for the arrays of any library."""

    module = None

    @classmethod
    def setUpClass(cls):
        if obstacle := obstacle_of(cls):
            raise unittest.SkipTest(obstacle)

    def grains(self):
        return ((packing, packing.dimension) for packing in (DISKS, SPHERES))

    def test_device_arrays_have_the_bits_of_host_arrays(self):
        for packing, d in self.grains():
            here, there = batch_of(packing), batch_of(packing)
            self.assertEqual(there.device_number, 0)
            for which in (None, [2, 0]):
                n = COUNT if which is None else len(which)
                for call in ("trial", "advance"):
                    f = increments(d, n, seed=n)
                    given, out = self.to_device(f), self.to_device(np.zeros((n, d, d)))
                    stresses, statuses = getattr(here, call)(f, DT[d], 40, which)
                    answer, statuses_there = getattr(there, call)(given, DT[d], 40, which, out=out)
                    self.assertIs(answer, out)
                    np.testing.assert_array_equal(self.to_host(out), stresses)
                    np.testing.assert_array_equal(statuses_there, statuses)
                    np.testing.assert_array_equal(self.to_host(given), f)
                    here.revert()
                    there.revert()
            self.assertEqual(there.save(), here.save())

    def test_device_arrays_may_be_mixed_with_host_arrays(self):
        for packing, d in self.grains():
            batch, f = batch_of(packing), increments(d, COUNT, seed=1)
            plain, _ = batch.trial(f, DT[d], 40)
            np.testing.assert_array_equal(batch.trial(self.to_device(f), DT[d], 40)[0], plain)
            received, out = np.zeros((COUNT, d, d)), self.to_device(np.zeros((COUNT, d, d)))
            batch.trial(self.to_device(f), DT[d], 40, out=received)
            batch.trial(f, DT[d], 40, out=out)
            np.testing.assert_array_equal(received, plain)
            np.testing.assert_array_equal(self.to_host(out), plain)

    def test_quantities_and_stiffness_have_the_bits_of_host_arrays(self):
        for packing, d in self.grains():
            batch = batch_of(packing)
            for work in (lambda **out: batch.quantity("p", **out),
                         lambda **out: batch.quantity("syy", [1], **out), batch.affine_stiffness):
                plain = work()
                out = self.to_device(np.zeros(plain.shape))
                work(out=out)
                np.testing.assert_array_equal(self.to_host(out), plain)

    def test_arrays_that_do_not_fit_are_refused_and_change_nothing(self):
        for packing, d in self.grains():
            batch, on_cpu, f = batch_of(packing), batch_of(packing, "cpu"), increments(d,
                                                                                       COUNT,
                                                                                       seed=3)
            state, good, room = batch.save(), self.to_device(f), self.to_device(
                np.zeros((COUNT, d, d)))
            for message, work in (
                ("increments has dtype float32; it must have float64",
                 lambda: batch.advance(self.to_device(f.astype(np.float32)), DT[d], 1)),
                ("increments has shape", lambda: batch.advance(self.to_device(f[0]), DT[d], 1)),
                ("increments has strides", lambda: batch.advance(
                    self.to_device(np.zeros((d, d, COUNT))).swapaxes(0, 2), DT[d], 1)),
                ("out has dtype int64", lambda: batch.advance(
                    good, DT[d], 1, out=self.to_device(np.zeros((COUNT, d, d), np.int64)))),
                ("out has shape",
                 lambda: batch.advance(self.to_device(f[:2]), DT[d], 1, which=[0, 1], out=room)),
                ("dt is in the memory of a device",
                 lambda: batch.advance(good, self.to_device(np.full(COUNT, DT[d])), 1)),
                ("increments is in the memory of a device, and the batch is on CPU",
                 lambda: on_cpu.advance(good, DT[d], 1)),
                ("out is in the memory of a device, and the batch is on CPU",
                 lambda: on_cpu.advance(f, DT[d], 1, out=room))):
                with self.assertRaisesRegex(gpu_rve.Error, message):
                    work()
            self.assertEqual(batch.save(), state)


class ArraysOfTorch(DeviceArrays, unittest.TestCase):
    @classmethod
    def find(cls):
        import torch
        if not torch.cuda.is_available():
            raise RuntimeError("torch sees no GPU")
        cls.module = torch

    def to_device(self, array):
        return self.module.from_numpy(np.array(array)).cuda()

    def to_host(self, array):
        return array.cpu().numpy()

    def test_what_another_stream_still_computes_is_waited_for(self):
        torch = self.module
        for packing, d in self.grains():
            batch, f = batch_of(packing), increments(d, COUNT, seed=2)
            plain, _ = batch.trial(f, DT[d], 40)
            given, source, big = self.to_device(np.zeros(
                (COUNT, d, d))), self.to_device(f), torch.ones(4000, 4000, device="cuda")
            torch.cuda.synchronize()
            with torch.cuda.stream(torch.cuda.Stream()):
                for _ in range(50):
                    big = big @ big * 1e-4
                given.copy_(source)
                np.testing.assert_array_equal(batch.trial(given, DT[d], 40)[0], plain)


class ArraysOfCupy(DeviceArrays, unittest.TestCase):
    @classmethod
    def find(cls):
        import cupy
        cupy.zeros(1)
        cls.module = cupy

    def to_device(self, array):
        return self.module.asarray(array)

    def to_host(self, array):
        return self.module.asnumpy(array)


def obstacle_of(arrays):
    """Returns the reason why a library cannot be used; empty if it can."""
    try:
        arrays.find()
    except Exception as error:    # each library reports a missing driver in its own way
        return str(error)
    return ""


if __name__ == "__main__":
    obstacle = "; ".join(filter(None, map(obstacle_of, (ArraysOfTorch, ArraysOfCupy))))
    if ArraysOfTorch.module or ArraysOfCupy.module:
        obstacle = ""
        try:
            batch_of(DISKS)
        except gpu_rve.Error as error:
            obstacle = str(error)
    if obstacle:
        print(obstacle)
        sys.exit(1 if os.environ.get("GPU_RVE_REQUIRE_CUDA", "").lower() in ("1", "true", "yes",
                                                                             "on") else 77)
    unittest.main(verbosity=2)
