"""Which hard cases each method bears, which it refuses in words, and by what margin.

    python experiments/hard_cases.py                      # about ten minutes on one core
    python experiments/hard_cases.py --only full_box,still_heap
    python experiments/hard_cases.py --quick

A case is a scene at the edge of what can be computed, with figures that physics bounds: the formula
stands in the table. A method that claims the case passes with all figures within their bounds; the
margin is bound over figure, of the worst of them. A method that cannot handle it has to refuse in
words: numbers in their place count as a failure.
"""

import math
import os
import sys
import textwrap
import time

from _hard_cases import judge, named, registry
from _hard_cases._case import FAILED, PASSED, REFUSED
from _hard_cases._margins import case_title, method_styles, picture_margins, with_powers
from taichi_dem.kit.files import output_folder
from taichi_dem.kit.plot_style import GREY, RED, picture, power
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study import figure, finish, main, parser, several, show_rows, whole, write_rows

NAME = "hard_cases"
#: Cases of a quick run, one of each kind; the tests ask all, at quick size.
OF_QUICK = (
    *("full_box", "empty_box", "no_rebound", "longest_steps", "step_above_limit"),
    *("spheres_near_limit", "spheres_beyond_limit", "single_cell"),
    *("faster_than_the_bound", "flat_element", "step_that_is_no_number"),
)
COLUMNS = 5


def options_parser():
    """Options of this experiment."""
    made = parser(NAME, __doc__)
    made.add_argument("--only", type=several(str), help="cases by name, all by default")
    made.add_argument("--columns", type=whole(1, 8), default=COLUMNS, help="of the sheet, 5")
    return made


def run(options):
    """Ask every method of every case, write table, pictures and the sheet of all."""
    cases = registry()
    if options.only or options.quick:
        cases = named(cases, options.only or OF_QUICK)
    output_folder(options.out)
    started = time.perf_counter()
    results = ask(cases, options.quick)
    compiling = sum(result.compile_s for result in results)
    write_rows(os.path.join(options.out, "hard_cases.csv"), [row_of(result) for result in results])
    for case in cases:
        picture_case(os.path.join(options.out, f"{case.name}.png"), case, results)
    for package in dict.fromkeys(case.package for case in cases):
        own = [case for case in cases if case.package == package]
        seen = [result for result in results if result.package == package]
        path = os.path.join(options.out, f"hard_cases_{package}.png")
        picture_sheet(path, own, seen, options.columns)
    picture_margins(os.path.join(options.out, "hard_cases.png"), results)
    print_results(results)
    spent = time.perf_counter() - started
    seconds = compiling, spent - compiling
    finish(options, NAME, figures_of(cases, results), seconds)


def ask(cases, quick):
    """Results of all cases and methods."""
    asked = [(case, method) for case in cases for method in case.asked]
    results = []
    with ProgressBar("hard cases") as bar:
        for k, (case, method) in enumerate(asked):
            results.append(judge(case, method, quick))
            bar.count(k + 1, len(asked))
    return results


def row_of(result):
    """Row of the CSV; cells without a value are empty."""
    limit = result.limit
    worst = (limit.name, limit.value, limit.bound, limit.formula) if limit else ("",) * 4
    row = (result.case, result.package, result.method, result.status, *worst)
    row = (*row, result.margin if limit else "", f"{result.seconds:.3g}", result.words)
    names = "case,package,method,status,figure,value,bound,formula,margin,seconds,words"
    return dict(zip(names.split(","), map(str, row)))


def looks_of(results):
    """Label, colour and line width of every method; the first are thick, so that all are seen."""
    styles = method_styles(list(dict.fromkeys(result.method for result in results)))
    return {
        method: {"label": style.label, "color": style.colour, "lw": max(0.8, 3.0 - 0.45 * k)}
        for k, (method, style) in enumerate(styles.items())
    }


def picture_case(path, case, results):
    """One picture of a case: what its methods did, and how they fared."""
    own = [result for result in results if result.case == case.name]
    with picture(path, 1, 1, (7.0, 4.6)) as (figure, axis):
        draw_case(axis, own, looks_of(own), size=8.0)
        figure.suptitle(
            textwrap.fill(with_powers(case.question), 100), fontsize=9.0, x=0.02, ha="left"
        )
        handles, labels = axis.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)


