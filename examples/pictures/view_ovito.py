#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""The grains of grains.dump with their contacts of contacts.dump as force chains, drawn by OVITO.

    python3 view_ovito.py [--out ovito.png] [--frame 10]

Needs OVITO's Python module (PyPI: ovito), and for the picture a Vulkan driver (Debian: mesa-vulkan-drivers draws without a GPU). In OVITO's
window the same: load grains.dump, add the modifier Load trajectory with contacts.dump, map its columns id1 and id2 to Particle
Identifiers, and colour the bonds by fn.
"""

import argparse

import numpy as np
from ovito.io import import_file
from ovito.modifiers import ColorCodingModifier, LoadTrajectoryModifier
from ovito.vis import ParticlesVis, TachyonRenderer, Viewport

THICKEST = 0.4    # tube of the largest force / largest radius


def load(grains="grains.dump", contacts="contacts.dump"):
    pipeline = import_file(grains)
    bonds = LoadTrajectoryModifier()
    # the columns of in.pictures, in their order; the first two say which grains a bond joins
    bonds.source.load(contacts, multiple_frames=True, columns=[
        "Particle Identifiers.1", "Particle Identifiers.2", "fn", "ft", "force_x", "force_y", "branch_x", "branch_y", "overlap", "mobilized",
        "sliding"])
    pipeline.modifiers.append(bonds)
    return pipeline


def as_tubes(_, data):
    fn = np.array(data.particles.bonds["fn"])
    largest = np.max(data.particles["Radius"])
    data.particles_.bonds_.create_property("Width", data=THICKEST * largest * fn / fn.max())
    data.particles_.create_property("Color", data=np.full((data.particles.count, 3), 0.85))
    data.particles.vis.shape = ParticlesVis.Shape.Circle


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", default="ovito.png")
    parser.add_argument("--frame", type=int, help="from 0; the last one if left out")
    options = parser.parse_args()

    pipeline = load()
    pipeline.modifiers.append(as_tubes)
    pipeline.modifiers.append(ColorCodingModifier(operate_on="bonds", property="fn", gradient=ColorCodingModifier.Viridis()))
    frame = pipeline.num_frames - 1 if options.frame is None else options.frame
    data = pipeline.compute(frame)
    print(f"frame {frame}: {data.particles.count} grains, {data.particles.bonds.count} contacts")
    pipeline.add_to_scene()
    view = Viewport(type=Viewport.Type.Top)
    view.zoom_all((700, 700))
    view.render_image(filename=options.out, size=(700, 700), frame=frame, renderer=TachyonRenderer(shadows=False, ambient_occlusion=False))
    print("wrote", options.out)


if __name__ == "__main__":
    main()
