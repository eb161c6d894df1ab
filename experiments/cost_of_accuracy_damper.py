"""What does an error of 10 or 1 % in the damper's response cost, by automaton and by spheres?

    python experiments/cost_of_accuracy_damper.py          # about four minutes on one core
    python experiments/cost_of_accuracy_damper.py --quick

Automaton and spheres are different models, so each is compared with its own limit: the same method
at a step far below those of the sweep, with other seeds. A second panel takes the spheres' limit as
the truth.

The error is the RMS over the frequencies of (response - truth), mean over seeds, as a share of the
peak. Dotted is what seeds alone make of it. Seconds are CPU seconds of one thread, of the fastest
repeat.

Writes work_precision.png, points.csv and summary.json to results/cost_of_accuracy_damper/.
"""

import itertools
import math
import sys
from functools import partial
from typing import NamedTuple

import numpy as np

from ca_damper import Automaton, Paper, ProgressBar, Spheres, frequency_response
from ca_damper.errors import SimulationDiverged
from ca_damper.report.measures import curve_distance, seed_variance
from taichi_dem import InputError
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import picture, seconds, styles_of

NAME = "cost_of_accuracy_damper"
PARTICLES, SPHERES = 30, "dem_tsuji"
CA_STEPS = (2e-3, 1.1e-3, 7e-4, 5e-4, 3e-4, 2e-4, 1e-4, 5e-5)
DEM_STEPS = (1e-4, 6e-5, 4e-5, 3e-5, 2e-5, 1.4e-5)
SOFT, SOFT_STEPS = Spheres(young=5e6, wall_young=5e6), (4e-4, 2.5e-4, 2e-4, 1e-4, 5e-5)
PRINTED, PAPER = Spheres(damping="printed"), Automaton(Paper())
#: A filling, its steps [s] from coarse to fine, those of the quick job, step and seeds of the
#: reference.
METHODS = {
    "ca_static": (PAPER, CA_STEPS, (2e-3, 2e-4), 1e-5, 6),
    "ca_ejection": (Automaton(Paper("landing+ejection")), CA_STEPS, (), 1e-5, 6),
    "ca_landing": (Automaton(Paper("landing")), CA_STEPS, (2e-3, 2e-4), 1e-5, 6),
    SPHERES: (Spheres(), DEM_STEPS, (1e-4, 3e-5), 5e-6, 3),
    "dem_printed": (PRINTED, (6e-5, 4e-5, 2e-5), (), 5e-6, 3),
    "dem_soft": (SOFT, SOFT_STEPS, (2e-4,), 2.5e-5, 3),
}
#: Seeds of a reference are counted from here: a run that shares them would look too good.
FIRST_SEED = 1001
SETTINGS = {
    "ratios": ((0.92, 0.95, 0.966, 0.98, 1.0, 1.04), (0.95, 0.98, 1.0)),
    "cycles": ((40, 40), (10, 10)),
    "seeds": (range(1, 4), range(1, 3)),
    # The first may compile.
    "repeats": (3, 2),
}
#: Times are of one thread.
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)


class Point(NamedTuple):
    """A run of a method.

    step: the swept number, larger is coarser; label: the same in words. error: a share, NaN where a
    run failed. failure: why it did, in a word.
    """

    method: str
    step: float
    label: str
    seconds: float
    error: float = math.nan
    failure: str = ""


def cheapest(points, target, floor=0.0):
    """The cheapest point of a method with an error up to a target, or None.

    All finer steps must be as good, and the floor must lie below: the distance of runs that should
    not differ. A single lucky run answers nothing.
    """
    finest_first = sorted(points, key=lambda one: one.step)
    # NaN, of a failure, is no error at all.
    reached = itertools.takewhile(lambda one: one.error <= target, finest_first)
    return min(reached, key=lambda one: one.seconds, default=None) if floor <= target else None


class Sweep(NamedTuple):
    """Responses of a method [m], (ratios, seeds) each: of the reference, and by step of the runs.

    seconds: of the fastest repeat, by step. failures: "refused" or "diverged", by step.
    """

    reference: np.ndarray
    runs: dict
    seconds: dict
    failures: dict

    @property
    def truth(self):
        """Curve of the reference [m], (ratios,)."""
        return self.reference.mean(axis=1)


def sweep_of(name, options, bar):
    """All runs of a method, and their seconds of compiling."""
    filling, steps, quick, finest, count = METHODS[name]
    if options.quick:
        steps, finest, count = quick, 0.5 * min(quick), 2
    cycles = dict(zip(("transient_cycles", "measured_cycles"), options.cycles))
    job = {"particles": PARTICLES, "ratios": options.ratios, "start": "rigid", "progress": bar}
    respond = partial(frequency_response, filling, **job, **cycles)
    found = respond(dt=finest, seeds=range(FIRST_SEED, FIRST_SEED + count))
    made, compiling = Sweep(found.rms[0], {}, {}, {}), found.report.compile_seconds
    for dt in steps:
        try:
            repeats, spent = [], []
            for _ in range(options.repeats):
                started = study.clock()
                repeats.append(respond(dt=dt, seeds=options.seeds))
                spent.append(study.clock() - started)
        except (InputError, SimulationDiverged) as error:
            made.failures[dt] = "refused" if isinstance(error, InputError) else "diverged"
            continue
        reports = [one.report for one in repeats]
        compiling += sum(one.compile_seconds for one in reports)
        if any(one.diverged for one in reports):
            made.failures[dt] = "diverged"
        else:
            made.runs[dt] = repeats[0].rms[0]
            made.seconds[dt] = min(spent)
    return made, compiling


