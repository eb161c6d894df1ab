"""How far does the hole open, and what does contact cost?

The paper's block is blasted with two laws of contact, each with ever more points a face: spheres
behind broken faces, as in the paper, and whole bodies, which repel each other by the energy of the
volume that they share, summed along rays to points of their faces. Expect the hole to depend on the
number of spheres, but hardly on that of rays. Spheres appear within each other as a face breaks,
and so put in energy that no load gave; bodies put in none.

    python experiments/demo_contact.py                       # three minutes
    python experiments/demo_contact.py --divisions 5,10 --parts 3

Each run is made with three peaks of the gas pressure, 0.1 % apart, so that one sees what is chance:
with --parts 8 --step 1e-7 one of the runs goes another way from 0.2 ms on, by 0.9 mm at the end.
A sphere keeps its stiffness whatever their number, so more of them are stiffer together. Seconds
are of CPU, without compiling, the least of the three.

Writes contact.png, contact.csv and summary.json to results/demo_contact/.
"""

import sys
from functools import partial

from _blast import blast_parser, paper_effects, run_options
from _contact import LAWS, TABLE, Blasts, draw, spreads
from taichi_dem import CONCRETE, ImplicitDashpots, Scene, effects, read_mesh, simulate
from taichi_dem.kit import study

NAME = "demo_contact"
SETTINGS = {
    "divisions": (
        (4, 5, 6, 8, 9, 12),
        (4, 5),
        study.several(study.whole(3, 20)),
        "of an edge, for spheres",
    ),
    "parts": ((2, 3, 4, 6, 8), (2, 3), study.several(study.whole(1, 8)), "of an edge, for rays"),
    "until": (5e-4, 2e-4, study.number(0, 1), "simulated time [s], 5e-4"),
    "step": (2e-7, 2e-7, study.number(0, 1), "of all runs [s], 2e-7"),
    # As shares of the paper's peak, which is the first.
    "peaks": ((1.0, 0.999, 1.001), (1.0,)),
    "samples": (50, 10),
}
#: Times are of one thread.
options_parser = partial(blast_parser, NAME, __doc__, settings=SETTINGS, threads=1)


def blast(contact, share, options):
    """Blast the block with a contact and a share of the paper's peak; returns the result."""
    gas = effects.GasPressure(peak=share * effects.GasPressure().peak)
    acting = [one for one in paper_effects() if one.name not in ("sphere_contact", "gas_pressure")]
    acting += [contact, gas]
    scene, method = Scene(read_mesh(options.mesh), CONCRETE, acting), ImplicitDashpots(options.step)
    return simulate(scene, method=method, title=contact.name, **run_options(options))


def run(options):
    """Blast with both laws and all numbers of points, compare, picture."""
    at, made = study.output_paths(options.out), []
    for name, (make, option) in LAWS.items():
        for parts in vars(options)[option]:
            results = [blast(make(parts), share, options) for share in options.peaks]
            made.append(Blasts(name, parts, results))
    rows = TABLE.rows(made)
    study.write_rows(at("contact.csv"), rows)
    TABLE.show(rows)
    draw(at("contact.png"), rows)
    figures = spreads(rows)
    for row in rows:
        figures.update(TABLE.figures(row, "{law}_{points}_{key}"))
    study.finish(options, NAME, figures, [one.report for blasts in made for one in blasts.results])


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
