"""A container with particles beside an empty one: motion, energy, and both at work."""

import numpy as np

from ca_damper.plot.animation import moving_picture
from ca_damper.plot.box import Box, DrawnBox
from taichi_dem.plot_style import BLACK, BLUE, GREY, RED, picture

#: The spring hangs from the base, this far over a box in its middle [mm]; its coils and half width.
_HANGS, _COILS, _HALF = 75.0, 9, 7.0
#: Straight end of the spring [mm]; it reaches over the steps of a staggered box.
_LEAD = 6.0


def plot_motion(path, title, full, empty):
    """Displacement and energy over time, with particles and without.

    full, empty: dict of time_s, x_mm and energy_mJ of the container; full also particles_mJ.
    """
    with picture(path, 2, 1, size=(8.6, 5.6), sharex=True) as (_, (motion, energy)):
        motion.plot(empty["time_s"], empty["x_mm"], color=GREY, linewidth=0.8, label="empty")
        motion.plot(full["time_s"], full["x_mm"], color=BLUE, linewidth=0.9, label=title)
        motion.set(ylabel="displacement of\nthe container [mm]")
        look = {"color": GREY, "linestyle": "--"}
        energy.plot(empty["time_s"], empty["energy_mJ"], label="container, empty", **look)
        energy.plot(full["time_s"], full["energy_mJ"], color=BLUE, label=f"container, {title}")
        energy.plot(full["time_s"], full["particles_mJ"], color=RED, label="the particles")
        energy.set(xlabel="time [s]", ylabel="energy [mJ]", ylim=(0.0, None))
        energy.set_xlim(0.0, full["time_s"][-1])
        for axes in (motion, energy):
            axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)


def animate_motion(path, title, box, frames, empty_frames, fastest, milliseconds=60):
    """The empty container and the full one on their springs, and their displacement, as a GIF.

    frames, empty_frames: as many of each, at the same times. fastest: vertical speed at the ends
    of the colour scale [m/s].
    """
    swing = 1.1 * max(abs(frame.x) for frame in (*frames, *empty_frames))
    with moving_picture(path, (4.0, 3.0), milliseconds) as (figure, shoot):
        bench, curve = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
        shift = 1.35 * box.width
        pair = _Hung(bench, box, fastest, shift), _Hung(bench, _plain(box), fastest, 0.0)
        _frame_bench(bench, box, shift, swing, title)
        dots = _curves(curve, frames, empty_frames, swing)
        for shots in zip(frames, empty_frames):
            for one, dot, frame in zip(pair, dots, shots):
                one.show(frame)
                dot.set_data([frame.time_s - frames[0].time_s], [1e3 * frame.x])
            shoot()


def _plain(box):
    """The same box, of an empty container: it moves as smoothly as the container."""
    return Box(box.width, box.height, box.diameter)


class _Hung:
    """A box on a spring that hangs from the base."""

    def __init__(self, axes, box, fastest, offset):
        self.drawn, self.middle = DrawnBox(axes, box, fastest, offset), 1e3 * offset
        self.middle += 0.5e3 * box.width
        self.top = 1e3 * box.height
        (self.spring,) = axes.plot([], [], color=BLACK, linewidth=0.9)
        (self.base,) = axes.plot([], [], color=BLACK, linewidth=3.0)

    def show(self, frame):
        """Draw a ``record.Frame``."""
        self.drawn.show(frame)
        top = self.top + _HANGS + 1e3 * frame.y
        bottom = self.top + 1e3 * self.drawn.box.lift(frame.x)
        coils = np.linspace(top - _LEAD, bottom + _LEAD, 2 * _COILS)
        along = np.concatenate([[top], coils, [bottom]])
        across = np.tile([0.0, _HALF, 0.0, -_HALF], _COILS)[: len(along)]
        across[-2:] = 0.0
        self.spring.set_data(self.middle + across, along)
        self.base.set_data([self.middle - 20.0, self.middle + 20.0], [top, top])


def _frame_bench(axes, box, shift, swing, title):
    width, height = 1e3 * box.width, 1e3 * box.height
    axes.set(xlim=(-3.0, 1e3 * shift + width + 3.0))
    axes.set(ylim=(-1e3 * swing - 14.0, height + _HANGS + 6.0))
    axes.set_aspect("equal")
    axes.set_axis_off()
    under = -1e3 * swing - 12.0
    axes.text(0.5 * width, under, "empty", ha="center")
    axes.text(1e3 * shift + 0.5 * width, under, title, ha="center")


def _curves(axes, frames, empty_frames, swing):
    dots = []
    for shots, colour in ((frames, BLUE), (empty_frames, GREY)):
        time = [frame.time_s - frames[0].time_s for frame in shots]
        axes.plot(time, [1e3 * frame.x for frame in shots], color=colour, linewidth=0.9)
        dots += axes.plot([], [], "o", color=colour, markersize=4)
    axes.set(ylim=(-1e3 * swing, 1e3 * swing), xlabel="time [s]")
    axes.set_title("displacement [mm]")
    return dots
