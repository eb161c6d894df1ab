"""Why should a stranger believe it? Cases that others have published, beside our own numbers.

Each case has a number from a formula, another program or a test of real material. Ours is the mean
over random meshes with half of their range; a miss is printed as a miss, with its reason.

    python experiments/trust.py                           # about an hour on one core
    python experiments/trust.py --only slope,rotation
    python experiments/trust.py --quick

Writes trust.csv, trust.md, a picture of each case and summary.json to results/trust/.
"""

import sys
from functools import partial

import numpy as np

from _trust.blast import blast
from _trust.bonds import disc, joint
from _trust.common import Effort
from _trust.contacts import rotation, slope
from _trust.cracks import branching, crack
from _trust.waves import bar_wave, spall
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import picture
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.kit.validation import choice

NAME = "trust"
#: In the order of the page.
CASES = bar_wave, spall, disc, crack, branching, joint, blast, slope, rotation
CASES = {case.__name__: case for case in CASES}
QUICK = ("bar_wave", "joint", "rotation")
SETTINGS = {
    "only": (None, QUICK, study.several(str), "cases by name, all by default"),
    "meshes": (5, 2, study.whole(1, 100), "random meshes of each size, 5"),
    "sizes": (3, 1, study.whole(1, 3), "sizes of element in the plates, 3"),
    "seed": (0, 0, study.whole(0, 10**6), "of the first mesh, 0"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
HEADER = ("case", "source", "published", "ours", "wanted", "verdict")


def run(options):
    """Measure all cases; write the table, a picture of each, and the figures."""
    names = [choice("only", name, tuple(CASES)) for name in options.only or CASES]
    folder, rows = study.begin(options), []
    effort = Effort(range(options.seed, options.seed + options.meshes), options.sizes)
    with ProgressBar("cases") as progress:
        for k, name in enumerate(names):
            progress.at(k / len(names))
            numbers, draw = CASES[name](effort)
            rows += numbers
            with picture(folder / f"{name}.png", 1, 1, size=(4.6, 3.6)) as (_, axes):
                draw(axes)
    study.print_table([cells(row) for row in rows], HEADER)
    study.write_rows(folder / "trust.csv", [csv_row(row) for row in rows])
    write_text(folder / "trust.md", page_of(rows))
    study.finish(options, NAME, figures_of(rows), 0.0)


def cells(row):
    """Cells of the printed table."""
    unit = "" if row.unit == "1" else f" {row.unit}"
    spread = f" ± {row.spread:.2g}" if np.size(row.values) > 1 else ""
    ours, published = f"{row.mean:.4g}{spread}{unit}", f"{row.published:.4g}{unit}"
    wanted = f"{row.low:.4g} to {row.high:.4g}{unit}"
    return row.words, row.source, published, ours, wanted, "holds" if row.holds else "misses"


def csv_row(row):
    """Row of the CSV."""
    names = ("key", "unit", "published", "mean", "spread", "low", "high", "holds")
    values = " ".join(f"{value:.8g}" for value in np.ravel(row.values))
    found = {"ours" if name == "mean" else name: getattr(row, name) for name in names}
    return {**found, "values": values}


def figures_of(rows):
    """Value, error and spread of every number."""
    figures = {}
    for row in rows:
        figures[f"{row.key}_value"] = row.mean, row.unit
        figures[f"{row.key}_published"] = row.published, row.unit
        figures[f"{row.key}_error_percent"] = row.error_percent, "%"
        figures[f"{row.key}_spread"] = row.spread, row.unit
    holding = sum(row.holds for row in rows)
    return {**figures, "numbers": (len(rows), "1"), "numbers_that_hold": (holding, "1")}


def page_of(rows):
    """The table in Markdown, with the reasons of the misses below."""
    lines = ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
    lines += ["| " + " | ".join(cells(row)) + " |" for row in rows]
    notes = [f"- {row.words}: {row.note}." for row in rows if row.note and not row.holds]
    return "\n".join([*lines, "", *notes]) + "\n"


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
