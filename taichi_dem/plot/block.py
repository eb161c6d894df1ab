"""Pictures of the block: cracks (Konno et al., Fig 12) and steps (Fig 13)."""

from collections.abc import Sequence
from typing import Any, Optional

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from taichi_dem.kit.plot_style import area_key, picture
from taichi_dem.kit.validation import FileName
from taichi_dem.output.record import Frame, body_corners
from taichi_dem.plot.levels import level_look, level_names
from taichi_dem.plot.view import View, surface, traces
from taichi_dem.state.model import Model

STONE, JOINT, _INSIDE = "#E4E0D6", "#C9C3B5", "#B5AD9C"


def displaced(model: Model, frame: Frame, magnify: float) -> np.ndarray:
    """Corners of all bodies (body_count, 4, 3) [m], their displacement magnified."""
    rest = model.mesh.points[model.mesh.tetrahedra]
    return rest + magnify * (body_corners(model, frame) - rest)


def break_times(model: Model, broken_time: Optional[np.ndarray]) -> np.ndarray:
    """The times of breaking [s], (bond_count,); all NaN, unbroken, where none are given."""
    return np.full(model.bond_count, np.nan) if broken_time is None else broken_time


def frame_block(axes: Any, view: View, model: Model, margin: float = 0.05) -> None:
    """Limits, equal scales and labels of a view of the whole block; margin: share of its size."""
    flat = view.project(model.mesh.points)
    low, high = flat.min(axis=0), flat.max(axis=0)
    pad = margin * (high - low).max()
    axes.set(xlim=(low[0] - pad, high[0] + pad), ylim=(low[1] - pad, high[1] + pad))
    axes.set_aspect("equal")
    axes.locator_params(nbins=5)
    axes.grid(False)


def name_outer_axes(panels: np.ndarray, count: int, view: View) -> None:
    """Labels and numbers of x below each column and of y on the left; hide all but count panels."""
    columns = panels.shape[1]
    for axes in panels.flat[count:]:
        axes.set_axis_off()
    for axes in panels.flat[max(0, count - columns) : count]:
        axes.set_xlabel(view.labels()[0])
        axes.tick_params(labelbottom=True)
    for axes in panels[:, 0]:
        axes.set_ylabel(view.labels()[1])


def plot_cracks(
    path: Optional[FileName],
    model: Model,
    frame: Frame,
    broken_time: np.ndarray,
    magnify: float = 5.0,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
) -> Figure:
    """Broken faces by time of breaking, in the block at rest and as it is (Konno et al., Fig 12).

    frame: the block at one time. broken_time: (bond_count,) [s], NaN while a bond holds. magnify:
    of the displacement in the middle panel; the last one shows the most broken part, true to scale.
    axis: towards the viewer.
    """
    view = View(axis)
    broken_time = np.where(broken_time <= frame.time_s, broken_time, np.nan)
    with picture(path, 1, 3, size=(9.2, 3.6)) as (figure, panels):
        drawn = draw_breaks(panels[0], view, model, broken_time)
        panels[0].set_title(f"{np.sum(~np.isnan(broken_time))} broken faces, block at rest")
        for axes, factor in ((panels[1], magnify), (panels[2], 1.0)):
            lines = _deformed(axes, view, model, displaced(model, frame, factor), broken_time)
            for collection in (drawn, lines):
                collection.set_clim(0.0, 1e3 * frame.time_s or 1.0)
        scale = "true scale" if magnify == 1.0 else f"displacement × {magnify:g}"
        marks = [area_key("outer faces", fc=STONE, ec=JOINT)]
        marks.append(area_key("crack faces, seen where cracks open", fc=_INSIDE))
        figure.legend(handles=marks, loc="outside lower left", ncols=2)
        panels[1].set_title(f"t = {1e3 * frame.time_s:.3g} ms, {scale}")
        panels[2].set_title(f"t = {1e3 * frame.time_s:.3g} ms, close up, true scale")
        for axes in panels:
            frame_block(axes, view, model)
            axes.set(xlabel=view.labels()[0], ylabel=view.labels()[1])
        _close_up(panels[2], view, model, frame, broken_time)
        figure.colorbar(drawn, ax=panels, label="time of breaking [ms]", shrink=0.8, aspect=25)
    return figure


