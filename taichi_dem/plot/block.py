"""Pictures of the block: cracks (Konno et al., Fig 12), steps (Fig 13), where effects act, film."""

import contextlib
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure

from taichi_dem.kit.plot_style import STYLE, area_key, filming, picture, write_gif
from taichi_dem.kit.progress import drawing
from taichi_dem.kit.validation import FileName, positive, unit_vector
from taichi_dem.output.record import Frame
from taichi_dem.plot.series import level_look, level_names
from taichi_dem.plot.view import (
    ALONG_Z,
    JOINT,
    STONE,
    View,
    displaced,
    draw_bodies,
    draw_lines,
    draw_stone,
    frame_block,
    move_bodies,
    shades,
    surface,
    traces,
)

_INSIDE = "#B5AD9C"
_EDGE = "#00000030"
#: Titles by name, as ``Simulation.acting_since`` names them.
TITLES = {
    "softening": "softening of a bond",
    "slip": "slip of a bond",
    "damage": "damage of a bond",
    "contact": "contact",
    "friction": "friction",
    "awake": "body evaluated",
}
#: Half decades of speed that are told apart; what is slower has one colour.
_STEPS = 7


def plot_cracks(
    result: Any,
    frame: int = -1,
    *,
    magnify: float = 5.0,
    axis: Sequence[float] = ALONG_Z,
    path: FileName | None = None,
) -> Figure:
    """Draw broken faces by time of breaking, at rest and as deformed in a frame (Fig 12)."""
    now, magnify = result.frame(frame), positive("magnify", magnify)
    view, model = View(unit_vector("axis", axis).tolist()), result.model
    broken_time = np.where(result.broken_time <= now.time_s, result.broken_time, np.nan)
    with picture(path, 1, 3, size=(9.2, 3.6)) as (figure, panels):
        drawn = _draw_breaks(panels[0], view, model, broken_time)
        panels[0].set_title(f"{np.sum(~np.isnan(broken_time))} broken faces, block at rest")
        for axes, factor in ((panels[1], magnify), (panels[2], 1.0)):
            lines = _deformed(axes, view, model, displaced(model, now, factor), broken_time)
            for collection in (drawn, lines):
                collection.set_clim(0.0, 1e3 * now.time_s or 1.0)
        scale = "true scale" if magnify == 1.0 else f"displacement × {magnify:g}"
        marks = [area_key("outer faces", fc=STONE, ec=JOINT)]
        marks.append(area_key("crack faces, seen where cracks open", fc=_INSIDE))
        figure.legend(handles=marks, loc="outside lower left", ncols=2)
        panels[1].set_title(f"t = {1e3 * now.time_s:.3g} ms, {scale}")
        panels[2].set_title(f"t = {1e3 * now.time_s:.3g} ms, close up, true scale")
        for axes in panels:
            frame_block(axes, view, model)
            axes.set(xlabel=view.labels()[0], ylabel=view.labels()[1])
        _close_up(panels[2], view, model, broken_time)
        figure.colorbar(drawn, ax=panels, label="time of breaking [ms]", shrink=0.8, aspect=25)
    return figure


def _draw_breaks(axes, view, model, broken_time):
    """Every broken face of the block at rest, also inside it; the earliest on top."""
    draw_stone(axes, view, model)
    broken = np.flatnonzero(~np.isnan(broken_time))
    broken = broken[np.argsort(-broken_time[broken], kind="stable")]
    triangles = view.project(model.mesh.points[model.topology.vertices[broken]])
    outlines = np.concatenate([triangles, triangles[:, :1]], axis=1)
    return draw_lines(axes, outlines, 1e3 * broken_time[broken], linewidth=0.9)


def _deformed(axes, view, model, corners, broken_time):
    """The block as it is, its inside dark where it opens, and crack lips by time of breaking."""
    polygons, _, crack = surface(model.topology, view, corners, ~np.isnan(broken_time))
    colours = np.where(crack, _INSIDE, STONE)
    axes.add_collection(PolyCollection(polygons, facecolor=colours, edgecolor=JOINT, linewidth=0.3))
    body, ends, time_s = traces(model.mesh, model.topology, view, broken_time)
    order = np.argsort(-time_s, kind="stable")
    segments = view.project(corners[body[:, None], ends])[order]
    return draw_lines(axes, segments, 1e3 * time_s[order], linewidth=1.1)


def _close_up(axes, view, model, broken_time):
    """Limits around the first half of the breaks, where the block is crushed."""
    broken = np.flatnonzero(~np.isnan(broken_time))
    if len(broken) == 0:
        return
    early = broken[broken_time[broken] <= np.median(broken_time[broken])]
    flat = view.project(model.mesh.points[model.topology.vertices[early]]).reshape(-1, 2)
    middle = np.median(flat, axis=0)
    half = 1.3 * np.percentile(np.abs(flat - middle), 95)
    axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))


