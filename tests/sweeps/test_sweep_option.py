"""Option --sweep of every experiment, on a study that is quick."""

import json
import subprocess
import sys

import pytest

from tests.experiments.contract import rows_of
from tests.processes import users_environment
from tests.scenes import ROOT

STUDY = """
import sys
from taichi_dem import InputError
from taichi_dem.kit import study

def run(options):
    if options.mass < 0.5:
        raise InputError("mass is too small for this beam")
    at = study.output_paths(options.out)
    open(at(f"ran_{options.mass:g}"), "a").write("x")
    print("loud" if options.loud else "quiet")
    study.finish(options, "beam", {"twice": (2.0 * options.mass, "kg"), "mass": (1.0, "1")}, 0.0)

def options_parser():
    made = study.parser("beam", __doc__)
    made.add_argument("--mass", type=study.number(0, 10), default=1.0)
    made.add_argument("--loud", action="store_true")
    return made

if __name__ == "__main__":
    sys.exit(study.main(run, options_parser()))
"""


@pytest.fixture
def beam(tmp_path):
    """``beam(table, *arguments)``: the finished process of a sweep of a small study."""
    (tmp_path / "beam.py").write_text(STUDY)

    def start(table, *arguments):
        (tmp_path / "table.csv").write_text(table)
        line = [sys.executable, "beam.py", "--sweep", "table.csv", *arguments]
        options = {"cwd": tmp_path, "capture_output": True, "text": True}
        return subprocess.run(line, env=users_environment(PYTHONPATH=ROOT), **options)

    return start


def test_each_row_runs_once_in_a_folder_of_its_own(beam, tmp_path):
    table, folder = "mass,loud\n1.5,yes\n0.1,no\n2,0\n", tmp_path / "o"
    done = beam(table, "--out", "o", "--workers", "1")
    assert done.returncode == 1 and done.stderr == ""
    rows = rows_of(folder / "sweep.csv")
    assert [row["twice"] for row in rows] == ["3.0", "nan", "4.0"]
    assert [row["mass"] for row in rows] == ["1.5", "0.1", "2"]
    assert [row["mass_figure"] for row in rows] == ["1.0", "nan", "1.0"]
    assert [row["error"] for row in rows] == ["", "mass is too small for this beam", ""]
    assert float(rows[0]["seconds"]) > 0.0 and rows[0]["machine"] and rows[0]["version"]
    assert (folder / "row_0" / "output.txt").read_text().startswith("\nloud")
    command = json.loads((folder / "row_2" / "summary.json").read_text())["command"]
    assert "--mass=2 " in command and "--loud" not in command
    # Again: what is missing, has failed or is changed.
    (folder / "row_2" / "summary.json").unlink()
    again = beam("mass,loud\n1.5,yes\n0.7,no\n2,0\n", "--out", "o", "--workers", "1")
    assert again.returncode == 0
    runs = {path.name: path.read_text() for path in folder.glob("row_*/ran_*")}
    assert runs == {"ran_1.5": "x", "ran_0.7": "x", "ran_2": "xx"}


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("mass,peek\n1,2\n", "must be out of quick, arch, threads, mass, loud, got 'peek'"),
        ("mass,out\n1,2\n", "got 'out'"),
        ("mass\n1\n20\n", "row 1 of table table.csv: argument --mass: must be a number in (0, 10)"),
        ("mass,loud\n1,maybe\n", "loud must be one of yes, true, 1, no, false, 0, got 'maybe'"),
        ("mass,loud\n1,\n", "row 0 of table table.csv has an empty cell under 'loud'"),
        ("mass,mass\n1,1\n", "must name each column once, got 'mass' twice"),
        ("mass\n", "at least one row"),
    ],
)
def test_a_bad_table_is_one_sentence_before_any_run(tmp_path, monkeypatch, capsys, table, words):
    from taichi_dem.kit import study

    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "beam"}
    exec(STUDY, namespace)
    (tmp_path / "table.csv").write_text(table)
    given = ["--sweep", "table.csv", "--out", "o"]
    parser = namespace["options_parser"]()
    assert study.main(namespace["run"], parser, given) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["table.csv"]


def test_json_and_workers_without_a_sweep_are_refused(tmp_path, monkeypatch, capsys):
    from taichi_dem.kit import study

    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "beam"}
    exec(STUDY, namespace)
    parser = namespace["options_parser"]()
    for given, words in (
        (["--sweep", "table.csv", "--json"], "json must be left out with --sweep"),
        (["--workers", "2"], "workers must be left out without --sweep, got 2"),
    ):
        assert study.main(namespace["run"], parser, given) == 2
        said = capsys.readouterr().err
        assert words in said and said.count("\n") == 1
