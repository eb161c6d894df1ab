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

import os
import sys
from dataclasses import dataclass, replace

import numpy as np

from _cli import BLAST_DRIVERS, figure, main, number, parser, print_table
from _demo import conclude, placed_together
from taichi_dem import CONCRETE, InputError, Multirate, Scene, Simulation, Uniform, effects
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.plot_style import styles_of
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.mesh.shapes import bar
from taichi_dem.mesh.topology import faces_of_group
from taichi_dem.output.record import Recorder
from taichi_dem.plot.impact import film_impact, picture_impact
from taichi_dem.simulate import progress_of
from taichi_dem.simulation import macro_steps

NAME = "demo_multirate"
#: All methods, made in one place; the first is what the others are compared with.
METHODS = {
    "uniform": lambda dt0, distance: Uniform(dt0, distance),
    "held": lambda dt0, distance: Multirate(dt0, distance, "held"),
    "drifted": lambda dt0, distance: Multirate(dt0, distance, "drifted"),
}
QUICK = {"methods": ("uniform", "held"), "until": 4e-5}
FULL = {"methods": tuple(METHODS), "until": 2e-4}
DT0, DISTANCE = 4e-8, 5e-8
#: Bar and fragment [m], and the gap between them.
LENGTH, WIDTH, CELLS = 0.9, 0.1, (18, 2, 2)
FRAGMENT, GAP = 0.1, 2e-5
#: Share of the sphere dashpots that is left.
CONTACT_DAMPING = 0.05
SAMPLES, FRAMES = 80, 40


@dataclass(frozen=True, eq=False)
class Impact:
    """A run; all but name and Simulation has an entry a frame.

    struck, far: mean way of the bar's ends away from the fragment [m]. evaluations, broken: so far.
    """

    name: str
    simulation: Simulation
    frames: tuple
    struck: np.ndarray
    far: np.ndarray
    evaluations: np.ndarray
    broken: np.ndarray

    @property
    def time(self):
        """Time of every frame [s]."""
        return np.array([frame.time_s for frame in self.frames])

    @property
    def levels(self):
        """Level of every body at every frame, (frames, bodies)."""
        return np.array([frame.level for frame in self.frames])


def options_parser():
    """Options of this demonstration."""
    made = parser(NAME, __doc__, BLAST_DRIVERS)
    made.add_argument("--speed", type=number(0, 50), default=20.0, help="of the fragment [m/s], 20")
    return made


def built_scene():
    """The bar, and a fragment off its right end."""
    parts = {
        "bar": (bar(LENGTH, WIDTH, CELLS), (0.0, 0.0, 0.0)),
        "fragment": (bar(FRAGMENT, WIDTH, (2, 2, 2)), (LENGTH + GAP, 0.0, 0.0)),
    }
    acting = [
        effects.BondDamping(),
        effects.Softening(),
        effects.ShearSlip(),
        effects.SphereContact(outer_faces=True),
        effects.Friction(),
    ]
    soft = replace(CONCRETE, contact_damping=CONTACT_DAMPING * CONCRETE.contact_damping)
    return Scene(placed_together(parts), soft, acting)


def hit(name, scene, until, options):
    """Run one impact with a method; returns Impact."""
    method = METHODS[name](DT0, DISTANCE)
    last, counts, broken = macro_steps(until, DT0), [], []
    with ProgressBar(styles_of([name])[name].label) as shown:
        simulation = Simulation(scene, method, options.driver)
        model = simulation.model
        flying = model.centre[:, 0] > LENGTH
        velocity = np.outer(flying, (-options.speed, 0.0, 0.0))
        turn = np.tile([1.0, 0.0, 0.0, 0.0], (model.body_count, 1))
        simulation.state.set_motion(model.centre, turn, velocity)
        recorder = Recorder(simulation, None)
        simulation.start()
        for step in sorted({round(last * k / SAMPLES) for k in range(SAMPLES + 1)}):
            simulation.advance_to(step, lambda: shown(progress_of(simulation, until)))
            recorder.snapshot()
            counts.append(simulation.evaluations())
            ticks = simulation.state.broken_tick.to_numpy()
            broken.append(int((ticks[: model.bond_count] >= 0).sum()))
    frames = tuple(recorder.frames)
    ends = [end_moved(scene, model, frames, group) for group in ("bar_right", "bar_left")]
    return Impact(name, simulation, frames, *ends, np.array(counts), np.array(broken))


def end_moved(scene, model, frames, group):
    """Mean way of the bodies at one end of the bar, away from the fragment [m], every frame."""
    bodies, _ = faces_of_group(scene.mesh, model.topology, group)
    return np.array([-frame.displacement[bodies, 0].mean() for frame in frames])


def run(options):
    """Hit the bar with every method, compare, picture."""
    settings = QUICK if options.quick else FULL
    check_speed(options.speed, settings["until"])
    output_folder(options.out)
    impacts = [hit(name, built_scene(), settings["until"], options) for name in settings["methods"]]
    rows = compared(impacts)
    print_rows(rows)
    picture(impacts, options)
    simulations = [impact.simulation for impact in impacts]
    conclude(options, NAME, figures_of(rows), caption(rows, impacts[1]), simulations)


