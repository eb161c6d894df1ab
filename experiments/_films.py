"""Films of one or several runs over time, as GIF."""

import contextlib
import itertools
from typing import NamedTuple

import numpy as np

from taichi_dem.kit.plot_style import STYLE, filming, write_gif
from taichi_dem.kit.progress.progress import drawing
from taichi_dem.plot.view import ALONG_Z, View, draw_bodies, frame_block, move_bodies

#: Pixels an inch that are drawn; the GIF has half as many each way.
_DPI = 200
_SMALL = {
    **STYLE,
    "font.size": 7.5,
    "axes.titlesize": 7.5,
    "axes.labelsize": 7.5,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "legend.fontsize": 6.5,
    "lines.linewidth": 1.2,
}


@contextlib.contextmanager
def moving_picture(path, size, milliseconds):
    """A figure, and a function that takes it as the next frame; a GIF when the block ends well.

    size: in inches, at most 4 each way for a GIF of 400 pixels. milliseconds: a frame. The layout
    is that of the first frame.
    """
    drawing(path)
    with filming(size, _DPI, _SMALL) as (figure, shoot, images):
        yield figure, shoot
    write_gif(path, [image.reduce(2) for image in images], milliseconds, 48)


class FilmedRun(NamedTuple):
    """A run in a film; with an entry a frame, model apart: of the bodies.

    frames: of a run, such as ``Result.frames``. values: numbers by which bodies are coloured,
    (frames, bodies). titles: words above the bodies. curve: what is drawn over time. label, colour:
    of the curve.
    """

    model: object
    frames: list
    values: np.ndarray
    titles: list
    curve: np.ndarray
    label: str
    colour: str


def film_runs(
    path,
    runs,
    times,
    *,
    words,
    curve,
    magnify,
    axis=ALONG_Z,
    margin=0.1,
    ticks=None,
    footers=(),
    milliseconds=120,
    **look,
):
    """Write a GIF of runs over the same time.

    runs: FilmedRuns. times: of the pictures [s]; each run shows its frame at or before. words: of
    the colour bar; ticks: its places and their names. curve: options of ``Axes.set`` for the curves
    over time [µs]. magnify: of the displacement. axis: towards the viewer. margin: around the
    bodies, as a share of their extent. footers: text below each picture. milliseconds: a picture.
    look: of the bodies, as in ``draw_bodies``.
    """
    seen = {"magnify": magnify, "axis": axis}
    with moving_picture(path, (4.0, 4.0), milliseconds) as (figure, shoot):
        ratios = (*np.ones(len(runs)), 1.25)
        *panels, below = figure.subplots(len(runs) + 1, 1, height_ratios=ratios)
        bodies = [_bodies(*pair, margin, **seen, **look) for pair in zip(panels, runs)]
        words = f"{words}; displacement × {magnify:g}"
        bar = figure.colorbar(bodies[0], ax=panels, location="bottom", aspect=40, label=words)
        if ticks is not None:
            bar.ax.set_xticks(*ticks)
            bar.ax.minorticks_off()
        lines = []
        for run, line in zip(runs, itertools.cycle(("-", "--", ":"))):
            # The whole curve first: its extent is that of the axes.
            time = [1e6 * frame.time_s for frame in run.frames]
            lines += below.plot(time, run.curve, ls=line, color=run.colour, label=run.label)
        below.set(xlabel="time [µs]", xlim=(0.0, 1.03e6 * max(times)), **curve)
        below.legend(loc="upper left")
        # The first picture keeps room for the longest footer.
        room = " \n" * max(text.count("\n") + 1 for text in footers or [""])
        footer = figure.supxlabel(room, x=0.02, ha="left", fontsize=6.5, family="monospace")
        for number, now in enumerate(times):
            for axes, run, drawn, line in zip(panels, runs, bodies, lines):
                _show(axes, run, drawn, line, now, **seen)
            if number and footers:
                footer.set_text(footers[number])
            shoot()


def _bodies(axes, run, margin, axis, **look):
    model, frame = run.model, run.frames[0]
    drawn = draw_bodies(axes, model, frame, run.values[0], axis=axis, **look)
    frame_block(axes, View(axis), model, margin)
    axes.set_axis_off()
    return drawn


def _show(axes, run, drawn, line, now, **seen):
    """Show a run at a time [s]."""
    time = np.array([frame.time_s for frame in run.frames])
    row = int(np.searchsorted(time, now * (1.0 + 1e-9), side="right")) - 1
    move_bodies(drawn, run.model, run.frames[row], run.values[row], **seen)
    axes.set_title(run.titles[row], loc="center")
    line.set_data(1e6 * time[: row + 1], run.curve[: row + 1])
