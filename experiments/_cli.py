"""Options, exit codes, tables and summary.json of all experiments."""

import argparse
import json
import math
import os
import platform
import re
import shlex
import subprocess
import sys

import numpy as np

# The experiments import the mesh from here too.
from taichi_dem import PAPER_BLOCK as PAPER_BLOCK
from taichi_dem import Checkpoint, InputError, SimulationDiverged, runtime
from taichi_dem.kit.checkpoint import Interrupted
from taichi_dem.kit.files import write_csv, write_text
from taichi_dem.kit.progress.lasting_output import lasting_output
from taichi_dem.kit.validation import shown
from taichi_dem.kit.version import __version__, taichi_version

HERE = os.path.dirname(os.path.abspath(__file__))
_INTERVALS = {None: "every_wall_s", "s": "every_wall_s", "steps": "every_steps", "sim": "every_s"}
BLAST_DRIVERS = ("auto", "resident", "parallel")
#: Cells of a table that say nothing.
BLANK = ("", "None", "nan")


class Parser(argparse.ArgumentParser):
    """An argument parser whose complaints are one sentence."""

    def error(self, message):
        """Turn a wrong command line into an InputError."""
        raise InputError(message)


def number(low, high, *, open_low=True):
    """Type of an option that is a number in a range; the complaint names the range."""
    words = f"a number in {'(' if open_low else '['}{low:g}, {high:g})"
    return _checked(float, words, lambda x: low < x < high or (x == low and not open_low))


def whole(low, high):
    """Type of an option that is a whole number in a range."""
    return _checked(int, f"a whole number from {low} to {high}", lambda x: low <= x <= high)


def _checked(kind, words, allowed):
    def parse(text):
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not allowed(value):
            raise argparse.ArgumentTypeError(f"must be {words}, got {shown(text)}")
        return value

    return parse


def interval(text):
    """Type of an option that says how often: 600s on the wall, 5000steps, or 1e-5sim seconds."""
    found = re.fullmatch(r"([0-9.]+(?:[eE][-+]?[0-9]+)?)(s|steps|sim)?", text)
    try:
        unit = _INTERVALS[found[2]]
        value = int(found[1]) if unit == "every_steps" else float(found[1])
        Checkpoint("any", **{unit: value})
    except (TypeError, ValueError, InputError):
        raise argparse.ArgumentTypeError(
            f"must be like 600s (on the wall), 5000steps or 1e-5sim, got {shown(text)}"
        ) from None
    return {unit: value}


def several(kind):
    """Type of an option that is a comma-separated list of a type, without repetitions."""

    def parse(text):
        try:
            values = [kind(part) for part in text.split(",")]
        except InputError as error:
            # Argparse would put words of its own in its place.
            raise argparse.ArgumentTypeError(str(error)) from None
        if len(set(values)) < len(values):
            raise argparse.ArgumentTypeError(f"must not name a value twice, got {shown(text)}")
        return values

    return parse


def parser(name, description, drivers=()):
    """Parser with the options every experiment has; drivers: to choose from, where there are."""
    made = bare_parser(name, description)
    made.add_argument("--quick", action="store_true", help="a smaller job of under a minute")
    place = {"type": os.path.expanduser, "default": os.path.join("results", name)}
    made.add_argument("--out", help="folder for the output", **place)
    made.add_argument("--arch", default="cpu", choices=runtime.ARCHITECTURES)
    if drivers:
        made.add_argument("--driver", default=drivers[0], choices=drivers)
    made.add_argument("--threads", type=whole(1, 1024), default=None, help="CPU threads")
    return made


def bare_parser(name, description):
    """Parser of a script without options."""
    plain = {"formatter_class": argparse.RawDescriptionHelpFormatter, "allow_abbrev": False}
    return Parser(prog=f"python experiments/{name}.py", description=description, **plain)


def fill_in(options, values):
    """Set the options that the command line left out to values by name."""
    for name, value in values.items():
        if getattr(options, name, None) is None:
            setattr(options, name, value)


def add_checkpoints(made):
    """Add the options of a job that saves itself; see ``checkpoint_of``."""
    words = "save the run every 600s on the wall, 5000steps or 1e-5sim simulated seconds"
    made.add_argument("--checkpoint-every", type=interval, default={}, help=words)
    words = "go on from what a run has saved in the same --out"
    made.add_argument("--resume", action="store_true", help=words)


def checkpoint_of(options, name="checkpoint"):
    """Arguments checkpoint and resume of a job: its file is out/name.npz.

    A job saves itself on Ctrl-C and at its end in any case.
    """
    path = os.path.join(options.out, f"{name}.npz")
    checkpoint = Checkpoint(**{**options.checkpoint_every, "path": path})
    return {"checkpoint": checkpoint, "resume": path if options.resume else None}


