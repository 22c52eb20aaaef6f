# SPDX-License-Identifier: GPL-2.0-only
"""The micro simulation of examples/precice in preCICE's Micro Manager: its checks of a class, and
its coupling loop with a participant that replaces libprecice, which neither Debian 12 nor PyPI has.

    python3 test_micro_manager.py <examples>        with gpu_rve and micro-manager-precice
"""

import os
import pathlib
import pickle
import shutil
import sys
import tempfile
import types
import unittest

import numpy as np

import gpu_rve

EXAMPLES = pathlib.Path(sys.argv.pop(1)).resolve()
POINTS, WINDOWS, DT = 5, 3, 1e-3


class Participant:
    """The functions of preCICE that the Micro Manager calls.

    In each time window the macro program first tries a wrong displacement gradient, goes back, and
    then uses the right one.
    """

    def __init__(self, name, config, rank, size):
        self.window, self.iteration = 0, 0
        self.written, self.stresses = {}, []
        Participant.last = self

    def gradients(self):
        """Returns rows of grad u at all points (2, POINTS, 2) in an iteration of a window."""
        rng = np.random.default_rng(10 * self.window + self.iteration)
        right = 1e-4 * (self.window + 1) * np.random.default_rng(1).uniform(-1, 1, (2, POINTS, 2))
        return right if self.iteration == 1 else right + 1e-4 * rng.uniform(-1, 1, right.shape)

    def get_mesh_dimensions(self, mesh):
        return 2

    def get_max_time_step_size(self):
        return DT

    def initialize(self):
        pass

    def finalize(self):
        pass

    def start_profiling_section(self, name):
        pass

    def stop_last_profiling_section(self):
        pass

    def set_mesh_access_region(self, mesh, region):
        assert list(region) == [0.0, 1.0, 0.0, 1.0]

    def get_mesh_vertex_ids_and_coordinates(self, mesh):
        return np.arange(POINTS), np.linspace(0.1, 0.9, 2 * POINTS).reshape(POINTS, 2)

    def is_coupling_ongoing(self):
        return self.window < WINDOWS

    def requires_writing_checkpoint(self):
        return self.iteration == 0

    def requires_reading_checkpoint(self):
        return self.iteration == 1    # advance() has just ended the wrong iteration

    def is_time_window_complete(self):
        return self.iteration == 0

    def read_data(self, mesh, name, ids, dt):
        return self.gradients()[int(name[-1]) - 1][ids]

    def write_data(self, mesh, name, ids, values):
        self.written[name] = np.array(values)

    def advance(self, dt):
        if self.iteration == 1:
            self.stresses.append(
                np.stack([self.written["Stress-1"], self.written["Stress-2"]], axis=1))
            self.window, self.iteration = self.window + 1, 0
        else:
            self.iteration = 1


class MicroManager(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        sys.modules["precice"] = types.SimpleNamespace(Participant=Participant)
        sys.path.insert(0, str(EXAMPLES / "precice"))
        global micro_manager, micro_simulation
        import micro_manager
        import micro_simulation

    def setUp(self):
        micro_simulation.RANK = micro_simulation.Rank()
        micro_simulation.PACKING = EXAMPLES / "packings" / "A_h0075.rve"
        micro_simulation.OPTIONS = {"format": "double", "device": "cpu", "threads": 1}
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)
        for name in ("micro-manager-config.json", "precice-config.xml"):
            shutil.copy(EXAMPLES / "precice" / name, folder.name)

    def test_the_class_passes_the_checks_of_its_interface(self):
        from micro_manager.micro_simulation import MicroSimulationClass, load_backend_class

        found = load_backend_class("micro_simulation")
        # the class itself and not a wrapper
        self.assertIs(found, micro_simulation.MicroSimulation)
        log = types.SimpleNamespace(log_info_rank_zero=print)
        checked = MicroSimulationClass(found, "micro_simulation", "rve", 1, None, log)
        self.assertEqual(checked.check_initialize(checked(7), None), (False, False, False, None))
        self.assertFalse(checked.check_output())
        self.assertEqual(checked(8).get_global_id(), 8)

    def test_the_coupling_loop_has_the_bits_of_gpu_rve_in_one_call_for_all(self):
        manager = micro_manager.MicroManagerCoupling("micro-manager-config.json")
        manager.initialize()
        manager.solve()

        participant, rank = Participant.last, micro_simulation.RANK
        self.assertEqual(rank.calls, 2 * WINDOWS)
        batch = gpu_rve.Batch([gpu_rve.Packing.read(micro_simulation.PACKING)] * POINTS,
                              **micro_simulation.OPTIONS)
        steps = int(np.ceil(DT / rank.largest_step))
        before = np.tile(np.eye(2), (POINTS, 1, 1))
        participant.iteration = 1
        for window, found in enumerate(participant.stresses):
            participant.window = window
            f = np.eye(2) + np.moveaxis(participant.gradients(), 0, 1)
            stress, _ = batch.advance(f @ np.linalg.inv(before), DT / steps, steps)
            np.testing.assert_array_equal(found, stress)
            before = f

    def test_a_state_goes_to_another_simulation_by_bytes(self):
        first, second = (micro_simulation.MicroSimulation(k) for k in range(2))
        one, other = ({
            "Displacement-Gradient-1": [a, 0.0], "Displacement-Gradient-2": [0.0, -1e-4]
        } for a in (1e-4, 2e-4))
        first.solve(one, DT)
        state = pickle.loads(pickle.dumps(first.get_state()))
        second.set_state(state)
        here, there = first.solve(other, DT), second.solve(other, DT)
        self.assertEqual(micro_simulation.RANK.calls, 1)
        np.testing.assert_array_equal(here["Stress-2"], there["Stress-2"])
        self.assertEqual(micro_simulation.RANK.calls, 2)
        self.assertEqual(sorted(pickle.loads(pickle.dumps(here))), ["Stress-1", "Stress-2"])
        with self.assertRaisesRegex(KeyError, "there is no Strain"):
            here["Strain"]

    def test_simulations_may_come_and_go(self):
        first, gone = (micro_simulation.MicroSimulation(k) for k in range(2))
        data = {"Displacement-Gradient-1": [1e-4, 0.0], "Displacement-Gradient-2": [0.0, -1e-4]}
        more = {"Displacement-Gradient-1": [2e-4, 0.0], "Displacement-Gradient-2": [0.0, -1e-4]}
        stress = first.solve(data, DT)["Stress-1"]
        gone.destroy()
        late = micro_simulation.MicroSimulation(2)
        np.testing.assert_array_equal(late.solve(data, DT)["Stress-1"], stress)
        here, there = first.solve(more, DT), late.solve(more, DT)
        np.testing.assert_array_equal(here["Stress-1"], there["Stress-1"])

    def test_a_failure_names_the_simulation(self):
        sound, failing = (micro_simulation.MicroSimulation(k) for k in range(2))
        answer = sound.solve(
            {"Displacement-Gradient-1": [1e-4, 0.0], "Displacement-Gradient-2": [0.0, 0.0]}, DT)
        failing.solve(
            {"Displacement-Gradient-1": [-0.6, 0.0], "Displacement-Gradient-2": [0.0, -0.6]}, DT)
        with self.assertRaisesRegex(RuntimeError,
                                    "micro simulation 1 did not bear its increment: .*overlap"):
            answer["Stress-1"]


if __name__ == "__main__":
    unittest.main()
