"""Animations small enough for a web page."""

import contextlib
from collections.abc import Iterator
from typing import Any

from taichi_dem.kit.plot_style import STYLE, filming, write_gif
from taichi_dem.kit.progress.progress import drawing
from taichi_dem.kit.validation import FileName

_DPI = 100
_SMALL = {**STYLE, "font.size": 7.5, "axes.titlesize": 7.5, "xtick.labelsize": 6.5}
_SMALL = {**_SMALL, "ytick.labelsize": 6.5, "axes.labelsize": 7.0, "legend.fontsize": 6.5}


@contextlib.contextmanager
def moving_picture(
    path: FileName, size: tuple[float, float], milliseconds: float = 60
) -> Iterator[Any]:
    """A figure and a function that takes it as the next frame; a GIF when the block ends well.

    size: in inches, at 100 pixels an inch. The layout is that of the first frame.
    """
    drawing(path)
    with filming(size, _DPI, _SMALL) as (figure, shoot, images):
        yield figure, shoot
    write_gif(path, images, milliseconds)