def check_speed(speed, until):
    """InputError for a fragment that does not reach the bar in half of the time [s]."""
    slowest = 2.0 * GAP / until
    if speed < slowest:
        raise InputError(
            f"speed must be at least {slowest:g} m/s, at which the fragment crosses its gap of "
            f"{1e6 * GAP:g} um in half of {until:g} s, got {speed:g}"
        )


def compared(impacts):
    """A row for every method; differences are the largest over time, of the largest way."""
    base = impacts[0]
    rows = []
    for impact in impacts:
        report = impact.simulation.report()
        rows.append(
            {
                "method": impact.name,
                "evaluations": int(impact.evaluations[-1]),
                "saved": float(base.evaluations[-1] / impact.evaluations[-1]),
                "struck_um": 1e6 * float(impact.struck[-1]),
                "difference": float(
                    np.abs(impact.struck - base.struck).max() / np.abs(base.struck).max()
                ),
                "broken_faces": int(impact.broken[-1]),
                "smallest_step_s": DT0 / 2.0 ** int(impact.levels.max()),
                "residual": report.energy_residual_fraction,
                "cpu_s": report.run_cpu_seconds,
            }
        )
    return rows


def caption(rows, impact):
    """What to see; impact: of the second row, in which every body has its own step."""
    base, other = rows[:2]
    return (
        "A fragment (right of the blue line) hits a bar. Above one step for all bodies, below a "
        f"step for each, by colour: {short_steps(impact)}. The struck end moves alike, within "
        f"{100 * other['difference']:.2g} %, with {1e-6 * other['evaluations']:.1f} instead of "
        f"{1e-6 * base['evaluations']:.1f} million bonds and contacts evaluated (a ratio of "
        f"{other['saved']:.2f}). The account of {other['method']} neighbours is off by "
        f"{100 * other['residual']:.2g} % of the energy, that of one step by "
        f"{100 * base['residual']:.2g} %."
    )


def short_steps(impact):
    """How far short steps came into the bar, and how many have grown again, in words."""
    place = impact.simulation.model.centre[:, 0]
    in_bar = place < LENGTH
    place, levels = place[in_bar], impact.levels[:, in_bar]
    finest = levels.max(axis=0)
    reached = finest > 0
    if not reached.any():
        return "at this speed all bodies of the bar keep the largest step"
    grown = (levels[-1] < finest)[reached].mean()
    return (
        f"short steps (dark) run {LENGTH - place[reached].min():.2f} of {LENGTH:g} m into the bar "
        f"with the wave, and at the end {100 * grown:.0f} % of the bodies that had them have "
        "longer ones again"
    )


def print_rows(rows):
    """The methods as a table."""
    header = ["method", "evaluations", "fewer by", "struck end [um]", "difference", "broken"]
    cells = [
        (
            row["method"],
            f"{row['evaluations']:,}",
            f"{row['saved']:.2f}",
            f"{row['struck_um']:.2f}",
            f"{100 * row['difference']:.3f} %",
            row["broken_faces"],
            f"{100 * row['residual']:.2g} %",
            f"{row['cpu_s']:.2f}",
        )
        for row in rows
    ]
    print_table(cells, [*header, "residual", "CPU [s]"])
    print()


def figures_of(rows):
    """Figures for summary.json."""
    figures = {}
    for row in rows:
        name = row["method"]
        figures[f"{name}_evaluations"] = figure(row["evaluations"], "1")
        figures[f"{name}_struck_um"] = figure(row["struck_um"], "um")
        figures[f"{name}_broken_faces"] = figure(row["broken_faces"], "1")
        figures[f"{name}_residual"] = figure(row["residual"], "1")
        if name != rows[0]["method"]:
            figures[f"{name}_fewer_evaluations"] = figure(row["saved"], "1")
            figures[f"{name}_difference"] = figure(row["difference"], "1")
    return figures


def picture(impacts, options):
    """Write the picture, its tables and the film."""

    def at(name):
        return os.path.join(options.out, name)

    columns = {"time_s": impacts[0].time}
    for impact in impacts:
        columns[f"struck_{impact.name}_m"] = impact.struck
        columns[f"far_{impact.name}_m"] = impact.far
        columns[f"evaluations_{impact.name}"] = impact.evaluations
        top = int(impact.levels.max()) + 1
        shares = np.array([np.bincount(row, minlength=top) / len(row) for row in impact.levels])
        levels = {f"level_{k}": shares[:, k] for k in range(top)}
        write_csv(at(f"levels_{impact.name}.csv"), {"time_s": impact.time, **levels})
    write_csv(at("blow.csv"), columns)
    picture_impact(at("blow.png"), impacts, DT0)
    film_impact(at("blow.gif"), impacts[0], impacts[1], DT0, FRAMES)


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
