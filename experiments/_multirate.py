"""Runs of ``demo_multirate.py``: what is measured in them, tables, pictures and words."""

import numpy as np

from _films import FilmedRun, film_runs
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import GREY, line_key, picture, styles_of
from taichi_dem.kit.study import Table
from taichi_dem.mesh.topology import faces_of_group
from taichi_dem.plot.series import (
    draw_level_shares,
    level_columns,
    level_look,
    level_names,
    level_shares,
)

TABLE = Table(
    method=("name", "method"),
    evaluations=(lambda made: int(made.evaluations[-1]), "evaluations", ",", "1"),
    fewer_evaluations=("fewer_evaluations", "fewer by", ".2f", "1"),
    struck_um=(lambda made: 1e6 * float(made.struck[-1]), "struck end [um]", ".2f", "um"),
    difference=("difference", "difference", ".3f%", "1"),
    broken_faces=("result.report.broken_faces", "broken", "", "1"),
    residual=("result.report.energy_residual_fraction", "residual", ".2g%", "1"),
    cpu_s=("result.report.run_cpu_seconds", "CPU [s]", ".2f"),
)


class Impact:
    """A run with a method; an entry a frame.

    struck, far: mean way of the bar's ends away from the fragment [m]. evaluations: so far.
    levels: (frames, bodies). fewer_evaluations, difference: against the first run, the latter the
    largest over time, of its largest way.
    """

    def __init__(self, name, result, evaluations):
        self.name, self.style, self.evaluations = name, styles_of([name])[name], evaluations
        self.result, self.model, self.time = result, result.model, result.series["time_s"]
        self.levels = np.array([frame.level for frame in result.frames])
        self.struck, self.far = (self._moved(group) for group in ("bar_right", "bar_left"))

    def _moved(self, group):
        bodies, _ = faces_of_group(self.model.mesh, self.model.topology, group)
        return -np.array([f.displacement[bodies, 0].mean() for f in self.result.frames])

    def compare(self, base):
        """Take the first run."""
        self.fewer_evaluations = float(base.evaluations[-1] / self.evaluations[-1])
        apart = np.abs(self.struck - base.struck).max()
        self.difference = float(apart / np.abs(base.struck).max())


def figures_of(rows):
    """Figures for summary.json; the first row is what the others are compared with."""
    figures = {}
    for row in rows:
        figures.update(TABLE.figures(row, "{method}_{key}"))
    for key in ("fewer_evaluations", "difference"):
        del figures[f"{rows[0]['method']}_{key}"]
    return figures


def caption(rows, impact, length):
    """What to see; impact: of the second row; length: of the bar [m]."""
    base, other = rows[:2]
    return (
        "A fragment hits the bar from the right. Above one step for all bodies, below a step for "
        f"each, by colour: {short_steps(impact, length)}. The struck end moves alike, "
        f"within {100 * other['difference']:.2g} %, with {1e-6 * other['evaluations']:.1f} instead "
        f"of {1e-6 * base['evaluations']:.1f} million bonds and contacts evaluated (a ratio of "
        f"{other['fewer_evaluations']:.2f}). The account of {other['method']} neighbours is off by "
        f"{100 * other['residual']:.2g} % of the energy, that of one step by "
        f"{100 * base['residual']:.2g} %."
    )


def short_steps(impact, length):
    """How far short steps came into the bar [m], and how many have grown again, in words."""
    in_bar = impact.model.centre[:, 0] < length
    place, levels = impact.model.centre[in_bar, 0], impact.levels[:, in_bar]
    finest = levels.max(axis=0)
    reached = finest > 0
    if not reached.any():
        return "at this speed all bodies of the bar keep the largest step"
    grown = (levels[-1] < finest)[reached].mean()
    return (
        f"short steps (dark) run {length - place[reached].min():.2f} of {length:g} m into the bar "
        f"with the wave, and at the end {100 * grown:.0f} % of the bodies that had them have "
        "longer ones again"
    )


def write(impacts, dt0, at, pictures):
    """Write the tables of all that is plotted, the picture, and the film of some pictures."""
    time = {"time_s": impacts[0].time}
    columns = dict(time)
    for impact in impacts:
        for name in ("struck", "far"):
            columns[f"{name}_{impact.name}_m"] = getattr(impact, name)
        columns[f"evaluations_{impact.name}"] = impact.evaluations
        shares = level_columns(level_shares(impact.levels))
        write_csv(at(f"levels_{impact.name}.csv"), {**time, **shares})
    write_csv(at("blow.csv"), columns)
    picture_blow(at("blow.png"), impacts, dt0)
    film_blow(at("blow.gif"), impacts[:2], dt0, pictures)


def picture_blow(path, impacts, dt0):
    """Motion of the ends, evaluations, and share of bodies on each level of the second method."""
    time, other = 1e6 * impacts[0].time, impacts[1]
    with picture(path, 2, 2, size=(9.0, 6.0), sharex=True) as (_, panels):
        (way, work), (share, words) = panels
        for impact in impacts:
            look = {"color": impact.style.colour, "ls": impact.style.line}
            way.plot(time, 1e6 * impact.struck, **look)
            way.plot(time, 1e6 * impact.far, lw=0.8, **look)
            work.plot(time, 1e-6 * impact.evaluations, label=impact.style.label, **look)
        way.set(xlabel="time [µs]", ylabel="displacement [µm]", title="the answer")
        work.set(xlabel="time [µs]", ylabel="evaluations of bonds and pairs [10⁶]")
        work.set(title="the price", xlim=(0.0, time[-1]))
        words.set_axis_off()
        # There are no numbers below the right one, as words has no axes.
        for axes in (way, work):
            axes.tick_params(labelbottom=True)
        ends = {"struck end (thick)": 1.5, "far end (thin)": 0.8}
        way.legend(handles=[line_key(words, color=GREY, lw=width) for words, width in ends.items()])
        key = words.legend(*work.get_legend_handles_labels(), loc="upper left", handlelength=4.0)
        draw_level_shares(words, share, time, level_shares(other.levels), dt0, "lower left")
        words.add_artist(key)
        share.set(xlabel="time [µs]", title=f"steps: {other.style.label}")


def film_blow(path, impacts, dt0, count):
    """Both bars by their bodies' steps, and how far the struck end moves. count: of pictures."""
    top = int(max(impact.levels.max() for impact in impacts)) + 1
    runs, rows = [], np.linspace(0, len(impacts[0].time) - 1, count).round().astype(int)
    for impact in impacts:
        name, done = impact.style.label, zip(1e-6 * impact.evaluations, 1e6 * impact.time)
        titles = [f"{name}:\n{n:.1f} million evaluations after {t:.0f} µs" for n, t in done]
        shown = impact.model, impact.result.frames, impact.levels.astype(float), titles
        runs.append(FilmedRun(*shown, 1e6 * impact.struck, name, impact.style.colour))
    film_runs(
        *(path, runs, impacts[0].time[rows]),
        words="step of a body",
        ticks=(np.arange(top), level_names(dt0, top)),
        curve={"ylabel": "displacement of\nthe struck end [µm]"},
        magnify=40.0,
        margin=0.04,
        **level_look(top),
    )
