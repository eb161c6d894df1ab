"""Does a bond do what its law says, when it is pulled, unloaded, reloaded and sheared?

Five specimens are tested, each of two tetrahedra bonded by one face. One is pulled, pressed, and
pulled until it breaks; four are pressed together, slid, slid back and slid on. The left body of
each is fixed and measures the force; the right body is driven. Expect measured points on the drawn
law (Konno et al., Fig. 2 to 4): a peak of 6.66 MPa, failure at 29.93 um, 99.67 J/m^2 in between,
and in shear a plateau of cohesion + friction x pressure.

    python experiments/demo_fracture_law.py             # ten seconds
    python experiments/demo_fracture_law.py --steps 20000

Dashpots are left out: they would add a traction that depends on the speed. Writes
law.gif, law.png, tension.csv, shear.csv and summary.json to results/demo_fracture_law/.
"""

import sys
from functools import partial

import numpy as np

from _closed_forms import bond_shear, bond_tension
from _drawing import moving_picture
from _meshes import group_area
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
    # The unloading branch, by least squares over what lies above zero, and the law's.
    turn = int(np.argmax(opening >= (1.0 - 1e-9) * PULLED[0]))
    down = slice(turn, turn + int(np.argmax(opening[turn:] <= 0.0)))
    slope = np.polyfit(opening[down], pull[down], 1)[0]
    secant = CONCRETE.softening_slope * (CONCRETE.failure_opening - PULLED[0]) / PULLED[0]
    found = [
        ("peak_MPa", 1e-6 * pull.max(), 1e-6 * CONCRETE.tensile_strength, "MPa"),
        ("failure_opening_um", 1e6 * opening[broken], 1e6 * CONCRETE.failure_opening, "um"),
        ("energy_J_m2", work, CONCRETE.fracture_energy, "J/m2"),
        ("secant_MPa_mm", 1e-9 * slope, 1e-9 * secant, "MPa/mm"),
    ]
    for pressure, (_, shear) in zip(PRESSURES, curves[1:]):
        plateau = CONCRETE.cohesion + CONCRETE.friction * pressure
        name = f"plateau_at_{1e-6 * pressure:g}_MPa"
        found.append((name, 1e-6 * shear.max(), 1e-6 * plateau, "MPa"))
    return TABLE.rows(found)


def draw(panels, curves, size):
    """The law as lines in both panels, tension and shear; returns the points measured on them."""
    laws = [bond_tension(CONCRETE, curves[0][0])]
    laws += [bond_shear(CONCRETE, way, at) for at, (way, _) in zip(PRESSURES, curves[1:])]
    marks = []
    for k, (law, (way, traction)) in enumerate(zip(laws, curves)):
        axes, words = panels[min(k, 1)], f" at {1e-6 * PRESSURES[k - 1]:g} MPa" if k else ""
        axes.plot(1e6 * way, 1e-6 * law, color=GREY, lw=1.0, label="law" if k < 2 else None)
        # Even distances along the curve, so that points do not run together.
        look = {"ls": "none", "ms": size, "color": COLOURS[k], "marker": MARKERS[k]}
        look.update(label=f"measured{words}", markevery=0.02)
        marks += axes.plot(1e6 * way, 1e-6 * traction, **look)
    panels[0].set(xlabel="opening [µm]", ylabel="traction [MPa]", ylim=(-3.0, 8.0))
    panels[1].set(xlabel="sliding [µm]", ylabel="shear traction [MPa]", ylim=(0.0, 18.0))
    panels[0].axhline(0.0, color=BLACK, lw=0.5)
    panels[0].legend(loc="lower right")
    return marks


def film(path, curves, count=40):
    """The bench at work: two specimens above, their tractions below. count: of pictures."""
    with moving_picture(path, (4.0, 3.6), 120) as (figure, shoot):
        above, below = figure.subplots(2, 2, height_ratios=(1.0, 1.9))
        marks = draw(below, curves, size=1.8)
        below[0].set_title("tension")
        below[1].set_title("shear under four pressures")
        # Openings and slidings are drawn so much larger.
        first = "opening × 600", specimen(above[0], COLOURS[0]), curves[0], (0.6, 0.0)
        last = "sliding × 60", specimen(above[1], COLOURS[-1]), curves[-1], (0.0, 0.06)
        begin = first[1].get_xy()
        for row in np.linspace(0, len(curves[0][0]) - 1, count).round().astype(int):
            for mark, (way, traction) in zip(marks, curves):
                mark.set_data(1e6 * way[: row + 1], 1e-6 * traction[: row + 1])
            for title, body, (way, traction), factors in (first, last):
                body.set_xy(begin + np.multiply(factors, 1e6 * way[row]))
                # Rounded first, and zero added: no minus before a zero.
                shown = round(1e-6 * float(traction[row]), 2) + 0.0
                body.axes.set_title(f"{title}: {shown:.2f} MPa", loc="center")
            shoot()


def specimen(axes, colour):
    """Draw two tetrahedra from the side, in millimetres; returns the right one, to be moved."""
    *face, left, right = 1e3 * pair(EDGE).points[:, :2]
    edge = sorted(face, key=lambda corner: corner[1])[::2]
    axes.fill(*np.transpose([*edge, left]), color="#D8D3C6", ec=BLACK, lw=0.7)
    (body,) = axes.fill(*np.transpose([*edge, right]), color=colour, ec=BLACK, lw=0.7, alpha=0.85)
    axes.set(xlim=(1.1 * left[0], 1.75 * right[0]), ylim=(-20.0, 50.0), aspect="equal")
    axes.set_axis_off()
    return body


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
        draw(panels, curves, size=3.4)
        panels[1].legend(loc="upper left")
        panels[0].set_title("pulled, unloaded, pressed, pulled until it breaks")
        panels[1].set_title("slid, back and on, under four pressures")
    film(at("law.gif"), curves)
    TABLE.show(rows)
    for row in rows:
        name = row["name"]
        figures[name] = float(row["measured"]), row["unit"], PAPER.get(name)
        figures[f"{name}_error"] = row["error"], "1"
    study.finish(options, NAME, figures, [result.report])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
