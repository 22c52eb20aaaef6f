# SPDX-License-Identifier: GPL-2.0-only
"""The Python package gpu_rve with librve: NumPy arrays, trials, restarts, errors. GPU_RVE_LIBRARY
names the library.

    python3 test_gpu_rve.py <folder of the packings of the examples>
"""

import ctypes
import pathlib
import pickle
import sys
import tempfile
import unittest

import numpy as np

import gpu_rve
from gpu_rve import _arrays, element_tests

PACKINGS = pathlib.Path(sys.argv.pop(1))
DISKS, SPHERES = (gpu_rve.Packing.read(PACKINGS / name) for name in ("A_h0075.rve", "S500.rve"))
DT = {2: 2e-5, 3: 2e-6}
OPTIONS = {"format": "double", "device": "cpu", "threads": 1}


def increments(dimension, n, seed):
    return np.eye(dimension) + 1e-4 * np.random.default_rng(seed).uniform(
        -1, 1, (n, dimension, dimension))


new_capsule = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_char_p,
                                ctypes.c_void_p)(("PyCapsule_New", ctypes.pythonapi))


class Lender:
    """An array of another library that counts how often it was lent and returned.

    The numbers are NumPy's from row `skip` on. The kind of memory (`says`: only that in the
    capsule) and the type may be wrong.
    """

    def __init__(self,
                 array,
                 kind=1,
                 number=0,
                 says=None,
                 says_strides=False,
                 versioned=False,
                 code=2,
                 flags=0,
                 major=1,
                 skip=0):
        self.array, self.kind, self.number, self.says = array, kind, number, says or (kind, number)
        self.says_strides, self.versioned, self.code = says_strides, versioned, code
        self.flags, self.major, self.skip = flags, major, skip
        self.lent = self.returned = 0

    def __dlpack_device__(self):
        return self.says

    def __dlpack__(self, stream=None, max_version=None):
        if max_version and not self.versioned:
            raise TypeError("from before there were versions")
        a, ndim = self.array[self.skip:], self.array.ndim
        self.shape = (ctypes.c_int64 * ndim)(*a.shape)
        self.strides = (ctypes.c_int64 * ndim)(*(s // a.itemsize
                                                 for s in a.strides)) if self.says_strides else None
        tensor = _arrays.Tensor(self.array.ctypes.data, self.kind, self.number, ndim, self.code,
                                8 * a.itemsize, 1, self.shape, self.strides,
                                self.skip * a.strides[0])
        self.deleter = _arrays.Deleter(self.take_back)
        name = b"dltensor_versioned" if max_version else b"dltensor"
        if max_version:
            self.managed = _arrays.VersionedTensor(self.major, 0, None, self.deleter, self.flags,
                                                   tensor)
        else:
            self.managed = _arrays.ManagedTensor(tensor, None, self.deleter)
        self.lent += 1
        return new_capsule(ctypes.addressof(self.managed), name, None)

    def take_back(self, address):
        assert address == ctypes.addressof(self.managed)
        self.returned += 1


