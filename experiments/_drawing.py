"""Films of runs and cracks of a block in sections, which several pages draw."""

import contextlib
import itertools
from typing import NamedTuple

import numpy as np
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from taichi_dem.kit.plot_style import GREY, STYLE, filming, write_gif
from taichi_dem.kit.progress import drawing
from taichi_dem.plot.view import ALONG_Z, View, draw_bodies, frame_block, move_bodies

#: Pixels an inch that are drawn; the GIF has half as many each way.
_DPI = 200
_SMALL = {
    **STYLE,
    **dict.fromkeys(("font.size", "axes.titlesize", "axes.labelsize"), 7.5),
    **dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), 6.5),
    "lines.linewidth": 1.2,
}


@contextlib.contextmanager
def moving_picture(path, size, milliseconds):
    """A figure, and a function that takes it as the next frame; a GIF when the block ends well.

    size: in inches, at most 4 each way for a GIF of 400 pixels. milliseconds: a frame.
    """
    drawing(path)
    with filming(size, _DPI, _SMALL) as (figure, shoot, images):
        yield figure, shoot
    write_gif(path, [image.reduce(2) for image in images], milliseconds, 48)


class FilmedRun(NamedTuple):
    """A run in a film, with an entry a frame.

    values: numbers by which bodies are coloured, (frames, bodies). titles: words above the bodies.
    curve: what is drawn over time, with its label and colour.
    """

    result: object
    frames: list
    values: np.ndarray
    titles: list
    curve: np.ndarray
    label: str
    colour: str


def film_runs(path, runs, times, *, words, curve, magnify, ticks=None, **look):
    """Write a GIF of runs over the same time.

    runs: FilmedRuns. times: of the pictures [s]; each run shows its frame at or before. words: of
    the colour bar; ticks: its places and their names. curve: options of ``Axes.set`` for the curves
    over time [µs]. magnify: of the displacement. look: of the bodies, as in ``draw_bodies``.
    """
    seen = {"magnify": magnify, "axis": look.pop("axis", ALONG_Z)}
    with moving_picture(path, (4.0, 4.0), 125) as (figure, shoot):
        ratios = (*np.ones(len(runs)), 1.25)
        *panels, below = figure.subplots(len(runs) + 1, 1, height_ratios=ratios)
        bodies = [_first_picture(*pair, **seen, **look) for pair in zip(panels, runs)]
        words = f"{words}; displacement × {magnify:g}"
        bar = figure.colorbar(bodies[0], ax=panels, location="bottom", aspect=40, label=words)
        if ticks is not None:
            bar.ax.set_xticks(*ticks)
            bar.ax.minorticks_off()
        lines = []
        for run, dashes in zip(runs, itertools.cycle(("-", "--", ":"))):
            # The whole curve first: its extent is that of the axes.
            time = [1e6 * frame.time_s for frame in run.frames]
            lines += below.plot(time, run.curve, ls=dashes, color=run.colour, label=run.label)
        below.set(xlabel="time [µs]", xlim=(0.0, 1.03e6 * max(times)), **curve)
        below.legend(loc="upper left")
        for now in times:
            for axes, run, drawn, line in zip(panels, runs, bodies, lines):
                _show(axes, run, drawn, line, now, **seen)
            shoot()


def _first_picture(axes, run, axis, **look):
    model = run.result.model
    drawn = draw_bodies(axes, model, run.frames[0], run.values[0], axis=axis, **look)
    frame_block(axes, View(axis), model, 0.06)
    axes.set_axis_off()
    return drawn


def _show(axes, run, drawn, line, now, **seen):
    time = np.array([frame.time_s for frame in run.frames])
    row = int(np.searchsorted(time, now * (1.0 + 1e-9), side="right")) - 1
    move_bodies(drawn, run.result.model, run.frames[row], run.values[row], **seen)
    axes.set_title(run.titles[row], loc="center")
    line.set_data(1e6 * time[: row + 1], run.curve[: row + 1])


def crossings(triangles, normal, place):
    """Where triangles (n, 3, 3) [m] cross the plane at a place on an axis.

    Returns the ends of the lines (m, 2, 3) [m] and which triangle each belongs to (m,). One with a
    corner in the plane counts as lying above it.
    """
    above = triangles[..., normal] >= place
    which = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    crossed, above = triangles[which], above[which]
    # The corner that lies alone on its side: both lines that cross start there.
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows, ends = np.arange(len(which)), []
    first = crossed[rows, alone]
    for k in (1, 2):
        end = crossed[rows, (alone + k) % 3]
        share = (place - first[:, normal]) / (end[:, normal] - first[:, normal])
        ends.append(first + share[:, None] * (end - first))
    return np.stack(ends, axis=1), which


def in_space(axes, triangles, time_ms, box, look):
    """Broken faces, thin, in the outline of the block; the hole's axis stands upright."""
    box = box[:, [0, 2, 1]]
    faces = Poly3DCollection(triangles[..., [0, 2, 1]], linewidth=0.0, alpha=0.45, **look)
    faces.set_array(time_ms)
    axes.add_collection3d(faces, autolim=False)
    pairs = itertools.combinations(itertools.product(*box.T), 2)
    edges = [pair for pair in pairs if sum(a != b for a, b in zip(*pair)) == 1]
    axes.add_collection3d(Line3DCollection(edges, color=GREY, linewidth=0.8), autolim=False)
    axes.set(xlim=box[:, 0], ylim=box[:, 1], zlim=box[:, 2])
    axes.set_box_aspect(np.ptp(box, axis=0))
    axes.set(xlabel="x [m]", ylabel="z [m]", zlabel="y [m]")
    axes.view_init(elev=22.0, azim=-55.0)
    axes.locator_params(nbins=4)
    if np.ptp(box[:, 1]) < 0.5 * np.ptp(box, axis=0).max():
        axes.locator_params(axis="y", nbins=2)
