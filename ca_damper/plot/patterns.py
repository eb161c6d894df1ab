"""Particles over one cycle of the container (Komatsuzaki et al., Figs. 9 and 10)."""

import numpy as np

from ca_damper.plot.box import DrawnBox, frame_panel
from taichi_dem.kit.plot_style import BLACK, GREY, area_key, line_key, picture, styles_of

#: A container slower than this share of its fastest gets no arrow.
_SLOW = 0.1


def plot_patterns(path, rows, amplitude, fastest):
    """A row of frames for every filling, from left to right through one cycle.

    rows: name of the filling -> (Box, frames); as many frames in every row, evenly over the cycle,
    which begins when the container passes its middle upwards; arrows show its velocity. amplitude:
    of the container [m]. fastest: vertical speed at the ends of the colour scale [m/s].
    """
    count = len(next(iter(rows.values()))[1])
    size = (1.14 * count + 0.9, 2.45 * len(rows) + 0.3)
    with picture(path, len(rows), count, size=size, squeeze=False) as (figure, panels):
        for line, (name, (box, frames)) in zip(panels, rows.items()):
            for k, (axes, frame) in enumerate(zip(line, frames)):
                share = np.cos(2.0 * np.pi * k / count)
                drawn = _frame(axes, box, frame, amplitude, fastest, share)
            _name_row(line[0], styles_of(rows)[name].label)
        words = "one cycle of the container; arrows: its velocity, where it is not slow"
        figure.supxlabel(words, fontsize=9)
        first = next(iter(rows.values()))[1]
        for axes, frame in zip(panels[0], first):
            axes.set_title(f"{1e3 * (frame.time_s - first[0].time_s):.0f} ms", loc="center")
        figure.colorbar(
            drawn.particles,
            ax=panels,
            label="vertical speed of particles [m/s]",
            aspect=45,
            pad=0.01,
        )


def _name_row(axes, title):
    axes.text(-0.08, 0.5, title, transform=axes.transAxes, rotation=90, ha="right", va="center")


def _frame(axes, box, frame, amplitude, fastest, share):
    frame_panel(axes, box, amplitude, margin=9.0)
    drawn = DrawnBox(axes, box, fastest)
    drawn.show(frame)
    if abs(share) > _SLOW:
        _mark_motion(axes, box, box.lift(frame.x), share)
    return drawn


def _mark_motion(axes, box, lift, share):
    """An arrow beside the box for the container's velocity; share: of its largest."""
    reach, beside = 14.0 * share, 1e3 * box.width + 7.0
    middle = 1e3 * (0.5 * box.height + lift)
    look = {"arrowstyle": "-|>", "color": BLACK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    ends = (beside, middle + reach), (beside, middle - reach)
    axes.annotate("", *ends, arrowprops=look, annotation_clip=False)


def plot_cycle(path, cycles, container):
    """Mean height of the particles and how many touch floor and ceiling, over one cycle.

    cycles: particles -> name of the filling -> dict of phase (0 to 1), height_mm (in the room),
    spread_mm, floor and ceiling (shares of the particles). container: phase and displacement [mm].
    """
    with picture(
        path, 2, len(cycles), size=(4.2 * len(cycles) + 0.6, 5.7), sharex=True, sharey="row"
    ) as (figure, panels):
        panels = np.reshape(panels, (2, -1))
        for (top, bottom), (particles, fillings) in zip(panels.T, cycles.items()):
            top.plot(*container, color=GREY, linestyle=":", label="container")
            for name, cycle in fillings.items():
                style = styles_of(fillings)[name]
                _heights(top, cycle, style)
                _touching(bottom, cycle, style.colour)
            top.set_title(f"{particles} particles")
            bottom.set(xlabel="phase of the container [cycles]", xlim=(0.0, 1.0), ylim=(0.0, None))
        panels[0, 0].set_ylabel("mean height in the room\nless that at rest [mm]")
        panels[1, 0].set_ylabel("particles that touch [%]")
        ends = {"-": "floor", "--": "ceiling"}
        keys = [line_key(words, color=BLACK, ls=line) for line, words in ends.items()]
        panels[1, 0].legend(handles=keys, loc="upper right")
        keys, _ = panels[0, 0].get_legend_handles_labels()
        keys.append(area_key("± standard deviation of the cycles", fc=GREY, alpha=0.3))
        figure.legend(handles=keys, loc="outside upper left", ncols=len(keys))


def _touching(axes, cycle, colour):
    axes.plot(cycle["phase"], 100.0 * cycle["floor"], color=colour)
    axes.plot(cycle["phase"], 100.0 * cycle["ceiling"], color=colour, linestyle="--")


def _heights(axes, cycle, style):
    height, spread = cycle["height_mm"], cycle["spread_mm"]
    colour = style.colour
    axes.plot(cycle["phase"], height, color=colour, label=style.label)
    band = (height - spread, height + spread)
    axes.fill_between(cycle["phase"], *band, color=colour, alpha=0.18, linewidth=0)