class Packings(unittest.TestCase):
    def test_arrays_have_their_shapes_and_the_void_ratio_of_the_cell(self):
        for packing, d in ((DISKS, 2), (SPHERES, 3)):
            self.assertEqual(packing.dimension, d)
            self.assertEqual(packing.positions.shape, (packing.grains, d))
            self.assertEqual(packing.velocities.shape, (packing.grains, d))
            self.assertEqual(packing.spins.shape, (packing.grains, ) if d == 2 else
                             (packing.grains, 3))
            solid = np.sum(np.pi * packing.radii**2 if d == 2 else 4 / 3 * np.pi * packing.radii**3)
            self.assertAlmostEqual(np.linalg.det(packing.cell) / solid - 1, packing.void_ratio, 12)

    def test_contacts_give_the_stress_by_love(self):
        contacts = SPHERES.contacts()
        stress = np.einsum("ca,cb->ab", contacts["force"], contacts["branch"]) / np.linalg.det(
            SPHERES.cell)
        batch = gpu_rve.Batch([SPHERES], **OPTIONS)
        found = batch.trial(np.eye(3), DT[3], 0)[0][0]
        np.testing.assert_allclose(stress, found, atol=1e-9 * np.abs(found).max())

    def test_a_file_returns_what_was_written(self):
        with tempfile.TemporaryDirectory() as folder:
            copy = DISKS.copy()
            copy["friction"] = 0.25
            copy.write(pathlib.Path(folder) / "copy.rve")
            back = gpu_rve.Packing.read(pathlib.Path(folder) / "copy.rve")
        self.assertEqual(back["friction"], 0.25)
        self.assertNotEqual(DISKS["friction"], 0.25)
        np.testing.assert_array_equal(back.positions, DISKS.positions)


    def test_the_ground_is_laid_down_and_read_back_from_a_library(self):
        recipe = {
            "grains": 60, "seed": 3, "radius": (0.0025, 0.005), "kn": 1e6, "friction": 0.5,
            "density": 2650.0, "damping": 0.3, "thickness": 0.075, "mass_depth": 0.075,
            "friction_prep": 0.3
        }
        ground = gpu_rve.Packing.create(**recipe, pressure=2e4, k0="rest")
        batch = gpu_rve.Batch([ground], **OPTIONS)
        # tolerance of the recipe
        self.assertAlmostEqual(batch["syy"][0] / -2e4, 1.0, delta=1.1e-3)
        self.assertTrue(0.3 < batch["sxx"][0] / batch["syy"][0] < 0.8)    # Jaky: about 1 - sin(phi)
        with tempfile.TemporaryDirectory() as folder:
            ground.write(pathlib.Path(folder) / "ground.rve")
            back, = gpu_rve.Packing.read_library(pathlib.Path(folder) / "ground.rve")
        np.testing.assert_array_equal(back.positions, ground.positions)

    def test_grains_follow_a_grading_curve(self):
        curve = [(0.004, 20.0), (0.006, 60.0), (0.012, 100.0)]
        recipe = {"grains": 80, "kn": 1e6, "density": 2650.0, "thickness": 0.075, "pressure": 2e4}
        packing = gpu_rve.Packing.create(grading=np.array(curve), **recipe)
        area = packing.radii**2
        # The fines below 4 mm are cut off, so that half of the area is below 6 mm. A grain of 6 mm
        # has 1 % of the area.
        self.assertAlmostEqual(area[packing.radii < 0.003].sum() / area.sum(), 0.5, delta=0.011)
        order = np.argsort(packing.radii)
        passing = 100.0 * np.cumsum(area[order]) / area.sum()
        for name, percent in (("d10", 10), ("d50", 50), ("d60", 60)):
            k = np.argmax(passing >= percent)
            self.assertEqual(getattr(packing, name), 2.0 * packing.radii[order[k]])
        self.assertEqual(packing.uniformity, packing.d60 / packing.d10)

        needed = gpu_rve.grains_needed(grading=curve, shape="disk")
        self.assertEqual(gpu_rve.grains_needed(grading=[(2 * d, p) for d, p in curve]), needed)
        self.assertGreater(gpu_rve.grains_needed(grading=curve, shape="sphere"), needed)
        for kind, first in (("lognormal", 0.004), ("power_law", 2.0)):
            radius = (kind, first, *((0.2,) if kind == "lognormal" else ()), 0.003, 0.006)
            packing = gpu_rve.Packing.create(radius=radius, **recipe)
            self.assertTrue(np.all((packing.radii >= 0.003) & (packing.radii <= 0.006)))

    def test_wrong_sizes_are_named(self):
        for sizes, message in (({}, "radius or grading must be given"),
                               ({"grading": [1, 2, 3]}, r"shape \(3,\); it must have \(n, 2\)"),
                               ({"grading": [(1, 0), (2, 90)]}, "grading point is 90; it must be"),
                               ({"radius": (1, "x")}, "it must have numbers"),
                               ({"radius": ("normal", 1, 2)}, "radius is 'normal'; it must be"),
                               ({"radius": (1, 2), "grading": [(1, 0), (2, 100)]}, "not both")):
            with self.assertRaisesRegex(gpu_rve.Error, message):
                gpu_rve.grains_needed(**sizes)

    def test_hertz_material_is_that_of_scripts(self):
        words = "hertz/material 1e9 0 0.2 tangential mindlin NULL 0 0.5"
        stiffness = 2 / 3 * 1e9 / (1 - 0.2**2), 2 * 1e9 / (1.8 * 1.2)    # 4/3 E*, 8 G*
        material = {"contact": words, "density": 2650.0}
        made = gpu_rve.Packing.create(shape="sphere", grains=60, radius=(0.004, 0.005),
                                      pressure=2e4, **material)
        back = gpu_rve.Packing.from_arrays(made.cell, made.positions, made.radii, material)
        for packing in (made, back):
            np.testing.assert_allclose([packing["hertz_kn"], packing["mindlin_kt"]], stiffness,
                                       rtol=1e-14)
            self.assertEqual(packing["friction"], 0.5)
        np.testing.assert_allclose(back.contacts()["normal_force"],
                                   made.contacts()["normal_force"], rtol=1e-6)
        with self.assertRaisesRegex(gpu_rve.Error, "contact and friction exclude each other"):
            gpu_rve.Packing.from_arrays(made.cell, made.positions, made.radii,
                                        {**material, "friction": 0.5})

    def test_an_image_has_the_turned_stress(self):
        turned, straight = (gpu_rve.Batch([packing], **OPTIONS)
                            for packing in (DISKS.image(1), DISKS))
        for to, of, sign in (("sxx", "syy", 1), ("syy", "sxx", 1), ("sxy", "sxy", -1)):
            self.assertAlmostEqual(turned[to][0],
                                   sign * straight[of][0],
                                   delta=1e-9 * straight["p"][0])


