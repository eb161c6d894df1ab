"""Do steps of their own for every body change what one sees of a blow?

A fragment hits the free end of a bonded bar. Once with one step for all bodies, as short as the
fastest one needs; once with a step for every body, dt0 / 2^k, by the same rule: none moves further
than l in a step. Short steps spread into the bar with the wave, and the displacement of both
ends is the same; only the number of evaluations differs.

    python experiments/demo_multirate.py             # most of a minute
    python experiments/demo_multirate.py --speed 5

Writes blow.gif, blow.png, blow.csv, levels_*.csv and summary.json to results/demo_multirate/.
"""

import sys
from functools import partial

import numpy as np

import taichi_dem as dem
from _blast import BLAST_DRIVERS
from _multirate import TABLE, Impact, caption, figures_of, write
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import styles_of
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.validation import told_apart
from taichi_dem.mesh.shapes import bar, placed_together
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
    "pictures": (40, 10),
}
options_parser = partial(study.parser, NAME, __doc__, BLAST_DRIVERS, settings=SETTINGS)
DT0, DISTANCE = 4e-8, 5e-8
#: Bar and fragment [m], and the gap between them.
LENGTH, WIDTH, CELLS = 0.9, 0.1, (18, 2, 2)
FRAGMENT, GAP = 0.1, 2e-5
SAMPLES = 80


def built_scene():
    """The bar, and a fragment off its right end."""
    parts = {
        "bar": (bar(LENGTH, WIDTH, CELLS), (0.0, 0.0, 0.0)),
        "fragment": (bar(FRAGMENT, WIDTH, (2, 2, 2)), (LENGTH + GAP, 0.0, 0.0)),
    }
    bonds = [dem.effects.BondDamping(), dem.effects.Softening(), dem.effects.ShearSlip()]
    acting = [*bonds, dem.effects.BodyContact(), dem.effects.StickingFriction()]
    return dem.Scene(placed_together(parts), dem.CONCRETE, acting)


def hit(name, options):
    """Let the fragment hit the bar, with a method; returns Impact."""
    cost = dem.Collector(dem.Every(samples=1), evaluations=lambda view: view.evaluations)
    with ProgressBar(styles_of([name])[name].label) as shown:
        made = dem.Simulation(built_scene(), METHODS[name](DT0, DISTANCE), options.driver)
        place = made.model.centre
        speed = np.outer(place[:, 0] > LENGTH, (-options.speed, 0.0, 0.0))
        made.state.set_motion(place, velocity=speed)
        looks = {"samples": SAMPLES, "frames": SAMPLES, "observers": [cost], "progress": shown}
        return Impact(name, run_simulation(made, until=options.until, **looks), cost["evaluations"])


def run(options):
    """Hit the bar with every method, compare, picture."""
    slowest = 2.0 * GAP / options.until
    if options.speed < slowest:
        got, least = told_apart(options.speed, slowest)
        raise dem.InputError(
            f"speed must be at least {least} m/s, for {1e6 * GAP:g} um by half of until, got {got}"
        )
    at = study.output_paths(options.out)
    impacts = [hit(name, options) for name in options.methods]
    for impact in impacts:
        impact.compare(impacts[0])
    rows = TABLE.rows(impacts)
    TABLE.show(rows)
    write(impacts, DT0, at, options.pictures)
    reports = [impact.result.report for impact in impacts]
    words = caption(rows, impacts[1], LENGTH)
    study.finish(options, NAME, figures_of(rows), reports, caption=words)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
