"""Bench of ``demo_fracture_law.py``: driven ways and load cells, tables, pictures and words."""

import numpy as np

from _closed_forms import bond_shear, bond_tension
from _films import moving_picture
from taichi_dem import CONCRETE, Every, effects
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED, picture
from taichi_dem.kit.study import Table

#: Way of the specimen in tension [m]: beyond the strength, back into compression, to the break.
PULLED = (22e-6, -4e-6, 32e-6)
#: Pressures of the specimens in shear [Pa], and their way [m].
PRESSURES, SLID = (0.0, 5e6, 10e6, 15e6), (220e-6, 150e-6, 300e-6)
TABLE = Table(
    name=(0, "quantity"),
    measured=(1, "measured", ".4f"),
    law=(2, "law", ".4f"),
    unit=(3, "unit"),
    error=(lambda row: float(row[1] / row[2] - 1.0), "difference", "+.3f%"),
)
PAPER = {"peak_MPa": 6.66, "failure_opening_um": 29.93, "energy_J_m2": 99.67}
COLOURS = (RED, BLUE, GREEN, ORANGE, PURPLE)


def ways():
    """Corners of every specimen's way (corners, 2) [m]: opening and sliding; all begin at rest."""
    closed = [-pressure / CONCRETE.normal_stiffness for pressure in PRESSURES]
    slid = [[(0.0, 0.0), (at, 0.0), *((at, way) for way in SLID)] for at in closed]
    return [np.array([(0.0, 0.0), *((way, 0.0) for way in PULLED)]), *map(np.array, slid)]


def velocities(corners, steps, step):
    """Velocity of every step (steps, 2) [m/s] at an even pace along a way, corners to the step."""
    legs = np.diff(corners, axis=0)
    reached = np.cumsum(np.linalg.norm(legs, axis=1))
    counts = np.diff(np.round(steps * reached / reached[-1]).astype(int), prepend=0)
    legs, counts = legs[counts > 0], counts[counts > 0]
    return np.repeat(legs / (counts[:, None] * step), counts, axis=0)


class Bench:
    """Observer that drives all specimens along their ways and reads their load cells."""

    # The clamp gives the left body what the bond took from it at the start of the step.
    when = Every(steps=1)

    def __init__(self, simulation, steps, step):
        self.simulation, self.steps = simulation, steps
        self.drives = [
            one for one in simulation.tables.supports if isinstance(one, effects.PrescribedMotion)
        ]
        self.plans = [velocities(corners, steps, step) for corners in ways()]
        self.moved, self.given = [], []

    def observe(self, view):
        """Read, and set the velocities of the next step."""
        step = view.step
        for drive, plan in zip(self.drives, self.plans):
            if step == 0 or (step < self.steps and not np.array_equal(plan[step], plan[step - 1])):
                drive.law[0], drive.law[1] = plan[step]
        state, read = self.simulation.state, self.simulation.values
        displacement = read(state.position) - view.model.centre
        self.moved.append(displacement[1::2] - displacement[::2])
        self.given.append(read(state.load_impulse)[::2, :2])


def caption(rows, steps):
    """Words on what to see."""
    off = max(abs(row["error"]) for row in rows)
    return (
        f"{1 + len(PRESSURES)} bonds, {steps} samples of each. Left: pulled beyond its strength a "
        "bond softens; unloaded and reloaded it runs on the line to the origin, pressed it is as "
        f"stiff as ever; at {rows[1]['measured']:.2f} um it lets go. Right: under pressures of "
        f"{pressures_in_words()} MPa it slides at cohesion + friction x pressure, and elastically "
        "back and forth below that. Points are measured with a load cell, lines are the law; the "
        f"figures differ by at most {100 * off:.2g} %."
    )


def pressures_in_words():
    """Pressures of the specimens in shear, in MPa."""
    return ", ".join(f"{1e-6 * pressure:g}" for pressure in PRESSURES)


def figures_of(rows):
    """Figures for summary.json: what was measured, and how far from the law."""
    figures = {}
    for row in rows:
        name = row["name"]
        figures[name] = float(row["measured"]), row["unit"], PAPER.get(name)
        figures[f"{name}_error"] = row["error"], "1"
    return figures


