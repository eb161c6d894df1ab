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

import os
import sys
from dataclasses import dataclass

import numpy as np

from _cli import figure, main, parser, print_table, whole
from _demo import conclude, placed_together
from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.kit.files import output_folder, write_csv
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.mesh.mesh import group_area
from taichi_dem.mesh.shapes import pair, single
from taichi_dem.plot.law import film_law, picture_law

NAME = "demo_fracture_law"
QUICK, FULL = {"steps": 1000}, {"steps": 5000}
EDGE, APART = 0.05, 0.2
#: Bodies are driven, so the step decides only how finely the law is sampled.
STEP = 1e-8
#: Way of the specimen in tension [m]: beyond the strength, back into compression, to the break.
PULLED = (22e-6, -4e-6, 32e-6)
#: Pressures of the specimens in shear [Pa], and their way [m].
PRESSURES = (0.0, 5e6, 10e6, 15e6)
SLID = (220e-6, 150e-6, 300e-6)
FRAMES = 40


@dataclass(frozen=True, eq=False)
class Measured:
    """What the bench measured: one row a step, one column a specimen, the pulled one first.

    opening, sliding [m]; pull, shear: tractions [Pa]. broken: row at which the first one broke.
    """

    opening: np.ndarray
    sliding: np.ndarray
    pull: np.ndarray
    shear: np.ndarray
    broken: int


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
    ends = np.round(steps * reached / reached[-1]).astype(int)
    counts = np.diff(ends, prepend=0)
    legs, counts = legs[counts > 0], counts[counts > 0]
    return np.repeat(legs / (counts[:, None] * STEP), counts, axis=0)


def bench():
    """The scene of all specimens, each driven on its right."""
    specimens = [f"specimen{k}" for k in range(1 + len(PRESSURES))]
    mesh = placed_together(
        {name: (pair(EDGE), (0.0, 0.0, APART * k)) for k, name in enumerate(specimens)}
    )
    drives = [effects.PrescribedMotion(f"{name}_right", (0.0, 0.0, 0.0)) for name in specimens]
    acting = [effects.Softening(), effects.ShearSlip(), effects.Fixed("left"), *drives]
    return Scene(mesh, CONCRETE, acting)


def measure(simulation, steps, progress):
    """Drive all specimens along their ways and read their load cells; returns Measured.

    What the clamp gives the left body in a step is what the bond took from it at the step's start.
    """
    plans = [velocities(corners, steps) for corners in ways()]
    # A scene may serve many runs: the motion of this one is its model's.
    drives = [effect for effect in simulation.model.supports if effect.name == "prescribed_motion"]
    state, first = simulation.state, simulation.model.centre
    place, given = [], []
    simulation.start()
    for step in range(steps + 1):
        for drive, plan in zip(drives, plans):
            now = plan[min(step, steps - 1)]
            if step == 0 or (step < steps and not np.array_equal(now, plan[step - 1])):
                drive.motion[0], drive.motion[1] = now
        place.append(state.position.to_numpy() - first)
        given.append(state.load_impulse.to_numpy()[::2, :2])
        simulation.advance_to(step + 1)
        progress(step / steps)
    given.append(state.load_impulse.to_numpy()[::2, :2])
    area = group_area(single(EDGE), "base")
    traction = -np.diff(given, axis=0) / (area * STEP)
    moved = np.array(place)[:, 1::2] - np.array(place)[:, ::2]
    ticks = simulation.state.broken_tick.to_numpy()
    broken = round(ticks[0] * simulation.schedule.tick_seconds / STEP)
    return Measured(moved[..., 0], moved[..., 1], traction[..., 0], traction[..., 1], broken)


def run(options):
    """Measure all specimens, compare with the law, picture."""
    steps = options.steps or (QUICK if options.quick else FULL)["steps"]
    output_folder(options.out)
    simulation = Simulation(bench(), Uniform(STEP))
    with ProgressBar("bench") as bar:
        made = measure(simulation, steps, bar.at)
    rows = comparison(made)
    picture(made, options)
    print_table(
        [(name, f"{is_:.4f}", f"{should:.4f}", unit, f"{100 * (is_ / should - 1):+.3f} %")
         for name, (is_, should, unit) in rows.items()],
        ["quantity", "measured", "law", "unit", "difference"],
    )  # fmt: skip
    print()
    conclude(options, NAME, figures_of(rows), caption(rows, steps), [simulation])


