"""Does a particle fall and rebound as Fig. 8 of Komatsuzaki et al. says it should?

One particle falls from the top of a container at rest. Four ways in which the automaton treats the
way travelled when a particle turns are compared, and the spheres, each with the closed form for its
own gravity (10 m/s^2 on the lattice, 9.8 m/s^2 for the spheres). Expect "signed" and
"signed_through_walls" within a millisecond, the other two off by tens of them. A blow costs the
default about two steps: it falls in the step after the particle reached its last cell. Where the
particle no longer rises by a cell, the automaton's static contact holds it: there its bounces end.

    python experiments/damper_rebound.py                    # about half a minute
    python experiments/damper_rebound.py --restitution 0.5

Writes rebound.png, heights.csv, impacts.csv and summary.json to results/damper_rebound/.
"""

import math
import os
import sys
from dataclasses import dataclass

import numpy as np

from ca_damper import Automaton, Batch, SceneTable, Spheres, film
from ca_damper.automaton.accumulator import READINGS
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.plot_style import BLACK, VIOLET, picture, styles_of
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import figure, finish, main, number, parser, print_table, write_rows

NAME = "damper_rebound"
QUICK, FULL = {"impacts": 4, "every_s": 1e-3}, {"impacts": 6, "every_s": 4e-4}
#: Impacts that the figures speak of, and how far off the default reading may be.
COUNTED, ALLOWED_MS = 4, 2.0
#: The base stands still; its frequency [Hz] only makes whole steps of 1e-4 s and 2e-5 s.
FREQUENCY = 10.0
#: Column from which the particle falls; the second is one of those that stand lower.
COLUMN = 1
DEFAULT = Automaton().accumulator
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


@dataclass(frozen=True)
class Fall:
    """Fall from a height [m] with rebounds of one restitution, in closed form."""

    height: float
    restitution: float
    gravity: float

    @property
    def first_s(self):
        """Time of the first impact [s]."""
        return math.sqrt(2.0 * self.height / self.gravity)

    def impact_s(self, k):
        """Time of impact k = 1, 2, ... [s]: the flight after impact j lasts 2 e^j t_1."""
        e = self.restitution
        return self.first_s * (1.0 + 2.0 * sum(e**j for j in range(1, k)))

    def apex_m(self, k):
        """Height reached after impact k [m]."""
        return self.height * self.restitution ** (2 * k)

    def heights(self, time_s):
        """Height [m] at times [s], (n,)."""
        starts, k = [-self.first_s], 1
        while self.impact_s(k) < time_s[-1]:
            starts.append(self.impact_s(k))
            k += 1
        flight = np.searchsorted(starts, time_s, side="right") - 1
        since = time_s - np.array(starts)[flight]
        rise = self.gravity * self.first_s * self.restitution**flight
        return since * (rise - 0.5 * self.gravity * since)


@dataclass(frozen=True, eq=False)
class Run:
    """A particle that fell: its closed form, samples while it flew, impacts [s] and apexes [m]."""

    fall: Fall
    time_s: np.ndarray
    height_m: np.ndarray
    impacts_s: np.ndarray
    apexes_m: np.ndarray

    def errors(self):
        """Errors of the first impacts [ms] and of the apexes after them [mm], two arrays."""
        first = range(1, 1 + min(COUNTED, len(self.impacts_s)))
        late = self.impacts_s[: len(first)] - [self.fall.impact_s(k) for k in first]
        high = self.apexes_m[: len(first)] - [self.fall.apex_m(k) for k in first]
        return 1e3 * late, 1e3 * high


def options_parser():
    """Options of this experiment."""
    made = parser(NAME, __doc__)
    made.add_argument("--restitution", type=number(0.3, 1), default=0.75, help="0.75")
    made.add_argument("--ca-dt", type=number(0, 1), default=1e-4, help="automaton's step [s], 1e-4")
    made.add_argument("--dt", type=number(0, 1), default=2e-5, help="spheres' step [s], 2e-5")
    return made


def fillings(restitution):
    """Title -> (filling with one particle at the top, how far it falls [m])."""
    both = {"restitution": restitution, "wall_restitution": restitution}
    lattice, spheres, made = Automaton(), Spheres(), {}
    top = lattice.rows - 1
    for reading in READINGS:
        filling = Automaton(accumulator=reading, start=((COLUMN, top),), **both)
        made[reading] = filling, top * lattice.width
    place = (0.5 * spheres.width, spheres.height - spheres.radius)
    made["dem"] = Spheres(start=(place,), **both), spheres.height - spheres.diameter
    return made


def drop(batch, fall, settings, progress):
    """Let the particle fall until it has made its impacts and risen once more; returns a Run."""
    batch.start()
    dt = float(batch.table.column("dt")[0])
    last = settings["impacts"]
    until = 0.5 * (fall.impact_s(last) + fall.impact_s(last + 1)) + 0.1 * fall.first_s
    every = max(1, round(settings["every_s"] / dt))
    steps = every * math.ceil(until / (every * dt))
    recorded = film(batch, steps, sample_every=every, progress=progress).history
    return analysed(batch, fall, {name: v[:, 0] for name, v in recorded.items()})


