"""Option --sweep of every experiment, on a study that is quick: a row, a run, a line."""

import csv
import json
import shutil
import subprocess
import sys

import pytest

from tests.processes import users_environment
from tests.scenes import ROOT

pytestmark = pytest.mark.experiment

STUDY = """
import sys
from taichi_dem import InputError
from taichi_dem.kit import study

def run(options):
    if options.mass < 0.5:
        raise InputError("mass is too small for this beam")
    at = study.output_paths(options.out)
    open(at(f"ran_{options.mass:g}"), "a").write("x")
    study.finish(options, "beam", {"twice": (2.0 * options.mass, "kg"), "mass": (1.0, "1")}, 0.0)

def options_parser():
    made = study.parser("beam", __doc__)
    made.add_argument("--mass", type=study.number(0, 10), default=1.0)
    made.add_argument("--loud", action="store_true")
    return made

if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
"""


def start(folder, table):
    """Exit code of a sweep of a small study, in a process of its own."""
    (folder / "beam.py").write_text(STUDY)
    (folder / "table.csv").write_text(table)
    line = [sys.executable, "beam.py", "--sweep", "table.csv", "--out", "o", "--workers", "1"]
    return subprocess.run(line, cwd=folder, env=users_environment(PYTHONPATH=ROOT)).returncode


def test_each_row_runs_once_in_a_folder_of_its_own(tmp_path):
    folder = tmp_path / "o"
    assert start(tmp_path, "mass,loud\n1.5,yes\n0.1,no\n2,0\n") == 1
    with open(folder / "results.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["twice"] for row in rows] == ["3.0", "nan", "4.0"]
    assert [row["mass"] for row in rows] == ["1.5", "0.1", "2"]
    assert "seed" not in rows[0]
    assert [row["mass_figure"] for row in rows] == ["1.0", "nan", "1.0"]
    assert [row["error"] for row in rows] == ["", "mass is too small for this beam", ""]
    command = json.loads((folder / "row_2" / "summary.json").read_text())["command"]
    assert "--mass=2 " in command and "--loud" not in command
    # Again: what is missing, has failed or is changed.
    shutil.rmtree(folder / "row_2")
    assert start(tmp_path, "mass,loud\n1.5,yes\n0.7,no\n2,0\n") == 0
    runs = {path.name: path.read_text() for path in folder.glob("row_*/ran_*")}
    assert runs == {"ran_1.5": "x", "ran_0.7": "x", "ran_2": "x"}
