"""Figures and tables of a study, and the file summary.json that holds figures with their origin."""

import json
import math
import os
import platform
import shlex
import sys
import time
from argparse import Namespace
from collections.abc import Callable, Iterable, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from taichi_dem.kit import runtime
from taichi_dem.kit.bars.answer import Answer
from taichi_dem.kit.files import older_files, write_csv, write_text
from taichi_dem.kit.progress_bar import ProgressBar
from taichi_dem.kit.provenance import commit, processor
from taichi_dem.kit.study.entries import MOST_FIGURES, Entry, key_figures
from taichi_dem.kit.terminal import print_table, show_heading
from taichi_dem.kit.version import __version__, taichi_version

#: Most pictures of a list.
_MOST = 12
#: A row by key.
Row = dict[str, Any]
#: Endings of what is looked at.
_PICTURES = (".png", ".svg", ".gif", ".mp4", ".html")


def figure(value: object, unit: str, paper: object = None) -> dict:
    """One figure of summary.json; what was not measured is left out instead."""
    if isinstance(value, float) and not math.isfinite(value):
        value = None
    return {"value": value, "unit": unit, "paper": paper}


def finish(
    options: Namespace,
    name: str,
    figures: Mapping[str, dict | tuple],
    runs: Iterable | tuple[float, float] | float,
    *,
    see: str = "",
    draw: Callable[[], None] | None = None,
) -> None:
    """Write summary.json; print its figures, and the pictures."""
    values = {
        key: figure(*value) if isinstance(value, tuple) else value for key, value in figures.items()
    }
    _write_summary(options, name, values, runs)
    entry = getattr(options, "entry", None)
    if values:
        print_figures(values, entry)
    if draw:
        with ProgressBar(name):
            draw()
    first = (see, *(entry.pictures if entry else ()))
    show_files(options.out, getattr(options, "began", 0.0), first)


def _write_summary(options, name, figures, runs):
    """Write figures, machine, versions, seconds, and the command."""
    settings: Any = runtime.settings()
    words = [*getattr(options, "command", ())] or [f"experiments/{name}.py", *sys.argv[1:]]
    machine = {"processor": processor(), "cores": os.cpu_count(), "arch": settings.arch}
    (compile_s, run_s), known_errors = _seconds_of(options, runs)
    content = {
        "experiment": name,
        "figures": figures,
        "machine": {**machine, "threads": settings.threads, "system": platform.platform()},
        "versions": versions(),
        "known_errors": known_errors,
        "seconds": {"compile": compile_s, "run": run_s},
        "command": shlex.join(words),
        "quick": "--quick" in words,
    }
    write_text(os.path.join(options.out, "summary.json"), json.dumps(content, indent=1))


def _seconds_of(options, runs):
    """Seconds of compiling and running, and what reports say of the errors of their runs."""
    if isinstance(runs, float):
        return (runs, time.perf_counter() - options.started - runs), []
    if isinstance(runs, tuple):
        return runs, []
    reports = list(runs)
    seconds = [sum(getattr(run, f"{k}_seconds") for run in reports) for k in ("compile", "run")]
    errors = (getattr(run, "known_error", "") for run in reports)
    return seconds, list(dict.fromkeys(filter(None, errors)))


def show_report(options: Namespace, report: Any) -> None:
    """Print a report of a run, all of it with --verbose."""
    print(f"\n{report.details() if options.verbose else report}\n")


def add_to_summary(folder: str, **entries: Any) -> None:
    """Add entries, which JSON can hold, by name to the summary.json that ``finish`` wrote."""
    path = Path(folder, "summary.json")
    content = json.loads(path.read_text(encoding="utf-8"))
    write_text(path, json.dumps({**content, **entries}, indent=1))


def versions() -> dict[str, str]:
    """Versions of what computes, and the commit, "unknown" where there is none."""
    packages = {"taichi": taichi_version(), "numpy": np.__version__, "taichi-dem": __version__}
    return {**packages, "python": platform.python_version(), "commit": commit()}


def print_figures(figures: Mapping[str, dict], entry: Entry | None = None) -> None:
    """Print figures of summary.json, beside the paper's values where it gives any."""
    shown = [*figures]
    if entry is not None:
        shown = key_figures(figures, entry.figures) or shown[:MOST_FIGURES]
    header, rows = ["figure", "value", "unit", "paper"], []
    for name in shown:
        value = figures[name]
        paper = "" if value["paper"] is None else value_in_words(value["paper"])
        rows.append([name, value_in_words(value["value"]), value["unit"], paper])
    columns = 4 if any(row[3] for row in rows) else 3
    print_table([row[:columns] for row in rows], header[:columns])
    if len(shown) < len(figures):
        print(f"and {len(figures) - len(shown)} more in summary.json")


