"""Which hard cases each method bears, which it refuses in words, and by what margin.

    python experiments/hard_cases.py                      # about ten minutes on one core
    python experiments/hard_cases.py --only full_box,still_heap
    python experiments/hard_cases.py --quick

A case is a scene at the edge of what can be computed, with figures that physics bounds: the formula
stands in the table. A method that claims the case passes with all figures within their bounds; the
margin is bound over figure, of the worst of them. A method that cannot handle it has to refuse in
words: numbers in their place count as a failure.

Writes hard_cases.csv, a picture of each case, hard_cases_blast.png, hard_cases_damper.png,
hard_cases.png and summary.json to results/hard_cases/.
"""

import math
import os
import sys
import time

from _hard_cases import registry
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import figure, finish, main, parser, several, show_rows, whole, write_rows
from taichi_dem.kit.study.cases import FAILED, PASSED, REFUSED, Limit, assess, cases_named
from taichi_dem.kit.study.cases_picture import picture_cases, picture_margins

NAME = "hard_cases"
#: Cases of a quick run, one of each kind; the tests ask all, at quick size.
OF_QUICK = (
    *("full_box", "empty_box", "no_rebound", "longest_steps", "step_above_limit"),
    *("spheres_near_limit", "spheres_beyond_limit", "single_cell"),
    *("faster_than_the_bound", "flat_element", "step_that_is_no_number"),
)
#: A uniform step of a hard case is fixed: the paper's rule does not shorten it.
STYLES = {"uniform": "fixed"}


def options_parser():
    """Options of this experiment."""
    made = parser(NAME, __doc__)
    made.add_argument("--only", type=several(str), help="cases by name, all by default")
    made.add_argument("--columns", type=whole(1, 8), default=5, help="of the sheet, 5")
    return made


def run(options):
    """Ask every method of every case, write table, pictures and the sheet of all."""
    cases = registry()
    if options.only or options.quick:
        cases = cases_named(cases, options.only or OF_QUICK)
    output_folder(options.out)
    started, trials = time.perf_counter(), []
    jobs = [(case, method) for case in cases for method in case.asked]
    with ProgressBar("hard cases") as bar:
        for case, method in jobs:
            trials.append(assess(case, method, options.quick))
            bar.count(len(trials), len(jobs))
    rows = [row_of(trial) for trial in trials]
    write_rows(os.path.join(options.out, "hard_cases.csv"), rows)
    sheets = {case.name: [t for t in trials if t.case is case] for case in cases}
    for package in dict.fromkeys(case.package for case in cases):
        sheets[f"hard_cases_{package}"] = [t for t in trials if t.case.package == package]
    for name, own in sheets.items():
        picture_cases(os.path.join(options.out, f"{name}.png"), own, options.columns, STYLES)
    picture_margins(os.path.join(options.out, "hard_cases.png"), trials, STYLES)
    print_rows(rows)
    compiling = sum(trial.compile_s for trial in trials)
    seconds = compiling, time.perf_counter() - started - compiling
    finish(options, NAME, figures_of(cases, trials), seconds)


def row_of(trial):
    """Row of the table; cells without a value are empty."""
    figure, value, bound, formula = trial.worst or Limit("", "", "", "")
    head = trial.case.name, trial.case.package, trial.method, trial.status
    margin = str(trial.margin) if trial.worst else ""
    row = (*head, figure, value, bound, formula, margin, f"{trial.seconds:.3g}", trial.words)
    names = "case package method status figure value bound formula margin seconds words"
    return dict(zip(names.split(), map(str, row)))


def figures_of(cases, trials):
    """How many cases, and how many runs ended in which way."""
    counts = {"cases": len(cases), "askings": len(trials)}
    for status in (PASSED, REFUSED, FAILED):
        counts[status] = sum(trial.status == status for trial in trials)
    least = min((trial.margin for trial in trials if trial.worst), default=math.inf)
    if math.isfinite(least):
        counts["least_margin"] = least
    return {name: figure(count, "1") for name, count in counts.items()}


def print_rows(rows):
    """The table: case, method, status, margin, worst figure."""
    for row in rows:
        row["margin"] = float(row["margin"]) if row["margin"] else None
        if len(row["words"]) >= 90:
            row["words"] = row["words"][:87] + "..."
    formats = {name: (name, "") for name in ("case", "method", "status")}
    words = {"worst figure, or what it said": ("words", "")}
    show_rows(rows, {**formats, "margin": ("margin", ".3g"), **words})


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