def analysed(batch, fall, history):
    """Impacts and apexes of a recorded fall.

    Height and velocity of the only particle follow from energy and momentum. Two flights of equal
    gravity cross once: where those before and after an impact do, there the particle turned.
    """
    mass, gravity = batch.filling.particle_mass, batch.filling.gravity
    flying = history["force"] == 0.0
    time, velocity = history["time_s"][flying], history["momentum"][flying] / mass
    height = history["energy"][flying] / (mass * gravity) - 0.5 * velocity**2 / gravity
    # Over where the particle lies on the floor.
    height = height - height[0] + fall.height
    before = np.flatnonzero((velocity[:-1] < 0.0) & (velocity[1:] > 0.0))
    gap, h, v = np.diff(time)[before], height, velocity
    lost = h[before + 1] - h[before] - gap * (v[before + 1] + 0.5 * gravity * gap)
    impacts = time[before] + lost / (v[before] - v[before + 1] - gravity * gap)
    apexes = [part.max() for part in np.split(height, before + 1)[1:]]
    return Run(fall, time, height, impacts, np.array(apexes))


def run(options):
    """Drop the particle in every filling, compare, picture."""
    batches, runs = {}, {}
    for title, (filling, height) in fillings(options.restitution).items():
        dt = options.dt if title == "dem" else options.ca_dt
        batch = Batch(filling, SceneTable(1, 1, dt, FREQUENCY, 0.0), mount="base")
        batches[title] = batch, Fall(height, options.restitution, filling.gravity)
    output_folder(options.out)
    for title, job in batches.items():
        with ProgressBar(title) as progress:
            runs[title] = drop(*job, QUICK if options.quick else FULL, progress)
    picture_rebound(os.path.join(options.out, "rebound.png"), runs)
    write_tables(runs, options.out)
    print_errors(runs)
    finish(options, NAME, figures_of(runs), [batch for batch, _ in batches.values()], show=False)


def figures_of(runs):
    """Largest errors over the impacts compared: of the default reading, and of all."""
    figures = {}
    for end, made in {"": runs[DEFAULT], **{f"_{title}": runs[title] for title in runs}}.items():
        impact, apex = np.abs(made.errors())
        figures[f"impact_error_ms{end}"] = figure(float(impact.max()), "ms")
        figures[f"apex_error_mm{end}"] = figure(float(apex.max()), "mm")
    return figures


def write_tables(runs, folder):
    """A row a sample of every run, and a row an impact."""
    samples = [
        (title, *row)
        for title, made in runs.items()
        for row in zip(made.time_s, made.height_m, made.fall.heights(made.time_s))
    ]
    names = "filling time_s height_m closed_form_m"
    write_rows(os.path.join(folder, "heights.csv"), samples, names)
    impacts = [
        (title, k, time, made.fall.impact_s(k), apex, made.fall.apex_m(k))
        for title, made in runs.items()
        for k, (time, apex) in enumerate(zip(made.impacts_s, made.apexes_m), start=1)
    ]
    names = "filling impact time_s closed_form_s apex_m closed_form_apex_m"
    write_rows(os.path.join(folder, "impacts.csv"), impacts, names)


def picture_rebound(path, runs):
    """Height over time beside the closed form, and errors of the times of impact."""
    mosaic = [["first", "errors"], ["second", "errors"]]
    falls = {"ca_static": runs[DEFAULT], "dem": runs["dem"]}
    with picture(path, 0, 0, size=(10.4, 4.6)) as (figure, _):
        panels = figure.subplot_mosaic(mosaic, width_ratios=[1.7, 1.0])
        until = max(made.time_s[-1] for made in falls.values())
        for place, (name, made) in zip(("first", "second"), falls.items()):
            plot_fall(panels[place], styles_of(falls)[name], made)
            panels[place].set(xlim=(0.0, until), ylim=(-3.0, None), ylabel="height over floor [mm]")
        panels["first"].tick_params(labelbottom=False)
        panels["second"].set_xlabel("time [s]")
        errors = {TITLES[title]: made.errors()[0] for title, made in runs.items()}
        plot_errors(panels["errors"], errors)


def plot_fall(axes, style, made):
    """Samples of a run on its closed form."""
    time = np.linspace(0.0, made.time_s[-1], 2000)
    exact = f"closed form, g = {made.fall.gravity:g} m/s²"
    axes.plot(time, 1e3 * made.fall.heights(time), color=BLACK, linewidth=0.9, label=exact)
    every = max(1, len(made.time_s) // 130)
    points = made.time_s[::every], 1e3 * made.height_m[::every]
    look = {"color": style.colour, "markersize": 3.6, "markerfacecolor": "none"}
    axes.plot(*points, style.marker, label=style.label, **look)
    axes.legend(loc="upper right")


def plot_errors(axes, errors):
    """Bars by impact; errors: title -> errors of the impacts [ms]."""
    count = max(len(values) for values in errors.values())
    for k in range(count):
        own = [(row, values[k]) for row, values in enumerate(errors.values()) if k < len(values)]
        rows = [row + 0.19 * (k - 0.5 * (count - 1)) for row, _ in own]
        widths = [max(SHORTEST, abs(error)) for _, error in own]
        axes.barh(rows, widths, 0.17, color=SHADES[k % len(SHADES)], label=f"impact {k + 1}")
    words = f"most that passes, {ALLOWED_MS:g} ms"
    axes.axvline(ALLOWED_MS, color=VIOLET, linewidth=1.0, linestyle="--", label=words)
    axes.set_yticks(range(len(errors)), list(errors))
    axes.set(xscale="log", xlabel="error of the time of impact [ms]", xlim=(SHORTEST, None))
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=2, columnspacing=1.2)


def print_errors(runs):
    """Print the errors of every impact."""
    print("Error of impact [ms] and of the apex after it [mm], by impact")
    rows = []
    for title, made in runs.items():
        cells = [f"{late:+.3f} / {high:+.3f}" for late, high in zip(*made.errors())]
        rows.append((title, *cells, *["at rest"] * (COUNTED - len(cells))))
    print_table(rows, ["filling", *(str(k + 1) for k in range(COUNTED))])


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
