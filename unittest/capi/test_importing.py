# SPDX-License-Identifier: GPL-2.0-only
"""Packings of other programs: Packing.from_arrays, gpu_rve.importing and tools/import_packing.py.
GPU_RVE_LIBRARY names the library.

    python3 test_importing.py <folder of the packings of the examples>

Data in unittest/data: import_lammps.* is from LAMMPS (4 Feb 2025), 100 spheres that were sheared in
a triclinic cell with pair granular (hooke, linear_history). import_sudodem.* is from SudoDEM2D: the
packing A_h0075 after 1000 steps of shear, with the positions of the last force evaluation.
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

import gpu_rve
from gpu_rve import importing

PACKINGS = pathlib.Path(sys.argv.pop(1))
ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = ROOT / "unittest" / "data"
DISKS, SPHERES = (gpu_rve.Packing.read(PACKINGS / name) for name in ("A_h0075.rve", "S500.rve"))
OPTIONS = {"format": "double", "device": "cpu", "threads": 1}
OF_DISKS = {"kn": 1e6, "friction": 0.5, "density": 2650.0, "damping": 0.3, "thickness": 0.075}
OF_SPHERES = {"kn": 1e6, "friction": 0.5, "density": 2650.0, "damping": 0.3}
HERTZ = {
    "contact": "hertz",
    "hertz_kn": 1e9 * 4 / 3 / (2 * (1 - 0.25**2)),
    "mindlin_kt": 9e8,
    "friction": 0.5,
    "density": 2650.0,
    "damping": 0.3,
    "mindlin_displacement": 1
}
# Forces follow from positions that have about 16 digits. The error is relative to the largest
# force.
EXACT = 1e-12
SUDODEM_CELL = [[0.14296459993509414, 0.00036701568598255765], [0.0, 0.1469532276206437]]


def parts(contacts):
    """Returns normal forces (C) and tangential forces (C, D) on the first grains."""
    normal = contacts["branch"] / np.linalg.norm(contacts["branch"], axis=1)[:, None]
    return contacts["normal_force"], contacts["force"] + contacts["normal_force"][:, None] * normal


def assert_same_forces(found, expected, tolerance=EXACT):
    np.testing.assert_array_equal(found["grains"], expected["grains"])
    largest = expected["normal_force"].max()
    for a, b in zip(parts(found), parts(expected)):
        np.testing.assert_allclose(a, b, rtol=0, atol=tolerance * largest)


def sheared(packing, steps=400):
    """Returns the packing after some shear, so that contacts have tangential forces."""
    batch = gpu_rve.Batch([packing], **OPTIONS)
    f = np.eye(packing.dimension)
    f[0, 1] = 2e-3
    batch.advance(f, 0.5 * batch.time_steps()[0], steps)
    return batch.packing(0)


class Case(unittest.TestCase):

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, text):
        file = self.folder / name
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return file

    def assert_refused(self, message, work, *arguments, **options):
        with self.subTest(message), self.assertRaisesRegex(gpu_rve.Error, message):
            work(*arguments, **options)


class Arrays(Case):

    def test_forces_of_a_state_are_kept(self):
        hertz = gpu_rve.Packing.from_arrays(SPHERES.cell, SPHERES.positions, SPHERES.radii, HERTZ)
        for packing, material in ((DISKS, OF_DISKS), (SPHERES, OF_SPHERES), (hertz, HERTZ)):
            start = sheared(packing)
            self.assertGreater(np.abs(parts(start.contacts())[1]).max(), 0.0)
            back = gpu_rve.Packing.from_arrays(start.cell,
                                               start.positions,
                                               start.radii,
                                               material,
                                               start.contacts(),
                                               velocities=start.velocities,
                                               spins=start.spins)
            assert_same_forces(back.contacts(), start.contacts())
            for keyword, value in material.items():
                if keyword != "contact":
                    self.assertEqual(back[keyword], value)
            # Both packings continue in the same way.
            d = packing.dimension
            f, stresses = np.diag([1.0] * (d - 1) + [0.9999]), []
            for one in (start, back):
                batch = gpu_rve.Batch([one], **OPTIONS)
                stresses.append(batch.advance(f, 0.4 * batch.time_steps()[0], 50)[0][0])
            np.testing.assert_allclose(*stresses, atol=1e-8 * np.abs(stresses[0]).max())

    def test_defaults_of_the_material_are_those_of_create_rve(self):
        material = {"kn": 2e6, "density": 1000.0, "rolling_friction": 0.1}
        made = gpu_rve.Packing.from_arrays(DISKS.cell, DISKS.positions, DISKS.radii, material)
        created = gpu_rve.Packing.create(grains=60,
                                         radius=(0.0025, 0.005),
                                         pressure=1e4,
                                         **material)
        for keyword in ("kn", "kt", "kr", "friction", "rolling_friction", "gamma_n", "gamma_t",
                        "gamma_r", "density", "damping", "thickness", "mass_depth"):
            self.assertEqual(made[keyword], created[keyword], keyword)

    def test_every_keyword_of_the_material_is_read(self):
        values = {**HERTZ, "contact": "dmt", "surface_energy": 1.0, "adhesion_reach": 1e-4,
                  "gamma_n": 3.0, "viscoelastic_damping": 0.1, "restitution_damping": 0.2,
                  "mindlin_damping": 0.3, "kr": 4.0, "rolling_friction": 0.1, "gamma_r": 5.0,
                  "k_twist": 6.0, "twisting_friction": 7.0, "gamma_twist": 8.0,
                  "damping_objective": 1.0}    # yapf: disable
        made = gpu_rve.Packing.from_arrays(SPHERES.cell, SPHERES.positions, SPHERES.radii, values)
        for keyword, value in values.items():
            if keyword != "contact":
                self.assertEqual(made[keyword], value, keyword)

    def test_cells_of_the_same_lattice_have_the_same_forces(self):
        for packing, material in ((DISKS, OF_DISKS), (SPHERES, OF_SPHERES)):
            start = sheared(packing)
            d, h = start.dimension, start.cell
            exchanged = h[:, [1, 0] if d == 2 else [0, 2, 1]]
            oblique = h.copy()
            oblique[:, d - 1] += 3 * h[:, 0] - 2 * h[:, d - 2]
            for cell in (exchanged, oblique):
                back = gpu_rve.Packing.from_arrays(cell,
                                                   start.positions,
                                                   start.radii,
                                                   material,
                                                   start.contacts(),
                                                   wrap=True)
                self.assertGreater(np.linalg.det(back.cell), 0.0)
                assert_same_forces(back.contacts(), start.contacts())

    def test_origin_and_periodic_images_do_not_matter(self):
        for packing, material in ((DISKS, OF_DISKS), (SPHERES, OF_SPHERES)):
            d = packing.dimension
            corner = np.array([3.0, -2.0, 1.0])[:d] * 0.1
            image = np.random.default_rng(1).integers(-2, 3, (packing.grains, d)) @ packing.cell.T
            for x, options in ((packing.positions + corner, {
                    "origin": corner
            }), (packing.positions + image, {
                    "wrap": True
            })):
                back = gpu_rve.Packing.from_arrays(packing.cell, x, packing.radii, material,
                                                   **options)
                # The sums have larger numbers and hence larger rounding errors.
                assert_same_forces(back.contacts(), packing.contacts(), 30 * EXACT)

    def test_wrong_arrays_are_refused(self):
        x, r, h = DISKS.positions, DISKS.radii, DISKS.cell

        def changed(array, index, value):
            array = array.copy()
            array[index] = value
            return array

        far = changed(x, (17, 1), 1.1 * h[1, 1])
        near = changed(x, 5, x[9] + [0.3 * min(r[5], r[9]) + abs(r[5] - r[9]), 0.0])
        pair = DISKS.contacts()["grains"][0]
        apart = next([0, j]
                     for j in range(1, 400)
                     if not np.any(np.all(DISKS.contacts()["grains"] == [0, j], axis=1)))
        given = {"cell": h, "positions": x, "radii": r, "material": OF_DISKS}
        cases = (
            (r"^positions\[17, 1\] is nan \[length\]; it must be finite",
             {"positions": changed(x, (17, 1), np.nan)}),
            (r"^radii\[3\] is inf \[length\]; it must be finite", {"radii": changed(r, 3, np.inf)}),
            (r"^the radius of grain 3 \(counted from 0\) is 0.0 \[length\]; it must be greater",
             {"radii": changed(r, 3, 0.0)}),
            (r"^positions has shape \(400, 2\); it must have \(N, 3\)", {"cell": np.eye(3)}),
            (r"^radii has shape \(399,\); it must have \(400\)", {"radii": r[1:]}),
            (r"^cell has shape \(2, 3\)", {"cell": np.ones((2, 3))}),
            (r"^cell\[0, 1\] is nan \[length\]", {"cell": changed(h, (0, 1), np.nan)}),
            (r"^the cell has the volume 0 \[length\^2\]", {"cell": np.ones((2, 2))}),
            (r"^grain 17 \(counted from 0\) is 0.0147 \[length\] outside the cell along cell vector"
             r" 1 \(fraction 1.1\), as are 1 grains; the limit is its radius, 0.00486",
             {"positions": far}),
            ("grain 5 .* and grain 9 .* overlap by .* of the smaller radius; the limit is 0.5, "
             "which .* pairs exceed", {"positions": near, "wrap": True}),
            ("have the same position", {"positions": changed(x, 5, x[9])}),
            ("the limit is 0.01", {"overlap_limit": 0.01}),
            ("overlap by .*the limit is 0.5", {"radii": 2 * r}),
            ("^cell width perpendicular to cell vector 1 is 0.01",
             {"cell": [0.01, 0.04], "positions": x[:1], "radii": r[:1], "wrap": True}),
            ("^the material has no kn", {"material": {"density": 1.0}}),
            ("^the material has no hertz_kn", {"material": {"density": 1.0, "contact": "hertz"}}),
            ("^contact is 'jkr'; it must be hooke, hertz or dmt",
             {"material": {**OF_DISKS, "contact": "jkr"}}),
            ("^'frction' is not a material value; did you mean friction",
             {"material": {**OF_DISKS, "frction": 1}}),
            ("^friction is 'much'; it must be a number",
             {"material": {**OF_DISKS, "friction": "much"}}),
            ("^friction is -1 .*must not be negative", {"material": {**OF_DISKS, "friction": -1}}),
            ("^forces must be a dictionary", {"forces": [1.0]}),
            (r"forces\['grains'\]\[0\] is \(0, 400\)",
             {"forces": {"grains": [[0, 400]], "force": [1.0]}}),
            ("do not touch; the overlap must be above 0",
             {"forces": {"grains": [apart], "force": [[1.0, 0.0]]}}),
            ("is given twice in forces",
             {"forces": {"grains": [pair, pair[::-1]], "force": [0.0, 0.0]}}),
            (r"forces\['force'\]\[0, 1\] is nan \[force\]",
             {"forces": {"grains": [pair], "force": [[0.0, np.nan]]}}),
            (r"^the packing has a mean velocity \(10, -5\) \[length/time\], which is most of the "
             "motion of its grains; it must be 0",
             {"velocities": np.broadcast_to([10.0, -5.0], x.shape)}),
        )    # yapf: disable
        for message, changes in cases:
            self.assert_refused(message, gpu_rve.Packing.from_arrays, **{**given, **changes})


class References(Case):
    """Forces of imported states are those of the files."""

    def test_of_disks_with_tangential_forces(self):
        grains = importing.read_csv(DATA / "import_sudodem.csv", cell=SUDODEM_CELL)
        contacts = importing.read_contacts(DATA / "import_sudodem_contacts.csv")
        packing = grains.with_forces(contacts).packing(OF_DISKS)
        normal, tangential = parts(packing.contacts())
        table = np.loadtxt(DATA / "import_sudodem_contacts.csv", delimiter=",", skiprows=1)
        np.testing.assert_array_equal(packing.contacts()["grains"], table[:, :2])
        n = packing.contacts()["branch"] / np.linalg.norm(packing.contacts()["branch"],
                                                          axis=1)[:, None]
        along = tangential[:, 1] * n[:, 0] - tangential[:, 0] * n[:, 1]
        np.testing.assert_allclose(normal, table[:, 2], rtol=0, atol=EXACT * table[:, 2].max())
        np.testing.assert_allclose(along, table[:, 3], rtol=0, atol=EXACT * table[:, 2].max())
        # The sign is right: with it the forces on a grain cancel.
        self.assertLess(self.unbalanced(packing), 1e-3)
        wrong = {**contacts, "force": -contacts["force"]}
        self.assertGreater(self.unbalanced(grains.with_forces(wrong).packing(OF_DISKS)), 0.1)

    @staticmethod
    def unbalanced(packing):
        contacts, total = packing.contacts(), np.zeros_like(packing.positions)
        np.add.at(total, contacts["grains"][:, 0], contacts["force"])
        np.add.at(total, contacts["grains"][:, 1], -contacts["force"])
        return np.linalg.norm(total, axis=1).mean() / contacts["normal_force"].mean()

    def test_of_spheres_in_a_triclinic_cell(self):
        grains = importing.read_lammps_dump(DATA / "import_lammps.dump")
        file = importing.read_contacts(DATA / "import_lammps_contacts.dump")
        packing = grains.with_forces(file).packing(OF_SPHERES)
        normal, tangential = parts(packing.contacts())
        table = np.loadtxt(DATA / "import_lammps_contacts.dump", skiprows=9)
        pairs = np.sort(table[:, :2].astype(int), axis=1) - 1
        order = np.lexsort((pairs[:, 1], pairs[:, 0]))
        np.testing.assert_array_equal(packing.contacts()["grains"], pairs[order])
        n = packing.contacts()["branch"] / np.linalg.norm(packing.contacts()["branch"],
                                                          axis=1)[:, None]
        force = table[order, 3:] * np.where(table[order, 0] < table[order, 1], 1, -1)[:, None]
        along = np.einsum("ca,ca->c", force, n)
        largest = table[:, 2].max()
        # LAMMPS' own vectors are across the normal to about 3e-11.
        self.assertLess(np.abs(along).max(), 1e-10 * largest)
        np.testing.assert_allclose(normal, table[order, 2], rtol=0, atol=EXACT * largest)
        np.testing.assert_allclose(tangential,
                                   force - along[:, None] * n,
                                   rtol=0,
                                   atol=EXACT * largest)
        self.assertLess(self.unbalanced(packing), 1e-4)

    def test_stresses_of_packings_at_100_kpa(self):
        # stresses by which the packings were prepared
        material = {**HERTZ, "mindlin_displacement": 0}
        for name, values, expected in (("H1", material,
                                        [100000.00545927502, 4.257582795472862,
                                         -856.5132222060704]), ("S1", OF_SPHERES, None)):
            grains = importing.read_lammps_data(DATA / f"spheres_{name}.data")
            self.assertEqual(grains.densities[0], 2650.0)
            packing = grains.packing(values)
            stress = gpu_rve.Batch([packing], **OPTIONS).trial(np.eye(3), 1e-6, 0)[0][0]
            self.assertAlmostEqual(np.trace(stress) / 3, -1e5, delta=0.05)
            if expected:
                np.testing.assert_allclose(-stress[0], expected, rtol=0, atol=1e-7)


class Readers(Case):

    def test_data_and_dumps_of_lammps_have_the_same_grains(self):
        dump = importing.read_lammps_dump(DATA / "import_lammps.dump")
        data = importing.read_lammps_data(DATA / "import_lammps.data")
        self.assertEqual(dump.walls, (False,) * 3)
        np.testing.assert_array_equal(data.ids, np.arange(1, 101))
        expected = dump.packing(OF_SPHERES).contacts()
        # write_data has 16 digits
        assert_same_forces(data.packing(OF_SPHERES).contacts(), expected)

        h, x = dump.cell, dump.positions
        s = (x - dump.origin) @ np.linalg.inv(h).T
        image = np.random.default_rng(2).integers(-1, 2, x.shape)
        box = "ITEM: BOX BOUNDS abc origin pp pp pp\n" + "\n".join(
            " ".join(map(repr, [*h[:, a].tolist(), float(dump.origin[a])])) for a in range(3))
        bounds = "\n".join((DATA / "import_lammps.dump").read_text().split("\n")[4:8])
        for columns, values, head in (("xs ys zs", s, bounds), ("xu yu zu", x + image @ h.T,
                                                                bounds), ("xsu ysu zsu", s + image,
                                                                          box), ("x y z", x, box)):
            rows = "\n".join(f"{row[0]!r} {2 * float(r)!r} {k} " + " ".join(map(repr, row.tolist()))
                             for k, (row, r) in enumerate(zip(values, dump.radii), 1))
            text = (f"ITEM: TIMESTEP\n7\nITEM: NUMBER OF ATOMS\n{len(x)}\n{head}\n"
                    f"ITEM: ATOMS c_any[1] diameter id {columns}\n{rows}\n")
            file = self.write(
                "other.dump",
                text.replace("TIMESTEP\n7", "TIMESTEP\n3").replace("diameter", "radius") + text)
            grains = importing.read_lammps_dump(file)
            self.assertEqual(importing.kind_of(file), "dump")
            assert_same_forces(grains.packing(OF_SPHERES).contacts(), expected, 10 * EXACT)
            self.assert_refused("overlap by|cell width",
                                importing.read_lammps_dump(file, step=3).packing, OF_SPHERES)
        self.assert_refused("has no frame of step 5; its steps are from 3 to 7",
                            importing.read_lammps_dump,
                            file,
                            step=5)

    def test_general_triclinic_data_and_styles(self):
        data = importing.read_lammps_data(DATA / "import_lammps.data")
        turn, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
        turn *= np.linalg.det(turn)
        h, x = turn @ data.cell, (data.positions - data.origin) @ turn.T + 0.5
        text = ("title\n\n100 atoms\n1 atom types\n" + "\n".join(
            " ".join(map(repr, map(float, h[:, a]))) + f" {'abc'[a]}vec" for a in range(3)) +
                "\n0.5 0.5 0.5 abc origin\n\nAtoms # sphere\n\n" +
                "\n".join(f"{i} 1 {2 * float(r)!r} {1000 + i} " + " ".join(map(repr, row.tolist()))
                          for i, (r, row) in enumerate(zip(data.radii, x), 1)) + "\n")
        grains = importing.read_lammps_data(self.write("general.data", text))
        self.assert_refused(r"the grains have densities from 1001 to 1100 .*: give density",
                            grains.packing, {"kn": 1e6})
        found = grains.packing(OF_SPHERES).contacts()
        expected = data.packing(OF_SPHERES).contacts()
        np.testing.assert_array_equal(found["grains"], expected["grains"])
        np.testing.assert_allclose(found["force"],
                                   expected["force"] @ turn.T,
                                   rtol=0,
                                   atol=1e-10 * expected["normal_force"].max())
        for message, old, new in (
            (r"general.data:10: the atoms have the style atomic; it must be sphere", "# sphere",
             "# atomic"), ("has 100 lines of atoms; it must have 101", "100 atoms", "101 atoms"),
            (r"general.data:12: diameter is -1 \[length\]; it must be greater than 0",
             f"1 1 {2 * float(data.radii[0])!r}",
             "1 1 -1"), (r"general.data:12: diameter is nan \[length\]; it must be finite",
                         f"1 1 {2 * float(data.radii[0])!r}", "1 1 nan"),
            (r"general.data:13: grain 1 is given twice", "\n2 1 ", "\n1 1 ")):
            self.assertIn(old, text)
            self.assert_refused(message, importing.read_lammps_data,
                                self.write("general.data", text.replace(old, new, 1)))

    def rows(self, packing, separator=" "):
        return "\n".join(
            separator.join(map(repr, [*x.tolist(), *([0.0] if len(x) == 2 else []),
                                      float(r)]))
            for x, r in zip(packing.positions, packing.radii)) + "\n"

    def test_lines_of_yade(self):
        edges = " ".join(repr(float(e)) for e in np.diag(SPHERES.cell))
        for packing, material, head, options in ((SPHERES, OF_SPHERES, f"##PERIODIC:: {edges}\n",
                                                  {}), (SPHERES, OF_SPHERES,
                                                        "#format x_y_z_r\n# x y z r\n", {
                                                            "cell": SPHERES.cell
                                                        }), (DISKS, OF_DISKS, "", {
                                                            "cell": np.diag(DISKS.cell)
                                                        })):
            file = self.write("yade.txt", head + self.rows(packing))
            self.assertEqual(importing.kind_of(file), "yade")
            made = importing.read_yade(file, **options).packing(material)
            assert_same_forces(made.contacts(), packing.contacts())
        clump = self.write("clump.txt", "0 0 0 1 -1\n0 0 3 1 0\n")
        self.assert_refused("clump.txt:2: the grain belongs to clump 0", importing.read_yade, clump)
        self.assert_refused(r"clump.txt:1: z is nan \[length\]", importing.read_yade,
                            self.write("clump.txt", "0 0 nan 1\n"))
        self.assert_refused("the format is x_y_z_matId", importing.read_yade,
                            self.write("clump.txt", "#format x_y_z_matId\n0 0 0 1\n"))
        self.assert_refused("the box is not periodic along x, y, z; .*--cell.*--core",
                            importing.read_yade(self.write("box.txt", self.rows(SPHERES))).packing,
                            OF_SPHERES)

    def test_tables_as_people_save_them(self):
        cell = np.diag(DISKS.cell)
        rows = self.rows(DISKS, ",")
        for text in ("x,y,z,radius\n" + rows, "\ufeffx,y,z,r\r\n" + rows.replace("\n", "\r\n"),
                     "x,y,z,radius\r" + rows.replace("\n", "\r"),
                     '"x [m]";"y [m]";"z [m]";"R (m)"\n'.lower() + rows.replace(",", ";"),
                     "# x y z radius\n" + rows.replace(",", " "),
                     "X\tY\tZ\tradius\n" + rows.replace(",", "\t")):
            file = self.write("grains.csv", text)
            self.assertEqual(importing.kind_of(file), "csv")
            made = importing.read_csv(file, cell=cell).packing(OF_DISKS)
            assert_same_forces(made.contacts(), DISKS.contacts())
        millimetres = importing.read_csv(self.write(
            "grains.csv", "id,d,x,y\n" +
            "".join(f"{n},{2e3 * float(r)!r},{1e3 * float(x)!r},{1e3 * float(y)!r}\n"
                    for n, (r, (x, y)) in enumerate(zip(DISKS.radii, DISKS.positions)))),
                                         cell=1e3 * cell)
        assert_same_forces(
            millimetres.scaled(1e-3).packing(OF_DISKS).contacts(), DISKS.contacts(), 10 * EXACT)
        cases = (
            ("grains.csv:2: x is '0,5'; it must be a number with a decimal point",
             "x;y;r\n0,5;0,5;0,1\n"),
            ("grains.csv:2: the line has 6 values; it must have 3: x y r .numbers must have a "
             "decimal point", "x,y,r\n0,5,0,5,0,1\n"),
            ("grains.csv:2: x is 'm'; it must be a number", "x,y,r\nm,m,m\n0.5,0.5,0.1\n"),
            ("grains.csv:3: r is '0.1 m'", "x,y,r\n0.5,0.5,0.1\n0.5,0.5,0.1 m\n"),
            ("grains.csv:3: y is nan .length.; it must be finite",
             "x,y,r\n0.5,0.5,0.1\n0.5,nan,0.1\n"),
            ("its columns are 0.5 0.6 0.1: the first line must name them", "0.5,0.6,0.1\n"),
            ("no column radius or diameter; its columns are x y", "x,y\n0.5,0.6\n"),
            ("each column must have its own name", "x,x,y\n1,2,3\n"),
            ("has no grains", "x,y,r\n"),
            ("is empty", ""),
            ("grains.csv:2: id is '1.5'; it must be an integer", "id,x,y,r\n1.5,1,1,1\n"),
            ("grains.csv:3: .*; it must be greater than 0", "# id x y r\n1 1 1 1\n2 2 2 -1\n"),
        )    # yapf: disable
        for message, text in cases:
            self.assert_refused(message,
                                importing.read_csv,
                                self.write("grains.csv", text),
                                cell=[1.0, 1.0])
        self.assert_refused("plain text, not binary or UTF-16", importing.read_csv,
                            self.write("grains.csv", "x,y,r\n".encode("utf-16")))
        self.assert_refused("cannot read .*none.csv: No such file", importing.read_csv,
                            self.folder / "none.csv")

    def test_names_of_grains_are_those_of_the_file(self):
        grains = importing.read_csv(self.write("grains.csv", "id,x,y,r\n70,1,1,1\n90,2,1,1\n"),
                                    cell=[10.0, 10.0])
        self.assert_refused(
            "^grain 70 and grain 90 overlap by 1 .length., 1 of the smaller radius; the "
            "limit is 0.5, which 1 pairs exceed", grains.packing, OF_DISKS)
        self.assert_refused("^a contact of grains 70 and 5 has a force, and no grain has the id 5",
                            grains.with_forces, {
                                "ids": np.array([[70, 5]]),
                                "force": np.ones(1)
                            })
        # the file name.contacts of write_rve
        contacts = importing.read_contacts(
            self.write(
                "of.contacts", "# contacts of one RVE (GPU_RVE); n from i to j, force on i\n"
                "# i j branch_x branch_y n_x n_y overlap f_n f_t force_x force_y\n"
                "70 90 1 0 1 0 1e-3 5 2 -5 2\n"))
        np.testing.assert_array_equal(contacts["ids"], [[70, 90]])
        np.testing.assert_array_equal(contacts["force"], [[-5, 2]])
        contacts = self.write("contacts.csv", "a,b,f\n1,2,3\n")
        self.assert_refused("it must have i and j", importing.read_contacts, contacts)

    def test_few_digits_are_reported(self):
        text = "x y r\n" + "".join(
            f"{x:.6g} {y:.6g} {r:.6g}\n" for (x, y), r in zip(DISKS.positions, DISKS.radii))
        grains = importing.read_csv(self.write("few.csv", text), cell=np.diag(DISKS.cell))
        self.assertAlmostEqual(grains.rounding, 5e-7)
        self.assertIn("WARNING: coordinates are rounded to 5e-07 [length]",
                      importing.summary(grains.packing(OF_DISKS), grains.rounding))
        exact = importing.read_csv(DATA / "import_sudodem.csv", cell=SUDODEM_CELL)
        self.assertNotIn("WARNING", importing.summary(exact.packing(OF_DISKS), exact.rounding))


class Cores(Case):
    """A core of a box with walls becomes a periodic packing."""

    def box(self, packing):
        d = packing.dimension
        shifts = np.array(list(np.ndindex(*(2,) * d))) @ packing.cell.T
        x = np.concatenate([packing.positions + shift for shift in shifts])
        r = np.tile(packing.radii, len(shifts))
        low, high = (x - r[:, None]).min(axis=0), (x + r[:, None]).max(axis=0)
        return importing.Grains(np.diag(high - low), low, x, r, np.arange(1,
                                                                          len(x) + 1), (True,) * d)

    def test_core_is_brought_to_a_pressure_without_shear_stress(self):
        for packing, material in ((DISKS, OF_DISKS), (SPHERES, OF_SPHERES)):
            d, box = packing.dimension, self.box(packing)
            self.assert_refused("the box is not periodic along x, y", box.packing, material)
            core, report = importing.cut_core(box, 0.03)
            self.assertEqual(report.grains, len(box.radii))
            self.assertEqual(len(core.radii), report.grains - report.outside - report.removed)
            self.assertGreater(report.void_ratio, report.void_ratio_before)
            made = core.packing(material)
            contacts = made.contacts()
            self.assertEqual(len(contacts["grains"]), report.kept + report.new)
            share = contacts["overlap"] / made.radii[contacts["grains"]].min(axis=1)
            self.assertLess(share.max(), 0.101)
            # Contacts inside keep their forces.
            found = np.sort(contacts["normal_force"])
            least = packing.contacts()["normal_force"]
            nearest = np.abs(found[:, None] - least[None]).min(axis=1)
            self.assertGreaterEqual((nearest < 1e-9 * least.max()).sum(), report.kept)

            batch = gpu_rve.Batch([made], **OPTIONS)
            axes = "xyz"[:d]
            path = "stage " + " ".join(f"stress {a}{b} {-1e5 if a == b else 0}"
                                       for k, a in enumerate(axes)
                                       for b in axes[k:]) + " until time > 1"
            table, statuses = batch.follow_path(path, 0.5 * batch.time_steps()[0], 200, 100,
                                                ["p", "q"])
            self.assertFalse(statuses.any())
            self.assertAlmostEqual(table[-1, 0, 0], 1e5, delta=100)
            self.assertLess(table[-1, 0, 1], 1e3)

    def test_forces_inside_are_kept(self):
        state = sheared(DISKS)
        box = self.box(state)
        shifts = np.array([(i, j) for i in (0, 1) for j in (0, 1)])
        rows, forces = [], []
        inner = state.contacts()
        direct = state.positions[inner["grains"][:, 1]] - state.positions[inner["grains"][:, 0]]
        within = np.all(np.abs(direct - inner["branch"]) < 1e-9, axis=1)
        for k in range(len(shifts)):
            rows.append(inner["grains"][within] + k * state.grains)
            forces.append(inner["force"][within])
        box = importing.dataclasses.replace(box,
                                            forces={
                                                "grains": np.concatenate(rows),
                                                "force": np.concatenate(forces)
                                            })
        core, report = importing.cut_core(box, [[0.02, 0.03], [0.02, 0.04]])
        self.assertLess(len(core.forces["grains"]), report.kept + 1)
        self.assertGreater(len(core.forces["grains"]), 0.8 * report.kept)
        made = core.packing(OF_DISKS)
        tangential = np.linalg.norm(parts(made.contacts())[1], axis=1)
        self.assertLessEqual(np.count_nonzero(tangential > 1e-6), len(core.forces["grains"]))
        self.assertGreater(np.count_nonzero(tangential > 1e-6), 0.9 * len(core.forces["grains"]))

    def test_margins_that_leave_too_little_are_refused(self):
        box = self.box(DISKS)
        self.assert_refused("the margins along x are 0.2 and 0.2 .length.; their sum must be below",
                            importing.cut_core, box, 0.2)
        self.assert_refused("cell width .* must exceed twice the largest contact distance",
                            importing.cut_core, box, 0.14)
        oblique = importing.dataclasses.replace(box, cell=box.cell + [[0, 0.1], [0, 0]])
        self.assert_refused("a core can be cut only if it is along x", importing.cut_core, oblique,
                            0.02)


class Command(Case):

    def run_tool(self, *words):
        return subprocess.run(
            [sys.executable, ROOT / "tools" / "import_packing.py", *map(str, words)],
            capture_output=True,
            text=True)

    def test_writes_a_packing_file(self):
        out = self.folder / "out.rve"
        words = (DATA / "import_sudodem.csv", out, *"kn 1e6 friction 0.5 density 2650".split(),
                 "thickness", 0.075, "--cell", *np.ravel(SUDODEM_CELL), "--forces",
                 DATA / "import_sudodem_contacts.csv")
        run = self.run_tool(*words)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("400 disks, void ratio 0.16", run.stdout)
        made = gpu_rve.Packing.read(out)
        self.assertGreater(np.abs(parts(made.contacts())[1]).max(), 1.0)
        run = self.run_tool(*words, "--forces-on", "second")
        self.assertEqual(run.returncode, 0, run.stderr)
        other = gpu_rve.Packing.read(out)
        np.testing.assert_allclose(parts(other.contacts())[1],
                                   -parts(made.contacts())[1],
                                   atol=1e-9)

    def test_refuses_in_one_line(self):
        out = self.folder / "out.rve"
        for message, words in (
            ("ERROR: --cell is not an option of data files",
             (DATA / "import_lammps.data", out, "kn", 1e6, "--cell", 1, 1,
              1)), ("ERROR: the material keyword kn has no value",
                    (DATA / "import_lammps.data", out,
                     "kn")), ("ERROR: the box is not periodic along z; a packing must be periodic",
                              (DATA / "import_lammps.data", out, "kn", 1e6, "--walls", "z")),
            ("ERROR: the material has no density", (DATA / "import_lammps.dump", out, "kn", 1e6))):
            run = self.run_tool(*words)
            self.assertEqual(run.returncode, 1)
            self.assertIn(message, run.stderr)
            self.assertNotIn("Traceback", run.stderr)
            self.assertFalse(out.exists())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
