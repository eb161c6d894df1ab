"""Option --sweep of a study: the job once for each row of a CSV file, each in its own process."""

import json
import os
import subprocess
import sys
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import partial
from inspect import getfile, unwrap
from pathlib import Path

from taichi_dem.kit import children, runtime
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import output_folder, write_text
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study.costly_work import cached, digest
from taichi_dem.kit.sweeps.table import ADDED
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
    made.add_argument("--workers", type=count, help="rows side by side with --sweep, one a core")


def run_sweep(
    run: Callable, made: ArgumentParser, options: Namespace, arguments: Sequence[str]
) -> int:
    """Run all rows that are missing, gather their figures in sweep.csv; returns the exit code.

    A row is done where an earlier sweep ran it with the same options, files and sources.
    """
    if options.json:
        raise InputError("json must be left out with --sweep, which writes sweep.csv")
    table = _rows(options.sweep)
    count = options.workers or runtime.usable_cores()
    lines = _lines(made, table, options, arguments, count)
    script, folder = os.path.abspath(getfile(unwrap(run))), output_folder(options.out)
    beside = {
        str(path): path.read_bytes().hex() for path in sorted(Path(script).parent.glob("*.py"))
    }
    sources = digest(beside, ("taichi_dem", "ca_damper"))
    with ThreadPoolExecutor(count) as pool, ProgressBar("sweep") as bar:
        places = (os.path.join(folder, f"row_{k}") for k in range(len(lines)))
        jobs = [pool.submit(_run_row, script, sources, *job) for job in zip(lines, places)]
        try:
            for done, _ in enumerate(as_completed(jobs), 1):
                bar.count(done, len(jobs))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return _show(table, [job.result() for job in jobs], folder)


def _rows(path):
    """Rows of a CSV file, texts by column name."""
    import pandas

    try:
        rows = pandas.read_csv(path, dtype=str, keep_default_na=False).to_dict("records")
    except (OSError, ValueError) as error:
        raise InputError(f"table {shown(path)} must be a CSV file: {error}") from None
    if not rows:
        raise InputError(f"table {shown(path)} must have at least one row, got none")
    return rows


def _run_row(script, sources, line, folder):
    """Figures of a row's summary.json, and what computed them; or why it failed, in error."""
    words = [word for text in line for word in text.split("=")]
    files = {name: Path(name).read_bytes().hex() for name in filter(os.path.isfile, words)}
    begun = time.perf_counter()
    try:
        run = partial(_figures, [sys.executable, script, *line, f"--out={folder}"], folder)
        return cached(folder, "sweep", (line, sources, files), (), run)[0]
    except RuntimeError as error:
        return {"error": str(error), "seconds": time.perf_counter() - begun}


def _figures(line, folder):
    """Run a job and return its figures by name; RuntimeError with its last words."""
    begun = time.perf_counter()
    done = children.run(line, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        said = done.stderr.strip().splitlines()
        raise RuntimeError(said[-1] if said else f"exit code {done.returncode}")
    write_text(os.path.join(folder, "output.txt"), done.stdout)
    summary = json.loads(Path(folder, "summary.json").read_text(encoding="utf-8"))
    figures = {
        f"{name}_figure" if name in ADDED else name: one["value"]
        for name, one in summary["figures"].items()
    }
    versions, place = summary["versions"], summary["machine"]["processor"]
    made = "", versions["taichi-dem"], versions["commit"], place, time.perf_counter() - begun
    return {**figures, **dict(zip(ADDED, made))}


def _lines(made, table, options, arguments, count):
    """Arguments of each row, all of which the parser takes. Raises InputError otherwise."""
    own = ArgumentParser(allow_abbrev=False, add_help=False)
    for name in _OWN:
        own.add_argument(f"--{name}")
    for name in _LOUDNESS:
        own.add_argument(f"--{name}", action="store_true")
    common = own.parse_known_args(arguments)[1]
    if "threads" not in table[0] and options.threads is None:
        common = [*common, f"--threads={max(1, runtime.usable_cores() // count)}"]
    lines = []
    for k, row in enumerate(table):
        try:
            given = [_argument(made, name, cell) for name, cell in row.items()]
            lines.append([*common, *filter(None, given)])
            made.parse_args(lines[-1])
        except InputError as error:
            raise InputError(f"row {k} of table {options.sweep}: {error}") from None
    return lines


def _argument(made, name, cell):
    """The argument that a cell stands for, "" for a switch that is off."""
    known = {text[2:]: one for text, one in made._option_string_actions.items()}
    known = {text: one for text, one in known.items() if text not in ("", *_OWN, *_LOUDNESS)}
    if name not in known:
        raise InputError(f"columns must be out of {', '.join(known)}, got {shown(name)}")
    if known[name].nargs != 0:
        return f"--{name}={cell}"
    if cell.lower() not in _SWITCH:
        raise InputError(f"{name} must be one of {', '.join(_SWITCH)}, got {shown(cell)}")
    return f"--{name}" if _SWITCH[cell.lower()] else ""


def _show(table, found, folder):
    """Write sweep.csv and print what became of each row; 1 where one has failed."""
    import pandas

    made, given = pandas.DataFrame(found), pandas.DataFrame(table)
    figures = made.drop(columns=[name for name in ADDED if name in made])
    figures.columns = [f"{name}_figure" if name in given else name for name in figures]
    whole = pandas.concat([given, figures, made.reindex(columns=ADDED)], axis="columns")
    path = os.path.join(folder, "sweep.csv")
    write_text(path, whole.to_csv(index=False, na_rep="nan"))
    ends = [(f"{one['seconds']:.1f} s", one["error"] or "done") for one in found]
    rows = [[*row.values(), *end] for row, end in zip(table, ends)]
    print_table(rows, [*given, "time", "end"])
    print(f"\nFigures of all rows are in {path}, their pictures and tables in row_0, row_1, ...")
    return int(any(one["error"] for one in found))
