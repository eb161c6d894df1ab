"""A container with particles beside an empty one: motion, energy, and both at work."""

import numpy as np

from ca_damper.plot.animation import moving_picture
from ca_damper.plot.box import Box, DrawnBox
from taichi_dem.kit.plot_style import BLACK, GREY, STYLES, picture, styles_of

#: The spring hangs from the base, this far over a box in its middle [mm]; its coils and half width.
_HANGS, _COILS, _HALF = 75.0, 9, 7.0
#: Straight end of the spring [mm]; it reaches over the steps of a staggered box.
_LEAD = 6.0


def plot_motion(path, title, full, empty, filling="automaton"):
    """Displacement and energy over time, with particles and without.

    title: the particles in words. full, empty: dict of time_s, x_mm and energy_mJ of the container;
    full also particles_mJ. filling: its label, for the colour.
    """
    style, bare = styles_of([filling])[filling], STYLES["empty"].label
    words, colour = f"{style.label}, {title}", style.colour
    with picture(path, 2, 1, size=(8.6, 5.6), sharex=True) as (_, (motion, energy)):
        motion.plot(empty["time_s"], empty["x_mm"], color=GREY, linewidth=0.8, label=bare)
        motion.plot(full["time_s"], full["x_mm"], color=colour, linewidth=0.9, label=words)
        motion.set(ylabel="displacement of\nthe container [mm]")
        look = {"color": GREY, "linestyle": "--"}
        energy.plot(empty["time_s"], empty["energy_mJ"], label=bare, **look)
        energy.plot(
            full["time_s"], full["energy_mJ"], color=colour, label=f"container with {title}"
        )
        energy.plot(full["time_s"], full["particles_mJ"], color=BLACK, label="the particles alone")
        energy.set(xlabel="time [s]", ylabel="energy [mJ]", ylim=(0.0, None))
        energy.set_xlim(0.0, full["time_s"][-1])
        for axes in (motion, energy):
            axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)


def animate_motion(
    path, title, box, frames, empty_frames, fastest, milliseconds=60, filling="automaton"
):
    """The empty container and the full one on their springs, and their displacement, as a GIF.

    title, filling: as of ``plot_motion``. frames, empty_frames: as many of each, at the same times.
    fastest: vertical speed at the ends of the colour scale [m/s].
    """
    swing = 1.1 * max(abs(frame.x) for frame in (*frames, *empty_frames))
    with moving_picture(path, (4.0, 3.0), milliseconds) as (figure, shoot):
        bench, curve = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
        shift = 1.35 * box.width
        pair = _Hung(bench, box, fastest, shift), _Hung(bench, _plain(box), fastest, 0.0)
        _frame_bench(bench, box, shift, swing, title)
        looks = {styles_of([filling])[filling].colour: title, GREY: "empty"}
        dots = _curves(curve, looks, (frames, empty_frames), swing)
        bar = {"location": "bottom", "aspect": 30, "pad": 0.02}
        figure.colorbar(
            pair[0].drawn.particles, ax=bench, label="vertical speed of particles [m/s]", **bar
        )
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


def _curves(axes, looks, runs, swing):
    """Displacement of each run with a dot for the present; looks: words by colour, as the runs."""
    dots = []
    for shots, (colour, words) in zip(runs, looks.items()):
        time = [frame.time_s - shots[0].time_s for frame in shots]
        x = [1e3 * frame.x for frame in shots]
        axes.plot(time, x, color=colour, linewidth=0.9, label=words)
        dots += axes.plot([], [], "o", color=colour, markersize=4)
    axes.set(ylim=(-1e3 * swing, 1e3 * swing), xlabel="time [s]", ylabel="displacement [mm]")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return dots
