"""Runs with steps that are too large: energy from nowhere, and what a block looks like then.

A run has: limit (what sets it), share (of the limit), step [s], time [s] and residual (over the
energy put in by then), model, frames, speeds (of the bodies' corners [m/s], (frames,
bodies)), sentence (of its end; "" when it ended well).
"""

import textwrap

import numpy as np

from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, RED, picture, seconds
from taichi_dem.plot.bodies import FilmedBodies
from taichi_dem.plot.film import moving_picture
from taichi_dem.plot.view import View

#: Of the displacement in the film.
_MAGNIFY = 6000.0
#: Oblique enough to show two sides and the struck end.
_AXIS = (-0.35, 0.45, 1.0)
_LOOKS = {0: GREEN, 1: ORANGE, 2: RED, 3: BLUE}
#: Last pictures of the film, which stand still for the sentence.
_HELD = 8
_RANGE = (1e-5, 1e3)


def picture_energy(path, runs):
    """Energy that the account cannot explain over time, a panel a limit; the sentences below."""
    limits = list(dict.fromkeys(made.limit for made in runs))
    said = [made for made in runs if made.sentence]
    size = (4.6 * len(limits) + 0.6, 3.4 + 0.55 * len(said))
    with picture(path, 1, len(limits), size=size, squeeze=False) as (figure, panels):
        for axes, limit in zip(panels[0], limits):
            for k, made in enumerate(m for m in runs if m.limit == limit):
                _residual(axes, made, _LOOKS[k % len(_LOOKS)])
            axes.axhline(1.0, color=GREY, ls=":", lw=1.0, label="all that was put in")
            if any(made.sentence for made in runs if made.limit == limit):
                axes.plot([], [], "X", color=BLACK, ms=7, ls="none", label="ended by the program")
            axes.set(title=f"limited by its {limit}", xlabel="time [µs]")
            axes.legend(loc="upper right", title="step")
        panels[0, 0].set_ylabel("unexplained energy / energy put in [1]")
        width = 62 * len(limits)
        words = [f"{made.limit}, {made.share:g} × limit: “{made.sentence}”" for made in said]
        words = "\n".join(textwrap.fill(text, width) for text in words)
        figure.supxlabel(words, x=0.02, ha="left", fontsize=7.5, family="monospace")


def _residual(axes, made, colour):
    """One curve; a cross where the program ended the run."""
    time = 1e6 * made.time
    shown = np.where(made.residual > 0.0, made.residual, np.nan)
    axes.plot(time, shown, color=colour, label=f"{made.share:g} × limit = {seconds(made.step)}")
    if made.sentence:
        axes.plot(time[-1:], shown[-1:], "X", color=colour, ms=7, clip_on=False)
    axes.set(yscale="log", ylim=_RANGE)


def film_shaken(path, safe, bad, count):
    """A safe run and a diverging one side by side, their energy below. count: of pictures."""
    with moving_picture(path, (4.0, 4.0), 130) as (figure, shoot):
        grid = figure.add_gridspec(4, 2, height_ratios=(0.75, 0.9, 1.0, 0.4))
        fastest = float(safe.speeds.max())
        blocks = [
            _Block(figure, grid[0, k], grid[1, k], made, fastest)
            for k, made in enumerate((safe, bad))
        ]
        words = f"bodies: colour and points show their speed, displacement × {_MAGNIFY:g}"
        figure.suptitle(words, fontsize=6.5)
        energy = figure.add_subplot(grid[2, :])
        words = figure.add_subplot(grid[3, :])
        words.set_axis_off()
        said = words.text(-0.12, 1.0, "", va="top", fontsize=5.8, family="monospace")
        end = float(bad.time[-1])
        curves = [
            _curve(energy, made, colour) for made, colour in zip((safe, bad), _LOOKS.values())
        ]
        energy.set(yscale="log", ylim=_RANGE, xlim=(0.0, 1.03e6 * end))
        energy.set(xlabel="time [µs]", ylabel="unexplained\nenergy /\nput in [1]")
        energy.legend(loc="upper left")
        for now in _instants(end, count):
            for block in blocks:
                block.show_at(now)
            for line, time, values in curves:
                line.set_data(time[time <= 1e6 * now], values[time <= 1e6 * now])
            said.set_text(textwrap.fill(bad.sentence, 66) if now == end else "")
            shoot()


def _instants(end, count):
    """Times of the pictures [s]: closer together towards the end, where all happens at once."""
    early = np.linspace(0.0, 0.6 * end, (count - _HELD) // 3, endpoint=False)
    late = np.linspace(0.6 * end, end, count - _HELD - len(early))
    return np.concatenate([early, late, np.full(_HELD, end)])


def _curve(axes, made, colour):
    (line,) = axes.plot([], [], color=colour, label=f"{made.share:g} × limit")
    shown = np.where(made.residual > 0.0, made.residual, np.nan)
    return line, 1e6 * made.time, shown


class _Block(FilmedBodies):
    """The block of a run, coloured by speed, over the velocities of its bodies."""

    def __init__(self, figure, place, below, made, fastest):
        axes, speeds, self.made = figure.add_subplot(place), figure.add_subplot(below), made
        points = made.model.mesh.points
        pad = 0.16 * np.ptp(View(_AXIS).project(points), axis=0).max()
        look = {"cmap": "YlOrRd", "linewidth": 0.3, "edgecolor": BLACK}
        super().__init__(axes, made.model, _MAGNIFY, (pad,) * 4, _AXIS, **look)
        self.drawn.set_clim(0.0, fastest)
        (self.dots,) = speeds.plot([], [], ".", ms=2.5, color=BLUE)
        speeds.set(xlim=(0.0, points[:, 0].max()), xlabel="place [m]")
        speeds.set(yscale="log", ylim=(1e-4 * fastest, 1e2 * fastest), ylabel="speed [m/s]")

    def show_at(self, time):
        """Show the frame at or before a time [s]."""
        row = int(np.searchsorted(self.made.time, time * (1.0 + 1e-9), side="right")) - 1
        frame, speed = self.made.frames[row], self.made.speeds[row]
        self.show(frame, speed)
        self.dots.set_data(self.model.centre[:, 0], speed)
        text = f"{self.made.share:g} × limit, t = {1e6 * frame.time_s:.1f} µs"
        self.axes.set_title(text, loc="center")
