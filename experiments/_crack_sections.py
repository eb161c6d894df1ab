"""Cracks of a deep block in space and in sections, and how probable each face is to break."""

import itertools

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from taichi_dem.kit.plot_style import GREY, picture
from taichi_dem.plot.view import (
    JOINT,
    STONE,
    View,
    draw_lines,
    draw_stone,
    frame_block,
    shades,
    traces,
)

_AXES = "xyz"


def plot_deep_cracks(path, result, hole):
    """Broken faces of the block at rest by time of breaking: in space and cut by two planes.

    hole: point on the hole's axis (3,) [m], which runs along z; the planes are half-way along it,
    and through it.
    """
    mesh, topology = result.model.mesh, result.model.topology
    broken_time, time_s = result.broken_time, result.frames[-1].time_s
    broken = np.flatnonzero(broken_time <= time_s)
    # The latest first: early ones, near the hole, stay visible.
    broken = broken[np.argsort(-broken_time[broken], kind="stable")]
    triangles, time_ms = mesh.points[topology.vertices[broken]], 1e3 * broken_time[broken]
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    look = {"cmap": shades("plasma", 0.0, 0.88), "norm": Normalize(0.0, 1e3 * time_s)}
    with picture(path, 0, size=(9.2, 3.9)) as (figure, _):
        grid = figure.add_gridspec(1, 3, width_ratios=(1.25, 1.0, 0.8), wspace=0.14)
        whole = figure.add_subplot(grid[0], projection="3d")
        _in_space(whole, triangles, time_ms, low, high, look)
        whole.set_title(f"{len(broken)} broken faces at {1e3 * time_s:.3g} ms")
        middle = 0.5 * (low[2] + high[2])
        panels = [figure.add_subplot(grid[k]) for k in (1, 2)]
        lines = _section(panels[0], triangles, time_ms, 2, middle, (low, high), look)
        _section(panels[1], triangles, time_ms, 1, hole[1], (low, high), look)
        figure.colorbar(lines, ax=panels, label="time of breaking [ms]", shrink=0.8, aspect=25)


def _in_space(axes, triangles, time_ms, low, high, look):
    """Broken faces, thin, in the outline of the block; the hole's axis stands upright."""
    turned = triangles[..., [0, 2, 1]]
    faces = Poly3DCollection(turned, linewidth=0.0, alpha=0.45, **look)
    faces.set_array(time_ms)
    axes.add_collection3d(faces, autolim=False)
    box = np.stack([low, high])[:, [0, 2, 1]]
    axes.add_collection3d(Line3DCollection(_edges(box), color=GREY, linewidth=0.8), autolim=False)
    axes.set(xlim=box[:, 0], ylim=box[:, 1], zlim=box[:, 2])
    axes.set_box_aspect(np.ptp(box, axis=0))
    axes.set(xlabel="x [m]", ylabel="z [m]", zlabel="y [m]")
    axes.view_init(elev=22.0, azim=-55.0)
    axes.locator_params(nbins=4)
    if np.ptp(box[:, 1]) < 0.5 * np.ptp(box, axis=0).max():
        axes.locator_params(axis="y", nbins=2)


def _edges(box):
    """The twelve edges of a box, given its two corners (2, 3)."""
    pairs = itertools.combinations(itertools.product(*box.T), 2)
    return [pair for pair in pairs if sum(a != b for a, b in zip(*pair)) == 1]


def _section(axes, triangles, time_ms, normal, place, bounds, look):
    """Where broken faces cross the plane at a place on an axis."""
    across, up = (0, 1) if normal == 2 else (0, 2)
    segments, which = crossings(triangles, normal, place)
    lines = draw_lines(axes, segments[..., [across, up]], time_ms[which], linewidth=1.3, **look)
    low, high = bounds
    axes.set(xlim=(low[across], high[across]), ylim=(low[up], high[up]))
    axes.set(xlabel=f"{_AXES[across]} [m]", ylabel=f"{_AXES[up]} [m]")
    axes.set_aspect("equal")
    axes.locator_params(nbins=5)
    axes.set_title(f"Section at {_AXES[normal]} = {place:.3g} m")
    for side in ("top", "right"):
        axes.spines[side].set_visible(True)
    axes.grid(False)
    return lines


def crossings(triangles, normal, place):
    """Where triangles (n, 3, 3) [m] cross the plane at a place on an axis.

    Returns the ends of the lines (m, 2, 3) [m] and which triangle each belongs to (m,). One with a
    corner in the plane counts as lying above it.
    """
    above = triangles[..., normal] >= place
    which = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    crossed, above = triangles[which], above[which]
    # The corner that lies alone on its side comes first; both lines that cross start there.
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows = np.arange(len(which))
    first = crossed[rows, alone]
    ends = [crossed[rows, (alone + k) % 3] for k in (1, 2)]
    lines = []
    for end in ends:
        share = (place - first[:, normal]) / (end[:, normal] - first[:, normal])
        lines.append(first + share[:, None] * (end - first))
    return np.stack(lines, axis=1), which


def plot_crack_probability(path, model, probability):
    """Faces of the block at rest by their probability to break: on its front, and half-way through.

    probability: of each bond to be broken, (bond_count,); faces at 0 are not drawn.
    """
    view = View()
    with picture(path, 1, 2, size=(9.0, 4.1), sharey=True) as (figure, panels):
        drawn = _on_front(panels[0], view, model, probability)
        panels[0].set_title("On the front face")
        _half_way(panels[1], view, model, probability)
        for axes in panels:
            frame_block(axes, view, model)
            axes.set_xlabel(view.labels()[0])
        panels[0].set_ylabel(view.labels()[1])
        label = "probability of a face to break [1]"
        figure.colorbar(drawn, ax=panels, label=label, shrink=0.85, aspect=25)


def _on_front(axes, view, model, probability):
    """Edges of the front face by the most probable face that ends there."""
    corners = model.mesh.points[model.mesh.tetrahedra]
    draw_stone(axes, view, model)
    # Traces are of the least value that ends at an edge.
    falling = np.where(probability > 0.0, -probability, np.nan)
    body, ends, least = traces(model.mesh, model.topology, view, falling)
    return _lines(axes, view.project(corners[body[:, None], ends]), -least)


def _half_way(axes, view, model, probability):
    """Where faces cross the plane half-way through the block."""
    low, high = model.mesh.points.min(axis=0), model.mesh.points.max(axis=0)
    middle = 0.5 * float(low[2] + high[2])
    segments, which = crossings(model.mesh.points[model.topology.vertices], 2, middle)
    segments, found = view.project(segments), probability[which]
    whole = np.array([low, (high[0], low[1], 0.0), high, (low[0], high[1], 0.0)])[:, :2]
    axes.add_collection(PolyCollection([whole], facecolor=STONE, edgecolor=JOINT))
    axes.add_collection(LineCollection(segments, colors=JOINT, linewidth=0.4))
    axes.set_title(f"In the section at z = {middle:.3g} m")
    return _lines(axes, segments[found > 0.0], found[found > 0.0])


def _lines(axes, segments, probability):
    """Lines by probability, dark where it is high and on top."""
    order = np.argsort(probability, kind="stable")
    look = {"cmap": shades("viridis_r", 0.1, 1.0), "norm": Normalize(0.0, 1.0), "linewidth": 1.6}
    return draw_lines(axes, segments[order], probability[order], **look)