class Arrays(unittest.TestCase):
    def test_arrays_of_callers_are_read_where_they_are(self):
        f = increments(2, 3, 0)
        self.assertTrue(np.shares_memory(_arrays.numbers(f, "increments", f.shape), f))
        steps = np.arange(3, dtype=np.int32)
        self.assertTrue(np.shares_memory(_arrays.numbers(steps, "substeps", (3,), np.int32), steps))

        class Foreign:
            """An array of another library in the memory of the host."""

            def __dlpack__(self, **options):
                return f.__dlpack__(**options)

            def __dlpack_device__(self):
                return 1, 0

        self.assertTrue(np.shares_memory(_arrays.numbers(Foreign(), "increments", f.shape), f))
        for other in (f.astype(np.float32), f.swapaxes(1, 2), f[:1]):    # other arrays are copied
            found = _arrays.numbers(other, "increments", f.shape)
            self.assertFalse(np.shares_memory(found, f))
            np.testing.assert_array_equal(found, np.broadcast_to(other, f.shape))

    def test_arrays_of_a_packing_are_copies(self):
        for packing in (DISKS, SPHERES):
            before = packing.save()
            for array in (packing.positions, packing.velocities, packing.spins, packing.radii,
                          packing.cell, packing.contacts()["force"]):
                array[...] = -1.0
            self.assertEqual(packing.save(), before)
            self.assertTrue(np.all(packing.radii > 0.0))


class Pictures(unittest.TestCase):
    def setUp(self):
        try:
            import matplotlib
        except ImportError as error:
            self.skipTest(str(error))
        matplotlib.use("agg")
        from gpu_rve import plot
        self.plot = plot

    def test_each_contact_is_a_line_and_each_disk_a_circle(self):
        from matplotlib.collections import EllipseCollection, LineCollection
        for packing in (DISKS, SPHERES):
            axes = self.plot.force_chains(packing)
            # lines in space are such collections too
            lines, = (c for c in axes.collections if isinstance(c, LineCollection))
            axes.figure.canvas.draw()
            self.assertEqual(len(lines.get_linewidths()), len(packing.contacts()["grains"]))
            self.assertEqual(len(lines.get_segments()), len(packing.contacts()["grains"]))
            # the edges of the cell
            self.assertEqual(len(axes.lines), {2: 4, 3: 12}[packing.dimension])
        axes = self.plot.grains(DISKS)
        circles, = (c for c in axes.collections if isinstance(c, EllipseCollection))
        self.assertEqual(len(circles.get_offsets()), DISKS.grains)
        self.assertEqual(len(self.plot.grains(DISKS, forces=False).collections), 1)

    def test_spheres_are_not_drawn_as_disks(self):
        with self.assertRaisesRegex(ValueError, "the packing has spheres; use force_chains"):
            self.plot.grains(SPHERES)


