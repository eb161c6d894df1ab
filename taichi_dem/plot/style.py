"""One look for all pictures."""

import os

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

_STYLE = {
    "figure.dpi": 130,
    "savefig.bbox": "tight",
    "font.size": 10,
    "axes.titlesize": 10.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
}
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


def figure(rows=1, columns=1, size=(6.4, 4.2), **options):
    """A figure and its axes in the common style; size in inches."""
    with plt.rc_context(_STYLE):
        return plt.subplots(rows, columns, figsize=size, **options)


def save(fig, path):
    """Write a picture as a whole: under a temporary name first."""
    temporary = f"{path}.part.png"
    with plt.rc_context(_STYLE):
        fig.savefig(temporary)
    plt.close(fig)
    os.replace(temporary, path)
