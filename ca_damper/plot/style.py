"""One look for all pictures, and a writer that leaves no half-written file."""

import contextlib
import os

import matplotlib
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from taichi_dem.errors import InputError

STYLE = {
    "savefig.dpi": 150,
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.5,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
}

#: Okabe and Ito's colours, told apart by colour-blind readers too.
BLUE, RED, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY, BLACK, GREY = "#E69F00", "#56B4E9", "#222222", "#8A8A8A"


@contextlib.contextmanager
def picture(path, rows=1, columns=1, size=(6.4, 4.2), **options):
    """A figure and its axes in the common style, written as PNG when the block ends well.

    size: in inches. rows: 0 for no axes, which the block then makes. options: of
    ``Figure.subplots``. The Agg canvas needs no display.
    Raises InputError when the file cannot be written.
    """
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasAgg(figure)
        yield figure, figure.subplots(rows, columns, **options) if rows else None
        write_whole(path, lambda name: figure.savefig(name, format="png"))


def write_whole(path, write):
    """Write a file through ``write(name)`` under a temporary name, then rename it.

    Raises InputError when the file cannot be written.
    """
    temporary = f"{path}.part"
    try:
        write(temporary)
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"path {path} must be writable: {error.strerror or error}") from None
    finally:
        if os.path.exists(temporary):
            os.remove(temporary)
