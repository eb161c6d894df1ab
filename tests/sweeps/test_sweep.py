"""Sweeps have the bits of a loop, here or on a cluster, and lose nothing that was finished.

A kept row is used again only where its row, source, versions and record are as they were.
"""

import importlib
import os
import signal
import subprocess
import sys
import time

import distributed
import numpy as np
import pytest

from taichi_dem import InputError, sweep
from taichi_dem.kit.sweeps.jobs import jobs_of
from taichi_dem.kit.sweeps.table import checked_rows
from tests.processes import users_environment
from tests.scenes import ROOT
from tests.sweeps import jobs

QUIET = {"progress": None}


@pytest.fixture(scope="module")
def looped(tmp_path_factory):
    """A folder, and the table of the damper's job by a loop."""
    folder = tmp_path_factory.mktemp("loop")
    table = jobs.by_loop(jobs.damper, jobs.damper_rows(folder))
    assert np.isfinite(table["rms_m"]).all() and len(set(table["rms_m"])) == 4
    return folder, table


def test_a_process_that_is_killed_loses_nothing_and_bits_are_those_of_a_loop(looped):
    folder, table = looped
    found = sweep(jobs.damper, jobs.damper_rows(folder, killed=True), workers=2, **QUIET)
    jobs.assert_same_bits(found, table)


@pytest.fixture(scope="module")
def client():
    """A cluster of two workers, one for all tests, as it takes seconds to start."""
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0"}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as made:
        yield made


def test_so_it_is_on_a_cluster_and_what_it_kept_is_used_here(looped, client, tmp_path):
    folder, table = looped
    rows, address = jobs.damper_rows(folder, killed=True), client.scheduler_info()["address"]
    found = sweep(jobs.damper, rows, client=address, out=tmp_path, **QUIET)
    jobs.assert_same_bits(found, table)
    written = {path: path.stat().st_mtime_ns for path in (tmp_path / "jobs").iterdir()}
    again = sweep(jobs.damper, rows, workers=1, out=tmp_path, **QUIET)
    jobs.assert_same_bits(again, table)
    assert written == {path: path.stat().st_mtime_ns for path in (tmp_path / "jobs").iterdir()}


def test_a_row_gets_its_seed_and_a_worker_has_one_thread():
    found = sweep(jobs.where, {"x": [1, 2, 3]}, workers=1, seed=5, **QUIET)
    assert found["threads"].tolist() == [1, 1, 1] and os.getpid() not in found["pid"].tolist()
    given = jobs.by_loop(jobs.squared, {"x": [1, 2], "seed": [9, 9]})
    assert given["seed"].tolist() == [9, 9]
    # Frozen: results that are kept belong to these seeds.
    seeds = jobs.by_loop(jobs.squared, {"x": [1, 2]})["seed"]
    assert seeds.tolist() == [1234797308, 778162986]


@pytest.fixture
def folders(tmp_path):
    """Where the runs leave their marks, and where results are kept."""
    (tmp_path / "marks").mkdir()
    return tmp_path / "marks", tmp_path / "out"


def test_a_second_call_runs_what_is_missing_or_changed(folders, client):
    folder, out = folders
    kept = {"client": client, "out": out, **QUIET}
    rows = [{"x": x, "folder": str(folder)} for x in range(4)]
    first = sweep(jobs.counted, rows[:3], **kept)
    again = sweep(jobs.counted, rows[:3], **kept)
    jobs.assert_same_bits(first, again)
    assert jobs.marks(folder) == [0, 1, 2]
    # A file that is damaged, such as by a full disk, does not count.
    next((out / "jobs").iterdir()).write_text('{"values": {')
    changed = [*rows[:2], {"x": 7, "folder": str(folder)}, rows[3]]
    last = sweep(jobs.counted, changed, **kept)
    assert len(jobs.marks(folder)) in (5, 6) and last["square"].tolist() == [0, 1, 49, 9]


def test_a_sweep_that_is_killed_goes_on_to_the_same_bits(folders):
    folder, out = folders
    program = (
        "from taichi_dem import sweep\nfrom tests.sweeps import jobs\n"
        f"rows = [{{'x': x, 'folder': {str(folder)!r}}} for x in range(2000)]\n"
        f"sweep(jobs.counted, rows, workers=1, out={str(out)!r}, progress=None)\n"
    )
    line = [sys.executable, "-c", program]
    first = subprocess.Popen(line, cwd=ROOT, env=users_environment(PYTHONPATH=ROOT))
    while len(list(folder.iterdir())) < 20:
        time.sleep(0.01)
    first.send_signal(signal.SIGKILL)
    first.wait()
    rows = [{"x": x, "folder": str(folder)} for x in range(25)]
    assert len(list((out / "jobs").iterdir())) > 0
    found = sweep(jobs.counted, rows, workers=1, out=out, **QUIET)
    jobs.assert_same_bits(found, jobs.by_loop(jobs.squared, rows))


def test_failures_are_rows_and_only_what_may_end_otherwise_is_run_again(tmp_path, client):
    how = ["well", "input", "diverged", "mute", "exits", "text", "leaves"]
    found = sweep(jobs.bad, {"how": how}, client=client, out=tmp_path, **QUIET)
    assert np.array_equal(found["x"], [1.0, *6 * [np.nan]], equal_nan=True)
    assert [bool(words) for words in found["error"]] == [False, *6 * [True]]
    assert found["error"][1] == "sand must be dry, got wet"
    assert found["error"][6].startswith("its process was lost 4 times")
    kept = {path.read_text() for path in (tmp_path / "jobs").iterdir()}
    assert len(kept) == 4


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
