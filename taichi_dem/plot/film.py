"""Films: of a block for a page, and of one or several runs, as GIF and, with ffmpeg, as MP4."""

import contextlib
import itertools
import math
import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, Optional

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm

from taichi_dem.kit.files import renamed_when_done
from taichi_dem.kit.plot_style import STYLE, filming, write_gif
from taichi_dem.kit.validation import FileName
from taichi_dem.output.record import Frame
from taichi_dem.plot.bodies import (
    ALONG_Z,
    break_times,
    displaced,
    draw_bodies,
    frame_block,
    move_bodies,
    shades,
)
from taichi_dem.plot.view import View, traces
from taichi_dem.state.model import Model

#: Half decades of speed that are told apart; what is slower has one colour.
_STEPS = 7
#: Pixels an inch of the MP4; the GIF has half as many each way.
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
def moving_picture(
    path: FileName, size: tuple[float, float], milliseconds: float, colours: int = 48
) -> Iterator[Any]:
    """A figure, and a function that takes it as the next frame; files when the block ends well.

    path: of the GIF; the MP4 lies beside it. size: in inches, at most 4 each way for a GIF of
    400 pixels. milliseconds: a frame. The layout is that of the first frame.
    Raises InputError when a file cannot be written.
    """
    with filming(size, _DPI, _SMALL) as (figure, shoot, images):
        yield figure, shoot
    write_gif(path, [image.reduce(2) for image in images], milliseconds, colours)
    _write_mp4(os.path.splitext(path)[0] + ".mp4", images, milliseconds)


def _write_mp4(path, images, milliseconds):
    """Write RGB images of one size as H.264, which has even sizes; nothing without ffmpeg."""
    program = shutil.which("ffmpeg")
    if program is None:
        return
    width, height = images[0].size
    read = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
    read += ["-framerate", f"{1000.0 / milliseconds:g}", "-i", "-"]
    even = ["-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-pix_fmt", "yuv420p"]
    made = b"".join(image.tobytes() for image in images)
    with renamed_when_done(path) as temporary:
        line = [program, "-y", "-loglevel", "error", *read, "-c:v", "libx264", *even, temporary]
        done = subprocess.run(line, input=made, capture_output=True)
        if done.returncode:
            raise OSError(f"ffmpeg says {done.stderr.decode(errors='replace').strip()}")


def save_animation(
    path: FileName,
    model: Model,
    frames: Sequence[Frame],
    broken_time: Optional[np.ndarray] = None,
    magnify: float = 5.0,
    axis: Sequence[float] = ALONG_Z,
    milliseconds: float = 100,
) -> None:
    """Write the deforming block, coloured by speed, as a GIF below a megabyte.

    frames: at least one. broken_time: (bond_count,) [s], NaN while a bond holds; its
    cracks are drawn and open. magnify: of the
    displacement. One palette for all frames, no dithering and few colours keep 40 frames small.
    """
    view, broken_time = View(axis), break_times(model, broken_time)
    edges = speed_edges(frames)
    norm = BoundaryNorm(edges, len(edges), extend="min")
    look = {"cmap": shades("magma_r", 0.04, 0.9, len(edges)), "norm": norm, "linewidth": 0}
    lips, ends, times = traces(model.mesh, model.topology, view, broken_time)
    with filming((4.0, 3.4), 100, {**STYLE, "font.size": 8.5}) as (figure, shoot, images):
        axes = figure.subplots()
        drawn = draw_bodies(axes, model, None, frames[0].speed, axis=axis, **look)
        frame_block(axes, view, model, 0.08)
        axes.set_axis_off()
        cracks = LineCollection([], colors="black", linewidth=0.5)
        axes.add_collection(cracks)
        bar = figure.colorbar(drawn, ax=axes, label="speed [m/s]", aspect=25)
        bar.ax.set_yticks(edges, [f"{value:g}" for value in edges])
        text = "true scale" if magnify == 1.0 else f"displacement × {magnify:g}"
        for frame in frames:
            broken = broken_time <= frame.time_s
            seen: dict[str, Any] = {"magnify": magnify, "broken": broken, "axis": axis}
            move_bodies(drawn, model, frame, frame.speed, **seen)
            corners, now = displaced(model, frame, magnify), times <= frame.time_s
            cracks.set_segments(view.project(corners[lips[now, None], ends[now]]))
            axes.set_title(f"t = {1e3 * frame.time_s:.3f} ms, {text}", fontsize=9)
            shoot()
    write_gif(path, images, milliseconds, colours=32)


def speed_edges(frames: Sequence[Frame]) -> np.ndarray:
    """Half decades of speed [m/s], 1, 3, 10, ..., up to the fastest body of all frames."""
    fastest = max(max(float(frame.speed.max()) for frame in frames), 1e-12)
    top = math.ceil(2.0 * math.log10(fastest))
    parts = (divmod(k, 2) for k in range(top - _STEPS, top + 1))
    return np.array([(3.0 if half else 1.0) * 10.0**decade for decade, half in parts])


class FilmedRun(NamedTuple):
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


def film_runs(
    path: FileName,
    runs: Any,
    times: Any,
    *,
    words: Any,
    curve: Any,
    magnify: float = 1.0,
    axis: Sequence[float] = ALONG_Z,
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
