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

import numpy as np

from _blast import BLAST_DRIVERS
from _demo import set_moving
from _multirate import TABLE, Impact, caption, figures_of, write
from taichi_dem import (
    CONCRETE,
    Every,
    InputError,
    Multirate,
    Scene,
    Simulation,
    Uniform,
    Watch,
    effects,
)
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.plot_style import styles_of
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import finish, main, number, parser, show_rows
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.simulate import run_simulation

NAME = "demo_multirate"
#: All methods, made in one place; the first is what the others are compared with.
METHODS = {
    "uniform": Uniform,
    "held": Multirate,
    "drifted": lambda dt0, distance: Multirate(dt0, distance, "drifted"),
}
QUICK = {"methods": ("uniform", "held"), "until": 4e-5}
FULL = {"methods": tuple(METHODS), "until": 2e-4}
DT0, DISTANCE = 4e-8, 5e-8
#: Bar and fragment [m], and the gap between them.
LENGTH, WIDTH, CELLS = 0.9, 0.1, (18, 2, 2)
FRAGMENT, GAP = 0.1, 2e-5
#: Share of the sphere dashpots that is left.
CONTACT_DAMPING, SAMPLES = 0.05, 80


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
    bonds = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
    acting = [*bonds, effects.SphereContact(outer_faces=True), effects.Friction()]
    soft = replace(CONCRETE, contact_damping=CONTACT_DAMPING * CONCRETE.contact_damping)
    return Scene(placed_together(parts), soft, acting)


def hit(name, until, options):
    """Run one impact with a method; returns Impact."""
    cost = Watch(Every(samples=1), evaluations=lambda view: view.evaluations)
    with ProgressBar(styles_of([name])[name].label) as shown:
        made = Simulation(built_scene(), METHODS[name](DT0, DISTANCE), options.driver)
        set_moving(made, np.outer(made.model.centre[:, 0] > LENGTH, (-options.speed, 0.0, 0.0)))
        looks = {"samples": SAMPLES, "frames": SAMPLES, "observers": [cost], "progress": shown}
        return Impact(name, run_simulation(made, until=until, **looks), cost["evaluations"])


def check_speed(speed, until):
    """InputError for a fragment that does not cross its gap in half of the time [s]."""
    slowest = 2.0 * GAP / until
    if speed < slowest:
        raise InputError(
            f"speed must be at least {slowest:g} m/s, at which the fragment crosses its gap of "
            f"{1e6 * GAP:g} um in half of {until:g} s, got {speed:g}"
        )


def run(options):
    """Hit the bar with every method, compare, picture."""
    settings = QUICK if options.quick else FULL
    check_speed(options.speed, settings["until"])
    output_folder(options.out)
    impacts = [hit(name, settings["until"], options) for name in settings["methods"]]
    rows = [impact.row(impacts[0]) for impact in impacts]
    show_rows(rows, TABLE)
    write(impacts, DT0, options.out)
    reports = [impact.result.report for impact in impacts]
    finish(options, NAME, figures_of(rows), reports, caption=caption(rows, impacts[1], LENGTH))


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
