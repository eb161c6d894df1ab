"""A kept row is used again only where its row, source and versions are as they were."""

import importlib
import sys

import pytest

from taichi_dem import InputError
from taichi_dem.kit.sweeps.jobs import jobs_of
from taichi_dem.kit.sweeps.table import checked_rows

SOURCE = "def work(row):\n    return {'y': row['x']}\n"


@pytest.fixture
def digest(tmp_path, monkeypatch):
    """Digest of one row of a function in a file of the user, by text of the file and options."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def found(text=SOURCE, x=1.0, seed=0, version=""):
        (tmp_path / "users_job.py").write_text(text)
        work = importlib.import_module("users_job").work
        (job,) = jobs_of(work, [{"x": x}], seed, version)
        return job.digest

    yield found
    sys.modules.pop("users_job", None)


def test_a_digest_changes_with_the_row_its_seed_the_source_and_the_version_alone(digest):
    others = {"text": SOURCE + "X = 1\n", "x": 2.0, "seed": 1, "version": "of 28 November"}
    each = [digest(), *(digest(**{name: value}) for name, value in others.items())]
    assert len(set(each)) == 5 and digest() == each[0]


def test_a_table_has_numbers_where_cells_are_numbers_and_text_elsewhere(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("x, name, day\n1, NA, 2024_01\n2.5, b, 2024_02\n")
    assert checked_rows(path) == [
        {"x": 1.0, "name": "NA", "day": "2024_01"},
        {"x": 2.5, "name": "b", "day": "2024_02"},
    ]


@pytest.mark.parametrize(
    "text",
    ["", "x\n", "x,x\n1,2\n", "x,y\n1,\n", "x,y\n1\n", "x\n1,2\n", "x,\n1,2\n", "error\n1\n"],
)
def test_a_table_with_a_gap_or_a_bad_header_is_refused(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(InputError):
        checked_rows(path)
