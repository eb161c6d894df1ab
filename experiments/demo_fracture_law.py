"""Does a bond do what its law says, when it is pulled, unloaded, reloaded and sheared?

Five specimens are tested, each of two tetrahedra bonded by one face. One is pulled, pressed, and
pulled until it breaks; four are pressed together, slid, slid back and slid on. The left body of
each is fixed and measures the force; the right body is driven. Expect measured points on the drawn
law (Konno et al., Fig. 2 to 4): a peak of 6.66 MPa, failure at 29.93 um, 99.67 J/m^2 in between,
and in shear a plateau of cohesion + friction x pressure.

    python experiments/demo_fracture_law.py             # ten seconds
    python experiments/demo_fracture_law.py --steps 20000

Dashpots are left out: they would add a traction that depends on the speed. Writes
law.png, tension.csv, shear.csv and summary.json to results/demo_fracture_law/.
"""

import sys
from functools import partial

import numpy as np

from cases.meshes import group_area
from taichi_dem import CONCRETE, Every, Scene, Simulation, Uniform, effects
from taichi_dem.kit import study
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED, picture
from taichi_dem.mesh.shapes import pair, placed_together, single
from taichi_dem.simulate import run_simulation

NAME = "demo_fracture_law"
SETTINGS = {"steps": (5000, 1000, study.whole(200, 100000), "steps along the path, default 5000")}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Bodies are driven, so the step decides only how finely the law is sampled.
EDGE, APART, STEP = 0.05, 0.2, 1e-8
#: Way of the specimen in tension [m]: beyond the strength, back into compression, to the break.
PULLED = (22e-6, -4e-6, 32e-6)
#: Pressures of the specimens in shear [Pa], and their way [m].
PRESSURES, SLID = (0.0, 5e6, 10e6, 15e6), (220e-6, 150e-6, 300e-6)
TABLE = study.Table(
    name=(0, "quantity"),
    measured=(1, "measured", ".4f"),
    law=(2, "law", ".4f"),
    unit=(3, "unit"),
    error=(lambda row: float(row[1] / row[2] - 1.0), "difference", "+.3f%"),
)
PAPER = {"peak_MPa": 6.66, "failure_opening_um": 29.93, "energy_J_m2": 99.67}
COLOURS, MARKERS = (RED, BLUE, GREEN, ORANGE, PURPLE), "osD^v"


def velocities(steps):
    """Velocity (steps, 2) [m/s] of each specimen: opening and sliding at an even pace."""
    closed = [-pressure / CONCRETE.normal_stiffness for pressure in PRESSURES]
    ways = [[(0.0, 0.0), *((way, 0.0) for way in PULLED)]]
    ways += [[(0.0, 0.0), (at, 0.0), *((at, way) for way in SLID)] for at in closed]
    found = []
    for corners in ways:
        legs = np.diff(corners, axis=0)
        reached = np.cumsum(np.linalg.norm(legs, axis=1))
        counts = np.diff(np.round(steps * reached / reached[-1]).astype(int), prepend=0)
        legs, counts = legs[counts > 0], counts[counts > 0]
        found.append(np.repeat(legs / (counts[:, None] * STEP), counts, axis=0))
    return found


class Bench:
    """Observer that drives all specimens along their ways and reads their load cells."""

    # The clamp gives the left body what the bond took from it at the start of the step.
    when = Every(steps=1)

    def __init__(self, simulation, plans):
        self.simulation, self.plans, self.moved, self.given = simulation, plans, [], []
        supports = simulation.tables.supports
        self.drives = [one for one in supports if isinstance(one, effects.PrescribedMotion)]

    def observe(self, view):
        """Read, and set the velocities of the next step."""
        for drive, plan in zip(self.drives, self.plans):
            if view.step < len(plan):
                drive.law[0], drive.law[1] = plan[view.step]
        state, read = self.simulation.state, self.simulation.values
        displacement = read(state.position) - view.model.centre
        self.moved.append(displacement[1::2] - displacement[::2])
        self.given.append(read(state.load_impulse)[::2, :2])


def measure(steps):
    """Drive the bench; returns way [m] and traction [Pa] of every specimen, and the Result."""
    names = {f"specimen{k}": k for k in range(1 + len(PRESSURES))}
    mesh = placed_together({name: (pair(EDGE), (0, 0, APART * k)) for name, k in names.items()})
    drives = [effects.PrescribedMotion(f"{name}_right", (0.0, 0.0, 0.0)) for name in names]
    acting = [effects.Softening(), effects.ShearSlip(), effects.Fixed("left"), *drives]
    simulation = Simulation(Scene(mesh, CONCRETE, acting), Uniform(STEP))
    cells = Bench(simulation, velocities(steps))
    looks = {"samples": 1, "title": "bench", "observers": [cells]}
    result = run_simulation(simulation, until=(steps + 1) * STEP, **looks)
    traction = -np.diff(cells.given, axis=0) / (group_area(single(EDGE), "base") * STEP)
    moved = np.array(cells.moved[:-1])
    return [(moved[:, k, min(k, 1)], traction[:, k, min(k, 1)]) for k in names.values()], result


