"""One look for all pictures; touches no setting of matplotlib that a caller may have made."""

import os

import matplotlib
from cycler import cycler
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

#: Okabe and Ito's colours, told apart by colour-blind readers too.
COLOURS = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
    "#000000",
    "#F0E442",
    "#8C564B",
    "#7F7F7F",
    "#17BECF",
)

_STYLE = {
    "font.size": 10,
    "axes.titlesize": 10.5,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "lines.linewidth": 1.6,
}


def figure(rows=1, columns=1, size=(6.4, 4.2), dpi=130, layout="constrained", **options):
    """A figure and its axes in the common style; size in inches."""
    with matplotlib.rc_context(_STYLE):
        fig = Figure(figsize=size, dpi=dpi, layout=layout)
        FigureCanvasAgg(fig)
        return fig, fig.subplots(rows, columns, **options)


def save(fig, path):
    """Write a picture as a whole: under a temporary name first."""
    temporary = f"{path}.part.png"
    with matplotlib.rc_context(_STYLE):
        fig.savefig(temporary, bbox_inches="tight")
    os.replace(temporary, path)