@contextlib.contextmanager
def _panels(path, view, model, columns, extra, names) -> Iterator[Any]:
    """A panel of the whole block for each name, which is its title; labels at the outer ones."""
    extent, rows = np.ptp(view.project(model.mesh.points), axis=0), -(-len(names) // columns)
    height = 2.6 * float(np.clip(extent[1] / extent[0], 0.15, 2.0)) + extra[0]
    size = 2.6 * columns + extra[1], height * rows + extra[2]
    options = {"squeeze": False, "sharex": True, "sharey": True}
    with picture(path, rows, columns, size=size, **options) as (figure, panels):
        yield figure, panels
        for axes, name in zip(panels.flat, names):
            axes.set_title(name)
            frame_block(axes, view, model, 0.03)
        for axes in panels.flat[len(names) :]:
            axes.set_axis_off()
        for axes in panels.flat[max(0, len(names) - columns) : len(names)]:
            axes.set_xlabel(view.labels()[0])
            axes.tick_params(labelbottom=True)
        for axes in panels[:, 0]:
            axes.set_ylabel(view.labels()[1])


def plot_steps(
    result: Any, *, axis: Sequence[float] = ALONG_Z, path: FileName | None = None
) -> Figure:
    """Draw the step of every body at several times (Konno et al., Fig 13)."""
    view, model = View(axis), result.model
    frames = result.frames[1:] or result.frames
    if len(frames) > 6:
        picked = np.linspace(0, len(frames), 7).round().astype(int)[1:] - 1
        frames = [frames[k] for k in picked]
    top = max(1, *(int(frame.level.max()) for frame in frames))
    look = {"edgecolor": _EDGE, "axis": axis, **level_look(top + 1)}
    names = [
        f"t = {1e3 * frame.time_s:.3g} ms, finest level {int(frame.level.max())}"
        for frame in frames
    ]
    columns = len(frames) if len(frames) <= 3 else -(-len(frames) // 2)
    with _panels(path, view, model, columns, (0.1, 1.2, 0.6), names) as (figure, panels):
        figure.get_layout_engine().set(h_pad=0.08)
        for axes, frame in zip(panels.flat, frames):
            seen = result.broken_time <= frame.time_s
            drawn = draw_bodies(axes, model, frame, frame.level, broken=seen, **look)
        bar = figure.colorbar(drawn, ax=panels, ticks=range(top + 1), pad=0.02, aspect=30)
        bar.ax.set_yticklabels(level_names(result.method.dt0, top + 1))
        bar.ax.tick_params(length=0)
        bar.ax.invert_yaxis()
        bar.set_label("step of a body")
    return figure


def plot_acting(
    result: Any, *, axis: Sequence[float] = ALONG_Z, path: FileName | None = None
) -> Figure:
    """Draw the bodies at rest, coloured by the time from which an effect acts; a panel each."""
    model, acting_since, until = result.model, result.acting_since, result.frames[-1].time_s
    view, names = View(axis), [name for name in TITLES if name in acting_since]
    extent = np.ptp(view.project(model.mesh.points), axis=0)
    columns = min(3, len(names)) if extent[1] > 0.3 * extent[0] else 1
    titles = [
        f"{TITLES[name]}\n{np.isfinite(acting_since[name]).sum():,} of {model.body_count:,} bodies"
        for name in names
    ]
    colours = shades("plasma", 0.0, 0.92).with_extremes(bad=STONE)
    look = {"cmap": colours, "clim": (0.0, 1e3 * until), "edgecolor": _EDGE, "axis": axis}
    with _panels(path, view, model, columns, (0.6, 1.4, 0.8), titles) as (figure, panels):
        for axes, name in zip(panels.flat, names):
            times = np.ma.masked_invalid(1e3 * acting_since[name])
            drawn = draw_bodies(axes, model, None, times, **look)
        figure.colorbar(drawn, ax=panels, label="acts from [ms]", pad=0.02, aspect=30)
        never = area_key("never", fc=STONE, ec=_EDGE)
        figure.legend(handles=[never], loc="outside lower left")
    return figure


def plot_film(
    result: Any, path: FileName, *, magnify: float = 5.0, axis: Sequence[float] = ALONG_Z
) -> None:
    """Write the deforming block, coloured by speed, as a GIF below a megabyte."""
    # One palette, no dithering and few colours keep 40 frames below a megabyte.
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
