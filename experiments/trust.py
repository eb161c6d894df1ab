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

from _trust import CASES, Effort
from taichi_dem.kit import study
from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import picture
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.validation import choice

NAME = "trust"
SETTINGS = {
    "only": (
        None,
        ("bar_wave", "joint", "rotation"),
        study.several(str),
        "cases by name, all by default",
    ),
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
    effort = Effort(options.meshes, options.sizes, options.seed)
    with ProgressBar("cases") as progress:
        for k, name in enumerate(names):
            progress.at(k / len(names))
            numbers, draw = CASES[name](effort)
            rows += numbers
            with picture(folder / f"{name}.png", 1, 1, size=(4.6, 3.6)) as (_, axes):
                draw(axes)
    study.print_table([row.cells() for row in rows], HEADER)
    study.write_rows(folder / "trust.csv", [row.as_dict() for row in rows])
    write_text(folder / "trust.md", page_of(rows))
    study.finish(options, NAME, figures_of(rows), 0.0)


def figures_of(rows):
    """Value, error and spread of every number."""
    figures = {}
    for row in rows:
        figures[f"{row.key}_value"] = study.figure(row.mean, row.unit)
        figures[f"{row.key}_published"] = study.figure(row.published, row.unit)
        figures[f"{row.key}_error_percent"] = study.figure(row.error_percent, "%")
        figures[f"{row.key}_spread"] = study.figure(row.spread, row.unit)
    figures["numbers"] = study.figure(len(rows), "1")
    figures["numbers_that_hold"] = study.figure(sum(row.holds for row in rows), "1")
    return figures


def page_of(rows):
    """The table in Markdown, with the reasons of the misses below."""
    lines = ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
    lines += ["| " + " | ".join(row.cells()) + " |" for row in rows]
    notes = [f"- {row.words}: {row.note}." for row in rows if row.note and not row.holds]
    return "\n".join([*lines, "", *notes]) + "\n"


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