def draw_breaks(axes: Any, view: View, model: Model, broken_time: np.ndarray) -> Any:
    """Every broken face of the block at rest, also inside it; the earliest on top."""
    rest = model.mesh.points[model.mesh.tetrahedra]
    polygons, _, _ = surface(model.topology, view, rest, np.zeros(model.bond_count, dtype=bool))
    axes.add_collection(PolyCollection(polygons, facecolor=STONE, edgecolor=JOINT, linewidth=0.4))
    broken = np.flatnonzero(~np.isnan(broken_time))
    broken = broken[np.argsort(-broken_time[broken], kind="stable")]
    triangles = view.project(model.mesh.points[model.topology.vertices[broken]])
    lines = LineCollection(np.concatenate([triangles, triangles[:, :1]], axis=1), linewidth=0.9)
    return _by_time(axes, lines, broken_time[broken])


def _deformed(axes, view, model, corners, broken_time):
    """The block as it is, its inside dark where it opens, and crack lips by time of breaking."""
    polygons, _, crack = surface(model.topology, view, corners, ~np.isnan(broken_time))
    colours = np.where(crack, _INSIDE, STONE)
    axes.add_collection(PolyCollection(polygons, facecolor=colours, edgecolor=JOINT, linewidth=0.3))
    body, ends, time_s = traces(model.mesh, model.topology, view, broken_time)
    order = np.argsort(-time_s, kind="stable")
    segments = view.project(corners[body[:, None], ends])[order]
    return _by_time(axes, LineCollection(segments, linewidth=1.1), time_s[order])


def _by_time(axes, lines, time_s):
    """Colour lines by time [ms], dark first; light yellow would vanish on the stone."""
    shades = matplotlib.colormaps["plasma"](np.linspace(0.0, 0.88, 256))
    lines.set_cmap(ListedColormap(shades))
    lines.set_array(1e3 * time_s)
    lines.set_capstyle("round")
    axes.add_collection(lines)
    return lines


def _close_up(axes, view, model, frame, broken_time):
    """Limits around the first half of the breaks, where the block is crushed."""
    broken = np.flatnonzero(~np.isnan(broken_time))
    if len(broken) == 0:
        return
    early = broken[broken_time[broken] <= np.median(broken_time[broken])]
    flat = view.project(model.mesh.points[model.topology.vertices[early]]).reshape(-1, 2)
    middle = np.median(flat, axis=0)
    half = 1.3 * np.percentile(np.abs(flat - middle), 95)
    axes.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half))


def plot_steps(
    path: FileName,
    model: Model,
    frames: Sequence[Frame],
    dt0: float,
    broken_time: Optional[np.ndarray] = None,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
) -> None:
    """Step of every body at several times (Konno et al., Fig 13).

    frames: of more than six, six are drawn, evenly up to the last. dt0: step of level 0 [s].
    broken_time: (bond_count,) [s], NaN while a bond holds; lets one see into open cracks. axis:
    towards the viewer.
    """
    view, broken_time = View(axis), break_times(model, broken_time)
    if len(frames) > 6:
        picked = np.linspace(0, len(frames), 7).round().astype(int)[1:] - 1
        frames = [frames[k] for k in picked]
    rows = 1 if len(frames) <= 3 else 2
    columns = -(-len(frames) // rows)
    top = max(1, *(int(frame.level.max()) for frame in frames))
    look = level_look(top + 1)
    extent = np.ptp(view.project(model.mesh.points), axis=0)
    height = 2.6 * np.clip(extent[1] / extent[0], 0.15, 2.0)
    size = (2.6 * columns + 1.2, (height + 0.1) * rows + 0.6)
    with picture(path, rows, columns, size=size, squeeze=False, sharex=True, sharey=True) as (
        figure,
        panels,
    ):
        figure.get_layout_engine().set(h_pad=0.08)
        for axes, frame in zip(panels.flat, frames):
            drawn = _levels(axes, view, model, frame, broken_time, look)
        name_outer_axes(panels, len(frames), view)
        bar = figure.colorbar(drawn, ax=panels, ticks=range(top + 1), pad=0.02, aspect=30)
        bar.ax.set_yticklabels(level_names(dt0, top + 1))
        bar.ax.tick_params(length=0)
        bar.ax.invert_yaxis()
        bar.set_label("step of a body")


def _levels(axes, view, model, frame, broken_time, look):
    corners = body_corners(model, frame)
    polygons, body, _ = surface(model.topology, view, corners, broken_time <= frame.time_s)
    drawn = PolyCollection(polygons, edgecolor="#00000030", linewidth=0.3, **look)
    drawn.set_array(frame.level[body])
    axes.add_collection(drawn)
    smallest = int(frame.level.max())
    axes.set_title(f"t = {1e3 * frame.time_s:.3g} ms, finest level {smallest}")
    frame_block(axes, view, model, 0.03)
    return drawn
