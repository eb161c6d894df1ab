"""A kept row is used again only where all that its result depends on is as it was."""

import importlib
import json
import subprocess
import sys

import pytest

from taichi_dem import sweep
from taichi_dem.kit.sweeps.dependencies import Dependencies
from taichi_dem.kit.sweeps.job import jobs_of, run_job
from taichi_dem.kit.sweeps.journal import Journal
from tests.processes import users_environment
from tests.scenes import ROOT
from tests.sweeps import jobs
from tests.sweeps.test_sweep import QUIET

JOB = '''
import functools
from collections import namedtuple
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import parts
from parts import far

SCALE = 2.0
TABLE = {"a": np.array([1.0, 2.0]), "names": {"x", "y", "z"}}
Point = namedtuple("Point", "x y")


@dataclass(frozen=True)
class Load:
    peak: float = 4e8
    marks: list = field(default_factory=list)

    def rise(self):
        return self.peak / 8.0


def helper(x):
    return inner(x) + 1.0


def inner(x):
    return 3.0 * x


def closing(exponent):
    def power(x):
        return x**exponent

    return power


power = closing(2.0)
half = functools.partial(pow, 0.5)


@functools.lru_cache(None)
def kept(x):
    return x + 5.0


class Solver(Load):
    tolerance = 1e-3

    @staticmethod
    def solved(x):
        return x - 7.0


def work(row, shift=1.5, *, gain=1.0):
    """A sentence."""
    x = row["x"] * SCALE + shift + gain + TABLE["a"].sum()
    more = [near(x) for near in (helper, power, kept, Solver.solved) if near]
    read = float(Path("input.txt").read_text())
    here = Load().rise() + Point(1.0, 2.0).x + half(2.0)
    return {"y": sum(more) + read + here + far(x) + parts.constant + (lambda z: z + 0.25)(x)}


def unrelated(x):
    return 10.0
'''
PARTS = "from deeper import offset\n\nconstant = 8.0\n\n\ndef far(x):\n    return x + offset()\n"
DEEPER = "BASE = 4.0\n\n\ndef offset():\n    return BASE\n"
FILES = {"job.py": JOB, "parts.py": PARTS, "deeper.py": DEEPER, "input.txt": "0.5\n"}
#: What is changed into what, in which file.
EDITS = {
    "a constant": ("job.py", "SCALE = 2.0", "SCALE = 2.5"),
    "an entry of an array": ("job.py", "[1.0, 2.0]", "[1.0, 2.5]"),
    "an element of a set": ("job.py", '"z"}', '"w"}'),
    "a number in the function": ("job.py", "z + 0.25", "z + 0.75"),
    "an operator": ("job.py", "here = Load().rise() +", "here = Load().rise() -"),
    "a helper": ("job.py", "inner(x) + 1.0", "inner(x) + 2.0"),
    "a helper of a helper": ("job.py", "3.0 * x", "4.0 * x"),
    "a default": ("job.py", "shift=1.5", "shift=1.6"),
    "a default by name": ("job.py", "gain=1.0", "gain=2.0"),
    "a value closed over": ("job.py", "closing(2.0)", "closing(3.0)"),
    "an argument of a partial": ("job.py", "partial(pow, 0.5)", "partial(pow, 0.6)"),
    "a decorated function": ("job.py", "x + 5.0", "x + 6.0"),
    "a default of a class": ("job.py", "peak: float = 4e8", "peak: float = 5e8"),
    "a factory of a class": ("job.py", "default_factory=list", "default_factory=tuple"),
    "a method": ("job.py", "/ 8.0", "/ 9.0"),
    "a constant of a class": ("job.py", "tolerance = 1e-3", "tolerance = 1e-4"),
    "a static method": ("job.py", "x - 7.0", "x - 8.0"),
    "a base of a class": ("job.py", "Solver(Load)", "Solver(Point)"),
    "a function from another file": ("parts.py", "x + offset", "x - offset"),
    "a constant taken from a module": ("parts.py", "constant = 8.0", "constant = 9.0"),
    "a constant of a file's import": ("deeper.py", "BASE = 4.0", "BASE = 5.0"),
}
#: Changes after which the rows need not be run again.
HARMLESS = {
    "a comment": ("job.py", "SCALE = 2.0", "SCALE = 2.0  # of the scene"),
    "empty lines": ("job.py", "SCALE = 2.0", "\n\n\nSCALE = 2.0"),
    "another function": ("job.py", "return 10.0", "return 11.0"),
    "the order of a set": ("job.py", '{"x", "y", "z"}', '{"z", "y", "x"}'),
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


def kept(folder, work, rows):
    """Jobs of rows, and which of them a journal has."""
    each = jobs_of(work, rows, 0)
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
    edit(place, file, before, after)
    assert (Dependencies(anew()).digest != digest) == (change in EDITS)
    edit(place, file, after, before)
    assert Dependencies(anew()).digest == digest
    anew()({"x": 1.0})


def test_a_key_does_not_change_as_a_function_runs(place):
    work = anew()
    digest = Dependencies(work).digest
    for x in range(100):
        work({"x": float(x)})
    assert Dependencies(work).digest == digest


def test_a_changed_input_file_runs_the_rows_that_name_it_again(place):
    (place / "a.txt").write_text("1")
    rows = [{"x": 1.0, "file": "a.txt"}, {"x": 1.0, "file": "b.txt"}, {"x": 1.0, "file": "none"}]
    journal, each, known = kept(place, anew(), rows)
    assert known == [False, False, False]
    for job in each:
        journal.write(job, run_job(lambda row: {"y": 1.0}, job.row))
    assert kept(place, anew(), rows)[2] == [True, True, True]
    (place / "a.txt").write_text("2")
    # What the job has written itself is no input that has changed.
    (place / "b.txt").write_text("3")
    assert kept(place, anew(), rows)[2] == [False, True, True]
    (place / "a.txt").write_text("1")
    (place / "input.txt").write_text("0.75")
    assert kept(place, anew(), rows)[2] == [False, False, False]


def test_a_row_that_lacked_a_file_is_run_again_when_the_file_is_there(place):
    rows = [{"x": 1.0, "file": "mesh.msh"}]
    journal, (job,), _ = kept(place, anew(), rows)
    journal.write(job, run_job(lambda row: {}, job.row)._replace(error="no file mesh.msh"))
    assert kept(place, anew(), rows)[2] == [True]
    (place / "mesh.msh").write_text("mesh")
    assert kept(place, anew(), rows)[2] == [False]


SAY = """
import os, sys
sys.dont_write_bytecode = True
from taichi_dem.kit.sweeps.job import jobs_of
if __name__ == "__main__":
    print(jobs_of(work, [{"x": 1.0}], 0)[0].digest)
"""


def test_a_key_is_that_of_any_other_process_and_of_a_script_that_is_run(place):
    (place / "job.py").write_text(JOB + SAY)
    say = "import job; print(job.jobs_of(job.work, [{'x': 1.0}], 0)[0].digest)"
    said = set()
    for seed, line in (("1", ["job.py"]), ("2", ["-c", say]), ("3", ["-c", say])):
        options = {"capture_output": True, "text": True, "check": True, "cwd": place}
        environment = users_environment(PYTHONPATH=f"{ROOT}:{place}", PYTHONHASHSEED=seed)
        said.add(subprocess.run([sys.executable, *line], env=environment, **options).stdout)
    assert len(said) == 1 and len(said.pop().strip()) == 24


HIDDEN = """
import threading

LOCK = threading.Lock()


def work(row):
    import parts

    with LOCK, open("input" + ".txt") as file:
        name = __import__("deeper")
        return {"y": float(file.read()) + parts.constant}
"""


def test_what_cannot_be_seen_is_said(place):
    assert Dependencies(anew()).unseen == ("files whose names work computes, by read_text",)
    (place / "job.py").write_text(HIDDEN)
    assert set(Dependencies(anew()).unseen) == {
        "what work runs or imports by __import__",
        "files whose names work computes, by open",
        "what work imports when it is run, by way of parts",
        "the value of LOCK, a lock",
    }
    digest = Dependencies(anew()).digest
    edit(place, "parts.py", "constant = 8.0", "constant = 9.0")
    assert Dependencies(anew()).digest != digest


def test_a_sweep_says_what_its_rows_do_not_notice(tmp_path):
    table = sweep(jobs.counted, {"x": [3], "folder": [str(tmp_path)]}, workers=1, **QUIET)
    assert table.unseen == ("files whose names counted computes, by listdir",)


def test_a_record_with_a_changed_digit_is_not_believed(tmp_path):
    journal, (job,) = (
        Journal(tmp_path, "tests.sweeps.jobs:squared"),
        jobs_of(jobs.squared, [{"x": 3}], 0),
    )
    journal.write(job, run_job(jobs.squared, job.row))
    (path,) = (tmp_path / "jobs").iterdir()
    text = path.read_text()
    for before, after in (('"square": 9', '"square": 8'), ('"error": ""', '"error": "x"')):
        assert text.count(before) == 1
        path.write_text(text.replace(before, after))
        assert journal.read([job]) == {}
    path.write_text(text)
    assert journal.read([job])[job.digest].values["square"] == 9


def test_jobs_that_an_older_version_kept_are_run_again_and_it_is_said(tmp_path):
    (tmp_path / "sweep.json").write_text(json.dumps({"function": "tests.sweeps.jobs:squared"}))
    with pytest.warns(UserWarning, match="^finished jobs in .* are run again: an older version"):
        Journal(tmp_path, "tests.sweeps.jobs:squared")
    Journal(tmp_path, "tests.sweeps.jobs:squared")


def test_values_of_any_kind_have_a_digest_or_are_named(place):
    (place / "job.py").write_text(
        "import enum, fractions, datetime, re, collections, pathlib\nimport numpy as np\n"
        "from ca_damper import Automaton\n"
        "class Colour(enum.Enum):\n    RED = 1\n"
        "loop = [1]\nloop.append(loop)\n"
        "deep = []\nfor _ in range(5000):\n    deep = [deep]\n"
        "ALL = [Colour.RED, fractions.Fraction(1, 3), datetime.date(2020, 1, 1), re.compile('a'),\n"
        "    collections.OrderedDict(a=1), collections.deque([1]), pathlib.Path('a'), 10**5000,\n"
        "    np.float32(0.1), np.random.default_rng(1), Automaton(), loop, slice(1), range(3)]\n"
        "def work(row):\n    return {'y': len(ALL)}\n"
        "def nested(row):\n    return {'y': len(deep)}\n"
    )
    first, again = Dependencies(anew()), Dependencies(anew())
    assert first.digest == again.digest and first.unseen == ()
    assert Dependencies(sys.modules["job"].nested).unseen == ("values that are nested too deeply",)
    sys.modules["job"].ALL[9].random()
    assert Dependencies(sys.modules["job"].work).digest != first.digest
