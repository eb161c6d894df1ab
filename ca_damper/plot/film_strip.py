"""Frames of shaken containers: side by side as a picture, and one after the other as a GIF."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ca_damper.plot.animation import moving_picture
from ca_damper.plot.box import DrawnBox, frame_panel
from taichi_dem.kit.plot_style import BLACK, picture, styles_of
from taichi_dem.kit.validation import FileName

#: A container slower than this share of its fastest gets no arrow; ends of the colour scale as a
#: share of the container's largest speed.
_SLOW, _SCALE = 0.1, 1.2
_SPEED = "vertical speed of particles [m/s]"


def picture_film_strips(
    path: FileName, films: Mapping[str, Any], amplitude: float, frequency: float
) -> None:
    """A row of frames for every filling, from left to right through one cycle of the container.

    films: (Box, ``record.Frame``s evenly spaced over one cycle) by label of the filling, as many
    frames in each. The cycle begins when the container passes its middle upwards; arrows show its
    velocity. amplitude [m], frequency [Hz]: of the container.
    """
    count = len(next(iter(films.values()))[1])
    size = 1.03 * count + 0.9, 2.3 * len(films) + 0.3
    fastest = 2.0 * np.pi * frequency * amplitude
    with picture(path, len(films), count, size=size, squeeze=False) as (figure, panels):
        for line, (name, (box, frames)) in zip(panels, films.items()):
            for k, (axes, frame) in enumerate(zip(line, frames)):
                frame_panel(axes, box, amplitude, margin=9.0)
                drawn = DrawnBox(axes, box, _SCALE * fastest)
                drawn.show(frame)
                _mark_motion(axes, box, box.lift(frame.x), np.cos(2.0 * np.pi * k / count))
            look = {"rotation": 90, "ha": "right", "va": "center", "transform": line[0].transAxes}
            line[0].text(-0.08, 0.5, styles_of(films)[name].label, **look)
        for axes, frame in zip(panels[0], frames):
            axes.set_title(f"{1e3 * (frame.time_s - frames[0].time_s):.0f} ms", loc="center")
        figure.supxlabel(_caption(box), fontsize=9)
        figure.colorbar(drawn.particles, ax=panels, label=_SPEED, aspect=45, pad=0.01)


def _caption(box):
    """What the strips show; the size is the panels' only scale."""
    inside = f"{1e3 * box.width:.0f} × {1e3 * box.height:.0f} mm"
    arrows = "arrows: its velocity, where it is not slow"
    return f"one cycle of the container, {inside} inside; {arrows}"


def _mark_motion(axes, box, lift, share):
    """An arrow beside the box for the container's velocity; share: of its largest."""
    reach, beside = 14.0 * share, 1e3 * box.width + 7.0
    middle = 1e3 * (0.5 * box.height + lift)
    look = {"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    if abs(share) > _SLOW:
        ends = (beside, middle + reach), (beside, middle - reach)
        axes.annotate("", *ends, arrowprops=look, annotation_clip=False)


def animate_films(
    path: FileName, films: Mapping[str, Any], amplitude: float, frequency: float
) -> None:
    """Containers side by side through one cycle, as a GIF below a megabyte.

    films: (Box, ``record.Frame``s) by title, as many frames in each. amplitude [m], frequency [Hz]:
    of the containers.
    """
    fastest, drawn = 2.0 * np.pi * frequency * amplitude, []
    with moving_picture(path, (4.0, 2.6)) as (figure, shoot):
        panels = figure.subplots(1, len(films), squeeze=False)[0]
        for axes, (title, (box, _)) in zip(panels, films.items()):
            frame_panel(axes, box, amplitude)
            axes.set_title(title, loc="center")
            drawn.append(DrawnBox(axes, box, _SCALE * fastest))
        bar = {"location": "bottom", "aspect": 40, "pad": 0.02}
        figure.colorbar(drawn[0].particles, ax=panels.tolist(), label=_SPEED, **bar)
        for shots in zip(*(frames for _, frames in films.values())):
            for one, frame in zip(drawn, shots):
                one.show(frame)
            shoot()