class Quantities(unittest.TestCase):
    def test_fabric_and_energies_of_contacts_are_those_of_the_answer(self):
        for packing, factor in ((DISKS, 4.0), (SPHERES, 7.5)):
            d = packing.dimension
            batch = gpu_rve.Batch([packing] * 2, **OPTIONS)
            batch.advance(increments(d, 2, 4)[[0, 0]], DT[d], 100)
            packing_now = batch.packing(0).contacts()
            for ab in ("xx", "xy"):
                trace = 1 / d if ab == "xx" else 0.0
                np.testing.assert_allclose(batch[f"contact_fabric_{ab}"],
                                           factor * (batch[f"fabric_{ab}"] - trace),
                                           atol=1e-9)
            slides = packing_now["sliding"]
            strong = packing_now["normal_force"] > packing_now["normal_force"].mean()
            np.testing.assert_allclose(batch["strong"], strong.mean(), rtol=1e-12)
            np.testing.assert_allclose(batch["sliding_weak"], slides[~strong].mean(), rtol=1e-12)
            kinds = [name for name in batch.quantities if name.startswith("elastic_")]
            self.assertEqual(len(kinds), d + 1)
            np.testing.assert_allclose(sum(batch[name] for name in kinds),
                                       batch["elastic"],
                                       rtol=1e-7)

    def test_fabric_follows_trials_that_are_made_and_forgotten(self):
        batch = gpu_rve.Batch([DISKS], **OPTIONS)
        before = batch["fn_fabric_xx"]
        batch.trial(np.diag([1.0, 0.999]), DT[2], 200)
        self.assertNotEqual(batch["fn_fabric_xx"], before)
        batch.revert()
        self.assertEqual(batch["fn_fabric_xx"], before)


class SmallStrains(unittest.TestCase):
    """The law of all points of a host on flat arrays."""

    def model(self, packing, **options):
        return gpu_rve.SmallStrainModel([packing] * 2, 30, **options, **OPTIONS)

    def evaluate(self, model, gradients, history=None, tangent=True, del_t=None):
        d, s = model.geometric_dim, model.stress_strain_dim
        stress, matrices = np.full(2 * s, 7.0), np.full(2 * s * s, 7.0)
        model.evaluate(0.0, del_t or 30 * DT[d], gradients.ravel(), stress,
                       matrices if tangent else None, history)
        return stress.reshape(2, s), matrices.reshape(2, s, s)

    def mandel(self, tensors):
        """Returns Mandel's components of symmetric tensors (n, D, D), with a zz of 0 for disks."""
        t, d = 0.5 * (tensors + tensors.swapaxes(1, 2)), tensors.shape[1]
        if d == 2:
            return np.stack([t[:, 0, 0], t[:, 1, 1], 0 * t[:, 0, 0],
                             np.sqrt(2) * t[:, 0, 1]],
                            axis=1)
        return np.stack([
            t[:, 0, 0], t[:, 1, 1], t[:, 2, 2], *(np.sqrt(2) * t[:, a, b]
                                                  for a, b in ((0, 1), (0, 2), (1, 2)))
        ],
                        axis=1)

    def test_stresses_are_those_of_a_trial(self):
        for packing in (DISKS, SPHERES):
            d = packing.dimension
            gradients = increments(d, 2, 3) - np.eye(d)
            for rotates, f in ((False, 0.5 * (gradients + gradients.swapaxes(1, 2))), (True,
                                                                                       gradients)):
                batch, model = gpu_rve.Batch([packing] * 2, **OPTIONS), self.model(packing,
                                                                                   rotates=rotates)
                expected = self.mandel(batch.trial(np.eye(d) + f, DT[d], 30)[0])
                for tangent in (False, True):
                    # The results agree up to the rounding of a mean of xy and yx.
                    np.testing.assert_allclose(self.evaluate(model, gradients, tangent=tangent)[0],
                                               expected,
                                               rtol=1e-14,
                                               atol=1e-14 * np.abs(expected).max())
                # The trial at the point of the tangent is the last one.
                model.update()
                batch.commit()
                self.assertEqual(model.batch.save(), batch.save())
                np.testing.assert_allclose(model.stress().reshape(expected.shape),
                                           expected,
                                           rtol=1e-6,
                                           atol=1e-6 * np.abs(expected).max())
                self.assertEqual(model.batch.save(), batch.save())

    def test_tangents_are_differences_of_stresses(self):
        for packing in (DISKS, SPHERES):
            d = packing.dimension
            gradients, model = increments(d, 2, 4) - np.eye(d), self.model(packing)
            stress, tangent = self.evaluate(model, gradients)
            for a, b in ((0, 0), (d - 1, d - 1), (0, 1)):
                strain = np.zeros((1, d, d))
                strain[0, a, b] += 0.5e-5
                strain[0, b, a] += 0.5e-5
                difference = self.evaluate(model, gradients + strain)[0] - stress
                # Strains are exact to 1e-16 of 1, relative to 1e-5; contacts are equally stiff in
                # both directions.
                np.testing.assert_allclose(tangent @ self.mandel(strain)[0],
                                           difference,
                                           atol=1e-6 * np.abs(difference).max())
            if d == 2:
                self.assertFalse(tangent[:, 2].any() or tangent[:, :, 2].any()
                                 or stress[:, 2].any())

    def test_the_history_says_what_is_accepted(self):
        d, first, second = 2, *(increments(2, 2, seed) - np.eye(2) for seed in (5, 6))
        model, plain = self.model(DISKS, rotates=True), gpu_rve.Batch([DISKS] * 2, **OPTIONS)
        begin = {"trial": np.zeros(2)}
        tried = [{"trial": begin["trial"].copy()} for _ in range(3)]
        self.evaluate(model, second, tried[0])
        self.evaluate(model, first, tried[1])    # starts again from the beginning
        accepted = {"trial": tried[1]["trial"].copy()}
        plain.advance(np.eye(2) + first, DT[d], 30)
        answer, _ = self.evaluate(model, second, accepted)
        self.assertEqual(model.batch.save(), plain.save())
        np.testing.assert_allclose(answer,
                                   self.mandel(plain.trial(np.eye(2) + second, DT[d], 30)[0]),
                                   rtol=1e-14,
                                   atol=1e-9)
        for gone in (begin, tried[0], {"trial": np.array([2.0, 3.0])}):
            with self.assertRaisesRegex(gpu_rve.Error,
                                        "it must have the committed state 2 or the last trial 3"):
                self.evaluate(model, second, gone)

    def test_what_an_rve_does_not_bear_is_told_and_forgotten(self):
        model = self.model(DISKS)
        state, history = model.batch.save(), {"trial": np.zeros(2)}
        with self.assertRaisesRegex(gpu_rve.TrialFailed,
                                    "^2 of 2 RVEs fail in the increment; RVE 0: "):
            self.evaluate(model, np.tile(-0.9 * np.eye(2), (2, 1, 1)), history, tangent=False)
        model.update()
        self.assertEqual(model.batch.save(), state)
        self.assertFalse(history["trial"].any())
        self.evaluate(model, np.zeros((2, 2, 2)), history)
        with self.assertRaisesRegex(gpu_rve.Error,
                                    "grad_del_u has 4 numbers; for 2 points it must have 8"):
            self.evaluate(model, np.zeros((2, 2)))
        with self.assertRaisesRegex(gpu_rve.Error, "del_t is -1"):
            self.evaluate(model, np.zeros((2, 2, 2)), del_t=-1.0)


