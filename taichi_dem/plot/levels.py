"""Steps of bodies by level: their colours, their names, and their shares over time."""

from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap

from taichi_dem.kit.plot_style import seconds


def level_shades(count: int) -> Any:
    """Colours of so many levels, the coarsest first and lightest."""
    return matplotlib.colormaps["magma_r"](np.linspace(0.02, 0.92, max(2, count)))


def level_look(count: int) -> Any:
    """Arguments cmap and norm of a collection whose values are levels."""
    norm = BoundaryNorm(np.arange(count + 1) - 0.5, count)
    return {"cmap": ListedColormap(level_shades(count)[:count]), "norm": norm}


def level_names(dt0: float, count: int) -> Any:
    """Step of each level in words; dt0: of level 0 [s]."""
    return [seconds(dt0 / 2.0**level) for level in range(count)]


def draw_level_shares(
    owner: Any,
    axes: Any,
    time: np.ndarray,
    shares: np.ndarray,
    dt0: float,
    loc: str = "outside right center",
) -> None:
    """Share of bodies on each level over time, the coarsest at the bottom, with its legend.

    owner: figure or axes that get the legend, at a place loc. time: in the unit of the axis.
    shares: (sample_count, level_count), rows summing to 1. dt0: step of level 0 [s].
    """
    count = shares.shape[1]
    areas = axes.stackplot(time, 100.0 * shares.T, colors=level_shades(count))
    axes.set(ylabel="share of bodies [%]", ylim=(0.0, 100.0))
    names = level_names(dt0, count)
    owner.legend(areas[::-1], names[::-1], title="step", loc=loc)
