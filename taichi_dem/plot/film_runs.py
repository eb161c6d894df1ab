"""A film of several runs: bodies coloured by a value below each other, and a curve of each."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichi_dem.kit.display import by_fields
from taichi_dem.kit.validation import FileName
from taichi_dem.plot.block import frame_block
from taichi_dem.plot.bodies import draw_bodies, move_bodies
from taichi_dem.plot.film import moving_picture
from taichi_dem.plot.view import View


@dataclass(frozen=True, eq=False)
class FilmedRun:
    """A run in a film; with an entry a frame, model apart: of the bodies.

    frames: of a run, such as ``Result.frames``. values: numbers by which bodies are coloured,
    (frames, bodies). titles: words above the bodies. curve: what is drawn over time. label, colour:
    of the curve.
    """

    model: Any
    frames: Sequence
    values: np.ndarray
    titles: Sequence[str]
    curve: np.ndarray
    label: str
    colour: str

    def __repr__(self) -> str:
        return by_fields(self)


def film_runs(
    path: FileName,
    runs: Any,
    times: Any,
    *,
    words: Any,
    curve: Any,
    magnify: float = 1.0,
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    margin: float = 0.1,
    ticks: Any = None,
    footers: Any = None,
    milliseconds: float = 120,
    **look: Any,
) -> None:
    """Write a GIF of runs over the same time, and an MP4 where ffmpeg is found.

    runs: FilmedRuns. times: of the pictures [s]; each run shows its frame at or before. words: of
    the colour bar; ticks: its places and their names. curve: options of ``Axes.set`` for the curves
    over time [µs]. magnify: of the displacement. axis: towards the viewer. margin: around the
    bodies, as a share of their extent. footers: text below each picture. milliseconds: a picture.
    look: of the bodies, as in ``draw_bodies``.
    """
    with moving_picture(path, (4.0, 4.0), milliseconds) as (figure, shoot):
        ratios = (*np.ones(len(runs)), 1.25)
        *panels, below = figure.subplots(len(runs) + 1, 1, height_ratios=ratios)
        bodies = [_bodies(*pair, magnify, axis, margin, look) for pair in zip(panels, runs)]
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
                _show(axes, run, drawn, line, now, magnify, axis)
            if number and footers:
                footer.set_text(footers[number])
            shoot()


def _bodies(axes, run, magnify, axis, margin, look):
    look = {"magnify": magnify, "axis": axis, **look}
    drawn = draw_bodies(axes, run.model, run.frames[0], run.values[0], **look)
    frame_block(axes, View(axis), run.model, margin)
    axes.set_axis_off()
    return drawn


def _show(axes, run, drawn, line, now, magnify, axis):
    """Show a run at a time [s]."""
    time = np.array([frame.time_s for frame in run.frames])
    row = int(np.searchsorted(time, now * (1.0 + 1e-9), side="right")) - 1
    look = {"magnify": magnify, "axis": axis}
    move_bodies(drawn, run.model, run.frames[row], run.values[row], **look)
    axes.set_title(run.titles[row], loc="center")
    line.set_data(1e6 * time[: row + 1], run.curve[: row + 1])
