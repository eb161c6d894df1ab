"""A kept row is used again only where all that its result depends on is as it was."""

import importlib
import sys

import pytest

from taichi_dem.kit.sweeps.dependencies import digest_of_sources
from taichi_dem.kit.sweeps.jobs import Journal, jobs_of, run_job
from tests.sweeps import jobs

FILES = {
    "job.py": "from parts import far\ndef work(row):\n    return {'y': far(row['x'])}\n",
    "parts.py": "from deeper import BASE\ndef far(x):\n    return x + BASE\n",
    "deeper.py": "BASE = 4.0\n",
    "beside.py": "BASE = 4.0\n",
}
#: What is changed, and whether the rows have to be run again.
EDITS = {"job.py": True, "parts.py": True, "deeper.py": True, "beside.py": False}


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder of the user, in which the files of a job stand."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    yield tmp_path
    for name in ("job", "parts", "deeper"):
        sys.modules.pop(name, None)


def kept(folder, rows):
    """A journal, jobs of rows, and which of them it has."""
    each = jobs_of(importlib.import_module("job").work, rows, 0)
    journal = Journal(folder / "out", "job:work")
    found = journal.read(each)
    return journal, each, [job.digest in found for job in each]


@pytest.mark.parametrize("file", EDITS)
def test_a_changed_source_runs_rows_again_and_one_taken_back_does_not(place, file):
    rows = [{"x": 1.0}]
    journal, (job,), _ = kept(place, rows)
    journal.write(job, run_job(importlib.import_module("job").work, job.row))
    for text, again in (("\nX = 1\n", EDITS[file]), ("", False)):
        (place / file).write_text(FILES[file] + text)
        assert kept(place, rows)[2] == [not again]


def test_a_source_that_a_package_imports_from_its_own_place_counts(tmp_path, monkeypatch):
    """By ``from .parts import far``; the text of both files is in the digest."""
    monkeypatch.syspath_prepend(str(tmp_path))
    files = {
        "__init__": "",
        "job": FILES["job.py"].replace("parts", ".parts"),
        "parts": "far = abs",
    }
    (tmp_path / "packed").mkdir()
    for name, text in files.items():
        (tmp_path / "packed" / f"{name}.py").write_text(text)
    work = importlib.import_module("packed.job").work
    digests = [digest_of_sources(work)]
    for name in ("job", "parts"):
        (tmp_path / "packed" / f"{name}.py").write_text(files[name] + "\nX = 1\n")
        digests.append(digest_of_sources(work))
    for name in ("packed.job", "packed.parts", "packed"):
        del sys.modules[name]
    assert len(set(digests)) == 3


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
