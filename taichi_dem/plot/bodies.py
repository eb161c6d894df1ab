"""Bodies coloured by a value, in a panel that may have other things to show too."""

from collections.abc import Sequence
from typing import Any, Optional

import numpy as np
from matplotlib.collections import PolyCollection

from taichi_dem.output.record import Frame
from taichi_dem.plot.block import displaced
from taichi_dem.plot.view import View, surface
from taichi_dem.state.model import Model


def draw_bodies(
    axes: Any,
    model: Model,
    frame: Optional[Frame],
    values: np.ndarray,
    *,
    magnify: float = 1.0,
    broken: Any = None,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
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
    frame: Optional[Frame],
    values: np.ndarray,
    *,
    magnify: float = 1.0,
    broken: Any = None,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
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
