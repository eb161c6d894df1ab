"""Does a bar hold as often as it says? Random questions, judged by far finer runs.

    make coverage                                   # 120 questions
    python experiments/bar_coverage.py --battery 7  # others of the same kind
    python experiments/bar_coverage.py --quick

A battery asks about bars, the paper's block, parts under impact, and dampers. Its number is the
seed of meshes and their numbering, materials, loads, times, goals and tolerances. The reference of
an answer is a run with a step 16 times finer, or for a damper other seeds at a quarter of the step.
It should lie in 95 % of the bars: fewer mean bars too narrow, more mean bars too wide. References
of batteries 0 to 2 are kept in bar_references.csv; finer ones are made where an answer needs them.

Writes bars.csv, references.csv, bar_coverage.md, bar_coverage.png and summary.json to
results/bar_coverage/.
"""

import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from cases import accuracy as judge
from cases import questions as questions
from taichi_dem.kit import study
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import write_text
from taichi_dem.kit.plot_style import BLUE, GREEN, GREY, ORANGE, RED, picture
from taichi_dem.kit.progress_bar import ProgressBar

NAME = "bar_coverage"
REFERENCES = Path(__file__).with_name("bar_references.csv")
SETTINGS = {
    "battery": (0, 0, study.whole(0, 2**31), "seed of the questions, default 0"),
    "questions": (120, 4, study.whole(1, 10_000), "number of questions, default 120"),
    # Cheap ones in a quick run.
    "first": (0, 108),
}
options_parser = partial(study.parser, NAME, __doc__, settings=SETTINGS, threads=1)
#: What is asked about, and how often in twelve questions.
KINDS = {
    "bar": (questions.bar_question, RED),
    "block": (questions.block_question, BLUE),
    "part": (questions.part_question, GREEN),
    "damper": (questions.damper_question, ORANGE),
}
ORDER = "bar block part damper bar block damper block bar damper bar block".split()
#: Columns of bars.csv.
COLUMNS = "number kind question value error parts true doubt holds deviation single reached cpu_s"
TABLE = study.Table(
    kind=("kind", "asked about"),
    answers=("answers", "answers"),
    reached=("reached", "as narrow as asked"),
    several=("several", "no single number"),
    coverage_percent=("held", "bars that hold [%]", ".1f", "%"),
    worst_ratio=("worst", "worst, in bars", ".2f", "1"),
    cpu_s=("cpu_s", "CPU [s]", ".3g"),
)


def judged(options, references):
    """Answers beside the truth, one a question that is not refused."""
    found = []
    with ProgressBar(NAME) as bar:
        for done in range(options.questions):
            number = options.first + done
            kind = ORDER[number % len(ORDER)]
            question = KINDS[kind][0](options.battery, number)
            one = judge.judged(question, references.of(options.battery, number, question))
            found += [SimpleNamespace(number=number, kind=kind, **vars(one))] if one else []
            bar.count(done + 1, options.questions)
    return found


def rows_of(found):
    """Rows of ``TABLE``, of all kinds and of all answers."""
    kinds = [(kind, [one for one in found if one.kind == kind]) for kind in KINDS]
    kinds.append(("all", found))
    return [row_of(*named) for named in kinds if any(one.single for one in named[1])]


def row_of(kind, found):
    """Row of ``TABLE``; what has several ends, or no limit, states no bar."""
    single = [one for one in found if one.single]
    return SimpleNamespace(
        kind=kind,
        answers=len(found),
        reached=sum(one.reached for one in found),
        several=len(found) - len(single),
        held=100.0 * np.mean([one.holds for one in single]),
        worst=max(abs(one.deviation) for one in single),
        cpu_s=sum(one.cpu_s for one in found),
    )


def page_of(rows):
    """The table in Markdown."""
    return study.markdown_of(*TABLE.cells(TABLE.rows(rows)))


def draw(path, found, held):
    """Histogram of (value - true) / half-width of its bar, by kind; held: share inside [%]."""
    edges = np.linspace(-3.0, 3.0, 25)
    kinds = {kind: [one.deviation for one in found if one.kind == kind] for kind in KINDS}
    kinds = {kind: np.clip(some, edges[0], edges[-1]) for kind, some in kinds.items() if some}
    with picture(path, size=(6.6, 4.2)) as (_, axes):
        axes.axvspan(-1.0, 1.0, color=GREY, alpha=0.15, label="inside the bar")
        look = {"color": [KINDS[kind][1] for kind in kinds], "stacked": True}
        names = [f"{len(some)} of a {kind}" for kind, some in kinds.items()]
        axes.hist(kinds.values(), edges, label=names, **look)
        axes.set_xlabel("(value − true value) / half-width of the bar [1]; beyond 3 at the ends")
        axes.set_ylabel("answers [1]")
        axes.locator_params(axis="y", integer=True)
        axes.set_title(f"{held:.1f} % of the bars hold the true value (95 % meant)")
        axes.legend(fontsize=8)


def run(options):
    """Ask all questions, judge the answers, write the tables and the picture."""
    folder = study.begin(options)
    references = judge.References(REFERENCES)
    found = judged(options, references)
    if not any(one.single for one in found):
        raise InputError(f"questions must be more: none of {options.questions} had a single number")
    answers = pd.DataFrame([vars(one) for one in found])
    answers.to_csv(folder / "bars.csv", index=False, columns=COLUMNS.split())
    references.write(folder / "references.csv")
    rows = rows_of(found)
    TABLE.show(TABLE.rows(rows))
    write_text(folder / "bar_coverage.md", page_of(rows))
    whole = rows[-1]
    draw(folder / "bar_coverage.png", [one for one in found if one.single], whole.held)
    figures = {
        "coverage_percent": (whole.held, "%"),
        "worst_ratio": (whole.worst, "1"),
        "answers": (whole.answers, "1"),
        "reached": (whole.reached, "1"),
        "without_a_single_number": (whole.several, "1"),
        **{f"coverage_percent_{row.kind}": (row.held, "%") for row in rows[:-1]},
    }
    study.finish(options, NAME, figures, 0.0, see="bar_coverage.png")


if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
