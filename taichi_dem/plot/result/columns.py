"""Columns of a table over time, a panel for each unit."""

from collections.abc import Sequence
from typing import Optional

import numpy as np
from matplotlib.figure import Figure

from taichi_dem.kit.data_table import Table
from taichi_dem.kit.plot_style import SPARE_COLOURS, picture
from taichi_dem.kit.units import without_unit
from taichi_dem.kit.validation import FileName, choices
from taichi_dem.plot.summary import scale

#: What columns of a unit are called together.
_KINDS = {"J": "energy", "m/s": "speed", "m": "length", "mm": "displacement", "s": "time"}


def plot_columns(path: Optional[FileName], table: Table, names: Sequence[str]) -> Figure:
    """Draw columns over time; those of one unit share a panel.

    names: of columns of the table, which has one called time_s. InputError for others.
    """
    names = choices("names", names, [name for name in table if name != "time_s"])
    units = list(dict.fromkeys(table.units[name] for name in names))
    factor, unit = scale(float(np.abs(table["time_s"]).max(initial=0.0)), "s")
    shape = {"size": (6.4, 1.0 + 2.2 * len(units)), "sharex": True, "squeeze": False}
    with picture(path, max(1, len(units)), 1, **shape) as (figure, panels):
        for axes, one in zip(panels[:, 0], units):
            group = [name for name in names if table.units[name] == one]
            _draw(axes, factor * table["time_s"], table, group, one)
        panels[-1, 0].set(xlabel=f"time [{unit}]")
    return figure


def _draw(axes, time, table, names, unit):
    """A panel of columns of one unit, scaled to one that is readable."""
    largest = max(float(np.abs(table[name]).max(initial=0.0)) for name in names)
    # Numbers take no prefix, and what has one in its name keeps it.
    factor, words = scale(largest, unit) if unit in ("s", "m", "J", "m/s", "N") else (1.0, unit)
    words = words.replace("^2", "²").replace("^3", "³")
    for k, name in enumerate(names):
        colour, line = SPARE_COLOURS[k % len(SPARE_COLOURS)], ("-", "--")[k % 2]
        label = without_unit(name).replace("_", " ")
        axes.plot(time, factor * table[name], line, color=colour, label=label)
    if len(names) == 1:
        axes.set(ylabel=f"{label} [{words}]")
    else:
        axes.set(ylabel=f"{_KINDS.get(unit, 'value')} [{words}]")
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
