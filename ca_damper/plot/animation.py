"""Animations small enough for a web page."""

import contextlib

from ca_damper.plot.box import DrawnBox, frame_panel
from taichi_dem.kit.plot_style import STYLE, filming, write_gif

_DPI = 100
_SMALL = {**STYLE, "font.size": 7.5, "axes.titlesize": 7.5, "xtick.labelsize": 6.5}
_SMALL = {**_SMALL, "ytick.labelsize": 6.5, "axes.labelsize": 7.0, "legend.fontsize": 6.5}


@contextlib.contextmanager
def moving_picture(path, size, milliseconds):
    """A figure and a function that takes it as the next frame; a GIF when the block ends well.

    size: in inches, at 100 pixels an inch. The layout is that of the first frame.
    """
    with filming(size, _DPI, _SMALL) as (figure, shoot, images):
        yield figure, shoot
    write_gif(path, images, milliseconds)


def animate_patterns(path, rows, amplitude, fastest, milliseconds=60):
    """The boxes of several fillings side by side through one cycle, as a GIF below a megabyte.

    rows: title -> (Box, frames), as many frames in each. amplitude: of the container [m]. fastest:
    vertical speed at the ends of the colour scale [m/s].
    """
    with moving_picture(path, (4.0, 2.6), milliseconds) as (figure, shoot):
        panels, drawn = figure.subplots(1, len(rows)), []
        for axes, (title, (box, _)) in zip(panels, rows.items()):
            frame_panel(axes, box, amplitude)
            axes.set_title(title, loc="center")
            drawn.append(DrawnBox(axes, box, fastest))
        bar = {"location": "bottom", "aspect": 40, "pad": 0.02}
        words = "vertical speed of particles [m/s]"
        figure.colorbar(drawn[0].particles, ax=panels.tolist(), label=words, **bar)
        for shots in zip(*(frames for _, frames in rows.values())):
            for one, frame in zip(drawn, shots):
                one.show(frame)
            shoot()
