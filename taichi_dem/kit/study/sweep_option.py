"""Option --sweep of a study: the job once for each row of a CSV file, each in its own process."""

import json
import os
import subprocess
import sys
from argparse import Action, ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from inspect import getfile, unwrap
from pathlib import Path
from typing import Any

from taichi_dem.kit import children, runtime
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.files import claiming, write_csv, write_text
from taichi_dem.kit.sweeps.jobs import Job, Journal, jobs_of, table_of
from taichi_dem.kit.sweeps.sweep import run_missing
from taichi_dem.kit.sweeps.table import ADDED, Row, read_rows
from taichi_dem.kit.terminal import print_table
from taichi_dem.kit.validation import shown

#: Options that are of the sweep, not of a row.
_OWN = ("sweep", "workers", "out")
#: Those without a value.
_LOUDNESS = ("quiet", "json", "help")
#: Cells of a column that is an option without a value.
_SWITCH = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}
#: Columns of the row of a job.
_OF_JOBS = ("script", "arguments", "out")


def add_sweep(made: ArgumentParser, count: Callable[[str], int]) -> None:
    """Add the options of a sweep; count: type of a number of processes."""
    words = "run the job for each row of a CSV file, whose columns are options"
    made.add_argument("--sweep", metavar="TABLE.csv", help=words)
    made.add_argument("--workers", type=count, help="rows side by side with --sweep, one a core")


def run_sweep(
    run: Callable, made: ArgumentParser, options: Namespace, arguments: Sequence[str]
) -> int:
    """Run all rows that are missing, gather their figures in sweep.csv; returns the exit code."""
    table = read_rows(options.sweep, typed=False)
    count = options.workers or runtime.usable_cores()
    lines = _lines(made, table, options, arguments, count)
    name = os.path.basename(getfile(unwrap(run)))
    script = os.path.abspath(getfile(unwrap(run)))
    with claiming():
        journal = Journal(options.out, f"experiments/{name}")
        folders = [os.path.join(options.out, f"row_{k}") for k in range(len(table))]
        cells = zip([script] * len(table), map(json.dumps, lines), folders)
        rows: list[Row] = [dict(zip(_OF_JOBS, row)) for row in cells]
        jobs = jobs_of(run_row, rows, 0, _files(script, lines))
        for job in jobs:
            if not os.path.exists(_summary_of(job)):
                journal.forget(job)
        records = run_missing(run_row, jobs, journal, count=count)
    return _show(table, table_of(jobs, records, seeded=False), options.out)


def run_row(row: Row) -> dict[str, Any]:
    """Figures of the summary.json that a job leaves; run in a process of its own.

    Raises InputError and SimulationDiverged with the job's sentence, RuntimeError for another end.
    """
    script, arguments, out = (str(row[name]) for name in _OF_JOBS)
    line = [sys.executable, script, *json.loads(arguments), f"--out={out}"]
    done = children.run(line, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        kinds = {2: InputError, 3: SimulationDiverged}
        words = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        raise kinds.get(done.returncode, RuntimeError)(words)
    write_text(os.path.join(out, "output.txt"), done.stdout)
    with open(os.path.join(out, "summary.json"), encoding="utf-8") as file:
        figures = json.load(file)["figures"]
    # No figure has the name of a column of the job or of the provenance.
    return {
        f"{name}_figure" if name in (*row, *ADDED) else name: one["value"]
        for name, one in figures.items()
        if one["value"] is not None
    }


def _files(script, lines):
    """Files on which rows depend: scripts in the folder of the job's, and those in arguments."""
    scripts = map(str, Path(script).parent.glob("*.py"))
    return [*scripts, *(word for line in lines for text in line for word in text.split("="))]


def _summary_of(job: Job) -> str:
    return os.path.join(str(job.row["out"]), "summary.json")


def _lines(made, table, options, arguments, count):
    """Arguments of each row, all of which the parser takes. Raises InputError otherwise."""
    own = ArgumentParser(allow_abbrev=False, add_help=False)
    for name in _OWN:
        own.add_argument(f"--{name}")
    for name in _LOUDNESS:
        own.add_argument(f"--{name}", action="store_true")
    common = own.parse_known_args(arguments)[1]
    known = _options_of(made)
    for column in table[0]:
        if column not in known:
            raise InputError(
                f"columns of table {options.sweep} must be out of {', '.join(known)}, "
                f"got {shown(column)}"
            )
    if "threads" not in table[0] and options.threads is None:
        common = [*common, f"--threads={max(1, runtime.usable_cores() // count)}"]
    lines = []
    for k, row in enumerate(table):
        try:
            given = [_argument(known[name], name, str(cell)) for name, cell in row.items()]
            lines.append([*common, *filter(None, given)])
            made.parse_args(lines[-1])
        except InputError as error:
            raise InputError(f"row {k} of table {options.sweep}: {error}") from None
    return lines


def _options_of(made: ArgumentParser) -> dict[str, Action]:
    """Options that a column may name, by their long names without dashes."""
    found = {
        text[2:]: action
        for action in made._actions
        for text in action.option_strings
        if text.startswith("--")
    }
    return {name: action for name, action in found.items() if name not in (*_OWN, *_LOUDNESS)}


def _argument(action, name, cell):
    """The argument that a cell stands for, "" for a switch that is off."""
    if action.nargs != 0:
        return f"--{name}={cell}"
    if cell.lower() not in _SWITCH:
        raise InputError(f"{name} must be one of {', '.join(_SWITCH)}, got {shown(cell)}")
    return f"--{name}" if _SWITCH[cell.lower()] else ""


def _show(table, found, folder):
    """Write sweep.csv and print what became of each row; 1 where one has failed."""
    given = {name: [row[name] for row in table] for name in table[0]}
    figures = {name: column for name, column in found.items() if name not in _OF_JOBS}
    named = {f"{name}_figure" if name in given else name: figures[name] for name in figures}
    provenance = {name: found.provenance[name] for name in ADDED[1:]}
    path = os.path.join(folder, "sweep.csv")
    write_csv(path, {**given, **named, **provenance})
    rows = [
        [*row.values(), f"{seconds:.1f} s", error or "done"]
        for row, seconds, error in zip(table, found.provenance["seconds"], found["error"])
    ]
    print_table(rows, [*given, "time", "end"])
    print(f"\nFigures of all rows are in {path}, their pictures and tables in row_0, row_1, ...")
    return int(any(found["error"]))
