# SPDX-License-Identifier: GPL-2.0-only
"""Reads text dumps of LAMMPS (dump custom, local, rve/grain) frame by frame, for other scripts.

    for frame in dumps.frames("points.dump"):
        frame.step, frame.time, frame["stress_xx"]

Columns are NumPy arrays by name; dump_modify colname gives them readable names (the manual: Reading
results). The module needs numpy (Debian: python3-numpy).
"""

import numpy as np

# Names of this package's columns in the manual and the examples, with unit (SI) and label of an
# axis.
QUANTITIES = {
    "ux": ("horizontal displacement", "m"),
    "uy": ("vertical displacement", "m"),
    "displacement": ("displacement |u|", "m"),
    "stress_xx": ("stress xx", "Pa"),
    "stress_yy": ("stress yy", "Pa"),
    "stress_xy": ("stress xy", "Pa"),
    "stress_yx": ("stress yx", "Pa"),
    "stress_zz": ("stress zz", "Pa"),
    "p": ("mean stress p", "Pa"),
    "q": ("deviatoric stress q", "Pa"),
    "eps_v": ("volumetric strain", ""),
    "eps_q": ("deviatoric strain", ""),
    "eps_p": ("plastic strain", ""),
    "density": ("density", "kg/m³"),
    "void_ratio": ("void ratio", ""),
    "coordination": ("coordination number", ""),
    "anisotropy": ("anisotropy of the contacts", ""),
    "inertial": ("inertial number", ""),
    "sliding": ("share of sliding contacts", ""),
    "vx": ("horizontal velocity", "m/s"),
    "vy": ("vertical velocity", "m/s"),
    "dem_steps": ("DEM steps", ""),
}


class Frame:
    """A frame of a dump: columns by name, in the order of the IDs if there are any."""

    def __init__(self, step, time, units, cell, origin, columns):
        self.step, self.time, self.units = step, time, units
        self.cell, self.origin = cell, origin    # columns of `cell` are the box vectors
        self.columns = columns

    def __getitem__(self, name):
        if name not in self.columns:
            raise SystemExit(f"the dump has no column {name}; it has {' '.join(self.columns)}")
        return self.columns[name]

    def __contains__(self, name):
        return name in self.columns

    def __len__(self):
        return len(next(iter(self.columns.values())))


def box(words, rows):
    """Returns vectors (columns) and origin of the box of a frame, in any of LAMMPS' three forms."""
    if words[:2] == ["abc", "origin"]:
        return rows[:, :3].T, rows[:, 3]
    xy, xz, yz = rows[:, 2] if words[:3] == ["xy", "xz", "yz"] else (0.0, 0.0, 0.0)
    low = rows[:, 0] - [min(0.0, xy, xz, xy + xz), min(0.0, yz), 0.0]
    high = rows[:, 1] - [max(0.0, xy, xz, xy + xz), max(0.0, yz), 0.0]
    width = high - low
    return np.array([[width[0], xy, xz], [0.0, width[1], yz], [0.0, 0.0, width[2]]]), low


def frames(path):
    """Yields all frames of a dump."""
    step = time = units = cell = origin = None
    count = 0
    with open(path) as stream:
        for line in stream:
            words = line.split()
            if line.startswith("ITEM: TIMESTEP"):
                step = int(stream.readline())
            elif line.startswith("ITEM: TIME"):
                time = float(stream.readline())
            elif line.startswith("ITEM: UNITS"):
                units = stream.readline().strip()
            elif line.startswith("ITEM: NUMBER OF"):
                count = int(stream.readline())
            elif line.startswith("ITEM: BOX BOUNDS"):
                cell, origin = box(
                    words[3:],
                    np.array(
                        [[float(word) for word in stream.readline().split()] for _ in range(3)]))
            elif line.startswith("ITEM:"):
                names = words[2:]
                table = np.array([[float(word) for word in stream.readline().split()]
                                  for _ in range(count)]).reshape(count, -1)
                if count and table.shape[1] != len(names):
                    raise SystemExit(
                        f"{path}: step {step} has {table.shape[1]} numbers in a row and "
                        f"{len(names)} names of columns"
                    )
                if "id" in names and count:
                    table = table[np.argsort(table[:, names.index("id")], kind="stable")]
                columns = {
                    name: table[:, k] if count else np.empty(0)
                    for k, name in enumerate(names)
                }
                yield Frame(step, time, units, cell, origin, columns)
                time = None
            else:
                raise SystemExit(f"{path} is no text dump of LAMMPS: '{line.strip()[:60]}'")
    if step is None:
        raise SystemExit(f"{path} has no frame")


def last_frame(path):
    for frame in frames(path):
        pass
    return frame


def spacing(frame):
    """Returns the initial distance between neighbouring points [length], by displacements if the
    dump has them."""
    if "ux" in frame:
        lines = np.unique(np.round(frame["x"] - frame["ux"], 6))
        if len(lines) > 1:
            return np.diff(lines).min()
    width, height = np.ptp(frame["x"]), np.ptp(frame["y"])
    # n points on a rectangle with equal squares
    n = len(frame)
    if n < 2:
        raise SystemExit("one point has no distance to others: say how large it is with --size")
    b = width + height
    return (b + np.sqrt(b * b + 4.0 * (n - 1) * width * height)) / (2.0 * (n - 1))


def domains(frame, side):
    """Returns corners (points, 4, 2) of the squares of points, deformed by the deformation
    gradient, def_xx to def_yy, if the dump has it."""
    corners = 0.5 * side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    at = np.stack([frame["x"], frame["y"]], axis=1)
    if "def_xx" in frame:
        gradient = np.stack([frame[name] for name in ("def_xx", "def_xy", "def_yx", "def_yy")],
                            axis=1).reshape(-1, 2, 2)
        return at[:, None, :] + np.einsum("nij,kj->nki", gradient, corners)
    return at[:, None, :] + corners[None, :, :]
