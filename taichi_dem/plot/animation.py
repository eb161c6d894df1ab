"""Animations small enough for a web page."""

import math
from collections.abc import Sequence
from typing import Optional

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import BoundaryNorm, ListedColormap

from taichi_dem.kit.plot_style import STYLE, filming, write_gif
from taichi_dem.kit.validation import FileName
from taichi_dem.output.record import Frame
from taichi_dem.plot.block import break_times, displaced, frame_block
from taichi_dem.plot.view import View, surface, traces
from taichi_dem.state.model import Model

#: Half decades of speed that are told apart; what is slower has one colour.
_STEPS = 7


def save_animation(
    path: FileName,
    model: Model,
    frames: Sequence[Frame],
    broken_time: Optional[np.ndarray] = None,
    magnify: float = 5.0,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    milliseconds: float = 100,
) -> None:
    """Write the deforming block, coloured by speed, as a GIF below a megabyte.

    frames: at least one. broken_time: (bond_count,) [s], NaN while a bond holds; its
    cracks are drawn and open. magnify: of the
    displacement. One palette for all frames, no dithering and few colours keep 40 frames small.
    """
    times = break_times(model, broken_time)
    with filming((4.0, 3.4), 100, {**STYLE, "font.size": 8.5}) as (figure, shoot, images):
        for _ in _drawn(figure, model, frames, times, magnify, View(axis)):
            shoot()
    write_gif(path, images, milliseconds, colours=32)


def _drawn(figure, model, frames, broken_time, magnify, view):
    """Draw frame after frame; a single collection changes, nothing else is drawn anew."""
    axes = figure.subplots()
    frame_block(axes, view, model, 0.08)
    axes.set_axis_off()
    drawn = _empty_collection(frames)
    cracks = LineCollection([], colors="black", linewidth=0.5)
    axes.add_collection(drawn)
    axes.add_collection(cracks)
    bar = figure.colorbar(drawn, ax=axes, label="speed [m/s]", aspect=25)
    bar.ax.set_yticks(drawn.norm.boundaries, [f"{v:g}" for v in drawn.norm.boundaries])
    lips, ends, times = traces(model.mesh, model.topology, view, broken_time)
    for frame in frames:
        corners = displaced(model, frame, magnify)
        polygons, body, _ = surface(model.topology, view, corners, broken_time <= frame.time_s)
        drawn.set_verts(polygons)
        drawn.set_array(frame.speed[body])
        open_now = times <= frame.time_s
        cracks.set_segments(view.project(corners[lips[open_now, None], ends[open_now]]))
        text = "true scale" if magnify == 1.0 else f"displacement × {magnify:g}"
        axes.set_title(f"t = {1e3 * frame.time_s:.3f} ms, {text}", fontsize=9)
        yield frame


def _empty_collection(frames):
    """A collection coloured by half decades of speed up to the fastest body of all frames."""
    edges = speed_edges(frames)
    shades = matplotlib.colormaps["magma_r"](np.linspace(0.04, 0.9, len(edges)))
    norm = BoundaryNorm(edges, len(edges), extend="min")
    return PolyCollection([], cmap=ListedColormap(shades), norm=norm, linewidth=0)


def speed_edges(frames: Sequence[Frame]) -> np.ndarray:
    """Half decades of speed [m/s] up to the fastest body of all frames, ascending."""
    fastest = max(max(float(frame.speed.max()) for frame in frames), 1e-12)
    top = math.ceil(2.0 * math.log10(fastest))
    return np.array([_nice(k) for k in range(top - _STEPS, top + 1)])


def _nice(half_decades):
    """1, 3, 10, 30, ... for 0, 1, 2, 3, ..."""
    decade, rest = divmod(half_decades, 2)
    return (3.0 if rest else 1.0) * 10.0**decade
