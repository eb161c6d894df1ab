"""A kept row is used again only where all that its result depends on is as it was."""

import importlib
import subprocess
import sys

import pytest

from taichi_dem.kit.sweeps.dependencies import Dependencies
from taichi_dem.kit.sweeps.jobs import Journal, jobs_of, run_job
from tests.processes import users_environment
from tests.scenes import ROOT
from tests.sweeps import jobs

JOB = """
import functools
from dataclasses import dataclass
from pathlib import Path
import numpy as np
import parts
from parts import far
TABLE = {"a": np.array([1.0, 2.0]), "names": {"x", "y", "z"}}
@dataclass(frozen=True)
class Load:
    peak: float = 4e8
    def rise(self):
        return self.peak / 8.0
class Solver(Load):
    tolerance = 1e-3
    @staticmethod
    def solved(x):
        return x - 7.0
def helper(x):
    return inner(x) + 1.0
def inner(x):
    return 3.0 * x
def closing(exponent):
    return lambda x: x**exponent
power = closing(2.0)
half = functools.partial(pow, 0.5)
@functools.lru_cache(None)
def kept(x):
    return x + 5.0
def work(row, shift=1.5):
    x = row["x"] + shift + TABLE["a"].sum() + Load().rise() + half(2.0)
    more = [near(x) for near in (helper, power, kept, Solver.solved, far)]
    return {"y": sum(more) + float(Path("input.txt").read_text()) + parts.constant}
def unrelated(x):
    return 10.0
"""
PARTS = "from deeper import offset\nconstant = 8.0\ndef far(x):\n    return x + offset()\n"
DEEPER = "BASE = 4.0\ndef offset():\n    return BASE\n"
FILES = {"job.py": JOB, "parts.py": PARTS, "deeper.py": DEEPER, "input.txt": "0.5\n"}
#: What is changed into what, in which file.
EDITS = {
    "an entry of an array": ("job.py", "[1.0, 2.0]", "[1.0, 2.5]"),
    "an operator": ("job.py", "far)]", "far)][1:]"),
    "a helper of a helper": ("job.py", "3.0 * x", "4.0 * x"),
    "a default": ("job.py", "shift=1.5", "shift=1.6"),
    "a value closed over": ("job.py", "closing(2.0)", "closing(3.0)"),
    "an argument of a partial": ("job.py", "partial(pow, 0.5)", "partial(pow, 0.6)"),
    "a decorated function": ("job.py", "x + 5.0", "x + 6.0"),
    "a method": ("job.py", "/ 8.0", "/ 9.0"),
    "a constant of a class": ("job.py", "tolerance = 1e-3", "tolerance = 1e-4"),
    "a base of a class": ("job.py", "Solver(Load)", "Solver(Exception)"),
    "a function from another file": ("parts.py", "x + offset", "x - offset"),
    "a constant of a file's import": ("deeper.py", "BASE = 4.0", "BASE = 5.0"),
}
#: Changes after which the rows need not be run again.
HARMLESS = {
    "a comment": ("job.py", "3.0 * x", "3.0 * x  # by hand\n\n"),
    "another function": ("job.py", "return 10.0", "return 11.0"),
}


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder of the user, in which the files of a job stand."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    yield tmp_path
    forget()


def forget():
    for name in ("job", "parts", "deeper"):
        sys.modules.pop(name, None)


def anew():
    """The job as a new process imports it."""
    forget()
    importlib.invalidate_caches()
    return importlib.import_module("job").work


def kept(folder, rows):
    """A journal, jobs of rows, and which of them it has."""
    each = jobs_of(anew(), rows, 0)
    journal = Journal(folder / "out", "job:work")
    found = journal.read(each)
    return journal, each, [job.digest in found for job in each]


def edit(place, file, before, after):
    text = (place / file).read_text()
    assert text.count(before) == 1
    (place / file).write_text(text.replace(before, after))


@pytest.mark.parametrize("change", [*EDITS, *HARMLESS])
def test_a_change_runs_rows_again_and_one_taken_back_does_not(place, change):
    file, before, after = {**EDITS, **HARMLESS}[change]
    digest = Dependencies(anew()).digest
    anew()({"x": 1.0})
    edit(place, file, before, after)
    assert (Dependencies(anew()).digest != digest) == (change in EDITS)
    edit(place, file, after, before)
    assert Dependencies(anew()).digest == digest


def test_a_changed_input_file_runs_the_rows_that_name_it_again(place):
    (place / "a.txt").write_text("1")
    rows = [{"x": 1.0, "file": "a.txt"}, {"x": 1.0, "file": "b.txt"}, {"x": 1.0, "file": "none"}]
    journal, each, known = kept(place, rows)
    assert known == [False, False, False]
    for job in each:
        journal.write(job, run_job(lambda row: {"y": 1.0}, job.row))
    assert kept(place, rows)[2] == [True, True, True]
    (place / "a.txt").write_text("2")
    # What the job has written itself is no input that has changed.
    (place / "b.txt").write_text("3")
    assert kept(place, rows)[2] == [False, True, True]
    (place / "a.txt").write_text("1")
    (place / "input.txt").write_text("0.75")
    assert kept(place, rows)[2] == [False, False, False]


def test_a_key_is_that_of_any_other_process(place):
    say = "import job; print(job.jobs_of(job.work, [{'x': 1.0}], 0)[0].digest)"
    (place / "job.py").write_text(JOB + "from taichi_dem.kit.sweeps.jobs import jobs_of\n")
    said = set()
    for seed in ("1", "2"):
        options = {"capture_output": True, "text": True, "check": True, "cwd": place}
        environment = users_environment(PYTHONPATH=f"{ROOT}:{place}", PYTHONHASHSEED=seed)
        line = [sys.executable, "-c", say]
        said.add(subprocess.run(line, env=environment, **options).stdout)
    assert len(said) == 1 and len(said.pop().strip()) == 24


def test_a_record_with_a_changed_digit_is_not_believed(tmp_path):
    journal = Journal(tmp_path, "tests.sweeps.jobs:squared")
    (job,) = jobs_of(jobs.squared, [{"x": 3}], 0)
    journal.write(job, run_job(jobs.squared, job.row))
    (path,) = (tmp_path / "jobs").iterdir()
    text = path.read_text()
    path.write_text(text.replace('"square": 9', '"square": 8'))
    assert path.read_text() != text and journal.read([job]) == {}
    path.write_text(text)
    assert journal.read([job])[job.digest].values["square"] == 9