def caption(rows, steps):
    """What to see; rows: of ``comparison``."""
    pressures = ", ".join(f"{1e-6 * pressure:g}" for pressure in PRESSURES)
    off = max(abs(found / law - 1.0) for found, law, _ in rows.values())
    return (
        f"{len(ways())} bonds, {steps} samples of each. Left: pulled beyond its strength a bond "
        "softens; unloaded and reloaded it runs on the line to the origin, pressed it is as stiff "
        f"as ever; at {rows['failure_opening_um'][0]:.2f} um it lets go. Right: under pressures of "
        f"{pressures} MPa it slides at cohesion + friction x pressure, and elastically back and "
        "forth below that. Points are measured with a load cell, lines are the law; the figures "
        f"differ by at most {100 * off:.2g} %."
    )


def comparison(made):
    """Measured against the law: name -> (measured, law, unit)."""
    law, end = CONCRETE, made.broken
    opening, pull = made.opening[: end + 1, 0], made.pull[: end + 1, 0]
    work = np.sum(0.5 * (pull[1:] + pull[:-1]) * np.diff(opening))
    rows = {
        "peak_MPa": (1e-6 * pull.max(), 1e-6 * law.tensile_strength, "MPa"),
        "failure_opening_um": (1e6 * opening[end], 1e6 * law.failure_opening, "um"),
        "energy_J_m2": (work, law.fracture_energy, "J/m2"),
        "secant_MPa_mm": (1e-9 * secant(opening, pull), 1e-9 * law_secant(), "MPa/mm"),
    }
    for k, pressure in enumerate(PRESSURES, start=1):
        plateau = law.cohesion + law.friction * pressure
        found = made.shear[:, k].max()
        rows[f"plateau_at_{1e-6 * pressure:g}_MPa"] = (1e-6 * found, 1e-6 * plateau, "MPa")
    return rows


def secant(opening, pull):
    """Slope of the unloading branch [Pa/m], by least squares over what lies above zero."""
    turn = int(np.argmax(opening >= (1.0 - 1e-9) * PULLED[0]))
    down = slice(turn, turn + int(np.argmax(opening[turn:] <= 0.0)))
    return np.polyfit(opening[down], pull[down], 1)[0]


def law_secant():
    """Slope of the line from the first turning point to the origin [Pa/m]."""
    law = CONCRETE
    return law.softening_slope * (law.failure_opening - PULLED[0]) / PULLED[0]


def figures_of(rows):
    """Figures for summary.json: what was measured, and how far from the law."""
    paper = {"peak_MPa": 6.66, "failure_opening_um": 29.93, "energy_J_m2": 99.67}
    figures = {}
    for name, (found, law, unit) in rows.items():
        figures[name] = figure(float(found), unit, paper.get(name))
        figures[f"{name}_error"] = figure(float(found / law - 1.0), "1")
    return figures


def drawn_law():
    """The law as lines: (opening, traction) of tension, sliding and traction of every pressure."""
    law = CONCRETE
    kept = law_secant() * PULLED[0]
    shape = [(PULLED[1], law.normal_stiffness * PULLED[1]), (0.0, 0.0)]
    shape += [(law.onset_opening, law.tensile_strength), (PULLED[0], kept), (0.0, 0.0)]
    shape += [(PULLED[0], kept), (law.failure_opening, 0.0), (PULLED[2], 0.0)]
    lines = [np.array(shape)]
    for pressure in PRESSURES:
        limit = law.cohesion + law.friction * pressure
        onset, fall = limit / law.shear_stiffness, SLID[0] - SLID[1]
        back = (SLID[1], limit - law.shear_stiffness * fall)
        lines.append(
            np.array([(0, 0), (onset, limit), (SLID[0], limit), back, (SLID[0], limit),
                      (SLID[2], limit)])
        )  # fmt: skip
    return lines


def picture(made, options):
    """Write the curves, their tables and the film."""

    def at(name):
        return os.path.join(options.out, name)

    write_csv(at("tension.csv"), {"opening_m": made.opening[:, 0], "traction_Pa": made.pull[:, 0]})
    columns = {}
    for k, pressure in enumerate(PRESSURES, start=1):
        name = f"{1e-6 * pressure:g}_MPa"
        columns[f"sliding_{name}_m"] = made.sliding[:, k]
        columns[f"traction_{name}_Pa"] = made.shear[:, k]
    write_csv(at("shear.csv"), columns)
    curves = [(made.opening[:, 0], made.pull[:, 0])]
    curves += [(made.sliding[:, k], made.shear[:, k]) for k in range(1, 1 + len(PRESSURES))]
    picture_law(at("law.png"), drawn_law(), curves, PRESSURES)
    film_law(at("law.gif"), drawn_law(), curves, PRESSURES, pair(EDGE).points, FRAMES)


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
