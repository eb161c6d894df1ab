"""Do steps of their own for every body change what one sees of a blow?

A fragment hits the free end of a bonded bar. Once with one step for all bodies, as short as the
fastest one needs; once with a step for every body, dt0 / 2^k, by the same rule: none moves further
than l in a step. Short steps spread into the bar with the wave, and the displacement of both
ends is the same; only the number of evaluations differs.

The dashpots of sphere contacts have a twentieth of their strength here: at full strength they ask
for 2.7e-9 s while two faces touch, whatever the speed, and l does not know of that (at 5e-8 m the
run ends as diverged; the paper's 1e-8 m merely makes all steps short).

    python experiments/demo_multirate.py             # most of a minute
    python experiments/demo_multirate.py --speed 5

Writes blow.gif, blow.png, blow.csv, levels_*.csv and summary.json to results/demo_multirate/.
"""

import sys
from dataclasses import replace
from functools import partial

import numpy as np

import taichi_dem as dem
from _blast import BLAST_DRIVERS
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import GREY, line_key, picture, styles_of
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.mesh.topology import faces_of_group
from taichi_dem.output.run_costs import level_columns, level_shares
from taichi_dem.plot.film_runs import FilmedRun, film_runs
from taichi_dem.plot.levels import draw_level_shares, level_look, level_names
from taichi_dem.simulate import run_simulation

NAME = "demo_multirate"
#: All methods, made in one place; the first is what the others are compared with.
METHODS = {
    "uniform": dem.Uniform,
    "held": dem.Multirate,
    "drifted": lambda dt0, distance: dem.Multirate(dt0, distance, "drifted"),
}
SETTINGS = {
    "speed": (20.0, 20.0, study.number(0, 50), "of the fragment [m/s], 20"),
    "methods": (tuple(METHODS), ("uniform", "held")),
    "until": (2e-4, 4e-5),
}
options_parser = partial(study.parser, NAME, __doc__, BLAST_DRIVERS, settings=SETTINGS)
DT0, DISTANCE = 4e-8, 5e-8
#: Bar and fragment [m], and the gap between them.
LENGTH, WIDTH, CELLS = 0.9, 0.1, (18, 2, 2)
FRAGMENT, GAP = 0.1, 2e-5
#: Share of the sphere dashpots that is left.
CONTACT_DAMPING, SAMPLES = 0.05, 80
TABLE = study.Table(
    method=("name", "method"),
    evaluations=(lambda made: int(made.evaluations[-1]), "evaluations", ",", "1"),
    fewer_evaluations=("fewer_evaluations", "fewer by", ".2f", "1"),
    struck_um=(lambda made: 1e6 * float(made.struck[-1]), "struck end [um]", ".2f", "um"),
    difference=("difference", "difference", ".3f%", "1"),
    broken_faces=("result.report.broken_faces", "broken", "", "1"),
    residual=("result.report.energy_residual_fraction", "residual", ".2g%", "1"),
    cpu_s=("result.report.run_cpu_seconds", "CPU [s]", ".2f"),
)


def built_scene():
    """The bar, and a fragment off its right end."""
    parts = {
        "bar": (bar(LENGTH, WIDTH, CELLS), (0.0, 0.0, 0.0)),
        "fragment": (bar(FRAGMENT, WIDTH, (2, 2, 2)), (LENGTH + GAP, 0.0, 0.0)),
    }
    bonds = [dem.effects.BondDamping(), dem.effects.Softening(), dem.effects.ShearSlip()]
    acting = [*bonds, dem.effects.SphereContact(outer_faces=True), dem.effects.Friction()]
    soft = replace(dem.CONCRETE, contact_damping=CONTACT_DAMPING * dem.CONCRETE.contact_damping)
    return dem.Scene(placed_together(parts), soft, acting)


class Impact:
    """A run with a method; an entry a frame.

    struck, far: mean way of the bar's ends away from the fragment [m]. evaluations: so far.
    levels: (frames, bodies). fewer_evaluations, difference: against the first run, the latter the
    largest over time, of its largest way.
    """

    def __init__(self, name, options):
        self.name, self.style = name, styles_of([name])[name]
        cost = dem.Collector(dem.Every(samples=1), evaluations=lambda view: view.evaluations)
        with ProgressBar(self.style.label) as shown:
            made = dem.Simulation(built_scene(), METHODS[name](DT0, DISTANCE), options.driver)
            self.model, place = made.model, made.model.centre
            speed = np.outer(place[:, 0] > LENGTH, (-options.speed, 0.0, 0.0))
            made.state.set_motion(place, velocity=speed)
            looks = {"samples": SAMPLES, "frames": SAMPLES, "observers": [cost], "progress": shown}
            self.result = run_simulation(made, until=options.until, **looks)
        self.time, self.evaluations = self.result.history["time_s"], cost["evaluations"]
        self.levels = np.array([frame.level for frame in self.result.frames])
        self.struck, self.far = (self._moved(group) for group in ("bar_right", "bar_left"))

    def _moved(self, group):
        bodies, _ = faces_of_group(self.model.mesh, self.model.topology, group)
        return -self.result.mean_displacement(bodies)[:, 0]

    def compare(self, base):
        """Take the first run."""
        self.fewer_evaluations = float(base.evaluations[-1] / self.evaluations[-1])
        apart = np.abs(self.struck - base.struck).max()
        self.difference = float(apart / np.abs(base.struck).max())


