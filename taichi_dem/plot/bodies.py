"""Bodies of a bar or block in a panel that has other things to show too."""

import numpy as np
from matplotlib.collections import PolyCollection

from taichi_dem.plot.block import displaced
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


class FilmedBodies:
    """Bodies of a film in a panel of their own, the displacement magnified, coloured by a value.

    margins: beside the bodies, to the left, right, below and above [m]. axis: towards the viewer.
    look: of the ``PolyCollection`` ``drawn``.
    """

    def __init__(self, axes, model, magnify, margins, axis=(0.0, 0.0, 1.0), **look):
        self.axes, self.model, self.magnify, self.view = axes, model, magnify, View(axis)
        flat = self.view.project(model.mesh.points)
        low, high = flat.min(axis=0), flat.max(axis=0)
        left, right, below, above = margins
        axes.set(xlim=(low[0] - left, high[0] + right), ylim=(low[1] - below, high[1] + above))
        axes.set_aspect("equal")
        axes.set_axis_off()
        self.drawn = PolyCollection([], **look)
        axes.add_collection(self.drawn)

    def show(self, frame, values, broken=None):
        """Show a ``Frame``. values: of the bodies. broken: (bond_count,) bool, None for none."""
        if broken is None:
            broken = np.zeros(self.model.bond_count, dtype=bool)
        corners = displaced(self.model, frame, self.magnify)
        polygons, body, _ = surface(self.model.topology, self.view, corners, broken)
        self.drawn.set_verts(polygons)
        self.drawn.set_array(values[body])
