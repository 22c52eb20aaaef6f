#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-2.0-only
"""Draws columns of a dump as fields: points of the continuum as boxes with the colour of their
value.

    python3 plot_fields.py points.dump eps_q                     last frame, points.dump.eps_q.png
    python3 plot_fields.py points.dump eps_q p --frames all      points.dump.eps_q/0000.png, ...
    python3 plot_fields.py points.dump eps_q --gif bands.gif     an animation
    python3 plot_fields.py points.dump uy --window 0 6 4 9 --label "settlement [mm]" --scale -1000

All frames have the same colours, which suit colour-blind readers: cividis, and blue to red through
white for values of both signs. The script needs numpy and matplotlib (Debian: python3-numpy,
python3-matplotlib), and for --gif pillow (python3-pil).
"""

import argparse
import os

import dumps
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.ticker import MaxNLocator

SEQUENTIAL, DIVERGING = "cividis", "RdBu_r"
# Share of values that may lie beyond either end of the colours; otherwise a few points would hide
# the rest.
OUTLIERS = 0.005


def scale_and_label(name, values, units="si"):
    """Returns a factor for the values and the label of their colours: kPa or MPa if Pa needs many
    digits."""
    words, unit = dumps.QUANTITIES.get(name, (name, ""))
    if not unit or units not in (None, "si"):
        return 1.0, words
    largest = np.abs(values[np.isfinite(values)]).max(initial=0.0)
    if unit == "Pa" and largest >= 1e3:
        return (1e-6, f"{words} [MPa]") if largest >= 1e6 else (1e-3, f"{words} [kPa]")
    return 1.0, f"{words} [{unit}]"


def colours(values, limits=None, log=False, cmap=None):
    """Returns colour map and norm for these values."""
    values = values[np.isfinite(values)]
    if log:
        values = values[values > 0.0]
    if not len(values):
        return cmap or SEQUENTIAL, Normalize(0.0, 1.0)
    share = OUTLIERS if OUTLIERS * len(values) >= 1.0 else 0.0
    low, high = limits or np.quantile(values, [share, 1.0 - share])
    if log:
        return cmap or SEQUENTIAL, LogNorm(low, high if high > low else 10.0 * low)
    if not limits and low < 0.0 < high and min(-low, high) > 0.05 * max(-low, high):
        high = max(-low, high)
        return cmap or DIVERGING, Normalize(-high, high)
    if high <= low:
        low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
    return cmap or SEQUENTIAL, Normalize(low, high)


def draw(axes,
         frame,
         values,
         label,
         cmap,
         norm,
         size,
         solid=(),
         window=None,
         colorbar="horizontal"):
    """Draws one value for each point of the frame as boxes; points of the types `solid` are dark
    grey.

    `window` is the visible part (xlo, xhi, ylo, yhi) [length].
    """
    boxes = dumps.domains(frame, 1.02 * size)    # without seams
    rigid = np.isin(frame["type"], solid) if "type" in frame else np.zeros(len(frame), bool)
    drawn = PolyCollection(boxes[~rigid],
                           array=values[~rigid],
                           cmap=cmap,
                           norm=norm,
                           linewidths=0,
                           antialiased=False)
    axes.add_collection(drawn)
    axes.add_collection(PolyCollection(boxes[rigid], facecolor="0.25", linewidths=0))
    xlo, ylo = boxes.min(axis=(0, 1)) - 0.5 * size
    xhi, yhi = boxes.max(axis=(0, 1)) + 0.5 * size
    xlo, xhi, ylo, yhi = window or (xlo, xhi, ylo, yhi)
    axes.set(xlim=(xlo, xhi), ylim=(ylo, yhi), aspect="equal", xlabel="x [m]", ylabel="y [m]")
    if frame.units not in (None, "si"):
        axes.set(xlabel="x", ylabel="y")
    axes.set_facecolor("white")
    shown = values[~rigid]
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[
        int((shown < norm.vmin).any()), int((shown > norm.vmax).any())] if len(shown) else "neither"
    ticks = None if isinstance(norm, LogNorm) else MaxNLocator(6)
    axes.figure.colorbar(drawn,
                         ax=axes,
                         label=label,
                         orientation=colorbar,
                         shrink=0.6,
                         extend=extend,
                         ticks=ticks)
    return drawn


def field(axes,
          frame,
          name,
          label=None,
          limits=None,
          log=False,
          cmap=None,
          solid=(),
          window=None,
          size=None):
    """Draws a column of a frame on axes of a figure with its own colours, for scripts that compose
    figures."""
    values = frame[name]
    soil = ~np.isin(frame["type"], solid) if "type" in frame else np.ones(len(frame), bool)
    if window:
        soil &= (frame["x"] >= window[0]) & (frame["x"] <= window[1]) & (
            frame["y"] >= window[2]) & (frame["y"] <= window[3])
    if not label:
        scale, label = scale_and_label(name, values[soil], frame.units)
        values = scale * values
    cmap, norm = colours(values[soil], limits, log, cmap)
    return draw(axes, frame, values, label, cmap, norm, size or dumps.spacing(frame), solid, window)