def caption(rows, impact):
    """What to see; impact: of the second row, in which every body has its own step."""
    base, other = rows[:2]
    return (
        "A fragment hits the bar from the right. Above one step for all bodies, below a step for "
        f"each, by colour: {short_steps(impact, LENGTH)}. The struck end moves alike, "
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


def write_tables(impacts, at):
    """Write all that is plotted."""
    time = {"time_s": impacts[0].time}
    columns = dict(time)
    for impact in impacts:
        for name in ("struck", "far"):
            columns[f"{name}_{impact.name}_m"] = getattr(impact, name)
        columns[f"evaluations_{impact.name}"] = impact.evaluations
        shares = level_columns(level_shares(impact.levels))
        write_csv(at(f"levels_{impact.name}.csv"), {**time, **shares})
    write_csv(at("blow.csv"), columns)


def picture_blow(path, impacts):
    """Motion of the ends, evaluations, and share of bodies on each level of the second method."""
    time, other = 1e6 * impacts[0].time, impacts[1]
    with picture(path, 1, 3, size=(12.0, 3.6), sharex=True) as (figure, (way, work, share)):
        for impact in impacts:
            look = {"color": impact.style.colour, "ls": impact.style.line}
            way.plot(time, 1e6 * impact.struck, **look)
            way.plot(time, 1e6 * impact.far, lw=0.8, **look)
            work.plot(time, 1e-6 * impact.evaluations, label=impact.style.label, **look)
        way.set(xlabel="time [µs]", ylabel="displacement [µm]", title="the answer")
        work.set(xlabel="time [µs]", ylabel="evaluations of bonds and pairs [10⁶]")
        work.set(title="the price", xlim=(0.0, time[-1]))
        figure.legend(*work.get_legend_handles_labels(), loc="outside lower left", ncols=3)
        ends = {"struck end (thick)": 1.5, "far end (thin)": 0.8}
        way.legend(handles=[line_key(words, color=GREY, lw=width) for words, width in ends.items()])
        draw_level_shares(figure, share, time, level_shares(other.levels), DT0)
        share.set(xlabel="time [µs]", title=f"steps: {other.style.label}")


def film_blow(path, impacts, count=40):
    """Both bars by their bodies' steps, and how far the struck end moves. count: of pictures."""
    top = int(max(impact.levels.max() for impact in impacts)) + 1
    runs, rows = [], np.linspace(0, SAMPLES, count).round().astype(int)
    for impact in impacts:
        name, done = impact.style.label, zip(1e-6 * impact.evaluations, 1e6 * impact.time)
        titles = [f"{name}:\n{n:.1f} million evaluations after {t:.0f} µs" for n, t in done]
        shown = impact.model, impact.result.frames, impact.levels.astype(float), titles
        runs.append(FilmedRun(*shown, 1e6 * impact.struck, name, impact.style.colour))
    film_runs(
        *(path, runs, impacts[0].time[rows]),
        words="step of a body",
        ticks=(np.arange(top), level_names(DT0, top)),
        curve={"ylabel": "displacement of\nthe struck end [µm]"},
        magnify=40.0,
        margin=0.04,
        **level_look(top),
    )


def run(options):
    """Hit the bar with every method, compare, picture."""
    slowest = 2.0 * GAP / options.until
    if options.speed < slowest:
        raise dem.InputError(
            f"speed must be at least {slowest:g} m/s, at which the fragment crosses its gap of "
            f"{1e6 * GAP:g} um in half of {options.until:g} s, got {options.speed:g}"
        )
    at = study.output_paths(options.out)
    impacts = [Impact(name, options) for name in options.methods]
    for impact in impacts:
        impact.compare(impacts[0])
    rows = TABLE.rows(impacts)
    TABLE.show(rows)
    write_tables(impacts, at)
    picture_blow(at("blow.png"), impacts)
    film_blow(at("blow.gif"), impacts[:2])
    figures = {}
    for row in rows:
        figures.update(TABLE.figures(row, "{method}_{key}"))
    # The first is what the others are compared with.
    for key in ("fewer_evaluations", "difference"):
        del figures[f"{options.methods[0]}_{key}"]
    reports = [impact.result.report for impact in impacts]
    study.finish(options, NAME, figures, reports, caption=caption(rows, impacts[1]))


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
