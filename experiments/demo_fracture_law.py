"""Does a bond do what its law says, when it is pulled, unloaded, reloaded and sheared?

A bench with five specimens, each of two tetrahedra bonded by one face. One is pulled, pressed and
pulled on until it breaks; four are pressed together, slid, slid back and slid on. The left body
of each is clamped and serves as load cell, the right one is driven. Expect measured points on the
drawn law (Konno et al., Fig. 2 to 4): a peak of 6.66 MPa, failure at 29.93 um, 99.67 J/m^2 in
between, and in shear a plateau of cohesion + friction x pressure.

    python experiments/demo_fracture_law.py             # ten seconds
    python experiments/demo_fracture_law.py --steps 20000

Dashpots are left out: they would add a traction that depends on how fast one pulls. Writes
law.gif, law.png, tension.csv, shear.csv and summary.json to results/demo_fracture_law/.
"""

import sys
from functools import partial

import numpy as np

import _fracture_law as law
from taichi_dem import CONCRETE, Every, Scene, Simulation, Uniform, effects
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import finish, main, output_paths, parser, show_rows, whole
from taichi_dem.mesh.mesh import group_area
from taichi_dem.mesh.shapes import pair, placed_together, single
from taichi_dem.simulate import run_simulation

NAME = "demo_fracture_law"
SETTINGS = {"steps": (5000, 1000, whole(200, 100000), "samples along the way, 5000")}
options_parser = partial(parser, NAME, __doc__, settings=SETTINGS)
EDGE, APART = 0.05, 0.2
#: Bodies are driven, so the step decides only how finely the law is sampled.
STEP = 1e-8


def bench():
    """The scene of all specimens, each driven on its right."""
    names = {f"specimen{k}": k for k in range(1 + len(law.PRESSURES))}
    mesh = placed_together({name: (pair(EDGE), (0, 0, APART * k)) for name, k in names.items()})
    drives = [effects.PrescribedMotion(f"{name}_right", (0.0, 0.0, 0.0)) for name in names]
    acting = [effects.Softening(), effects.ShearSlip(), effects.Fixed("left"), *drives]
    return Scene(mesh, CONCRETE, acting)


class Bench:
    """Observer that drives all specimens along their ways and reads their load cells."""

    # The clamp gives the left body what the bond took from it at the start of the step.
    when = Every(steps=1)

    def __init__(self, simulation, steps):
        self.state, self.steps = simulation.state, steps
        self.drives = [one for one in simulation.tables.supports if one.name == "prescribed_motion"]
        self.plans = [law.velocities(corners, steps, STEP) for corners in law.ways()]
        self.moved, self.given = [], []

    def observe(self, view):
        """Read, and set the velocities of the next step."""
        step = view.step
        for drive, plan in zip(self.drives, self.plans):
            if step == 0 or (step < self.steps and not np.array_equal(plan[step], plan[step - 1])):
                drive.law[0], drive.law[1] = plan[step]
        displacement = self.state.position.to_numpy() - view.model.centre
        self.moved.append(displacement[1::2] - displacement[::2])
        self.given.append(self.state.load_impulse.to_numpy()[::2, :2])


def measure(steps):
    """Drive the bench; returns the measured curves and the Result of the run."""
    with ProgressBar("bench") as bar:
        simulation = Simulation(bench(), Uniform(STEP))
        cells = Bench(simulation, steps)
        looks = {"samples": 1, "progress": bar, "observers": [cells]}
        result = run_simulation(simulation, until=(steps + 1) * STEP, **looks)
    traction = -np.diff(cells.given, axis=0) / (group_area(single(EDGE), "base") * STEP)
    return law.curves_of(np.array(cells.moved[:-1]), traction), result


def run(options):
    """Measure all specimens, compare with the law, picture."""
    at = output_paths(options.out)
    curves, result = measure(options.steps)
    rows = law.comparison(curves, round(result.broken_time[0] / STEP))
    law.write(curves, pair(EDGE).points, at)
    show_rows(rows, law.TABLE)
    caption = law.caption(rows, options.steps)
    finish(options, NAME, law.figures_of(rows), [result.report], caption=caption)


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
