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
import sys
from collections import Counter, defaultdict
from functools import partial

from _hard_cases import registry
from taichi_dem.kit import study
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study.cases import FAILED, PASSED, REFUSED, assess, cases_named
from taichi_dem.kit.study.cases_picture import picture_cases, picture_margins

NAME = "hard_cases"
#: Of a quick run, which compile little; the tests ask all, at quick size.
OF_QUICK = ("single_cell", "step_above_limit", "flat_element", "step_that_is_no_number")
SETTINGS = {
    "only": (None, OF_QUICK, study.several(str), "cases by name, all by default"),
    "columns": (3, 3, study.whole(1, 8), "of the sheet, 3"),
}
#: A uniform step of a hard case is fixed: the paper's rule does not shorten it.
STYLES = {"uniform": "fixed"}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)


def worst(member):
    """Function of a trial: a member of its worst figure, an empty cell without one."""
    return lambda trial: getattr(trial.worst, member, "")


TABLE = study.Table(
    case=("case.name", "case"),
    package=("case.package",),
    method=("method", "method"),
    status=("status", "status"),
    figure=(worst("name"),),
    value=(worst("value"),),
    bound=(worst("bound"),),
    formula=(worst("formula"),),
    margin=(worst("margin"), "margin", ".3g"),
    seconds=(lambda trial: f"{trial.seconds:.3g}",),
    words=("words", "worst figure, or what it said"),
)


def run(options):
    """Ask every method of every case, write table, pictures and the sheet of all."""
    cases = cases_named(registry(), options.only) if options.only else registry()
    folder, trials, sheets = study.begin(options), [], defaultdict(list)
    jobs = [(case, method) for case in cases for method in case.asked]
    with ProgressBar("hard cases") as bar:
        for case, method in jobs:
            trials.append(assess(case, method, options.quick))
            bar.count(len(trials), len(jobs))
    rows = TABLE.rows(trials)
    study.write_rows(folder / "hard_cases.csv", rows)
    for trial in trials:
        sheets[trial.case.name].append(trial)
        sheets[f"hard_cases_{trial.case.package}"].append(trial)
    for name, own in sheets.items():
        picture_cases(folder / f"{name}.png", own, options.columns, STYLES)
    picture_margins(folder / "hard_cases.png", trials, STYLES)
    for row in rows:
        row["margin"] = None if row["margin"] == "" else row["margin"]
        row["words"] = row["words"] if len(row["words"]) < 90 else row["words"][:87] + "..."
    TABLE.show(rows)
    ends = Counter(trial.status for trial in trials)
    counts = {"cases": len(cases), "askings": len(trials)}
    counts.update({status: ends[status] for status in (PASSED, REFUSED, FAILED)})
    least = min((trial.margin for trial in trials if trial.worst), default=math.inf)
    if math.isfinite(least):
        counts["least_margin"] = least
    figures = {name: (count, "1") for name, count in counts.items()}
    study.finish(options, NAME, figures, sum(trial.compile_s for trial in trials))


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
