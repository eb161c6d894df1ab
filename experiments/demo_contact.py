"""How far does the hole open, and what does contact cost?

The paper's block is blasted with two contact laws, each with more and more points a face. Spheres
lie behind broken faces, as in the paper. Whole bodies repel each other by the energy of their
shared volume, summed along rays to points of their faces. Expect the hole to depend on the number
of spheres, but hardly on that of rays. Spheres overlap when a face breaks, which adds energy that
no load gave; bodies add none.

    python experiments/demo_contact.py                       # three minutes
    python experiments/demo_contact.py --divisions 5,10 --parts 3

Each run is made with three peaks of the gas pressure, 0.1 % apart, to show the effect of chance:
with --parts 8 --step 1e-7 one run separates at 0.2 ms, by 0.9 mm at the end. The stiffness of a
sphere does not depend on their number, so more spheres are stiffer. Times are CPU seconds of the
fastest of the three, without compiling.

Writes contact.png, contact.csv and summary.json to results/demo_contact/.
"""

import sys
from functools import partial
from types import SimpleNamespace

import pandas as pd

from cases.blast import blast_parser, paper_effects, run_options
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, effects, read_mesh, simulate
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import BLUE, RED, picture

NAME = "demo_contact"
DIVISIONS, PARTS = study.several(study.whole(3, 20)), study.several(study.whole(1, 8))
SETTINGS = {
    "divisions": ((4, 5, 6, 8, 9, 12), (4, 5), DIVISIONS, "parts of an edge, for spheres"),
    "parts": ((2, 3, 4, 6, 8), (2, 3), PARTS, "parts of an edge, for rays"),
    "until": (5e-4, 2e-4, study.number(0, 1), "simulated time [s], default 5e-4"),
    "step": (2e-7, 2e-7, study.number(0, 1), "step of all runs [s], default 2e-7"),
    # As shares of the paper's peak, which is the first.
    "peaks": ((1.0, 0.999, 1.001), (1.0,)),
    "samples": (50, 10),
}
#: Times are of one thread.
options_parser = partial(blast_parser, NAME, __doc__, settings=SETTINGS, threads=1)
LOOKS = {
    "spheres": {"label": "spheres (6 a face in the paper)", "color": RED, "marker": "^"},
    "bodies": {"label": "whole bodies (9 rays a face by default)", "color": BLUE, "marker": "o"},
}
TABLE = study.Table(
    law=("law", "contact"),
    points=("points", "points a face"),
    hole_mm=(lambda one: one.holes[0], "hole [mm]", ".2f", "mm"),
    lowest_mm=(lambda one: min(one.holes), "lowest", ".2f"),
    highest_mm=(lambda one: max(one.holes), "highest", ".2f"),
    injected_kJ=(lambda one: 1e-3 * one.energy["injected"], "injected [kJ]", ".1f", "kJ"),
    gas_work_kJ=(lambda one: 1e-3 * one.energy["load_work"], "gas [kJ]", ".0f", "kJ"),
    most_shared=("first.interpenetration.share", "body shared", ".0f%", "1"),
    residual=("first.energy_residual_fraction", "residual", ".2g%", "1"),
    cpu_s=(lambda one: min(r.run_cpu_seconds for r in one.reports), "CPU [s]", ".2f", "s"),
)
#: Panels: a column, the label of its axis, and the title.
PANELS = {
    "hole_mm": ("displacement of the hole's wall [mm]", "how far the hole opens"),
    "injected_kJ": ("energy put in as faces break [kJ]", "energy that no load gave"),
    "cpu_s": ("CPU time of a run [s]", "what it costs"),
}


def blasts(law, points, contact, options):
    """Blasts with a contact and all peaks, a subject of TABLE; points: on a face."""
    listed = [one for one in paper_effects() if one.name not in ("sphere_contact", "gas_pressure")]
    results = []
    for share in options.peaks:
        gas = effects.GasPressure(peak=share * effects.GasPressure().peak)
        scene = Scene(read_mesh(options.mesh), CONCRETE, [*listed, contact, gas])
        job = {"method": ImplicitDashpots(options.step), "title": contact.name}
        results.append(simulate(scene, **job, **run_options(options)))
    holes = [float(one.series["hole_radial_displacement_mm"][-1]) for one in results]
    reports = [one.report for one in results]
    told = {"first": reports[0], "energy": reports[0].energy_balance, "reports": reports}
    return SimpleNamespace(law=law, points=points, holes=holes, **told)


def draw(path, table):
    """Hole, energy out of nothing and seconds over the number of points a face."""
    with picture(path, 1, 3, size=(10.5, 4.0)) as (figure, panels):
        for axes, (key, (label, title)) in zip(panels, PANELS.items()):
            for law, look in LOOKS.items():
                own = table[table["law"] == law]
                axes.plot(own["points"], own[key], clip_on=False, **look)
            axes.set(xlabel="points a face [1]", ylabel=label, title=title, ylim=(0, None))
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)


def run(options):
    """Blast with both laws and all numbers of points, compare, picture."""
    at = study.output_paths(options.out)
    spheres = partial(effects.SphereContact, outer_faces=False)
    made = [
        blasts("spheres", (n - 1) * (n - 2) // 2, spheres(n), options) for n in options.divisions
    ]
    made += [blasts("bodies", n**2, effects.BodyContact(n), options) for n in options.parts]
    rows = TABLE.rows(made)
    TABLE.show(rows)
    table = pd.DataFrame(rows)
    table.to_csv(at("contact.csv"), index=False)
    draw(at("contact.png"), table)
    holes = table.groupby("law")["hole_mm"]
    spread = (holes.max() - holes.min()).to_dict()
    figures = {f"{law}_spread_mm": (value, "mm") for law, value in spread.items()}
    for row in rows:
        figures.update(TABLE.figures(row, "{law}_{points}_{key}"))
    study.finish(options, NAME, figures, [report for one in made for report in one.reports])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
