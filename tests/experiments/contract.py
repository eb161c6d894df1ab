"""Experiments as a user starts them: their names, and a run in a process of its own."""

import csv
import subprocess
import sys
from pathlib import Path

from gallery import TOOLS
from tests import arch
from tests.processes import users_environment

FOLDER = Path(__file__).resolve().parents[2] / "experiments"
NAMES = sorted(
    path.stem
    for path in FOLDER.glob("*.py")
    if not path.stem.startswith("_") and path.stem not in TOOLS
)


def command(name, *arguments):
    """Command line of an experiment with two threads."""
    everywhere = ["--threads", "2", "--arch", arch.chosen()]
    return [sys.executable, str(FOLDER / f"{name}.py"), *everywhere, *map(str, arguments)]


def start(name, *arguments):
    """The finished process of an experiment, output in pipes."""
    options = {"capture_output": True, "text": True, "timeout": 1800}
    return subprocess.run(command(name, *arguments), env=users_environment(), **options)


def rows_of(path):
    """Rows of a CSV file as dicts of strings."""
    with open(path, newline="") as handle:
        return list(csv.DictReader(handle))
