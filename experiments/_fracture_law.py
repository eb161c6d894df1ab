"""The law of ``demo_fracture_law.py`` beside the tractions that its bench measures."""

import numpy as np

from taichi_dem import CONCRETE as LAW
from taichi_dem.kit.files import write_csv
from taichi_dem.kit.plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED, picture
from taichi_dem.plot.film import moving_picture

#: Way of the specimen in tension [m]: beyond the strength, back into compression, to the break.
PULLED = (22e-6, -4e-6, 32e-6)
#: Pressures of the specimens in shear [Pa], and their way [m].
PRESSURES, SLID = (0.0, 5e6, 10e6, 15e6), (220e-6, 150e-6, 300e-6)
#: Slope of the line from the first turning point to the origin [Pa/m].
SECANT = LAW.softening_slope * (LAW.failure_opening - PULLED[0]) / PULLED[0]
#: Shear tractions at which the specimens slide [Pa].
PLATEAUS = [LAW.cohesion + LAW.friction * pressure for pressure in PRESSURES]
PAPER = {"peak_MPa": 6.66, "failure_opening_um": 29.93, "energy_J_m2": 99.67}
TABLE = {
    "quantity": ("name", ""),
    "measured": ("measured", ".4f"),
    "law": ("law", ".4f"),
    "unit": ("unit", ""),
    "difference": ("error", "+.3f%"),
}
COLOURS = (RED, BLUE, GREEN, ORANGE, PURPLE)


def ways():
    """Corners of every specimen's way (corners, 2) [m]: opening and sliding; all begin at rest."""
    made = [np.array([(0.0, 0.0), *((opening, 0.0) for opening in PULLED)])]
    for pressure in PRESSURES:
        closed = -pressure / LAW.normal_stiffness
        made.append(np.array([(0.0, 0.0), (closed, 0.0), *((closed, way) for way in SLID)]))
    return made


def velocities(corners, steps, step):
    """Velocity of every step (steps, 2) [m/s] at an even pace along a way, corners to the step."""
    legs = np.diff(corners, axis=0)
    reached = np.cumsum(np.linalg.norm(legs, axis=1))
    counts = np.diff(np.round(steps * reached / reached[-1]).astype(int), prepend=0)
    legs, counts = legs[counts > 0], counts[counts > 0]
    return np.repeat(legs / (counts[:, None] * step), counts, axis=0)


def curves_of(moved, traction):
    """Way [m] and traction [Pa] of every specimen, the pulled one first."""
    shear = zip(moved[:, 1:, 1].T, traction[:, 1:, 1].T)
    return [(moved[:, 0, 0], traction[:, 0, 0]), *shear]


def comparison(curves, broken):
    """Rows: name, measured, law, unit, error. broken: row at which the pulled one broke."""
    opening, pull = (values[: broken + 1] for values in curves[0])
    work = np.sum(0.5 * (pull[1:] + pull[:-1]) * np.diff(opening))
    found = [
        ("peak_MPa", 1e-6 * pull.max(), 1e-6 * LAW.tensile_strength, "MPa"),
        ("failure_opening_um", 1e6 * opening[broken], 1e6 * LAW.failure_opening, "um"),
        ("energy_J_m2", work, LAW.fracture_energy, "J/m2"),
        ("secant_MPa_mm", 1e-9 * secant(opening, pull), 1e-9 * SECANT, "MPa/mm"),
    ]
    for pressure, plateau, (_, shear) in zip(PRESSURES, PLATEAUS, curves[1:]):
        name = f"plateau_at_{1e-6 * pressure:g}_MPa"
        found.append((name, 1e-6 * shear.max(), 1e-6 * plateau, "MPa"))
    keys = ("name", "measured", "law", "unit")
    return [{**dict(zip(keys, row)), "error": float(row[1] / row[2] - 1.0)} for row in found]


def secant(opening, pull):
    """Slope of the unloading branch [Pa/m], by least squares over what lies above zero."""
    turn = int(np.argmax(opening >= (1.0 - 1e-9) * PULLED[0]))
    down = slice(turn, turn + int(np.argmax(opening[turn:] <= 0.0)))
    return np.polyfit(opening[down], pull[down], 1)[0]


def figures_of(rows):
    """Figures for summary.json: what was measured, and how far from the law."""
    figures = {}
    for row in rows:
        name = row["name"]
        figures[name] = (float(row["measured"]), row["unit"], PAPER.get(name))
        figures[f"{name}_error"] = (row["error"], "1")
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
    first, pressed, last = PULLED
    kept, pushed = (first, SECANT * first), (pressed, LAW.normal_stiffness * pressed)
    onset = (LAW.onset_opening, LAW.tensile_strength)
    pulled = [pushed, (0, 0), onset, kept, (0, 0), kept, (LAW.failure_opening, 0), (last, 0)]
    lines, (turn, back, end) = [np.array(pulled)], SLID
    for top in PLATEAUS:
        down = (back, top - LAW.shear_stiffness * (turn - back))
        way = [(0, 0), (top / LAW.shear_stiffness, top), (turn, top), down, (turn, top), (end, top)]
        lines.append(np.array(way))
    return lines


