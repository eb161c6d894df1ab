"""Does a particle fall and rebound as Fig. 8 of Komatsuzaki et al. says it should?

One particle falls from the top of a container at rest. Four readings of the automaton's rule for
the distance travelled when a particle turns, and the spheres, are compared with the closed form for
their gravity (10 m/s^2 on the lattice, 9.8 m/s^2 for the spheres). Expect "signed" and
"signed_through_walls" to agree within a millisecond, and the other two to be off by tens of
milliseconds. An impact delays the default by about two steps: it acts in the step after the
particle reached its last cell. Bounces end where the particle no longer rises by a cell: the
automaton's static contact then holds it. A quick run leaves out "signed_through_walls".

    python experiments/damper_rebound.py
    python experiments/damper_rebound.py --restitution 0.5

Writes rebound.png, heights.csv, impacts.csv and summary.json to results/damper_rebound/.
"""

import math
import sys
from functools import partial

import numpy as np
import pandas as pd

from ca_damper import Automaton, Batch, Paper, SceneTable, Spheres, film
from ca_damper.automaton.paper.transport import READINGS
from ca_damper.theory.bouncing import Fall, RecordedFall
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLACK, VIOLET, picture, styles_of
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "damper_rebound"
SETTINGS = {
    "restitution": (0.75, 0.75, study.number(0.3, 1), "coefficient of restitution, default 0.75"),
    "ca_dt": (1e-4, 1e-4, study.number(0, 1), "step of the automaton [s], default 1e-4"),
    "dt": (2e-5, 2e-5, study.number(0, 1), "step of the spheres [s], default 2e-5"),
    "impacts": (6, 4),
    # Between two samples [s].
    "every": (4e-4, 4e-3),
    # Of the way travelled when a particle turns; each is a program of its own.
    "readings": (READINGS, ("signed", "reset", "kept")),
}
#: Impacts that the figures speak of, and how far off the default reading may be.
COUNTED, ALLOWED_MS = 4, 2.0
#: The base stands still; its frequency [Hz] only makes whole steps of 1e-4 s and 2e-5 s.
FREQUENCY = 10.0
#: Column from which the particle falls; the second is one of those that stand lower.
COLUMN = 1
DEFAULT = Paper().accumulator
TITLES = {
    "signed": "automaton\nsigned (default)",
    "signed_through_walls": "automaton\nsigned through walls",
    "reset": "automaton\nreset",
    "kept": "automaton\nkept",
    "dem": "spheres",
}
#: Errors below this [ms] would lengthen a logarithmic axis for nothing.
SHORTEST = 5e-3
#: First impact to fourth: light to dark, as no colour of a filling is meant.
SHADES = ("#D0D0D0", "#A0A0A0", "#6A6A6A", "#2A2A2A")
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def run(options):
    """Drop the particle in every filling, compare, picture."""
    jobs = {
        title: (
            Batch(filling, SceneTable(1, 1, dt, FREQUENCY, 0.0), mount="base"),
            Fall(height, options.restitution, filling.gravity),
        )
        for title, filling, dt, height in fillings(options)
    }
    folder, runs = study.begin(options), {}
    for title, job in jobs.items():
        with ProgressBar(title) as progress:
            runs[title] = drop(*job, options, progress)
    errors = {title: 1e3 * np.array(made.errors(COUNTED)) for title, made in runs.items()}
    picture_rebound(folder / "rebound.png", runs, errors)
    write_tables(folder, runs)
    study.finish(options, NAME, figures_of(errors), [batch for batch, _ in jobs.values()])


def fillings(options):
    """Title, filling with one particle at the top, step [s], and how far it falls [m]."""
    both = {"restitution": options.restitution, "wall_restitution": options.restitution}
    lattice, spheres = Automaton(), Spheres()
    top = lattice.rows - 1
    for reading in options.readings:
        filling = Automaton(Paper(accumulator=reading), start=((COLUMN, top),), **both)
        yield reading, filling, options.ca_dt, top * lattice.width
    place = 0.5 * spheres.width, spheres.height - spheres.radius
    filling = Spheres(start=(place,), **both)
    yield "dem", filling, options.dt, spheres.height - spheres.diameter


