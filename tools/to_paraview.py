#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Converts dumps into files of ParaView: one .vtu for each frame and a .pvd with all frames and
times.

    python3 to_paraview.py points points.dump                           points.pvd
    python3 to_paraview.py points points.dump --boxes --out soil.pvd    deformed quadrilaterals
    python3 to_paraview.py grains grains.dump --contacts contacts.dump  grains.pvd and
                                                                        grains.contacts.pvd

points    Any dump with the columns x and y. Every other column becomes an array; ux and uy
          become a vector `displacement_vector`, vx, vy a vector `velocity`, stress_xx,
          stress_yy, stress_xy (and stress_zz) a tensor `stress`, def_xx, def_xy, def_yx, def_yy
          a tensor `deformation_gradient`. With --boxes each point has a cell, which is deformed
          if the dump has def_xx, ...
grains    A dump rve/grain: points with radius and all columns, for Glyph (sphere, scale array
          radius, scale factor 2). --contacts adds the dump of compute rve/contact/local (id1,
          id2, and for periodic contacts branch_x, branch_y): a line from center to center for
          each contact, with all columns, for Tube (vary radius by fn). A line across the
          border of the cell leaves it. <out>.cell.pvd has the cell.

Times are those of the dump (dump_modify time yes), or steps times --dt, or steps. The script needs
numpy (Debian: python3-numpy) and meshio (Debian: python3-meshio; PyPI: meshio).
"""

import argparse
import os
import xml.etree.ElementTree as xml

import dumps
import meshio
import numpy as np


def flat(frame, x="x", y="y"):
    return np.stack([frame[x], frame[y], np.zeros(len(frame))], axis=1)


def tensor(frame, names):
    """Returns tensors (n, 9) in the row order of ParaView; the name 0 stands for a missing
    component."""
    return np.stack(
        [frame[name] if name and name in frame else np.zeros(len(frame)) for name in names], axis=1)


def arrays(frame, without=()):
    """Returns all columns of a frame, and the vectors and tensors that some of them form."""
    data = {
        name: values.astype(np.int64)
        if name in ("id", "type", "atom", "id1", "id2", "sliding", "contacts")
        and np.all(values == np.round(values)) else values
        for name, values in frame.columns.items() if name not in without
    }
    for vector, x, y in (("displacement_vector", "ux", "uy"), ("velocity", "vx", "vy"),
                         ("force", "fx", "fy"), ("force", "force_x", "force_y")):
        if x in frame and y in frame:
            data[vector] = flat(frame, x, y)
    if all(name in frame for name in ("stress_xx", "stress_yy", "stress_xy")):
        yx = "stress_yx" if "stress_yx" in frame else "stress_xy"
        data["stress"] = tensor(
            frame, ("stress_xx", "stress_xy", 0, yx, "stress_yy", 0, 0, 0, "stress_zz"))
    if all(name in frame for name in ("def_xx", "def_xy", "def_yx", "def_yy")):
        gradient = tensor(frame, ("def_xx", "def_xy", 0, "def_yx", "def_yy", 0, 0, 0, 0))
        gradient[:, 8] = 1.0    # plane strain
        data["deformation_gradient"] = gradient
    return data


class Series:
    """A .pvd next to a folder with the .vtu files of its frames."""

    def __init__(self, path):
        self.path = path if path.endswith(".pvd") else path + ".pvd"
        self.folder = self.path[:-4]
        os.makedirs(self.folder, exist_ok=True)
        self.root = xml.Element("VTKFile",
                                type="Collection",
                                version="0.1",
                                byte_order="LittleEndian")
        self.list = xml.SubElement(self.root, "Collection")

    def add(self, time, mesh):
        name = f"{len(self.list):05d}.vtu"
        meshio.write(os.path.join(self.folder, name), mesh, file_format="vtu", binary=True)
        xml.SubElement(self.list,
                       "DataSet",
                       timestep=repr(float(time)),
                       group="",
                       part="0",
                       file=f"{os.path.basename(self.folder)}/{name}")

    def close(self):
        xml.indent(self.root)
        xml.ElementTree(self.root).write(self.path, xml_declaration=True, encoding="utf-8")
        print(f"wrote {self.path} ({len(self.list)} frames)")


def time_of(frame, dt):
    return frame.time if frame.time is not None else frame.step * (dt or 1.0)


def points(options):
    series = Series(options.out or os.path.splitext(options.dump)[0])
    size = options.size
    for frame in dumps.frames(options.dump):
        if options.boxes:
            size = size or dumps.spacing(frame)
            corners = dumps.domains(frame, size).reshape(-1, 2)
            cells = [("quad", np.arange(4 * len(frame)).reshape(-1, 4))]
            mesh = meshio.Mesh(
                np.column_stack([corners, np.zeros(len(corners))]),
                cells,
                cell_data={name: [values]
                           for name, values in arrays(frame, ("z", )).items()})
        else:
            mesh = meshio.Mesh(flat(frame), [("vertex", np.arange(len(frame)).reshape(-1, 1))],
                               point_data=arrays(frame, ("z", )))
        series.add(time_of(frame, options.dt), mesh)
    series.close()


def contact_lines(grains, contacts):
    """Returns a line for each contact with its own two points, since a contact across the border of
    the cell ends outside."""
    place = {int(number): k for k, number in enumerate(grains["id"])}
    first = np.array([place[int(number)] for number in contacts["id1"]], int)
    second = np.array([place[int(number)] for number in contacts["id2"]], int)
    begin = flat(grains)[first]
    if "branch_x" in contacts:
        branch = flat(contacts, "branch_x", "branch_y")
    else:    # the nearest image; a cell is wider than two contacts
        away = (flat(grains)[second] - begin) @ np.linalg.inv(grains.cell).T
        branch = (away - np.round(away)) @ grains.cell.T
    n = len(contacts)
    ends = np.stack([begin, begin + branch], axis=1).reshape(-1, 3)
    data = arrays(contacts)
    return meshio.Mesh(
        ends, [("line", np.arange(2 * n).reshape(-1, 2))],
        cell_data={name: [values]
                   for name, values in data.items()},
        point_data={name: np.repeat(data[name], 2)
                    for name in ("fn", "ft") if name in data})


def grains(options):
    out = options.out or os.path.splitext(options.dump)[0]
    out = out[:-4] if out.endswith(".pvd") else out
    series, cells = Series(out), Series(out + ".cell")
    lines = Series(out + ".contacts") if options.contacts else None
    # Contacts belong to the grains of the same step.
    others = {frame.step: frame
              for frame in dumps.frames(options.contacts)} if options.contacts else {}
    for frame in dumps.frames(options.dump):
        time = time_of(frame, options.dt)
        series.add(
            time,
            meshio.Mesh(flat(frame), [("vertex", np.arange(len(frame)).reshape(-1, 1))],
                        point_data=arrays(frame, ("z", ))))
        a, b = frame.cell[:, 0], frame.cell[:, 1]
        low = np.array([frame.origin[0], frame.origin[1], 0.0])
        cells.add(
            time,
            meshio.Mesh(np.array([low, low + a, low + a + b, low + b]),
                        [("quad", np.array([[0, 1, 2, 3]]))]))
        if lines:
            if frame.step not in others:
                raise SystemExit(
                    f"{options.contacts} has no frame of step {frame.step}, which {options.dump} "
                    "has: write both at the same steps"
                )
            lines.add(time, contact_lines(frame, others[frame.step]))
    for written in (series, cells, lines):
        if written:
            written.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(required=True, metavar="points | grains")
    for name, function, help_text in (("points", points, "points of the continuum"),
                                      ("grains", grains, "grains of an RVE, and contacts")):
        kind = kinds.add_parser(name, help=help_text)
        kind.add_argument("dump", help="text dump of LAMMPS")
        kind.add_argument(
            "--out", help="the .pvd; beside it comes a folder of the same name with the frames")
        kind.add_argument("--dt",
                          type=float,
                          help="time step, for dumps without dump_modify time yes")
        if name == "points":
            kind.add_argument("--boxes", action="store_true", help="a quadrilateral for each point")
            kind.add_argument(
                "--size",
                type=float,
                help="its side in the undeformed state; found from the points if left out")
        else:
            kind.add_argument("--contacts", help="dump local of compute rve/contact/local")
        kind.set_defaults(function=function)
    options = parser.parse_args()
    options.function(options)


if __name__ == "__main__":
    main()