def write(curves, points, at):
    """Write the curves, their tables and the film; points: of a specimen."""
    opening, pull = curves[0]
    write_csv(at("tension.csv"), {"opening_m": opening, "traction_Pa": pull})
    columns = {}
    for pressure, (sliding, shear) in zip(PRESSURES, curves[1:]):
        columns[f"sliding_{1e-6 * pressure:g}_MPa_m"] = sliding
        columns[f"traction_{1e-6 * pressure:g}_MPa_Pa"] = shear
    write_csv(at("shear.csv"), columns)
    picture_law(at("law.png"), curves)
    film_law(at("law.gif"), curves, points)


def draw(panels, curves, size):
    """The law as lines in both panels, tension and shear; returns the points measured on them."""
    marks = []
    for k, (line, (way, traction)) in enumerate(zip(drawn_law(), curves)):
        axes, words = panels[min(k, 1)], f" at {1e-6 * PRESSURES[k - 1]:g} MPa" if k else ""
        law = "law" if k < 2 else None
        axes.plot(1e6 * line[:, 0], 1e-6 * line[:, 1], color=GREY, lw=1.0, label=law)
        # Even distances along the curve, so that points do not run together.
        look = {"ls": "none", "ms": size, "color": COLOURS[k], "markevery": 0.02}
        marks += axes.plot(1e6 * way, 1e-6 * traction, "o", label=f"measured{words}", **look)
    panels[0].set(xlabel="opening [µm]", ylabel="traction [MPa]", ylim=(-3.0, 8.0))
    panels[1].set(xlabel="sliding [µm]", ylabel="shear traction [MPa]", ylim=(0.0, 18.0))
    panels[0].axhline(0.0, color=BLACK, lw=0.5)
    panels[0].legend(loc="upper right")
    return marks


def picture_law(path, curves):
    """Tension left, shear right."""
    with picture(path, 1, 2, size=(9.6, 4.0)) as (_, panels):
        draw(panels, curves, size=3.4)
        panels[1].legend(loc="upper left")
        panels[0].set_title("pulled, unloaded, pressed, pulled until it breaks")
        panels[1].set_title("slid, back and on, under four pressures")


def film_law(path, curves, points, count=40):
    """The bench at work: two specimens above, their tractions below. count: of pictures."""
    with moving_picture(path, (4.0, 3.6), 120) as (figure, shoot):
        above, below = figure.subplots(2, 2, height_ratios=(1.0, 1.9))
        marks = draw(below, curves, size=1.8)
        look = {"marker": "o", "ms": 5.5, "mec": BLACK}
        heads = [mark.axes.plot([], [], color=mark.get_color(), **look)[0] for mark in marks]
        below[0].set_title("tension")
        below[1].set_title("shear under pressure")
        # Openings and slidings are drawn so much larger.
        first = "opening × 600", Specimen(above[0], points, COLOURS[0]), curves[0], (0.6, 0.0)
        last = "sliding × 60", Specimen(above[1], points, COLOURS[-1]), curves[-1], (0.0, 0.06)
        for row in np.linspace(0, len(curves[0][0]) - 1, count).round().astype(int):
            for mark, head, (way, traction) in zip(marks, heads, curves):
                mark.set_data(1e6 * way[: row + 1], 1e-6 * traction[: row + 1])
                head.set_data([1e6 * way[row]], [1e-6 * traction[row]])
            for title, specimen, (way, traction), factors in (first, last):
                specimen.move(np.multiply(factors, 1e6 * way[row]))
                # Rounded first, and zero added: no minus before a zero.
                shown = round(1e-6 * float(traction[row]), 2) + 0.0
                specimen.axes.set_title(f"{title}: {shown:.2f} MPa", loc="center")
            shoot()


class Specimen:
    """Two tetrahedra seen from the side, in millimetres; the right one moves."""

    def __init__(self, axes, points, colour):
        face, tips = 1e3 * points[:3, :2], 1e3 * points[3:, :2]
        edge = face[face[:, 1].argsort()[[0, -1]]]
        self.axes, self.place = axes, np.vstack([edge, tips[1]])
        axes.fill(*np.vstack([edge, tips[0]]).T, color="#D8D3C6", ec=BLACK, lw=0.7)
        (self.body,) = axes.fill(*self.place.T, color=colour, ec=BLACK, lw=0.7, alpha=0.85)
        span = np.abs(tips[:, 0]).max()
        axes.set(xlim=(-1.1 * span, 1.75 * span), ylim=(-20.0, 50.0), aspect="equal")
        axes.set_axis_off()

    def move(self, way):
        """Move the right one by a way [mm]."""
        self.body.set_xy(self.place + way)
