"""Films of containers that hang on their springs from a shaken base."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ca_damper.plot.animation import moving_picture
from ca_damper.plot.box import Box, DrawnBox
from ca_damper.report.record import Frame
from taichi_dem.kit.display import in_brief
from taichi_dem.kit.plot_style import BLACK
from taichi_dem.kit.validation import FileName

#: The spring hangs from the base, this far over a box in its middle [mm]; its coils, half width and
#: straight ends [mm], which reach over the steps of a staggered box.
_HANGS, _COILS, _HALF, _LEAD = 75.0, 9, 7.0, 6.0


@dataclass(frozen=True)
class Hanging:
    """A container in a film: its name, its Box, its frames, and the colour of its curve.

    curve: times [s] and displacements [m], where it is drawn finer than its frames.
    """

    title: str
    box: Box
    frames: Sequence[Frame]
    colour: str
    curve: tuple[np.ndarray, np.ndarray] | None = None

    def __repr__(self):
        return in_brief(self, self.title, f"{len(self.frames)} frames")


def film_hanging(path: FileName, containers: Sequence[Hanging], fastest: float) -> None:
    """Write a GIF of containers side by side, with their displacement over time.

    containers: with frames at the same times. fastest: end of the colour scale of the particles'
    vertical speed [m/s]. Raises InputError when the file cannot be written.
    """
    first = containers[0].frames
    # A container that diverged has frames without numbers.
    swing = 1.1 * np.nanmax([abs(frame.x) for one in containers for frame in one.frames])
    step = 1.35 * max(one.box.width for one in containers)
    with moving_picture(path, (4.0, 3.0)) as (figure, shoot):
        bench, curve = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
        hung = [_Hung(bench, one, fastest, k * step, swing) for k, one in enumerate(containers)]
        bench.margins(0.02)
        bench.set_aspect("equal")
        bench.set_axis_off()
        bar = {"location": "bottom", "aspect": 30, "pad": 0.02}
        words = "vertical speed of particles [m/s]"
        figure.colorbar(hung[0].drawn.particles, ax=bench, label=words, **bar)
        dots = [_curve(curve, one, first[0].time_s) for one in containers]
        curve.set(ylim=(-1e3 * swing, 1e3 * swing), xlabel="time [s]", ylabel="displacement [mm]")
        # Under the dots, which move: what lies over them is drawn again for each frame.
        curve.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0)).set_zorder(1)
        for shots in zip(*(one.frames for one in containers)):
            for one, dot, frame in zip(hung, dots, shots):
                one.show(frame)
                dot.set_data([frame.time_s - first[0].time_s], [1e3 * frame.x])
            shoot()


def _curve(axes, one, begin):
    """Draw the displacement of a container; returns the dot for the present."""
    frames = zip(*((frame.time_s, frame.x) for frame in one.frames))
    time, moved = map(np.array, frames if one.curve is None else one.curve)
    axes.plot(time - begin, 1e3 * moved, color=one.colour, linewidth=0.9, label=one.title)
    return axes.plot([], [], "o", color=one.colour, markersize=4)[0]


class _Hung:
    """A box on a spring that hangs from the base."""

    def __init__(self, axes, one, fastest, offset, swing):
        self.drawn = DrawnBox(axes, one.box, fastest, offset)
        width, self.top = 1e3 * one.box.width, 1e3 * one.box.height
        left, below = 1e3 * offset, -1e3 * swing
        self.middle = left + 0.5 * width
        (self.spring,) = axes.plot([], [], color=BLACK, linewidth=0.9)
        (self.base,) = axes.plot([], [], color=BLACK, linewidth=3.0)
        axes.text(self.middle, below - 12.0, one.title, ha="center")
        axes.update_datalim([(left, below - 14.0), (left + width, self.top + _HANGS)])

    def show(self, frame):
        """Draw a ``record.Frame``."""
        self.drawn.show(frame)
        top = self.top + _HANGS + 1e3 * frame.y
        bottom = self.top + 1e3 * self.drawn.box.lift(frame.x)
        along = [top, *np.linspace(top - _LEAD, bottom + _LEAD, 2 * _COILS), bottom]
        across = np.tile([0.0, _HALF, 0.0, -_HALF], _COILS)[: len(along)]
        across[-2:] = 0.0
        self.spring.set_data(self.middle + across, along)
        self.base.set_data([self.middle - 20.0, self.middle + 20.0], [top, top])