def write(curves, points, at):
    """Write the tables, the picture and the film; points: corners of a specimen [m]."""
    write_csv(at("tension.csv"), dict(zip(("opening_m", "traction_Pa"), curves[0])))
    columns = {}
    for pressure, (sliding, shear) in zip(PRESSURES, curves[1:]):
        columns[f"sliding_{1e-6 * pressure:g}_MPa_m"] = sliding
        columns[f"traction_{1e-6 * pressure:g}_MPa_Pa"] = shear
    write_csv(at("shear.csv"), columns)
    with picture(at("law.png"), 1, 2, size=(9.2, 4.0)) as (_, panels):
        draw(panels, curves, size=3.4)
        panels[1].legend(loc="upper left")
        panels[0].set_title("pulled, unloaded, pressed, pulled until it breaks")
        panels[1].set_title("slid, back and on, under four pressures")
    film_law(at("law.gif"), curves, points)


def draw(panels, curves, size):
    """The law as lines in both panels, tension and shear; returns the points measured on them."""
    laws = [bond_tension(CONCRETE, curves[0][0])]
    laws += [bond_shear(CONCRETE, way, at) for at, (way, _) in zip(PRESSURES, curves[1:])]
    marks = []
    for k, (law, (way, traction)) in enumerate(zip(laws, curves)):
        axes, words = panels[min(k, 1)], f" at {1e-6 * PRESSURES[k - 1]:g} MPa" if k else ""
        axes.plot(1e6 * way, 1e-6 * law, color=GREY, lw=1.0, label="law" if k < 2 else None)
        # Even distances along the curve, so that points do not run together.
        look = {"ls": "none", "ms": size, "color": COLOURS[k], "markevery": 0.02}
        look["marker"] = "osD^v"[k]
        marks += axes.plot(1e6 * way, 1e-6 * traction, label=f"measured{words}", **look)
    panels[0].set(xlabel="opening [µm]", ylabel="traction [MPa]", ylim=(-3.0, 8.0))
    panels[1].set(xlabel="sliding [µm]", ylabel="shear traction [MPa]", ylim=(0.0, 18.0))
    panels[0].axhline(0.0, color=BLACK, lw=0.5)
    panels[0].legend(loc="lower right")
    return marks


def film_law(path, curves, points, count=40):
    """The bench at work: two specimens above, their tractions below. count: of pictures."""
    with moving_picture(path, (4.0, 3.6), 120) as (figure, shoot):
        above, below = figure.subplots(2, 2, height_ratios=(1.0, 1.9))
        marks = draw(below, curves, size=1.8)
        look = {"ms": 5.5, "mec": BLACK}
        forms = [{"color": mark.get_color(), "marker": mark.get_marker(), **look} for mark in marks]
        heads = [mark.axes.plot([], [], **form)[0] for mark, form in zip(marks, forms)]
        below[0].set_title("tension")
        below[1].set_title(f"shear at {pressures_in_words()} MPa")
        # Openings and slidings are drawn so much larger.
        first = "opening × 600", specimen(above[0], points, COLOURS[0]), curves[0], (0.6, 0.0)
        last = "sliding × 60", specimen(above[1], points, COLOURS[-1]), curves[-1], (0.0, 0.06)
        begin = first[1].get_xy()
        for row in np.linspace(0, len(curves[0][0]) - 1, count).round().astype(int):
            for mark, head, (way, traction) in zip(marks, heads, curves):
                mark.set_data(1e6 * way[: row + 1], 1e-6 * traction[: row + 1])
                head.set_data([1e6 * way[row]], [1e-6 * traction[row]])
            for title, body, (way, traction), factors in (first, last):
                body.set_xy(begin + np.multiply(factors, 1e6 * way[row]))
                # Rounded first, and zero added: no minus before a zero.
                shown = round(1e-6 * float(traction[row]), 2) + 0.0
                body.axes.set_title(f"{title}: {shown:.2f} MPa", loc="center")
            shoot()


def specimen(axes, points, colour):
    """Draw two tetrahedra from the side, in millimetres; returns the right one, to be moved."""
    *face, left, right = 1e3 * points[:, :2]
    edge = sorted(face, key=lambda corner: corner[1])[::2]
    axes.fill(*np.transpose([*edge, left]), color="#D8D3C6", ec=BLACK, lw=0.7)
    (body,) = axes.fill(*np.transpose([*edge, right]), color=colour, ec=BLACK, lw=0.7, alpha=0.85)
    axes.set(xlim=(1.1 * left[0], 1.75 * right[0]), ylim=(-20.0, 50.0), aspect="equal")
    axes.set_axis_off()
    return body
