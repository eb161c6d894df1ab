"""Space-time diagrams: a quantity over place and time, as waves in bars are looked at."""

import matplotlib
import numpy as np

#: Below zero, at zero, above: pressed, at rest, pulled.
_COLOURS = "RdBu_r"


def draw_space_time(axes, place, time_s, values, label=None, top=None):
    """Draw values over place and time: red above zero, blue below; returns the ``QuadMesh``.

    place: (places,) [m]. time_s: (times,) [s]. values: (times, places). label: of a colour bar,
    without one for None. top: end of the colour scale, the largest size of the values if None.
    """
    top = np.abs(values).max() if top is None else top
    look = {"cmap": _COLOURS, "vmin": -top, "vmax": top, "shading": "auto", "rasterized": True}
    drawn = axes.pcolormesh(place, 1e3 * np.asarray(time_s), values, **look)
    axes.set(xlabel="place [m]", ylabel="time [ms]")
    if label is not None:
        axes.figure.colorbar(drawn, ax=axes, label=label)
    return drawn


def tension_shades(values, top):
    """Colours, (..., 4), of values between -top and top, as of ``draw_space_time``."""
    return matplotlib.colormaps[_COLOURS](0.5 + 0.5 * np.asarray(values) / top)