def value_in_words(value: object) -> str:
    """A figure's value: four digits, or "not found" where the run looked for one in vain."""
    if value is None or isinstance(value, str):
        return value or "not found"
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"


def show_files(folder: str, since: float = 0.0, first: Sequence[str] = ()) -> None:
    """Print the paths of the pictures in a folder, and where everything else is."""
    names = set(os.listdir(folder)) - set(older_files(folder, since))
    files = sorted(name for name in names if name.endswith(_PICTURES) and not name.startswith("."))
    files.sort(key=lambda name: first.index(name) if name in first else len(first))
    print()
    if files:
        show_heading("Pictures")
        print(*(f"  {os.path.join(folder, name)}" for name in files[:_MOST]), sep="\n")
    if len(files) > _MOST:
        print(f"  and {len(files) - _MOST} more")
    print(f"Tables and all figures are in {folder}")


def show_answer(label: str, answer: Answer) -> None:
    """Print an answer, whether it was reached, and what other tolerances cost; label: of what."""
    print(f"{label}, {answer.goal}: {answer}")
    asked = f"{100.0 * answer.tolerance:g} %"
    print(f"  {asked} {'was' if answer.reached else 'was not'} reached")
    for expense in answer.cost_curve:
        print(f"  {expense}")


def write_accuracy(
    folder: str, names: Sequence[str], rows: Iterable[tuple[Sequence[Any], Answer]]
) -> None:
    """Write accuracy.csv; rows: cells under these names, and the answer that they belong to."""
    header = [*names, "goal", "unit", "value", "error", "seconds", "reached"]
    cells = [
        (*first, a.goal, a.unit, a.value, a.error, a.plan.seconds, a.reached) for first, a in rows
    ]
    write_csv(os.path.join(folder, "accuracy.csv"), dict(zip(header, zip(*cells))))


class Column(NamedTuple):
    """A column: value, header and format of the printed table, unit of the figure.

    value: dotted attribute, place in a tuple, or function of a row's subject. A column without a
    header is not printed, one without a unit is no figure.
    """

    value: str | int | Callable[[Any], Any]
    header: str = ""
    format: str = ""
    unit: str = ""

    def of(self, subject: Any) -> Any:
        """Value for the subject of a row."""
        if isinstance(self.value, int):
            return subject[self.value]
        return (attrgetter(self.value) if isinstance(self.value, str) else self.value)(subject)


class Table:
    """Columns by key, each the arguments of a ``Column``."""

    def __init__(self, **columns: tuple):
        self.columns = {key: Column(*given) for key, given in columns.items()}

    def rows(self, subjects: Iterable) -> list[Row]:
        """A row for each subject, a dict that ``write_rows`` takes too."""
        columns = self.columns.items()
        return [{key: column.of(subject) for key, column in columns} for subject in subjects]

    def show(self, rows: Iterable[Row]) -> None:
        """Print the columns that have a header."""
        header, cells = self.cells(rows)
        print_table(cells, header)
        print()

    def cells(self, rows: Iterable[Row]) -> tuple[list[str], list[list[str]]]:
        """Headers of the columns that have one, and their cells in words, a list a row."""
        shown = [(key, column) for key, column in self.columns.items() if column.header]
        cells = [[_cell(row[key], column.format) for key, column in shown] for row in rows]
        return [column.header for _, column in shown], cells

    def figures(
        self, row: Row, name: str = "{key}", paper: Mapping[str, Any] = {}
    ) -> dict[str, dict]:
        """Figures of a row, of the columns that have a unit."""
        units = {key: column.unit for key, column in self.columns.items() if column.unit}
        return {
            name.format(key=key, **row): figure(row[key], unit, paper.get(key))
            for key, unit in units.items()
        }


def markdown_of(header: Sequence[str], cells: Iterable[Sequence[str]]) -> str:
    """A table of texts in Markdown."""
    lines = [header, ["---"] * len(header), *cells]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def write_rows(path: Any, rows: Sequence, names: str | Sequence[str] | None = None) -> None:
    """Write rows as CSV."""
    if names is None:
        write_csv(path, {name: [row[name] for row in rows] for name in rows[0]})
        return
    names = names.split() if isinstance(names, str) else names
    columns: list[Any] = list(zip(*rows)) or [()] * len(names)
    write_csv(path, dict(zip(names, columns)))


def _cell(value, form):
    if value is None:
        return ""
    if form.endswith("%"):
        return f"{100.0 * value:{form[:-1]}} %"
    return format(value, form)
