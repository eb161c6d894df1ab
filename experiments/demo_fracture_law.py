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

import numpy as np

from _cli import main, parser, whole
from _demo import placed_together
from _fracture_law import PRESSURES, PULLED, SLID, Measured, caption, comparison, figures_of, write
from _report import finish, show_rows
from taichi_dem import CONCRETE, Every, Scene, Simulation, Uniform, effects
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.mesh.mesh import group_area
from taichi_dem.mesh.shapes import pair, single
from taichi_dem.simulate import run_simulation

NAME = "demo_fracture_law"
QUICK, FULL = 1000, 5000
EDGE, APART = 0.05, 0.2
#: Bodies are driven, so the step decides only how finely the law is sampled.
STEP = 1e-8


def options_parser():
    """Options of this demonstration."""
    made = parser(NAME, __doc__)
    made.add_argument("--steps", type=whole(200, 100000), help="samples along the way, 5000")
    return made


def ways():
    """Corners of every specimen's way (corners, 2) [m]: opening and sliding; all begin at rest."""
    made = [np.array([(0.0, 0.0), *((opening, 0.0) for opening in PULLED)])]
    for pressure in PRESSURES:
        closed = -pressure / CONCRETE.normal_stiffness
        made.append(np.array([(0.0, 0.0), (closed, 0.0), *((closed, way) for way in SLID)]))
    return made


def velocities(corners, steps):
    """Velocity of every step (steps, 2) [m/s] at an even pace along a way, corners to the step."""
    legs = np.diff(corners, axis=0)
    reached = np.cumsum(np.linalg.norm(legs, axis=1))
    counts = np.diff(np.round(steps * reached / reached[-1]).astype(int), prepend=0)
    legs, counts = legs[counts > 0], counts[counts > 0]
    return np.repeat(legs / (counts[:, None] * STEP), counts, axis=0)


def bench():
    """The scene of all specimens, each driven on its right."""
    names = [f"specimen{k}" for k in range(1 + len(PRESSURES))]
    mesh = placed_together({name: (pair(EDGE), (0, 0, APART * k)) for k, name in enumerate(names)})
    drives = [effects.PrescribedMotion(f"{name}_right", (0.0, 0.0, 0.0)) for name in names]
    acting = [effects.Softening(), effects.ShearSlip(), effects.Fixed("left"), *drives]
    return Scene(mesh, CONCRETE, acting)


class Bench:
    """Observer that drives all specimens along their ways and reads their load cells.

    What the clamp gives the left body in a step is what the bond took from it at the step's start.
    """

    when = Every(steps=1)

    def __init__(self, simulation, steps):
        self.state, self.steps = simulation.state, steps
        self.drives = [one for one in simulation.model.supports if one.name == "prescribed_motion"]
        self.plans = [velocities(corners, steps) for corners in ways()]
        self.moved, self.given = [], []

    def observe(self, view):
        """Read, and set the velocities of the next step."""
        for drive, plan in zip(self.drives, self.plans):
            now, before = (plan[min(max(k, 0), self.steps - 1)] for k in (view.step, view.step - 1))
            if view.step == 0 or not np.array_equal(now, before):
                drive.motion[0], drive.motion[1] = now
        displacement = self.state.position.to_numpy() - view.model.centre
        self.moved.append(displacement[1::2] - displacement[::2])
        self.given.append(self.state.load_impulse.to_numpy()[::2, :2])


def measure(steps):
    """Drive the bench; returns Measured, and the Report of the run."""
    with ProgressBar("bench") as bar:
        simulation = Simulation(bench(), Uniform(STEP))
        cells = Bench(simulation, steps)
        until = (steps + 1) * STEP
        result = run_simulation(simulation, until=until, samples=1, progress=bar, observers=[cells])
    traction = -np.diff(cells.given, axis=0) / (group_area(single(EDGE), "base") * STEP)
    broken = round(result.broken_time[0] / STEP)
    return Measured(np.array(cells.moved[:-1]), traction, broken), result.report


def run(options):
    """Measure all specimens, compare with the law, picture."""
    steps = options.steps or (QUICK if options.quick else FULL)
    output_folder(options.out)
    made, report = measure(steps)
    rows = comparison(made)
    write(made, pair(EDGE).points, options.out)
    formats = {key: (key, ".4f") for key in ("measured", "law")}
    ends = {"unit": ("unit", ""), "difference": ("error", "+.3f%")}
    show_rows(rows, {"quantity": ("name", ""), **formats, **ends})
    finish(options, NAME, figures_of(rows), [report], caption(rows, steps))


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
