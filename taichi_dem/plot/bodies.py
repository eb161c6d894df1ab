"""Bodies coloured by a value, lines by another: what all pictures of a block are made of."""

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap

from taichi_dem.output.record import Frame, body_corners
from taichi_dem.plot.view import View, surface
from taichi_dem.state.model import Model

STONE, JOINT = "#E4E0D6", "#C9C3B5"
#: A view along the z axis.
ALONG_Z = (0.0, 0.0, 1.0)


def shades(name: str, low: float, high: float, count: int = 256) -> ListedColormap:
    """A part of a map of colours of matplotlib; low, high: shares of it."""
    return ListedColormap(matplotlib.colormaps[name](np.linspace(low, high, count)))


def displaced(model: Model, frame: Frame, magnify: float) -> np.ndarray:
    """Corners of all bodies (body_count, 4, 3) [m], their displacement magnified."""
    rest = model.mesh.points[model.mesh.tetrahedra]
    return rest + magnify * (body_corners(model, frame) - rest)


def frame_block(axes: Any, view: View, model: Model, margin: float = 0.05) -> None:
    """Limits, equal scales and labels of a view of the whole block; margin: share of its size."""
    flat = view.project(model.mesh.points)
    low, high = flat.min(axis=0), flat.max(axis=0)
    pad = margin * (high - low).max()
    axes.set(xlim=(low[0] - pad, high[0] + pad), ylim=(low[1] - pad, high[1] + pad))
    axes.set_aspect("equal")
    axes.locator_params(nbins=5)
    axes.grid(False)


def draw_stone(axes: Any, view: View, model: Model) -> None:
    """Draw the outer faces of the block at rest, all in one colour."""
    rest = model.mesh.points[model.mesh.tetrahedra]
    polygons, _, _ = surface(model.topology, view, rest, np.zeros(model.bond_count, dtype=bool))
    axes.add_collection(PolyCollection(polygons, facecolor=STONE, edgecolor=JOINT, linewidth=0.4))


def draw_lines(axes: Any, segments: np.ndarray, values: np.ndarray, **look: Any) -> Any:
    """Draw lines (n, points, 2) coloured by a value each; look: of the ``LineCollection``.

    By default colours run from dark to orange: light yellow would vanish on the stone.
    """
    lines = LineCollection(segments, **{"cmap": shades("plasma", 0.0, 0.88), **look})
    lines.set_array(values)
    lines.set_capstyle("round")
    axes.add_collection(lines)
    return lines


def draw_bodies(
    axes: Any,
    model: Model,
    frame: Frame | None,
    values: np.ndarray,
    *,
    magnify: float = 1.0,
    broken: Any = None,
    axis: Sequence[float] = ALONG_Z,
    **look: Any,
) -> Any:
    """Draw the bodies where they are, coloured by a value each; returns the collection.

    frame: a ``Frame``, None for the bodies at rest. values: (n,). magnify: of the displacement.
    broken: (bond_count,) bool, bonds into which one sees. axis: towards the viewer. look: of the
    ``PolyCollection``, such as cmap, norm, clim.
    """
    drawn = PolyCollection([], **{"linewidth": 0.3, "edgecolor": "#00000060", **look})
    move_bodies(drawn, model, frame, values, magnify=magnify, broken=broken, axis=axis)
    axes.add_collection(drawn)
    axes.set_aspect("equal")
    axes.grid(False)
    return drawn


def move_bodies(
    drawn: Any,
    model: Model,
    frame: Frame | None,
    values: np.ndarray,
    *,
    magnify: float = 1.0,
    broken: Any = None,
    axis: Sequence[float] = ALONG_Z,
) -> None:
    """Change what ``draw_bodies`` has drawn to another frame: arguments as there."""
    corners = model.mesh.points[model.mesh.tetrahedra]
    if frame is not None:
        corners = displaced(model, frame, magnify)
    whole = np.zeros(model.bond_count, dtype=bool)
    seen = whole if broken is None else broken
    polygons, body, _ = surface(model.topology, View(axis), corners, seen)
    drawn.set_verts(polygons)
    drawn.set_array(values[body])
