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

from _fracture_law import PRESSURES, PULLED, TABLE, Bench, caption, figures_of, write
from _meshes import group_area
from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.kit import study
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.mesh.shapes import pair, placed_together, single
from taichi_dem.simulate import run_simulation

NAME = "demo_fracture_law"
SETTINGS = {"steps": (5000, 1000, study.whole(200, 100000), "samples along the way, 5000")}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Bodies are driven, so the step decides only how finely the law is sampled.
EDGE, APART, STEP = 0.05, 0.2, 1e-8
#: Slope of the line from the first turning point to the origin [Pa/m].
SECANT = CONCRETE.softening_slope * (CONCRETE.failure_opening - PULLED[0]) / PULLED[0]


def bench():
    """The scene of all specimens, each driven on its right."""
    names = {f"specimen{k}": k for k in range(1 + len(PRESSURES))}
    mesh = placed_together({name: (pair(EDGE), (0, 0, APART * k)) for name, k in names.items()})
    drives = [effects.PrescribedMotion(f"{name}_right", (0.0, 0.0, 0.0)) for name in names]
    acting = [effects.Softening(), effects.ShearSlip(), effects.Fixed("left"), *drives]
    return Scene(mesh, CONCRETE, acting)


def measure(steps):
    """Drive the bench; returns way [m] and traction [Pa] of every specimen, and the Result."""
    with ProgressBar("bench") as bar:
        simulation = Simulation(bench(), Uniform(STEP))
        cells = Bench(simulation, steps, STEP)
        looks = {"samples": 1, "progress": bar, "observers": [cells]}
        result = run_simulation(simulation, until=(steps + 1) * STEP, **looks)
    traction = -np.diff(cells.given, axis=0) / (group_area(single(EDGE), "base") * STEP)
    moved, specimens = np.array(cells.moved[:-1]), range(1 + len(PRESSURES))
    return [(moved[:, k, min(k, 1)], traction[:, k, min(k, 1)]) for k in specimens], result


def compared(curves, broken):
    """Rows of the table. broken: sample at which the pulled one broke."""
    opening, pull = (values[: broken + 1] for values in curves[0])
    work = np.sum(0.5 * (pull[1:] + pull[:-1]) * np.diff(opening))
    # The unloading branch, by least squares over what lies above zero.
    turn = int(np.argmax(opening >= (1.0 - 1e-9) * PULLED[0]))
    down = slice(turn, turn + int(np.argmax(opening[turn:] <= 0.0)))
    secant = np.polyfit(opening[down], pull[down], 1)[0]
    found = [
        ("peak_MPa", 1e-6 * pull.max(), 1e-6 * CONCRETE.tensile_strength, "MPa"),
        ("failure_opening_um", 1e6 * opening[broken], 1e6 * CONCRETE.failure_opening, "um"),
        ("energy_J_m2", work, CONCRETE.fracture_energy, "J/m2"),
        ("secant_MPa_mm", 1e-9 * secant, 1e-9 * SECANT, "MPa/mm"),
    ]
    for pressure, (_, shear) in zip(PRESSURES, curves[1:]):
        plateau = CONCRETE.cohesion + CONCRETE.friction * pressure
        name = f"plateau_at_{1e-6 * pressure:g}_MPa"
        found.append((name, 1e-6 * shear.max(), 1e-6 * plateau, "MPa"))
    return TABLE.rows(found)


def run(options):
    """Measure all specimens, compare with the law, picture."""
    at = study.output_paths(options.out)
    curves, result = measure(options.steps)
    rows = compared(curves, round(result.broken_time[0] / STEP))
    write(curves, pair(EDGE).points, at)
    TABLE.show(rows)
    words = caption(rows, options.steps)
    study.finish(options, NAME, figures_of(rows), [result.report], caption=words)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
