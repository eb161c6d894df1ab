"""Which hard cases each method can compute, which it refuses in words, and by what margin.

    python experiments/hard_cases.py                      # about ten minutes on one core
    python experiments/hard_cases.py --only full_box,still_heap
    python experiments/hard_cases.py --quick

A case is a scene at the edge of what can be computed, with figures that physics bounds by a formula
in the table. A method that claims the case passes if all figures are within their bounds; the
margin is the bound over the figure, of the worst figure. A method that cannot handle the case must
refuse it in words: returning numbers counts as a failure. The cases are in
experiments/cases/hard; tests run them too.

In the picture each case is a square; cases that all methods refuse are grey. Writes hard_cases.png,
hard_cases.csv and summary.json to results/hard_cases/.
"""

import itertools
import math
import sys
from collections import Counter
from functools import partial
from textwrap import fill

from matplotlib.patches import Rectangle

from cases.hard import (
    assess,
    blast_bonds,
    blast_contacts,
    blast_extremes,
    blast_piles,
    damper,
    damper_limits,
)
from taichi_dem.kit import study
from taichi_dem.kit.plot_style import (
    BLUE,
    GREY,
    NAVY,
    ORANGE,
    RED,
    SKY,
    area_key,
    picture,
)
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "hard_cases"
#: Of a quick run, which compile little; the tests ask all, at quick size.
OF_QUICK = ("single_cell", "step_above_limit", "flat_element", "step_that_is_no_number")
#: All cases, in the order of the page.
OF_BLAST = blast_bonds, blast_contacts, blast_extremes, blast_piles
CASES = [case for part in (*OF_BLAST, damper, damper_limits) for case in part.CASES]
NAMES = [case.name for case in CASES]
SETTINGS = {
    "only": (NAMES, OF_QUICK, study.several(study.one_of(NAMES)), "names of cases; default: all"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
#: Least margins of the squares of the wall, their colours, and how many are side by side.
MARGINS = {"above 100": 100.0, "10 to 100": 10.0, "2 to 10": 2.0, "1 to 2": 1.0}
WALL = dict(zip(["failed", *reversed(MARGINS), "refused"], (RED, ORANGE, SKY, BLUE, NAVY, GREY)))
ACROSS = 16


def row_of(trial):
    """A trial as a row of the table, with its worst figure."""
    names = ("name", "value", "bound", "formula", "margin")
    figure, value, bound, formula, margin = (getattr(trial.worst, name, "") for name in names)
    row = {"case": trial.case.name, "package": trial.case.package, "method": trial.method}
    row.update(status=trial.status, figure=figure, value=value, bound=bound, formula=formula)
    return {**row, "margin": margin, "seconds": f"{trial.seconds:.3g}", "words": trial.words}


def trials_of(options):
    """Every method of every case that is asked for."""
    asked = [(one, way) for one in CASES if one.name in options.only for way in one.asked]
    trials = []
    with ProgressBar("hard cases") as bar:
        for done, (case, method) in enumerate(asked):
            bar.count(done, len(asked))
            trials.append(assess(case, method, options.quick))
    return trials


def run(options):
    """Ask every method of every case, write table and pictures."""
    folder, trials = study.begin(options), trials_of(options)
    rows = [row_of(trial) for trial in trials]
    study.write_rows(folder / "hard_cases.csv", rows)
    picture_wall(folder / "hard_cases.png", trials)
    shown = ("case", "method", "status", "margin", "words")
    study.print_table([[cell_of(row[key]) for key in shown] for row in rows], shown)
    ends = Counter(trial.status for trial in trials)
    counts = {"cases": len({trial.case.name for trial in trials}), "askings": len(trials)}
    counts.update({status: ends[status] for status in ("passed", "refused", "failed")})
    least = min((trial.worst.margin for trial in trials if trial.worst), default=math.inf)
    if math.isfinite(least):
        counts["least_margin"] = least
    figures = {name: (count, "1") for name, count in counts.items()}
    study.finish(options, NAME, figures, sum(trial.compile_s for trial in trials))


def cell_of(value):
    """A value as it is printed."""
    text = value if isinstance(value, str) else f"{value:.3g}"
    return text if len(text) < 90 else f"{text[:87]}..."


def by_name(trials):
    """Trials of each case, by its name; those of a case follow each other."""
    groups = itertools.groupby(trials, lambda trial: trial.case.name)
    return {name: list(own) for name, own in groups}


def picture_wall(path, trials):
    """A square a case, coloured by ``level_of``."""
    levels = {name: level_of(own) for name, own in by_name(trials).items()}
    names = sorted(levels, key=lambda name: [*WALL].index(levels[name]))
    counts, columns = Counter(levels.values()), min(ACROSS, len(names))
    with picture(path, size=(5.0, 4.0), dpi=300) as (figure, axes):
        for k, name in enumerate(names):
            place, look = (k % columns, k // columns), {"fc": WALL[levels[name]], "lw": 0.0}
            axes.add_patch(Rectangle(place, 0.88, 0.88, **look))
        axes.set(xlim=(-0.1, columns), ylim=(-(-len(names) // columns), -0.1), aspect="equal")
        axes.set_axis_off()
        thin = ", ".join(name.replace("_", " ") for name in names if levels[name] == "1 to 2")
        axes.set_title(fill(thin and f"1 to 2: {thin}", 88), fontsize=8, loc="left")
        keys = [area_key(f"{name}: {counts[name]}", fc=colour) for name, colour in WALL.items()]
        look = {"loc": "outside lower center", "ncols": 3, "fontsize": 9.5, "title_fontsize": 9.5}
        title = f"{len(names)} hard cases, by what physics allows over what a run shows"
        figure.legend(handles=keys, title=title, **look)


def level_of(own):
    """Entry of the wall for the trials of a case: by the least margin of methods that bear it."""
    ends = {trial.status for trial in own}
    if "failed" in ends or "passed" not in ends:
        return "failed" if "failed" in ends else "refused"
    least = min(trial.worst.margin for trial in own if trial.worst)
    return next(name for name, margin in MARGINS.items() if least >= margin)


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
