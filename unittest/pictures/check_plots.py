# SPDX-License-Identifier: GPL-2.0-only
"""plot_fields.py draws a picture of the last frame, one for each frame, and an animation. A box has
the colour of its value at the position of its point, and a missing column or file is named."""

import os
import subprocess
import sys

import dumps
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import plot_fields
from PIL import Image

script = os.path.join(sys.argv[1], "plot_fields.py")


def run(*words):
    return subprocess.run([sys.executable, script, *words],
                          stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT,
                          universal_newlines=True)


frames = list(dumps.frames("points.dump"))
last = frames[-1]

# pictures
assert run("points.dump", "eps_q", "uy", "--solid", "2").returncode == 0
for name in ("eps_q", "uy"):
    picture = np.asarray(Image.open(f"points.dump.{name}.png").convert("RGB"))
    assert picture.shape[1] == 960, picture.shape
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50    # colours, not an empty frame
assert run("points.dump", "q", "--frames", "all", "--out", "all", "--dpi", "40").returncode == 0
assert sorted(os.listdir("all")) == [f"{k:04d}.png" for k in range(len(frames))]
assert run("points.dump", "q", "--gif", "q.gif").returncode == 0
assert Image.open("q.gif").n_frames == len(frames)

# Each point has a box, initially a square of a cell.
size = dumps.spacing(frames[0])
assert abs(size - 0.25) < 1e-9, size
assert abs(dumps.spacing(last) - 0.25) < 1e-5
figure, axes = plt.subplots()
drawn = plot_fields.field(axes, last, "q", solid=[2])
soil = last["type"] == 1
assert len(drawn.get_paths()) == soil.sum() == 96
middles = np.array([path.vertices[:4].mean(axis=0) for path in drawn.get_paths()])
assert np.allclose(middles, np.stack([last["x"], last["y"]], axis=1)[soil])
figure.canvas.draw()
expected = drawn.cmap(drawn.norm(1e-3 * last["q"][soil]))
assert np.allclose(drawn.get_facecolors(), expected)
assert drawn.colorbar.ax.get_xlabel() == "deviatoric stress q [kPa]"

# colours: one-sided values from dark to light, values of both signs about white
assert plot_fields.colours(np.linspace(0.0, 1.0, 50))[0] == "cividis"
cmap, norm = plot_fields.colours(np.array([-1.0, 0.5, 2.0]))
assert cmap == "RdBu_r" and norm.vmin == -2.0 and norm.vmax == 2.0

# units give readable digits
assert plot_fields.scale_and_label("q", np.array([10.0]))[1] == "deviatoric stress q [Pa]"
scaled = plot_fields.scale_and_label("q", np.array([-3e6, 0.0]))
assert scaled == (1e-6, "deviatoric stress q [MPa]")
assert plot_fields.scale_and_label("q", np.array([3e6]), "lj") == (1.0, "deviatoric stress q")

# messages
wrong = run("points.dump", "eps")
assert wrong.returncode != 0, wrong.stdout
assert "the dump has no column eps; it has id type" in wrong.stdout, wrong.stdout
wrong = run("points.dump", "q", "--frames", "7")
assert wrong.returncode != 0, wrong.stdout
assert "--frames 7: the dump has the steps 0 10 20 30 40" in wrong.stdout, wrong.stdout
wrong = run("out", "q")
assert wrong.returncode != 0 and "out is no text dump of LAMMPS" in wrong.stdout, wrong.stdout
print("pictures, frames and an animation")