def title_of(frame, dt):
    time = frame.time if frame.time is not None else None if dt is None else frame.step * dt
    return f"step {frame.step}" if time is None else f"t = {time:.4g}" + (" s" if frame.units in
                                                                          (None, "si") else "")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "dump",
        help=
        "text dump of a run: columns x, y, and those to be drawn; ux, def_xx, def_xy, def_yx, "
        "def_yy help"
    )
    parser.add_argument("columns", nargs="+", help="names of the columns to draw, as in the dump")
    parser.add_argument("--frames", default="last", help="last, all, or a step")
    parser.add_argument("--gif", help="an animation of all frames, instead of pictures")
    parser.add_argument(
        "--out",
        help=
        "picture, or folder with --frames all; its name gets the column's where there are several")
    parser.add_argument("--label", help="of the colour bar, with the unit")
    parser.add_argument("--scale", type=float, default=1.0, help="factor for all values")
    parser.add_argument("--limits",
                        type=float,
                        nargs=2,
                        metavar=("LOW", "HIGH"),
                        help="values at the ends of the colours, in the unit of the picture")
    parser.add_argument("--log", action="store_true", help="colours by the logarithm")
    parser.add_argument("--cmap",
                        help=f"colour map of matplotlib instead of {SEQUENTIAL} and {DIVERGING}")
    parser.add_argument("--window", type=float, nargs=4, metavar=("XLO", "XHI", "YLO", "YHI"))
    parser.add_argument(
        "--size",
        type=float,
        help="side of a point's box in the undeformed state; found from the points if left out")
    parser.add_argument("--solid",
                        type=int,
                        nargs="*",
                        default=[],
                        metavar="TYPE",
                        help="types of atoms that are rigid bodies: grey")
    parser.add_argument("--dt",
                        type=float,
                        help="time step, for dumps without dump_modify time yes")
    parser.add_argument("--dpi", type=int, default=120)
    options = parser.parse_args()

    frames = list(dumps.frames(options.dump))
    size = options.size or dumps.spacing(frames[0])
    if options.frames == "last" and not options.gif:
        frames = frames[-1:]
    elif options.frames not in ("all", "last"):
        if not options.frames.isdigit() or int(
                options.frames) not in [frame.step for frame in frames]:
            raise SystemExit(
                f"--frames {options.frames}: the dump has the steps "
                f"{' '.join(str(frame.step) for frame in frames)}"
            )
        frames = [frame for frame in frames if frame.step == int(options.frames)]

    for name in options.columns:
        seen = [
            frame[name][~np.isin(frame["type"], options.solid)] if "type" in frame else frame[name]
            for frame in frames
        ]
        seen = np.concatenate(seen)
        scale, label = scale_and_label(
            name, seen, frames[0].units) if options.scale == 1.0 and not options.label else (
                options.scale, options.label or name)
        cmap, norm = colours(scale * seen, options.limits, options.log, options.cmap)
        # The window fits all frames, so that only the points move.
        boxes = np.concatenate([dumps.domains(frame, size) for frame in frames])
        (xlo, ylo), (xhi, yhi) = boxes.min(axis=(0, 1)) - size, boxes.max(axis=(0, 1)) + size
        window = options.window or (xlo, xhi, ylo, yhi)
        height = 8.0 * (window[3] - window[2]) / (window[1] - window[0])
        stem, ending = os.path.splitext(options.out or f"{options.dump}.{name}")
        if options.out and len(options.columns) > 1:
            stem = f"{stem}.{name}"
        if not options.out:
            stem, ending = f"{options.dump}.{name}", ""
        many = len(frames) > 1
        pictures = []
        for k, frame in enumerate(frames):
            figure, axes = plt.subplots(figsize=(8.0, min(max(height + 1.4, 3.0), 14.0)),
                                        constrained_layout=True)
            draw(axes, frame, scale * frame[name], label, cmap, norm, size, options.solid, window)
            axes.set_title(title_of(frame, options.dt))
            if options.gif:
                figure.canvas.draw()
                pictures.append(np.asarray(figure.canvas.buffer_rgba())[..., :3].copy())
            else:
                path = os.path.join(stem +
                                    ending, f"{k:04d}.png") if many else stem + (ending or ".png")
                os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
                figure.savefig(path, dpi=options.dpi)
            plt.close(figure)
        if options.gif:
            from PIL import Image
            path = options.gif
            if len(options.columns) > 1:
                path = "{}.{}{}".format(os.path.splitext(path)[0], name, os.path.splitext(path)[1])
            images = [Image.fromarray(picture) for picture in pictures]
            images[0].save(path,
                           save_all=True,
                           append_images=images[1:],
                           duration=max(60, 4000 // len(images)),
                           loop=0)
        print(
            "wrote",
            path if not many or options.gif else f"{os.path.dirname(path)}/ ({len(frames)} frames)")


if __name__ == "__main__":
    main()