def floor_of(reference, runs):
    """Error of a run against the reference that seeds alone make; responses (ratios, seeds).

    The variance from seed to seed is the mean over all runs of the method, as a single run may see
    one of several steady motions only.
    """
    variance = np.mean([seed_variance(rms) for rms in (reference, *runs)])
    seeds = reference.shape[1], runs[0].shape[1]
    return float((variance * (1.0 / seeds[0] + 1.0 / seeds[1])) ** 0.5)


def points_of(name, sweep, truth):
    """Points of a method with errors against a curve [m]."""
    good = [
        Point(name, dt, seconds(dt), sweep.seconds[dt], curve_distance(rms.mean(axis=1), truth))
        for dt, rms in sweep.runs.items()
    ]
    bad = [
        Point(name, dt, seconds(dt), math.nan, failure=why) for dt, why in sweep.failures.items()
    ]
    return [*bad, *good]


def draw(path, own, toward, floors):
    """Errors over seconds: by method against its own limit, and toward the spheres."""
    panels = {"against its own limit": own, "against the spheres": toward}
    with picture(path, 2, 1, size=(9.2, 9.6)) as (figure, drawn):
        for axes, (title, points) in zip(drawn, panels.items()):
            draw_points(axes, points, floors)
            axes.set(xscale="log", yscale="log", title=title, xlabel="CPU time [s]")
            axes.set_ylabel("error of the response curve / its peak [1]")
        keys = [key for key in drawn[0].get_lines() if not key.get_label().startswith("_")]
        figure.legend(handles=keys, loc="outside upper left", ncols=2)


def draw_points(axes, points, floors):
    """A line a method; its coarsest and finest steps at their points, what failed in the legend."""
    for name, look in styles_of(points).items():
        good = [one for one in points[name] if not one.failure]
        failed = ", ".join(one.label for one in points[name] if one.failure)
        label, colour = look.label + f" (failed at {failed})" * bool(failed), look.colour
        costs, errors = [one.seconds for one in good], [one.error for one in good]
        axes.plot(costs, errors, color=colour, marker=look.marker, ms=5, lw=1.2, label=label)
        for one in (*good[:1], *good[-1:]):
            at = {"xytext": (4, 4), "textcoords": "offset points", "color": colour}
            axes.annotate(one.label, (one.seconds, one.error), fontsize=8.5, **at)
        axes.axhline(floors[name], color=colour, ls=":", lw=1.0)


def figures_of(points, floors, target, words):
    """Figures of the cheapest method for an error: its seconds and name."""
    found = [cheapest(some, target, floors[name]) for name, some in points.items()]
    best = min(filter(None, found), key=lambda one: one.seconds, default=None)
    return {
        f"cheapest_seconds_{words}": (best and best.seconds, "s"),
        f"cheapest_method_{words}": (best and best.method, ""),
    }


def run(options):
    """Measure all methods, write pictures and tables, find the cheapest method for an error."""
    folder, made, compiling = study.begin(options), {}, 0.0
    with ProgressBar("sweep") as bar:
        for name, one in METHODS.items():
            if one[2] or not options.quick:
                made[name], spent = sweep_of(name, options, bar)
                compiling += spent
    truth = made[SPHERES].truth
    own = {name: points_of(name, one, one.truth) for name, one in made.items()}
    toward = {name: points_of(name, one, truth) for name, one in made.items()}
    floors = {name: floor_of(one.reference, [*one.runs.values()]) for name, one in made.items()}
    study.write_rows(folder / "points.csv", [*itertools.chain(*own.values())], Point._fields)
    draw(folder / "work_precision.png", own, toward, floors)
    figures = figures_of(own, floors, 0.01, "at_1_percent")
    figures |= figures_of(own, floors, 0.1, "at_10_percent")
    figures |= figures_of(toward, floors, 0.02, "to_spheres_within_2_percent")
    figures["chaos_floor"] = min(floors.values()), "1"
    for name, one in made.items():
        best = cheapest(own[name], 0.01, floors[name])
        figures[f"seconds_at_1_percent_{name}"] = best and best.seconds, "s"
        figures[f"chaos_floor_{name}"] = floors[name], "1"
        figures[f"distance_to_spheres_{name}"] = curve_distance(one.truth, truth), "1"
    study.finish(options, NAME, figures, compiling)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
