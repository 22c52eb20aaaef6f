# SPDX-License-Identifier: GPL-2.0-only
"""VTK's reader, which is ParaView's, opens the files of to_paraview.py: points, cells and arrays
have the numbers of the dumps at their times."""

import os
import subprocess
import sys
import xml.etree.ElementTree as xml

import dumps
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

converter = os.path.join(sys.argv[1], "to_paraview.py")


def convert(*words):
    subprocess.run([sys.executable, converter, *words], check=True)


def series(path):
    """Returns times of a .pvd and its frames from VTK."""
    for entry in xml.parse(path).getroot().find("Collection"):
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(os.path.join(os.path.dirname(path), entry.get("file")))
        reader.Update()
        assert reader.GetErrorCode() == 0 and reader.GetOutput().GetNumberOfPoints() > 0, entry.get(
            "file")
        yield float(entry.get("timestep")), reader.GetOutput()


def array(data, name):
    found = data.GetArray(name)
    assert found is not None, (name, [
        data.GetArrayName(k) for k in range(data.GetNumberOfArrays())
    ])
    return vtk_to_numpy(found)


def at(grid):
    return vtk_to_numpy(grid.GetPoints().GetData())


points, grains, contacts = (list(dumps.frames(name + ".dump"))
                            for name in ("points", "grains", "contacts"))

convert("points", "points.dump", "--out", "paraview/points.pvd")
frames = list(series("paraview/points.pvd"))
assert len(frames) == len(points) == 5
for (time, grid), frame in zip(frames, points):
    assert time == frame.time == frame.step * 1e-3
    assert grid.GetNumberOfPoints() == grid.GetNumberOfCells() == len(frame) == 100
    assert np.array_equal(at(grid)[:, 0], frame["x"]) and np.array_equal(at(grid)[:, 1], frame["y"])
    data = grid.GetPointData()
    for name in frame.columns:    # every column of the dump
        if name not in ("x", "y", "z"):
            assert np.array_equal(array(data, name), frame[name]), name
    stress = array(data, "stress").reshape(-1, 3, 3)
    for name, i, j in (("xx", 0, 0), ("yy", 1, 1), ("xy", 0, 1), ("xy", 1, 0), ("zz", 2, 2)):
        assert np.array_equal(stress[:, i, j], frame["stress_" + name])
    assert np.array_equal(
        array(data, "deformation_gradient").reshape(-1, 3, 3)[:, 0, 1], frame["def_xy"])
    assert np.array_equal(array(data, "displacement_vector")[:, 1], frame["uy"])

# Boxes are initially squares that fill ground and footing, and later have the size of the
# deformation gradient.
convert("points", "points.dump", "--boxes", "--out", "paraview/soil.pvd")
for (time, grid), frame in zip(series("paraview/soil.pvd"), points):
    assert grid.GetNumberOfCells() == len(frame) and grid.GetNumberOfPoints() == 4 * len(frame)
    corners = at(grid).reshape(-1, 4, 3)[:, :, :2]
    diagonals = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    area = 0.5 * (diagonals[0][:, 0] * diagonals[1][:, 1] - diagonals[0][:, 1] * diagonals[1][:, 0])
    volume_change = frame["def_xx"] * frame["def_yy"] - frame["def_xy"] * frame["def_yx"]
    assert np.allclose(area, 0.25**2 * volume_change, rtol=1e-6), (area, volume_change)
    assert np.array_equal(array(grid.GetCellData(), "p"), frame["p"])

convert("grains", "grains.dump", "--contacts", "contacts.dump", "--out", "paraview/grains.pvd")
chains, cells = list(series("paraview/grains.contacts.pvd")), list(
    series("paraview/grains.cell.pvd"))
for k, (time, grid) in enumerate(series("paraview/grains.pvd")):
    grain, contact = grains[k], contacts[k]
    assert time == grain.time == chains[k][0] == cells[k][0]
    assert grid.GetNumberOfPoints() == len(grain) == 400
    assert np.array_equal(array(grid.GetPointData(), "radius"), grain["radius"])
    lines = chains[k][1]
    assert lines.GetNumberOfCells() == len(contact) > 700
    assert np.array_equal(array(lines.GetCellData(), "fn"), contact["fn"])
    assert np.array_equal(array(lines.GetCellData(), "force")[:, 0], contact["force_x"])
    ends = at(lines).reshape(-1, 2, 3)
    assert np.array_equal(ends[:, 0, 0], grain["x"][contact["id1"].astype(int) - 1])
    # The length is that of the radii less the overlap.
    reach = sum(grain["radius"][contact[name].astype(int) - 1] for name in ("id1", "id2"))
    assert np.allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1),
                       reach - contact["overlap"],
                       rtol=1e-7)
    corners = at(cells[k][1])
    assert np.allclose(corners[1] - corners[0], grain.cell[:, 0]) and np.allclose(
        corners[3] - corners[0], grain.cell[:, 1])

# Without branch vectors the nearest image is used, which gives the same lines.
with open("contacts.dump") as given, open("bare.dump", "w") as bare:
    for line in given:
        words = line.split()
        keep = [0, 1, 2, 3, 4] if line.startswith("ITEM: ENTRIES") else [0, 1, 2]
        table = line.startswith("ITEM: ENTRIES") or len(words) == 11
        bare.write(" ".join(words[n] for n in keep) + "\n" if table else line)
convert("grains", "grains.dump", "--contacts", "bare.dump", "--out", "paraview/bare.pvd")
for (_, lines), (_, others) in zip(series("paraview/bare.contacts.pvd"), chains):
    assert np.allclose(at(lines), at(others), atol=1e-10)
print(f"{len(points)} frames of points, boxes, grains, contacts and cells")
