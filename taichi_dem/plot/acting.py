"""Picture of where and since when each effect acts."""

from collections.abc import Mapping, Sequence

import matplotlib
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap

from taichi_dem.kit.plot_style import area_key, picture
from taichi_dem.kit.validation import FileName
from taichi_dem.plot.block import frame_block, name_outer_axes
from taichi_dem.plot.view import View, surface
from taichi_dem.state.model import Model

_NEVER = "#E4E0D6"
#: Titles by name, as ``Simulation.acting_since`` names them.
TITLES = {
    "softening": "softening of a bond",
    "slip": "slip of a bond",
    "damage": "damage of a bond",
    "contact": "contact",
    "friction": "friction",
    "awake": "body evaluated",
}


def plot_acting(
    path: FileName,
    model: Model,
    acting_since: Mapping[str, np.ndarray],
    until: float,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
) -> None:
    """Bodies of the block at rest, coloured by the time from which an effect acts; a panel each.

    acting_since: times [s] by name, (body_count,), NaN where an effect never acts
    (``Result.acting_since``). until: end of the run [s]. axis: towards the viewer.
    """
    view, names = View(axis), [name for name in TITLES if name in acting_since]
    rest = model.mesh.points[model.mesh.tetrahedra]
    polygons, body, _ = surface(model.topology, view, rest, np.zeros(model.bond_count, dtype=bool))
    extent = np.ptp(view.project(model.mesh.points), axis=0)
    height = 2.6 * float(np.clip(extent[1] / extent[0], 0.15, 2.0))
    columns = min(3, len(names)) if extent[1] > 0.3 * extent[0] else 1
    rows = -(-len(names) // columns)
    size = 2.6 * columns + 1.4, (height + 0.5) * rows + 0.7
    shades = ListedColormap(matplotlib.colormaps["plasma"](np.linspace(0.0, 0.92, 256)))
    with picture(path, rows, columns, size, squeeze=False, sharex=True, sharey=True) as (
        figure,
        panels,
    ):
        for axes, name in zip(panels.flat, names):
            times = acting_since[name]
            drawn = _coloured(axes, polygons, 1e3 * times[body], shades, 1e3 * until)
            count = int(np.isfinite(times).sum())
            axes.set_title(f"{TITLES[name]}\n{count:,} of {len(times):,} bodies", fontsize=9.5)
            frame_block(axes, view, model, 0.03)
        name_outer_axes(panels, len(names), view)
        figure.colorbar(drawn, ax=panels, label="acts from [ms]", pad=0.02, aspect=30)
        figure.legend(
            handles=[area_key("never", fc=_NEVER, ec="#00000030")], loc="outside lower left"
        )


def _coloured(axes, polygons, values, shades, most):
    """Polygons by their values, plain where they have none; returns those with a value."""
    known, edges = np.isfinite(values), {"edgecolor": "#00000030", "linewidth": 0.3}
    axes.add_collection(PolyCollection(polygons[~known], facecolor=_NEVER, **edges))
    drawn = PolyCollection(polygons[known], cmap=shades, **edges)
    drawn.set_array(values[known])
    drawn.set_clim(0.0, most)
    axes.add_collection(drawn)
    return drawn