class Batches(unittest.TestCase):
    def test_trials_leave_no_trace(self):
        for packing in (DISKS, SPHERES):
            d = packing.dimension
            tried, plain = (gpu_rve.Batch([packing] * 2, **OPTIONS) for _ in range(2))
            for k in range(2):
                tried.trial(increments(d, 2, 9 + k), DT[d], 30)
                stress, statuses = tried.trial(increments(d, 2, k), DT[d], 30)
                tried.commit()
                np.testing.assert_array_equal(stress,
                                              plain.advance(increments(d, 2, k), DT[d], 30)[0])
                self.assertFalse(statuses.any())
            self.assertEqual(tried.save(), plain.save())
            np.testing.assert_allclose(tried["p"],
                                       -np.trace(stress, axis1=1, axis2=2) / d,
                                       rtol=1e-14)

    def test_restoring_continues_to_the_bit(self):
        batch, other = (gpu_rve.Batch([DISKS] * 3, **OPTIONS) for _ in range(2))
        batch.advance(increments(2, 3, 1), DT[2], 50)
        saved = batch.save()
        went_on = batch.advance(increments(2, 3, 2), DT[2], 50)[0]
        other.restore(saved)
        np.testing.assert_array_equal(other.advance(increments(2, 3, 2), DT[2], 50)[0], went_on)

    def test_some_of_them_and_all_of_them_are_the_same(self):
        some, all_ = (gpu_rve.Batch([DISKS] * 3, **OPTIONS) for _ in range(2))
        f = increments(2, 3, 3)
        stress = all_.advance(f, DT[2], 20)[0]
        np.testing.assert_array_equal(
            some.advance(f[[2, 0]], DT[2], 20, which=[2, 0])[0], stress[[2, 0]])
        self.assertEqual(some.quantity("substeps", [1])[0], 0)

    def test_an_elastic_tangent_is_below_the_affine_stiffness(self):
        batch = gpu_rve.Batch([DISKS], **OPTIONS)
        before = batch.save()
        tangent = batch.tangents()[0]
        self.assertEqual(batch.save(), before)
        affine = batch.affine_stiffness()[0]
        affine = np.stack([affine[0, 0], affine[1, 1], affine[0, 1]])
        affine[:, 2] *= 0.5    # engineering strain
        self.assertTrue(np.all(np.linalg.eigvalsh(affine - tangent + (affine - tangent).T) > 0))
        self.assertTrue(np.all(np.linalg.eigvalsh(tangent + tangent.T) > 0))

    def test_a_failure_has_a_status(self):
        batch = gpu_rve.Batch([DISKS] * 2, **OPTIONS)
        f = np.stack([0.5 * np.eye(2), np.eye(2)])
        _, statuses = batch.trial(f, DT[2], 1)
        np.testing.assert_array_equal(batch.failed(statuses), [True, False])
        self.assertNotEqual(gpu_rve.status_text(statuses[0]), "ok")

    def test_a_packing_can_be_pickled_to_the_bit(self):
        batch = gpu_rve.Batch([SPHERES], **OPTIONS)
        batch.advance(increments(3, 1, 0), DT[3], 20)
        packing = pickle.loads(pickle.dumps(batch.packing(0)))
        other = gpu_rve.Batch([SPHERES], **OPTIONS)
        other.set_packing(0, packing)
        self.assertEqual(other.save(), batch.save())

    def test_arrays_of_others_come_by_dlpack(self):
        class Foreign:
            """An array of another library that NumPy does not support."""

            def __init__(self, array, device=1):
                self.array, self.device = array, device

            def __dlpack__(self, **options):
                return self.array.__dlpack__(**options)

            def __dlpack_device__(self):
                return self.device, 0

        f = increments(2, 2, 3)
        plain, foreign = (gpu_rve.Batch([DISKS] * 2, **OPTIONS) for _ in range(2))
        np.testing.assert_array_equal(
            foreign.advance(Foreign(f), DT[2], 10)[0],
            plain.advance(f, DT[2], 10)[0])
        with self.assertRaisesRegex(gpu_rve.Error, "in the memory of a device"):
            foreign.advance(Foreign(f, device=2), DT[2], 10)

    def test_stresses_go_where_the_caller_wants_them(self):
        for packing in (DISKS, SPHERES):
            d = packing.dimension
            plain, other = (gpu_rve.Batch([packing] * 2, **OPTIONS) for _ in range(2))
            history = np.zeros((3, 2, d, d))
            for k in range(3):
                answer, _ = other.advance(increments(d, 2, k), DT[d], 10, out=history[k])
                self.assertTrue(np.shares_memory(answer, history))
                np.testing.assert_array_equal(history[k],
                                              plain.advance(increments(d, 2, k), DT[d], 10)[0])
            room = np.zeros((2, d, d))
            self.assertIs(other.trial(increments(d, 2, 7), DT[d], 10, out=room)[0], room)
            np.testing.assert_array_equal(room, plain.trial(increments(d, 2, 7), DT[d], 10)[0])
            some, stiffness = np.zeros(1), np.zeros((2, d, d, d * (d + 1) // 2))
            self.assertIs(other.quantity("p", [1], out=some), some)
            self.assertIs(other.affine_stiffness(out=stiffness), stiffness)
            self.assertEqual(some[0], other["p"][1])
            np.testing.assert_array_equal(stiffness, other.affine_stiffness())

    def test_arrays_of_others_are_read_and_written_where_they_are_and_given_back(self):
        f = increments(2, 2, 3)
        plain = gpu_rve.Batch([DISKS] * 2, **OPTIONS).advance(f, DT[2], 10)[0]
        for versioned in (False, True):
            for says_strides in (False, True):
                room = np.zeros((3, 2, 2))
                given = Lender(f, versioned=versioned, says_strides=says_strides)
                wanted = Lender(room, versioned=versioned, says_strides=says_strides, skip=1)
                answer, _ = gpu_rve.Batch([DISKS] * 2, **OPTIONS).advance(given,
                                                                          DT[2],
                                                                          10,
                                                                          out=wanted)
                self.assertIs(answer, wanted)
                np.testing.assert_array_equal(room[1:], plain)
                self.assertFalse(room[0].any())
                for lender in (given, wanted):
                    self.assertEqual((lender.lent, lender.returned), (1, 1))

    def test_arrays_of_a_device_are_refused_before_they_are_touched(self):
        batch = gpu_rve.Batch([DISKS] * 2, **OPTIONS)
        self.assertIsNone(batch.device_number)
        f, state = increments(2, 2, 3), batch.save()
        for kind in (2, 13, 10):    # CUDA, CUDA managed, ROCm
            elsewhere = Lender(f, kind=kind)
            for name, work in (("increments", lambda: batch.advance(elsewhere, DT[2], 10)),
                               ("dt", lambda: batch.advance(f, elsewhere, 10)),
                               ("strain_rates", lambda: batch.tangents(elsewhere)),
                               ("out", lambda: batch.advance(f, DT[2], 10, out=elsewhere)),
                               ("out", lambda: batch.quantity("p", out=elsewhere))):
                with self.assertRaisesRegex(gpu_rve.Error, f"^{name} is in the memory of a device"):
                    work()
            self.assertEqual(elsewhere.lent, 0)
            # Only the capsule reports this kind of memory.
            liar = Lender(f, kind=kind, says=(1, 0))
            with self.assertRaisesRegex(gpu_rve.Error, "^out is in the memory of a device"):
                batch.advance(f, DT[2], 10, out=liar)
            self.assertEqual((liar.lent, liar.returned), (1, 1))
        self.assertEqual(batch.save(), state)

    def test_arrays_of_a_device_are_those_of_the_batch(self):
        f = increments(2, 2, 3)
        found = _arrays.found_doubles(Lender(f, kind=2, number=1), "out", f.shape, 1, True)
        self.assertEqual((found.address, found.on_device), (f.ctypes.data, True))
        for lender, message in (
            (Lender(f, kind=2),
             "CUDA device 0; it must be in the memory of CUDA device 1, which has the batch, or of "
             "the host"
             ),
            (Lender(f, kind=10, number=1),
             "a device that is not CUDA's .DLPack's kind 10.; it must be in the memory of CUDA "
             "device 1"
             )):
            with self.assertRaisesRegex(gpu_rve.Error, f"^out is in the memory of {message}"):
                _arrays.found_doubles(lender, "out", f.shape, 1, True)
            self.assertEqual(lender.lent, 0)

    def test_arrays_that_cannot_receive_are_refused_and_change_nothing(self):
        batch = gpu_rve.Batch([DISKS] * 2, **OPTIONS)
        f, state, room = increments(2, 2, 3), batch.save(), np.zeros((2, 2, 2))
        fixed = room.copy()
        fixed.flags.writeable = False
        for out, message in ((room.astype(np.float32), "dtype float32; it must have float64"),
                             (room.astype(int),
                              "dtype int64"), (room.astype(">f8"), "dtype >f8"), (np.zeros(
                                  (2, 2)), r"shape \(2, 2\); it must have \(2, 2, 2\)"),
                             (room.T, r"strides \(8, 16, 32\) .bytes.; they must be \(32, 16, 8\)"),
                             (np.zeros((2, 2, 4))[:, :, ::2], r"strides \(64, 32, 16\)"),
                             (fixed, "read-only"), ([[0.0]], "type list"), (Lender(
                                 room.astype(np.float32)), "dtype float32"), (Lender(
                                     room, says_strides=True, code=1), "dtype uint64"), (Lender(
                                         room.T,
                                         says_strides=True), r"strides \(8, 16, 32\)"), (Lender(
                                             room, versioned=True, flags=1), "read-only"), (Lender(
                                                 room, versioned=True,
                                                 major=2), "tensor of DLPack 2")):
            with self.subTest(message), self.assertRaisesRegex(
                    gpu_rve.Error, f"^out (has|is)( of| an?)* .*{message}"):
                batch.advance(f, DT[2], 10, out=out)
            if isinstance(out, Lender):
                self.assertEqual((out.lent, out.returned), (1, 1))
        self.assertEqual(batch.save(), state)

    def test_a_path_is_followed_to_its_end(self):
        batch = gpu_rve.Batch([DISKS] * 2, **OPTIONS)
        table, statuses = batch.follow_path("stage rate yy -0.5 until strain yy < -0.9e-3",
                                            DT[2],
                                            20,
                                            10, ["def_yy", "syy"],
                                            which=[1])
        self.assertEqual(table.shape, (11, 1, 2))
        self.assertFalse(statuses.any())
        np.testing.assert_allclose(np.log(table[:, 0, 0]),
                                   -np.minimum(np.arange(11) * 2e-4, 1e-3),
                                   atol=1e-9)
        self.assertEqual(table[-1, 0, 1], batch["syy"][1])
        self.assertEqual(batch["substeps"][0], 0)

    def test_whole_numbers_are_integers(self):
        batch = gpu_rve.Batch([DISKS] * 2, **OPTIONS)
        one, state = np.eye(2), batch.save()
        path = "stage rate yy -0.1 until time > 1"
        for work in (lambda n: batch.advance(one, DT[2], n),
                     lambda n: batch.trial(one, DT[2], [n, n]), lambda n: batch.time_steps([n]),
                     lambda n: batch.quantity("p", [n]), lambda n: batch.packing(n),
                     lambda n: batch.set_packing(n, DISKS), DISKS.image,
                     lambda n: batch.follow_path(path, DT[2], n, 1, ["p"]),
                     lambda n: batch.follow_path(path, DT[2], 1, n, ["p"]),
                     lambda n: gpu_rve.SmallStrainModel([DISKS], n, **OPTIONS),
                     lambda n: element_tests.shear(DISKS, rows=n, **OPTIONS)):
            for wrong in (1.5, 1.0, True, np.float64(1.0), np.bool_(True), "1", None):
                with self.assertRaises(TypeError):
                    work(wrong)
        for right in (3, np.int32(3), np.int64(3), np.uint8(3), [3, 3],
                      np.array([3, 3], dtype=np.uint16)):
            batch.trial(one, DT[2], right)
            batch.revert()
        self.assertEqual(batch.packing(np.int64(1)).grains, DISKS.grains)
        for wrong in (2**40, -2**31 - 1):
            with self.assertRaisesRegex(
                    gpu_rve.Error,
                    "substeps has a number that is not from -2147483648 to 2147483647"):
                batch.trial(one, DT[2], wrong)
        for wrong in (lambda: batch.follow_path(path, DT[2], 1, -1, ["p"]),
                      lambda: batch.quantity("p", [-1])):
            with self.assertRaisesRegex(gpu_rve.Error, "is -1; it must be at least 0"):
                wrong()
        self.assertEqual(batch.save(), state)

    def test_a_time_step_above_the_bound_is_refused(self):
        batch = gpu_rve.Batch([DISKS] * 2, **OPTIONS)
        bound = batch.time_steps()
        batch.trial(np.eye(2), bound, 1)
        with self.assertRaisesRegex(gpu_rve.Error,
                                    r"dt of RVE 0 is .* at most the stability bound .* \[time\]"):
            batch.trial(np.eye(2), 1.7 * bound, 1)

    def test_errors_name_what_is_wrong(self):
        batch = gpu_rve.Batch([DISKS], **OPTIONS)
        for message, work in (("must be fast or mixed",
                               lambda: gpu_rve.Batch([DISKS], format="quad")),
                              ("did you mean pairs", lambda: batch["pair"]),
                              ("nowhere.rve",
                               lambda: gpu_rve.Packing.read("nowhere.rve")), ("no parameter 'mu'",
                                                                              lambda: DISKS["mu"]),
                              ("must be a number or rest",
                               lambda: gpu_rve.Packing.create(radius=(1, 2), k0="lest")),
                              ("the recipe lacks grains",
                               lambda: gpu_rve.Packing.create(radius=(1, 2))),
                              ("must be below 1", lambda: batch.time_steps([1])),
                              ("packing 0 has disks, but packing 1 has spheres",
                               lambda: gpu_rve.Batch([DISKS, SPHERES])),
                              ("strain_rates is a null pointer",
                               lambda: batch.tangents(kind="loading"))):
            with self.subTest(message), self.assertRaisesRegex(gpu_rve.Error, message):
                work()
        with self.assertRaises(ValueError):    # shapes that do not fit are NumPy's errors
            batch.trial(np.eye(3), DT[2], 1)


if __name__ == "__main__":
    unittest.main()