def compared(curves, broken):
    """Rows of the table. broken: sample at which the pulled one broke."""
    opening, pull = (values[: broken + 1] for values in curves[0])
    work = np.sum(0.5 * (pull[1:] + pull[:-1]) * np.diff(opening))
    found = [
        ("peak_MPa", 1e-6 * pull.max(), 1e-6 * CONCRETE.tensile_strength, "MPa"),
        ("failure_opening_um", 1e6 * opening[broken], 1e6 * CONCRETE.failure_opening, "um"),
        ("energy_J_m2", work, CONCRETE.fracture_energy, "J/m2"),
    ]
    for pressure, (_, shear) in zip(PRESSURES, curves[1:]):
        plateau = CONCRETE.cohesion + CONCRETE.friction * pressure
        name = f"plateau_at_{1e-6 * pressure:g}_MPa"
        found.append((name, 1e-6 * shear.max(), 1e-6 * plateau, "MPa"))
    return TABLE.rows(found)


def law_in_tension(opening):
    """Traction [Pa] of a bond that is pulled along a way (Konno et al., Fig. 4).

    opening: its openings [m] in their order. It softens beyond its strength, unloads to the origin,
    is pressed at its full stiffness, and is gone once it has failed.
    """
    opening = np.asarray(opening, dtype=float)
    limit = np.maximum.accumulate(np.maximum(opening, CONCRETE.onset_opening))
    left = CONCRETE.failure_opening - limit
    stiffness = np.where(
        opening > 0.0, CONCRETE.softening_slope * left / limit, float(CONCRETE.normal_stiffness)
    )
    return np.where(left > 0.0, stiffness * opening, 0.0)


def law_in_shear(sliding, pressure):
    """Shear traction [Pa] of a bond that is slid along a way (Konno et al., Fig. 3).

    sliding: in its order [m]. pressure: on the bond all the time [Pa]. It slips at cohesion +
    friction x pressure, and goes back elastically.
    """
    bound = max(0.0, CONCRETE.cohesion + CONCRETE.friction * pressure)
    slip, stiffness = 0.0, float(CONCRETE.shear_stiffness)
    found = []
    for reach in np.asarray(sliding, dtype=float):
        found.append(float(np.clip(stiffness * (reach - slip), -bound, bound)))
        slip = reach - found[-1] / stiffness
    return np.array(found)


def draw(panels, curves):
    """The law as lines in both panels, tension and shear, with the points measured on them."""
    laws = [law_in_tension(curves[0][0])]
    laws += [law_in_shear(way, at) for at, (way, _) in zip(PRESSURES, curves[1:])]
    for k, (law, (way, traction)) in enumerate(zip(laws, curves)):
        axes, words = panels[min(k, 1)], f" at {1e-6 * PRESSURES[k - 1]:g} MPa" if k else ""
        axes.plot(1e6 * way, 1e-6 * law, color=GREY, lw=1.0, label="law" if k < 2 else None)
        # Even distances along the curve, so that points do not run together.
        look = {"ls": "none", "ms": 3.4, "color": COLOURS[k], "marker": MARKERS[k]}
        look.update(label=f"measured{words}", markevery=0.02)
        axes.plot(1e6 * way, 1e-6 * traction, **look)
    panels[0].set(xlabel="opening [µm]", ylabel="traction [MPa]", ylim=(-3.0, 8.0))
    panels[1].set(xlabel="sliding [µm]", ylabel="shear traction [MPa]", ylim=(0.0, 18.0))
    panels[0].axhline(0.0, color=BLACK, lw=0.5)
    panels[0].legend(loc="lower right")
    panels[1].legend(loc="upper left")
    panels[0].set_title("pulled, unloaded, pressed, pulled until it breaks")
    panels[1].set_title("slid, back and on, under four pressures")


def run(options):
    """Measure all specimens, compare with the law, picture."""
    at = study.output_paths(options.out)
    curves, result = measure(options.steps)
    rows = compared(curves, round(result.broken_time[0] / STEP))
    write_csv(at("tension.csv"), dict(zip(("opening_m", "traction_Pa"), curves[0])))
    columns, figures = {}, {}
    for pressure, (sliding, shear) in zip(PRESSURES, curves[1:]):
        end = f"{1e-6 * pressure:g}_MPa"
        columns.update({f"sliding_{end}_m": sliding, f"traction_{end}_Pa": shear})
    write_csv(at("shear.csv"), columns)
    with picture(at("law.png"), 1, 2, size=(9.2, 4.0)) as (_, panels):
        draw(panels, curves)
    TABLE.show(rows)
    for row in rows:
        name = row["name"]
        figures[name] = float(row["measured"]), row["unit"], PAPER.get(name)
        figures[f"{name}_error"] = row["error"], "1"
    study.finish(options, NAME, figures, [result.report])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