def main(run, made, arguments=None):
    """Parse, start Taichi, run; returns the exit code of ``exit_code``."""

    def work():
        options = made.parse_args(arguments)
        runtime.start(options.arch, options.threads)
        run(options)

    return exit_code(work)


def exit_code(work):
    """Exit code of a program that does work(): 0 done, or what work returns.

    2 bad input, 3 diverged, 130 interrupted: each with one line on stderr. The reader of the output
    may leave before its end (``| head -1``): the files are still written.
    """
    with lasting_output():
        try:
            return work() or 0
        except (InputError, SimulationDiverged) as error:
            code, words = (2 if isinstance(error, InputError) else 3), error
        except Interrupted as error:
            code, words = 130, f"{error}: go on with --resume"
        except KeyboardInterrupt:
            code, words = 130, "interrupted"
        print(" ".join(str(words).split()), file=sys.stderr)
        return code


def figure(value, unit, paper=None):
    """One figure of summary.json; what was not measured is left out instead.

    value: None where it was looked for in vain; NaN and infinity, which JSON lacks, count as None.
    """
    if isinstance(value, float) and not math.isfinite(value):
        value = None
    return {"value": value, "unit": unit, "paper": paper}


def finish(options, name, figures, runs, show=True):
    """Write summary.json, print the figures if asked to, and where the output is.

    runs: objects with compile_seconds and run_seconds, or both sums as a pair of numbers.
    """
    if not isinstance(runs, tuple):
        pairs = [(made.compile_seconds, made.run_seconds) for made in runs]
        runs = tuple(map(sum, zip(*pairs)))
    write_summary(options.out, name, figures, compile_seconds=runs[0], run_seconds=runs[1])
    if show:
        print_figures(figures)
    print(f"\nPictures and tables are in {options.out}")


def write_rows(path, names, rows):
    """Write rows of cells under names of columns, a sequence or words, as CSV."""
    names = names.split() if isinstance(names, str) else names
    columns = list(zip(*rows)) or [()] * len(names)
    write_csv(path, dict(zip(names, columns)))


def write_summary(folder, name, figures, *, compile_seconds, run_seconds):
    """Write summary.json: figures, machine, versions, seconds, command; see ``figure``.

    quick: whether the command asked for the smaller job, which the gallery's texts do not describe.
    """
    settings, arguments = runtime.settings(), sys.argv[1:]
    machine = {"processor": processor(), "cores": os.cpu_count(), "arch": settings.arch}
    content = {
        "experiment": name,
        "figures": figures,
        "machine": {**machine, "threads": settings.threads, "system": platform.platform()},
        "versions": versions(),
        "seconds": {"compile": compile_seconds, "run": run_seconds},
        "command": shlex.join([f"experiments/{name}.py", *arguments]),
        "quick": "--quick" in arguments,
    }
    write_text(os.path.join(folder, "summary.json"), json.dumps(content, indent=1))


def processor():
    """Name of the processor, as the system gives it."""
    try:
        with open("/proc/cpuinfo") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if "model name" in line]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()


def versions():
    """Versions of what computes, and the commit where there is one."""
    found = {"taichi": taichi_version(), "numpy": np.__version__, "taichi-dem": __version__}
    found["python"] = platform.python_version()
    git = ["git", "-C", HERE, "rev-parse", "--short", "HEAD"]
    try:
        found["commit"] = subprocess.run(git, capture_output=True, text=True).stdout.strip()
    except OSError:
        found["commit"] = ""
    return found


def print_table(rows, header):
    """Print rows of cells under a header, columns as wide as they need to be; blanks as a dash."""
    cells = [header, *[["-" if str(cell) in BLANK else str(cell) for cell in row] for row in rows]]
    widths = [max(len(row[k]) for row in cells) for k in range(len(header))]
    for row in cells:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip())


def print_figures(figures):
    """Print the figures of summary.json, beside the paper's values where it gives any."""
    header, rows = ["figure", "value", "unit", "paper"], []
    for name, one in figures.items():
        paper = "" if one["paper"] is None else value_in_words(one["paper"])
        rows.append([name, value_in_words(one["value"]), one["unit"], paper])
    shown = 4 if any(row[3] for row in rows) else 3
    print_table([row[:shown] for row in rows], header[:shown])


def value_in_words(value):
    """A figure's value: four digits, or "not found" where the run looked for one in vain."""
    if value is None or isinstance(value, str):
        return value or "not found"
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"
