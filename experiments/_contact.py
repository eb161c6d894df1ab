"""Laws, table and picture of ``demo_contact.py``."""

from functools import partial

import numpy as np

from taichi_dem import effects
from taichi_dem.kit.plot_style import BLUE, RED, picture
from taichi_dem.kit.study import Table

#: Law -> how it is made of a number of parts of an edge, and the option for these.
LAWS = {
    "spheres": (partial(effects.SphereContact, outer_faces=False), "divisions"),
    "bodies": (effects.BodyContact, "parts"),
}
LOOKS = {
    "spheres": {"label": "spheres (6 a face in the paper)", "color": RED, "marker": "^"},
    "bodies": {"label": "whole bodies (9 rays a face by default)", "color": BLUE, "marker": "o"},
}


class Blasts:
    """Results of a law with a number of parts of an edge, the first with the paper's peak.

    points: on a face. holes: displacements of the hole [mm].
    """

    def __init__(self, law, parts, results):
        self.law, self.results, self.first = law, results, results[0].report
        self.points = parts**2 if law == "bodies" else (parts - 1) * (parts - 2) // 2
        self.holes = [float(one.series["hole_radial_displacement_mm"][-1]) for one in results]

    def energy(self, name):
        """A term of the energy balance of the first [kJ]."""
        return 1e-3 * self.first.energy_balance[name]


TABLE = Table(
    law=("law", "contact"),
    points=("points", "points a face"),
    hole_mm=(lambda one: one.holes[0], "hole [mm]", ".2f", "mm"),
    lowest_mm=(lambda one: min(one.holes), "lowest", ".2f"),
    highest_mm=(lambda one: max(one.holes), "highest", ".2f"),
    injected_kJ=(lambda one: one.energy("injected"), "out of nothing [kJ]", ".1f", "kJ"),
    gas_work_kJ=(lambda one: one.energy("load_work"), "gas [kJ]", ".0f", "kJ"),
    most_shared=("first.interpenetration.share", "body shared", ".0f%", "1"),
    residual=("first.energy_residual_fraction", "residual", ".2g%", "1"),
    cpu_s=(lambda one: min(r.report.run_cpu_seconds for r in one.results), "CPU [s]", ".2f", "s"),
)
#: Panels: a column, the label of its axis, and the title.
PANELS = {
    "hole_mm": ("displacement of the hole's wall [mm]", "how far the hole opens"),
    "injected_kJ": ("energy put in as faces break [kJ]", "energy out of nothing"),
    "cpu_s": ("CPU time of a run [s]", "what it costs"),
}


def of_law(rows, name):
    """Columns of a law's rows as arrays."""
    some = [row for row in rows if row["law"] == name]
    return {key: np.array([row[key] for row in some]) for key in some[0]}


def spreads(rows):
    """Figures: by how much the hole differs over the numbers of points of a law."""
    holes = {name: of_law(rows, name)["hole_mm"] for name in LAWS}
    return {f"{name}_spread_mm": (float(np.ptp(hole)), "mm") for name, hole in holes.items()}


def draw(path, rows):
    """Hole, energy out of nothing and seconds over the number of points a face."""
    with picture(path, 1, 3, size=(10.5, 4.0)) as (figure, panels):
        for name, look in LOOKS.items():
            made = of_law(rows, name)
            for axes, key in zip(panels, PANELS):
                axes.plot(made["points"], made[key], clip_on=False, **look)
        for axes, (label, title) in zip(panels, PANELS.values()):
            axes.set(xlabel="points a face [1]", ylabel=label, title=title, ylim=(0, None))
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
