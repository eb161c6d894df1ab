"""Does a particle fall and rebound as Fig. 8 of Komatsuzaki et al. says it should?

One particle falls from the top of a container at rest. Four readings of what the automaton does
with the way travelled when a particle turns are compared, and the spheres, each with the closed
form for its own gravity (10 m/s^2 on the lattice, 9.8 m/s^2 for the spheres). Expect "signed" and
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

from _cli import figure, main, number, parser, print_table, write_summary
from ca_damper import Batch, SceneTable, film, plot
from ca_damper.automaton import Automaton
from ca_damper.automaton.accumulator import READINGS
from ca_damper.spheres import Spheres
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.progress.progress_bar import ProgressBar

NAME = "damper_rebound"
QUICK = {"impacts": 4, "every_s": 1e-3}
FULL = {"impacts": 6, "every_s": 4e-4}
#: Impacts that the figures speak of, and how far off the default reading may be.
COUNTED, ALLOWED_MS = 4, 2.0
#: The base stands still; its frequency [Hz] only makes whole steps of 1e-4 s and 2e-5 s.
FREQUENCY = 10.0
#: Column from which the particle falls; the second is one of those that stand lower.
COLUMN = 1
TITLES = {
    "signed": "automaton\nsigned (default)",
    "signed_through_walls": "automaton\nsigned through walls",
    "reset": "automaton\nreset",
    "kept": "automaton\nkept",
    "dem": "spheres",
}


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

    @property
    def compared(self):
        """Impacts that are compared: the first four, or as many as there were."""
        return min(COUNTED, len(self.impacts_s))

    def impact_errors_ms(self):
        """Time of the first impacts less the closed form's [ms]."""
        theory = [self.fall.impact_s(k + 1) for k in range(self.compared)]
        return 1e3 * (self.impacts_s[: self.compared] - theory)

    def apex_errors_mm(self):
        """Height of the first apexes less the closed form's [mm]."""
        theory = [self.fall.apex_m(k + 1) for k in range(self.compared)]
        return 1e3 * (self.apexes_m[: self.compared] - theory)


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
    made = {}
    for reading in READINGS:
        plain = Automaton(accumulator=reading, **both)
        start = ((COLUMN, plain.rows - 1),)
        falls = (plain.rows - 1) * plain.width
        made[reading] = Automaton(accumulator=reading, start=start, **both), falls
    plain = Spheres()
    place = (0.5 * plain.width, plain.height - plain.radius)
    made["dem"] = Spheres(start=(place,), **both), plain.height - plain.diameter
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
    settings = QUICK if options.quick else FULL
    batches, falls = {}, {}
    for title, (filling, height) in fillings(options.restitution).items():
        dt = options.dt if title == "dem" else options.ca_dt
        batches[title] = Batch(filling, SceneTable(1, 1, dt, FREQUENCY, 0.0), mount="base")
        falls[title] = Fall(height, options.restitution, filling.gravity)
    output_folder(options.out)
    runs = {}
    for title, batch in batches.items():
        with ProgressBar(title) as progress:
            runs[title] = drop(batch, falls[title], settings, progress)
    write(runs, options.out)
    figures = figures_of(runs)
    write_summary(
        options.out,
        NAME,
        figures,
        compile_seconds=sum(batch.compile_seconds for batch in batches.values()),
        run_seconds=sum(batch.run_seconds for batch in batches.values()),
    )
    show(runs, options.out)


def figures_of(runs):
    """Largest errors over the impacts compared: of the default reading, and of all."""
    default = Automaton().accumulator
    figures = {}
    for title, made in {"": runs[default], **runs}.items():
        end = f"_{title}" if title else ""
        impact, apex = np.abs(made.impact_errors_ms()), np.abs(made.apex_errors_mm())
        figures[f"impact_error_ms{end}"] = figure(float(impact.max()), "ms")
        figures[f"apex_error_mm{end}"] = figure(float(apex.max()), "mm")
    return figures


def write(runs, folder):
    """Picture and tables."""
    default, spheres = runs[Automaton().accumulator], runs["dem"]
    falls = {}
    for title, made in (("ca_static", default), ("dem", spheres)):
        time = np.linspace(0.0, made.time_s[-1], 2000)
        exact = f"closed form, g = {made.fall.gravity:g} m/s²"
        falls[title] = (made.time_s, made.height_m, time, made.fall.heights(time), exact)
    errors = {TITLES[title]: made.impact_errors_ms() for title, made in runs.items()}
    plot.plot_rebound(os.path.join(folder, "rebound.png"), falls, errors, ALLOWED_MS)
    write_csv(os.path.join(folder, "heights.csv"), heights_table(runs))
    write_csv(os.path.join(folder, "impacts.csv"), impacts_table(runs))


def heights_table(runs):
    """A row a sample of every run."""
    sizes = [len(made.time_s) for made in runs.values()]
    columns = {
        "time_s": [made.time_s for made in runs.values()],
        "height_m": [made.height_m for made in runs.values()],
        "closed_form_m": [made.fall.heights(made.time_s) for made in runs.values()],
    }
    joined = {name: np.concatenate(parts) for name, parts in columns.items()}
    return {"filling": np.repeat(list(runs), sizes), **joined}


def impacts_table(runs):
    """A row an impact of every run."""
    rows = []
    for title, made in runs.items():
        for k, (time, apex) in enumerate(zip(made.impacts_s, made.apexes_m), start=1):
            rows.append((title, k, time, made.fall.impact_s(k), apex, made.fall.apex_m(k)))
    names = ("filling", "impact", "time_s", "closed_form_s", "apex_m", "closed_form_apex_m")
    return dict(zip(names, zip(*rows)))


def show(runs, folder):
    """Print the errors of every impact."""
    print("Error of impact [ms] and of the apex after it [mm], by impact")
    rows = []
    for title, made in runs.items():
        pairs = zip(made.impact_errors_ms(), made.apex_errors_mm())
        cells = [f"{late:+.3f} / {high:+.3f}" for late, high in pairs]
        rows.append((title, *cells, *["at rest"] * (COUNTED - len(cells))))
    print_table(rows, ["filling", *(str(k + 1) for k in range(COUNTED))])
    print(f"\nPicture and tables are in {folder}")


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
