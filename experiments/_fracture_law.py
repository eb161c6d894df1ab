"""The law of ``demo_fracture_law.py`` beside what its bench measures."""

import os

import numpy as np

from taichi_dem import CONCRETE
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.study import figure
from taichi_dem.plot.law import film_law, picture_law

#: Way of the specimen in tension [m]: beyond the strength, back into compression, to the break.
PULLED = (22e-6, -4e-6, 32e-6)
#: Pressures of the specimens in shear [Pa], and their way [m].
PRESSURES = (0.0, 5e6, 10e6, 15e6)
SLID = (220e-6, 150e-6, 300e-6)
PAPER = {"peak_MPa": 6.66, "failure_opening_um": 29.93, "energy_J_m2": 99.67}
FRAMES = 40
TABLE = {
    "quantity": ("name", ""),
    "measured": ("measured", ".4f"),
    "law": ("law", ".4f"),
    "unit": ("unit", ""),
    "difference": ("error", "+.3f%"),
}


def ways():
    """Corners of every specimen's way (corners, 2) [m]: opening and sliding; all begin at rest."""
    made = [np.array([(0.0, 0.0), *((opening, 0.0) for opening in PULLED)])]
    for pressure in PRESSURES:
        closed = -pressure / CONCRETE.normal_stiffness
        made.append(np.array([(0.0, 0.0), (closed, 0.0), *((closed, way) for way in SLID)]))
    return made


def velocities(corners, steps, step):
    """Velocity of every step (steps, 2) [m/s] at an even pace along a way, corners to the step."""
    legs = np.diff(corners, axis=0)
    reached = np.cumsum(np.linalg.norm(legs, axis=1))
    counts = np.diff(np.round(steps * reached / reached[-1]).astype(int), prepend=0)
    legs, counts = legs[counts > 0], counts[counts > 0]
    return np.repeat(legs / (counts[:, None] * step), counts, axis=0)


def plans(steps, step):
    """Velocities of every specimen at every step [s]."""
    return [velocities(corners, steps, step) for corners in ways()]


class Measured:
    """What the bench measured: one row a step, one column a specimen, the pulled one first.

    opening, sliding [m]; pull, shear: tractions [Pa]. broken: row at which the first one broke.
    """

    def __init__(self, moved, traction, broken):
        self.opening, self.sliding = moved[..., 0], moved[..., 1]
        self.pull, self.shear, self.broken = traction[..., 0], traction[..., 1], broken

    @property
    def curves(self):
        """Way and traction of every specimen."""
        shear = zip(self.sliding.T[1:], self.shear.T[1:])
        return [(self.opening[:, 0], self.pull[:, 0]), *shear]


def comparison(made):
    """Rows: name, measured, law, unit, error."""
    law, end = CONCRETE, made.broken
    opening, pull = made.opening[: end + 1, 0], made.pull[: end + 1, 0]
    work = np.sum(0.5 * (pull[1:] + pull[:-1]) * np.diff(opening))
    found = [
        ("peak_MPa", 1e-6 * pull.max(), 1e-6 * law.tensile_strength, "MPa"),
        ("failure_opening_um", 1e6 * opening[end], 1e6 * law.failure_opening, "um"),
        ("energy_J_m2", work, law.fracture_energy, "J/m2"),
        ("secant_MPa_mm", 1e-9 * secant(opening, pull), 1e-9 * law_secant(), "MPa/mm"),
    ]
    for k, pressure in enumerate(PRESSURES, start=1):
        plateau, name = (
            law.cohesion + law.friction * pressure,
            f"plateau_at_{1e-6 * pressure:g}_MPa",
        )
        found.append((name, 1e-6 * made.shear[:, k].max(), 1e-6 * plateau, "MPa"))
    keys = ("name", "measured", "law", "unit")
    return [{**dict(zip(keys, row)), "error": float(row[1] / row[2] - 1.0)} for row in found]


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
    figures = {}
    for row in rows:
        name = row["name"]
        figures[name] = figure(float(row["measured"]), row["unit"], PAPER.get(name))
        figures[f"{name}_error"] = figure(row["error"], "1")
    return figures


def caption(rows, steps):
    """What to see; rows: of ``comparison``."""
    pressures = ", ".join(f"{1e-6 * pressure:g}" for pressure in PRESSURES)
    off = max(abs(row["error"]) for row in rows)
    return (
        f"{1 + len(PRESSURES)} bonds, {steps} samples of each. Left: pulled beyond its strength a "
        "bond softens; unloaded and reloaded it runs on the line to the origin, pressed it is as "
        f"stiff as ever; at {rows[1]['measured']:.2f} um it lets go. Right: under pressures of "
        f"{pressures} MPa it slides at cohesion + friction x pressure, and elastically back and "
        "forth below that. Points are measured with a load cell, lines are the law; the figures "
        f"differ by at most {100 * off:.2g} %."
    )


def drawn_law():
    """The law as lines: (opening, traction) of tension, sliding and traction of every pressure."""
    law, first, pressed, last = CONCRETE, *PULLED
    kept = (first, law_secant() * first)
    shape = [(pressed, law.normal_stiffness * pressed), (0.0, 0.0)]
    shape += [(law.onset_opening, law.tensile_strength), kept, (0.0, 0.0), kept]
    lines = [np.array([*shape, (law.failure_opening, 0.0), (last, 0.0)])]
    for pressure in PRESSURES:
        limit = law.cohesion + law.friction * pressure
        turn, back = (SLID[0], limit), limit - law.shear_stiffness * (SLID[0] - SLID[1])
        way = [(0, 0), (limit / law.shear_stiffness, limit), turn, (SLID[1], back), turn]
        lines.append(np.array([*way, (SLID[2], limit)]))
    return lines


def write(made, points, folder):
    """Write the curves, their tables and the film; points: of a specimen."""

    def at(name):
        return os.path.join(folder, name)

    write_csv(at("tension.csv"), {"opening_m": made.opening[:, 0], "traction_Pa": made.pull[:, 0]})
    columns = {}
    for pressure, (sliding, shear) in zip(PRESSURES, made.curves[1:]):
        columns[f"sliding_{1e-6 * pressure:g}_MPa_m"] = sliding
        columns[f"traction_{1e-6 * pressure:g}_MPa_Pa"] = shear
    write_csv(at("shear.csv"), columns)
    picture_law(at("law.png"), drawn_law(), made.curves, PRESSURES)
    film_law(at("law.gif"), drawn_law(), made.curves, PRESSURES, points, FRAMES)