def drop(batch, fall, options, progress):
    """Let the particle make its impacts and rise once more; returns a RecordedFall."""
    batch.start()
    dt, last = batch.table.row(0)["dt"], options.impacts
    until = 0.5 * (fall.impact_s(last) + fall.impact_s(last + 1)) + 0.1 * fall.first_s
    every = max(1, round(options.every / dt))
    steps = every * math.ceil(until / (every * dt))
    history = film(batch, steps, sample_every=every, progress=progress).history
    columns = {name: values[:, 0] for name, values in history.items()}
    return RecordedFall.of(columns, fall, batch.filling.particle_mass)


def figures_of(errors):
    """Largest errors over the impacts compared: of the default reading, and of all."""
    figures = {}
    for name, own in {"": errors[DEFAULT], **errors}.items():
        most = zip(("impact_error_ms", "apex_error_mm"), abs(own).max(axis=1).tolist())
        figures.update({f"{key}_{name}".rstrip("_"): (value, key[-2:]) for key, value in most})
    return figures


def write_tables(folder, runs):
    """A row a sample of every run, and a row an impact."""
    samples, impacts = [], []
    for title, made in runs.items():
        exact = made.fall.heights(made.time_s)
        samples += [(title, *row) for row in zip(made.time_s, made.height_m, exact)]
        for k, (time, apex) in enumerate(zip(made.impacts_s, made.apexes_m), start=1):
            impacts.append((title, k, time, made.fall.impact_s(k), apex, made.fall.apex_m(k)))
    names = "filling time_s height_m closed_form_m"
    study.write_rows(folder / "heights.csv", samples, names)
    names = "filling impact time_s closed_form_s apex_m closed_form_apex_m"
    study.write_rows(folder / "impacts.csv", impacts, names)


def picture_rebound(path, runs, errors):
    """Height over time beside the closed form, and errors of the times of impact."""
    falls = {"ca_static": runs[DEFAULT], "dem": runs["dem"]}
    with picture(path, 0, 0, size=(9.2, 4.6)) as (figure, _):
        mosaic = [["ca_static", "errors"], ["dem", "errors"]]
        panels = figure.subplot_mosaic(mosaic, width_ratios=[1.7, 1.0])
        panels["ca_static"].sharex(panels["dem"])
        for name, made in falls.items():
            time, style = np.linspace(0.0, made.time_s[-1], 2000), styles_of(falls)[name]
            exact = f"closed form, g = {made.fall.gravity:g} m/s²"
            axes, every = panels[name], slice(None, None, max(1, len(made.time_s) // 130))
            axes.plot(time, 1e3 * made.fall.heights(time), color=BLACK, linewidth=0.9, label=exact)
            look = {"color": style.colour, "markersize": 3.6, "markerfacecolor": "none"}
            points = made.time_s[every], 1e3 * made.height_m[every], style.marker
            axes.plot(*points, label=style.label, **look)
            axes.set(xlim=(0.0, None), ylim=(-3.0, None), ylabel="height over floor [mm]")
            axes.legend(loc="upper right")
        panels["ca_static"].tick_params(labelbottom=False)
        panels["dem"].set_xlabel("time [s]")
        plot_errors(panels["errors"], {title: abs(own[0]) for title, own in errors.items()})


def plot_errors(axes, errors):
    """Bars by impact; errors: of the times of impact [ms], by filling."""
    rows = [pd.Series(own, [f"impact {k + 1}" for k in range(len(own))]) for own in errors.values()]
    table = pd.DataFrame(rows, [TITLES[title] for title in errors]).clip(lower=SHORTEST)
    words = f"limit, {ALLOWED_MS:g} ms"
    axes.axvline(ALLOWED_MS, color=VIOLET, linewidth=1.0, linestyle="--", label=words)
    table.plot.barh(ax=axes, width=0.76, color=SHADES, logx=True)
    axes.set(xlabel="error of the time of impact [ms]", xlim=(SHORTEST, None))
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=2, columnspacing=1.2)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
