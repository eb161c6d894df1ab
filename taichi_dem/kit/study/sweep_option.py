"""Option --sweep of a study: the job once for each row of a CSV file, each in its own process."""

import hashlib
import json
import os
import subprocess
import sys
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from inspect import getfile, unwrap
from pathlib import Path
from typing import Any

from taichi_dem.kit import children, runtime
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.files import claiming, output_folder, write_text
from taichi_dem.kit.progress.progress_bar import ProgressBar
from taichi_dem.kit.study.cached_result import digest
from taichi_dem.kit.terminal import print_table
from taichi_dem.kit.validation import shown

#: Options that are of the sweep, not of a row, and those without a value.
_OWN, _LOUDNESS = ("sweep", "workers", "out"), ("quiet", "json", "help")
#: Cells of a column that is an option without a value.
_SWITCH = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}
#: Columns that sweep.csv has beside those of the table and the figures.
_ADDED = ("error", "version", "commit", "machine", "seconds")


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
    script = os.path.abspath(getfile(unwrap(run)))
    with claiming():
        folder = output_folder(options.out)
        notes = _run_missing(script, lines, folder, count)
    return _show(table, notes, folder)


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


def _run_missing(script, lines, folder, count):
    """Notes on all rows: how each ended, and what it depends on."""
    journal = Path(folder, "sweep.json")
    notes: dict[str, dict] = json.loads(journal.read_text()) if journal.exists() else {}
    scripts = [path.read_text() for path in sorted(Path(script).parent.glob("*.py"))]
    sources = digest(scripts, ("taichi_dem", "ca_damper"))
    stamps = {f"row_{k}": [sources, *line, *_digests(line)] for k, line in enumerate(lines)}
    missing = [
        name
        for name in stamps
        if notes.get(name, {}).get("stamp") != stamps[name]
        or not Path(folder, name, "summary.json").exists()
    ]
    with ThreadPoolExecutor(count) as pool, ProgressBar("sweep") as bar:
        jobs = {
            pool.submit(_run_row, script, line, os.path.join(folder, name)): name
            for name, line in zip(stamps, lines)
            if name in missing
        }
        try:
            for done, job in enumerate(as_completed(jobs)):
                bar.count(done, len(jobs))
                error, seconds = job.result()
                stamp = [] if error else stamps[jobs[job]]
                notes[jobs[job]] = {"stamp": stamp, "error": error, "seconds": seconds}
                write_text(journal, json.dumps(notes))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return [notes[name] for name in stamps]


def _digests(line):
    """Digests of the files that arguments name."""
    words = [word for text in line for word in text.split("=")]
    files = [Path(word).read_bytes() for word in words if os.path.isfile(word)]
    return [hashlib.sha256(content).hexdigest() for content in files]


def _run_row(script, line, folder):
    """Run the job of a row; why it failed, or "", and its seconds."""
    begun = time.perf_counter()
    line = [sys.executable, script, *line, f"--out={folder}"]
    done = children.run(line, stdin=subprocess.DEVNULL)
    seconds = time.perf_counter() - begun
    if done.returncode != 0:
        return (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1], seconds
    write_text(os.path.join(folder, "output.txt"), done.stdout)
    return "", seconds


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


def _show(table, notes, folder):
    """Write sweep.csv and print what became of each row; 1 where one has failed."""
    import pandas

    found = [
        {**row, **note, **({} if note["error"] else _figures(folder, k, row))}
        for k, (row, note) in enumerate(zip(table, notes))
    ]
    names = dict.fromkeys(name for row in found for name in row if name not in ("stamp", *_ADDED))
    path = os.path.join(folder, "sweep.csv")
    content = pandas.DataFrame(found, columns=[*names, *_ADDED])
    write_text(path, content.to_csv(index=False, na_rep="nan"))
    rows = [
        [*row.values(), f"{note['seconds']:.1f} s", note["error"] or "done"]
        for row, note in zip(table, notes)
    ]
    print_table(rows, [*table[0], "time", "end"])
    print(f"\nFigures of all rows are in {path}, their pictures and tables in row_0, row_1, ...")
    return int(any(note["error"] for note in notes))


def _figures(folder, number, row):
    """Figures of the summary.json of a row, and what computed them."""
    text = Path(folder, f"row_{number}", "summary.json").read_text(encoding="utf-8")
    summary: Any = json.loads(text)
    # No figure has the name of an option or of another column.
    figures = {
        f"{name}_figure" if name in (*row, *_ADDED) else name: one["value"]
        for name, one in summary["figures"].items()
    }
    versions = summary["versions"]
    place = versions["taichi-dem"], versions["commit"], summary["machine"]["processor"]
    return {**figures, **dict(zip(_ADDED[1:4], place))}
