"""Experiments as a user starts them: their names, and a run in a process of its own."""

import csv
import subprocess
import sys
from pathlib import Path

from gallery import TOOLS
from tests.processes import chosen_arch, users_environment

READER = Path(__file__).resolve().parents[1] / "figures.py"
FOLDER = Path(__file__).resolve().parents[2] / "experiments"
NAMES = sorted(
    path.stem
    for path in FOLDER.glob("*.py")
    if not path.stem.startswith("_") and path.stem not in TOOLS
)


def command(name, *arguments, report=None):
    """Command line of an experiment with two threads.

    report: file for what its figures lack, see ``tests.figures``.
    """
    read = [] if report is None else [str(READER), str(report)]
    everywhere = ["--threads", "2", "--arch", chosen_arch()]
    return [sys.executable, *read, str(FOLDER / f"{name}.py"), *everywhere, *map(str, arguments)]


def start(name, *arguments, report=None):
    """The finished process of an experiment, output in pipes."""
    options = {"capture_output": True, "text": True, "timeout": 1800}
    line = command(name, *arguments, report=report)
    return subprocess.run(line, env=users_environment(), **options)


def rows_of(path):
    """Rows of a CSV file as dicts of strings."""
    with open(path, newline="") as handle:
        return list(csv.DictReader(handle))
