"""The block in one frame, its bodies coloured by a value."""

from collections.abc import Sequence
from typing import Any, Optional

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from taichi_dem.kit.plot_style import SPARE_COLOURS, area_key, picture
from taichi_dem.kit.validation import FileName
from taichi_dem.output.body_values import COLOURS, Bodies, body_values, scale_end
from taichi_dem.output.fragments import broken_by
from taichi_dem.plot.block import frame_block
from taichi_dem.plot.bodies import draw_bodies
from taichi_dem.plot.summary import scale
from taichi_dem.plot.view import View

#: Fragments of a colour of their own; lighter ones are grey.
_NAMED = 6
_REST = "#C9C3B5"


def plot_block(
    path: Optional[FileName],
    bodies: Bodies,
    colour: str = "speed",
    magnify: float = 1.0,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
) -> Figure:
    """Draw the bodies where they are, coloured by one of ``body_values.COLOURS``.

    magnify: of the displacement. axis: towards the viewer.
    """
    values, view = body_values(bodies, colour), View(axis)
    model, frame, broken_time, _ = bodies
    options: dict[str, Any] = {
        "magnify": magnify,
        "axis": axis,
        "broken": broken_by(broken_time, frame.time_s),
    }
    with picture(path, size=(6.2, 4.8)) as (figure, axes):
        if colour == "fragment":
            shown = np.minimum(values, _NAMED)
            look: dict[str, Any] = {
                "cmap": ListedColormap([*SPARE_COLOURS[:_NAMED], _REST]),
                "clim": (0, _NAMED),
            }
            draw_bodies(axes, model, frame, shown, **options, **look)
            _name_fragments(figure, model.body_mass, values)
        else:
            unit, words = COLOURS[colour]
            # A few that fly away would leave one colour for all others.
            top = float(values.max()) if unit == "1" else scale_end(values)
            factor, unit = scale(top, unit) if unit != "1" else (1.0, unit)
            look = {"cmap": "viridis", "clim": (0.0, factor * top or 1.0)}
            drawn = draw_bodies(axes, model, frame, factor * values, **options, **look)
            beyond = "max" if values.max() > top else "neither"
            bar = {"label": f"{words} [{unit}]", "aspect": 25, "extend": beyond}
            figure.colorbar(drawn, ax=axes, **bar)
        frame_block(axes, view, model, 0.1)
        axes.set(xlabel=view.labels()[0], ylabel=view.labels()[1])
        note = "" if magnify == 1.0 else f", displacement × {magnify:g}"
        axes.set_title(f"t = {1e3 * frame.time_s:.3g} ms{note}")
    return figure


def _name_fragments(figure, mass, fragment):
    """Legend of the heaviest fragments with their shares of the mass."""
    share = 100.0 * np.bincount(fragment, mass) / mass.sum()
    keys = [
        area_key(f"{share[k]:.3g} % of the mass", fc=SPARE_COLOURS[k])
        for k in range(min(_NAMED, len(share)))
    ]
    if len(share) > _NAMED:
        rest = f"{len(share) - _NAMED} smaller ones, {share[_NAMED:].sum():.3g} %"
        keys.append(area_key(rest, fc=_REST))
    figure.legend(handles=keys, loc="outside right upper", title=f"{len(share)} fragments")
