"""Bodies of a bar or block in a panel that has other things to show too."""

import numpy as np
from matplotlib.collections import PolyCollection

from taichi_dem.plot.view import View, surface


def draw_bodies(axes, model, motion, values, *, magnify, limits, colours, broken=None, axis=None):
    """Draw the bodies where they are, coloured by a value each; returns the collection.

    motion: dict with position (n, 3) [m] and rotation (n, 3, 3), as ``State.motion`` gives it.
    values: (n,); limits: their ends of the colour scale. magnify: of the displacement. broken:
    (bond_count,) bool, bonds into which one sees. axis: towards the viewer, along z by default.
    """
    view = View((0.0, 0.0, 1.0) if axis is None else axis)
    rest = model.mesh.points[model.mesh.tetrahedra]
    arms = np.einsum("nij,nkj->nki", motion["rotation"], rest - model.centre[:, None])
    corners = rest + magnify * (motion["position"][:, None] + arms - rest)
    whole = np.zeros(model.bond_count, dtype=bool)
    polygons, body, _ = surface(model.topology, view, corners, whole if broken is None else broken)
    drawn = PolyCollection(polygons, cmap=colours, linewidth=0.3, edgecolor="#00000060")
    drawn.set_array(values[body])
    drawn.set_clim(*limits)
    axes.add_collection(drawn)
    axes.set_aspect("equal")
    axes.grid(False)
    return drawn
