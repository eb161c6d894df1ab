"""Bodies coloured by a value, in a panel that may have other things to show too."""

import numpy as np
from matplotlib.collections import PolyCollection

from taichi_dem.plot.block import displaced
from taichi_dem.plot.view import View, surface


def draw_bodies(
    axes, model, frame, values, *, magnify=1.0, broken=None, axis=(0.0, 0.0, 1.0), **look
):
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


def move_bodies(drawn, model, frame, values, *, magnify=1.0, broken=None, axis=(0.0, 0.0, 1.0)):
    """Change what ``draw_bodies`` has drawn to another frame: arguments as there."""
    corners = model.mesh.points[model.mesh.tetrahedra]
    if frame is not None:
        corners = displaced(model, frame, magnify)
    whole = np.zeros(model.bond_count, dtype=bool)
    seen = whole if broken is None else broken
    polygons, body, _ = surface(model.topology, View(axis), corners, seen)
    drawn.set_verts(polygons)
    drawn.set_array(values[body])
