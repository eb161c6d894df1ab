"""How probable each face of a block is to break, from many runs."""

from typing import Any

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import ListedColormap, Normalize

from taichi_dem.kit.plot_style import picture
from taichi_dem.kit.validation import FileName
from taichi_dem.plot.block import JOINT, STONE, frame_block
from taichi_dem.plot.deep import crossings
from taichi_dem.plot.view import View, surface, traces
from taichi_dem.state.model import Model


def plot_crack_probability(path: FileName, model: Model, probability: np.ndarray) -> None:
    """Faces of the block at rest by their probability to break: on its front, and half-way through.

    Parameters
    ----------
    path : path
        Name of the PNG file.
    model : Model
        Of a scene with the mesh of all runs.
    probability : ndarray, shape (bond_count,)
        Of each bond to be broken [1]; faces at 0 are not drawn.
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
    polygons, _, _ = surface(model.topology, view, corners, np.zeros(model.bond_count, dtype=bool))
    axes.add_collection(PolyCollection(polygons, facecolor=STONE, edgecolor=JOINT, linewidth=0.4))
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


def _lines(axes, segments, probability) -> Any:
    """Lines by probability, dark where it is high and on top; light yellow would not be seen."""
    order = np.argsort(probability, kind="stable")
    shades = matplotlib.colormaps["viridis_r"](np.linspace(0.1, 1.0, 256))
    lines = LineCollection(
        segments[order], linewidth=1.6, cmap=ListedColormap(shades), norm=Normalize(0.0, 1.0)
    )
    lines.set_array(probability[order])
    lines.set_capstyle("round")
    axes.add_collection(lines)
    return lines