def picture_sheet(path, cases, results, columns):
    """All cases of a package on one sheet."""
    rows, looks = -(-len(cases) // columns), looks_of(results)
    size = (3.2 * columns, min(16.0, 0.4 + 2.4 * rows))
    with picture(path, rows, columns, size, squeeze=False) as (figure, axes):
        panels = axes.ravel()
        for axis, case in zip(panels, cases):
            draw_case(axis, [result for result in results if result.case == case.name], looks, 6.0)
        for axis in panels[len(cases) :]:
            axis.set_axis_off()
        shown = dict.fromkeys(result.method for result in results if result.shown)
        lines = [panels[0].plot([], [], **looks[method])[0] for method in shown]
        lines += panels[0].plot([], [], color=GREY, ls=":", lw=1.0, label="bound of physics")
        figure.legend(handles=lines, loc="outside upper left", ncols=3)


def draw_case(axis, own, looks, size):
    """What the methods of a case did, and how they fared in the title.

    own: results of the case. looks: by method. size: of letters [points].
    """
    for result in own:
        if result.shown is not None:
            draw_curves(axis, result.shown, looks[result.method])
    if not any(result.shown for result in own):
        axis.set(xticks=[], yticks=[])
        said = textwrap.fill(f"“{own[0].words}”", 44)
        axis.text(0.03, 0.92, said, fontsize=size, va="top", transform=axis.transAxes)
    lowest, highest = axis.get_ylim()
    if axis.get_yscale() == "linear" and 0.0 < lowest < 0.95 * highest:
        axis.set_ylim(0.0, highest)
    if any(result.shown for result in own):
        axis.locator_params(axis="x", nbins=5)
    axis.tick_params(labelsize=size)
    axis.xaxis.label.set_size(size)
    axis.yaxis.label.set_size(size)
    axis.set_title(f"{case_title(own[0].case)}: {verdict(own)}", fontsize=size + 1.0)
    if any(result.status == FAILED for result in own):
        axis.title.set_color(RED)


def verdict(own):
    """How the methods of a case fared, in words."""
    words = {PASSED: "passed", REFUSED: "refused", FAILED: "FAILED"}
    counts = {word: sum(result.status == word for result in own) for word in words}
    said = [f"{counts[word]} {words[word]}" for word in words if counts[word]]
    margins = [result.margin for result in own if result.limit]
    if margins and math.isfinite(min(margins)):
        least = min(margins)
        said.append(f"margin {power(least) if least >= 1e4 else format(least, '.2g')}")
    return ", ".join(said)


def draw_curves(axis, shown, look):
    """Lines of one method, its bounds dotted."""
    for k, (x, y) in enumerate(shown.lines.values()):
        own = {**look, "label": None if k else look["label"]}
        if shown.dots:
            own.update(ls="none", marker="o", ms=1.6 * look["lw"] + 1.0, mfc="none", lw=1.0)
        axis.plot(x, y, **own)
    known = axis.get_legend_handles_labels()[1]
    for bound in shown.bounds:
        words = None if "bound of physics" in known else "bound of physics"
        axis.axhline(bound, color=GREY, ls=":", lw=1.0, label=words)
        known = [*known, words]
    axis.set(xlabel=shown.xlabel, ylabel=shown.ylabel)
    if shown.log:
        axis.set_yscale("log")


def figures_of(cases, results):
    """How many cases, and how many runs ended in which way."""
    counts = {word: sum(r.status == word for r in results) for word in (PASSED, REFUSED, FAILED)}
    margins = [result.margin for result in results if result.limit]
    figures = {"cases": figure(len(cases), "1"), "askings": figure(len(results), "1")}
    figures.update({word: figure(count, "1") for word, count in counts.items()})
    if margins and math.isfinite(min(margins)):
        figures["least_margin"] = figure(min(margins), "1")
    return figures


def print_results(results):
    """The table: case, method, status, worst figure, margin."""
    rows = [
        {
            **row_of(result),
            "margin": result.margin if result.limit else None,
            "words": result.words if len(result.words) < 90 else result.words[:87] + "...",
        }
        for result in results
    ]
    formats = {name: (name, "") for name in ("case", "method", "status")}
    words = {"worst figure, or what it said": ("words", "")}
    show_rows(rows, {**formats, "margin": ("margin", ".3g"), **words})


if __name__ == "__main__":
    sys.exit(main(run, options_parser()))
