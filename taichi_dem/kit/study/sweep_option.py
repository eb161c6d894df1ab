"""Option --sweep of a study: the job once for each row of a CSV file, each in its own process."""

import json
import os
import shlex
import subprocess
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import partial
from inspect import getfile, unwrap
from pathlib import Path

from taichi_dem.kit import children, runtime
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import write_text
from taichi_dem.kit.sweeps.dependencies import HOUSE, digest_of_files
from taichi_dem.kit.sweeps.jobs import Job, run_job
from taichi_dem.kit.sweeps.sweep import RESULTS, Ended, swept
from taichi_dem.kit.sweeps.table import ADDED, Row, checked_rows
from taichi_dem.kit.terminal import print_table
from taichi_dem.kit.validation import shown

#: Options that are of the sweep, not of a row, and those without a value.
_OWN, _LOUDNESS = ("sweep", "workers", "out"), ("quiet", "json", "help")
#: Cells of a column that is an option without a value.
_SWITCH = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}


def add_sweep(made: ArgumentParser, count: Callable[[str], int]) -> None:
    """Add the options of a sweep; count: type of a number of processes."""
    words = "run the job for each row of a CSV file, whose columns are options"
    made.add_argument("--sweep", metavar="TABLE.csv", help=words)
    made.add_argument("--workers", type=count, help="rows run in parallel; default: one per core")


def run_sweep(
    run: Callable, made: ArgumentParser, options: Namespace, arguments: Sequence[str]
) -> int:
    """Sweep over the rows of a table, each a run of the script of ``run``; returns the exit code.

    A row runs again where options, files that they name or sources have changed.
    """
    if options.json:
        raise InputError(f"json must be left out with --sweep, which writes {RESULTS}")
    table = [{name: str(cell) for name, cell in row.items()} for row in checked_rows(options.sweep)]
    count = options.workers or runtime.usable_cores()
    common = _common(table, options, arguments, count)
    titles = (f"row {k} of table {options.sweep}" for k in range(len(table)))
    lines = [_line(made, common, *one) for one in zip(table, titles)]
    script = os.path.abspath(getfile(unwrap(run)))
    sources = _sources(script, common)
    rows: list[Row] = []
    for k, (cells, line) in enumerate(zip(table, lines)):
        made_by = {"command": shlex.join([script, *line]), "sources": sources}
        rows.append({**cells, **made_by, "out": os.path.join(options.out, f"row_{k}")})
    found = swept(run_program, rows, partial(_run, count), options.out)
    _show(table, found, os.path.join(options.out, RESULTS))
    return int(any(found["error"]))


def _common(table, options, arguments, count):
    """Arguments of every row: those given that are not of the sweep, and a share of the cores."""
    own = ArgumentParser(allow_abbrev=False, add_help=False)
    for name in _OWN:
        own.add_argument(f"--{name}")
    for name in _LOUDNESS:
        own.add_argument(f"--{name}", action="store_true")
    common = own.parse_known_args(arguments)[1]
    if "threads" not in table[0] and options.threads is None:
        common.append(f"--threads={max(1, runtime.usable_cores() // count)}")
    return common


def _line(made, common, row, title):
    """Arguments of a row, which the parser takes. Raises InputError with the title otherwise."""
    try:
        given = [_argument(made, name, cell) for name, cell in row.items()]
        line = [*common, *filter(None, given)]
        made.parse_args(line)
    except InputError as error:
        raise InputError(f"{title}: {error}") from None
    return line


def _argument(made, name, cell):
    """The argument that a cell stands for, "" for a switch that is off."""
    known = {text[2:]: one for text, one in made._option_string_actions.items()}
    known = {text: one for text, one in known.items() if text not in ("", *_OWN, *_LOUDNESS)}
    if name not in known:
        raise InputError(f"columns must be among {', '.join(known)}, got {shown(name)}")
    if known[name].nargs != 0:
        return f"--{name}={cell}"
    if cell.lower() not in _SWITCH:
        raise InputError(f"{name} must be one of {', '.join(_SWITCH)}, got {shown(cell)}")
    return f"--{name}" if _SWITCH[cell.lower()] else ""


def _sources(script, common):
    """Digest of the packages, of the scripts in a folder, and of files among common arguments."""
    words = [word for text in common for word in text.split("=")]
    house = Path(__file__).parents[3]
    packages = [path for name in HOUSE for path in (house / name).rglob("*.py")]
    scripts = Path(script).parent.glob("*.py")
    return digest_of_files([*packages, *scripts, *filter(os.path.isfile, words)])


def run_program(row: Row) -> Row:
    """Figures of a run of a script, and the file with all on it. Raises InputError if it fails."""
    out, command = str(row["out"]), shlex.split(str(row["command"]))
    line = [sys.executable, *command, f"--out={out}"]
    done = children.run(line, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        said = done.stderr.strip().splitlines()
        raise InputError(said[-1] if said else f"exit code {done.returncode}")
    write_text(os.path.join(out, "output.txt"), done.stdout)
    path = os.path.join(out, "summary.json")
    figures = json.loads(Path(path).read_text(encoding="utf-8"))["figures"]
    found: Row = {"summary": path}
    for name, one in figures.items():
        key = f"{name}_figure" if name in (*row, *ADDED, *found) else name
        found[key] = float("nan") if one["value"] in (None, "") else one["value"]
    return found


def _run(count: int, jobs: Iterable[Job]) -> Ended:
    """Jobs and their records as their programs end, some side by side.

    A program may fail for what no digest sees, such as a full disk: it always runs again.
    """
    with ThreadPoolExecutor(count) as pool:
        running = {pool.submit(run_job, run_program, job.row): job for job in jobs}
        try:
            for one in as_completed(running):
                record = one.result()
                yield running[one], record._replace(final=not record.error)
        finally:
            pool.shutdown(cancel_futures=True)


def _show(table, found, path):
    """Print what became of each row, and where all figures are."""
    ends = zip(table, found["seconds"], found["error"])
    cells = [[*row.values(), f"{seconds:.1f} s", error or "done"] for row, seconds, error in ends]
    print_table(cells, [*table[0], "time", "end"])
    print(f"\nFigures of all rows are in {path}, their pictures and tables in row_0, row_1, ...")
