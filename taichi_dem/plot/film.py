"""Film of a block for a page, as GIF."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm

from taichi_dem.kit.plot_style import STYLE, filming, write_gif
from taichi_dem.kit.progress.progress import drawing
from taichi_dem.kit.validation import FileName
from taichi_dem.output.record import Frame
from taichi_dem.output.run_tables import RunTables
from taichi_dem.plot.bodies import (
    ALONG_Z,
    displaced,
    draw_bodies,
    frame_block,
    move_bodies,
    shades,
)
from taichi_dem.plot.view import View, traces

#: Half decades of speed that are told apart; what is slower has one colour.
_STEPS = 7


def plot_film(
    result: RunTables,
    path: FileName,
    *,
    magnify: float = 5.0,
    axis: Sequence[float] = ALONG_Z,
) -> None:
    """Write the deforming block, coloured by speed, as a GIF below a megabyte.

    Needs a frame. magnify: of the displacement. axis: towards the viewer. One palette for all
    frames, no dithering and few colours keep 40 frames small.
    """
    drawing(path)
    view, model, frames = View(axis), result.model, result.frames
    broken_time = result.broken_time
    edges = speed_edges(frames)
    norm = BoundaryNorm(edges, len(edges), extend="min")
    look = {"cmap": shades("magma_r", 0.04, 0.9, len(edges)), "norm": norm, "linewidth": 0}
    lips, ends, times = traces(model.mesh, model.topology, view, broken_time)
    with filming((4.0, 3.4), 100, {**STYLE, "font.size": 8.5}) as (figure, shoot, images):
        axes = figure.subplots()
        drawn = draw_bodies(axes, model, None, frames[0].speed, axis=axis, **look)
        frame_block(axes, view, model, 0.08)
        axes.set_axis_off()
        cracks = LineCollection([], colors="black", linewidth=0.5)
        axes.add_collection(cracks)
        bar = figure.colorbar(drawn, ax=axes, label="speed [m/s]", aspect=25)
        bar.ax.set_yticks(edges, [f"{value:g}" for value in edges])
        text = "true scale" if magnify == 1.0 else f"displacement × {magnify:g}"
        for frame in frames:
            broken = broken_time <= frame.time_s
            seen: dict[str, Any] = {"magnify": magnify, "broken": broken, "axis": axis}
            move_bodies(drawn, model, frame, frame.speed, **seen)
            corners, now = displaced(model, frame, magnify), times <= frame.time_s
            cracks.set_segments(view.project(corners[lips[now, None], ends[now]]))
            axes.set_title(f"t = {1e3 * frame.time_s:.3f} ms, {text}", fontsize=9)
            shoot()
    write_gif(path, images, 100, colours=32)


def speed_edges(frames: Sequence[Frame]) -> np.ndarray:
    """Half decades of speed [m/s], 1, 3, 10, ..., up to the fastest body of all frames."""
    fastest = max(max(float(frame.speed.max()) for frame in frames), 1e-12)
    top = math.ceil(2.0 * math.log10(fastest))
    parts = (divmod(k, 2) for k in range(top - _STEPS, top + 1))
    return np.array([(3.0 if half else 1.0) * 10.0**decade for decade, half in parts])
