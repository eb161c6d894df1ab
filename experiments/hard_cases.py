"""Which hard cases each method bears, which it refuses in words, and by what margin.

    python experiments/hard_cases.py                      # about ten minutes on one core
    python experiments/hard_cases.py --only full_box,still_heap
    python experiments/hard_cases.py --quick

A case is a scene at the edge of what can be computed, with figures that physics bounds: the formula
stands in the table. A method that claims the case passes with all figures within their bounds; the
margin is bound over figure, of the worst of them. A method that cannot handle it has to refuse in
words: numbers in their place count as a failure. The cases are tests, in tests/hard_cases.

Writes hard_cases.csv, a picture of each case, hard_cases_blast.png, hard_cases_damper.png,
hard_cases.png and summary.json to results/hard_cases/.
"""

import math
import sys
from collections import Counter, defaultdict
from functools import partial
from pathlib import Path

import pytest

from _hard_cases_pictures import picture_cases, picture_margins
from taichi_dem.kit import study
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "hard_cases"
#: Of a quick run, which compile little; the tests ask all, at quick size.
OF_QUICK = ("single_cell", "step_above_limit", "flat_element", "step_that_is_no_number")
SETTINGS = {
    "only": (None, OF_QUICK, study.several(str), "cases by name, all by default"),
    "columns": (3, 3, study.whole(1, 8), "of the sheet, 3"),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS)
TESTS = Path(__file__).parents[1] / "tests" / "hard_cases" / "test_hard_cases.py"
#: Nothing of what the other tests need, and nothing said but by this program.
PYTEST = "-s --noconftest -o addopts= --import-mode=importlib -p no:terminal -p no:cacheprovider"


class Asked:
    """A plugin of pytest that chooses cases and their size, and keeps what they gave."""

    def __init__(self, only, quick, bar):
        self.only, self.quick, self.bar = only, quick, bar
        self.trials, self.count, self.unknown, self.interrupted = [], 0, [], False

    def pytest_configure(self, config):
        """Tell the test that it is asked."""
        config.option.hard_cases = self

    def pytest_collection_modifyitems(self, items):
        """Keep the cases of these names."""
        given = [getattr(item, "callspec", None) for item in items]
        cases = [one and one.params.get("case") for one in given]
        names = {case.name for case in cases if case}
        self.unknown = sorted({*(self.only or ())} - names)
        chosen = () if self.unknown else self.only or names
        items[:] = [item for item, case in zip(items, cases) if case and case.name in chosen]
        self.count = len(items)

    def pytest_keyboard_interrupt(self):
        """Pytest keeps Ctrl-C to itself."""
        self.interrupted = True

    def take(self, trial):
        """Keep the trial of a test."""
        self.trials.append(trial)
        self.bar.count(len(self.trials), self.count)


def trials_of(options):
    """Run the tests; returns their trials."""
    with ProgressBar("hard cases") as bar:
        asked = Asked(options.only, options.quick, bar)
        pytest.main([str(TESTS), *PYTEST.split()], plugins=[asked])
    if asked.interrupted:
        raise KeyboardInterrupt
    if asked.unknown:
        raise InputError(f"only must name cases of {TESTS.parent}, got {', '.join(asked.unknown)}")
    if not asked.trials or len(asked.trials) < asked.count:
        raise RuntimeError(f"tests of hard cases broke: see pytest {TESTS}")
    return asked.trials


def row_of(trial):
    """A trial as a row of the table, with its worst figure."""
    names = ("name", "value", "bound", "formula", "margin")
    figure, value, bound, formula, margin = (getattr(trial.worst, name, "") for name in names)
    row = {"case": trial.case.name, "package": trial.case.package, "method": trial.method}
    row.update(status=trial.status, figure=figure, value=value, bound=bound, formula=formula)
    return {**row, "margin": margin, "seconds": f"{trial.seconds:.3g}", "words": trial.words}


def run(options):
    """Ask every method of every case, write table, pictures and the sheet of all."""
    folder, sheets = study.begin(options), defaultdict(list)
    trials = trials_of(options)
    rows = [row_of(trial) for trial in trials]
    study.write_rows(folder / "hard_cases.csv", rows)
    for trial in trials:
        sheets[trial.case.name].append(trial)
        sheets[f"hard_cases_{trial.case.package}"].append(trial)
    for name, own in sheets.items():
        picture_cases(folder / f"{name}.png", own, options.columns)
    picture_margins(folder / "hard_cases.png", trials)
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


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
