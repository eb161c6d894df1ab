"""Sweeps in local processes: same bits, nothing lost, and what is refused."""

import errno
import functools
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from taichi_dem import InputError, sweep
from taichi_dem.kit import files
from taichi_dem.kit.sweeps import local
from taichi_dem.kit.sweeps.job import jobs_of, run_job
from taichi_dem.kit.sweeps.journal import Journal
from taichi_dem.kit.sweeps.rows import checked_rows
from taichi_dem.kit.sweeps.table import SweepTable
from tests.processes import users_environment
from tests.scenes import ROOT
from tests.sweeps import jobs

QUIET = {"progress": None}


def serial(function, table, seed=0):
    """The same table by a plain loop in this process."""
    rows = checked_rows(table)
    each = jobs_of(function, rows, seed)
    return SweepTable(each, [run_job(function, job.row) for job in each], "seed" in rows[0])


def assert_same_bits(one, other):
    """All columns but the provenance agree, in order, name, type and bits."""
    assert list(one) == list(other)
    for name in one:
        assert one[name].dtype == other[name].dtype
        assert one[name].tobytes() == other[name].tobytes(), name
    assert one.digest == other.digest


@pytest.fixture(scope="module")
def by_loop(tmp_path_factory):
    """Rows of the damper's job and their table by a loop."""
    folder = tmp_path_factory.mktemp("loop")
    return folder, serial(jobs.damper, jobs.damper_rows(folder))


def test_a_process_that_is_killed_loses_nothing_and_bits_are_those_of_a_loop(by_loop):
    folder, table = by_loop
    found = sweep(jobs.damper, jobs.damper_rows(folder, killed=True), workers=2, **QUIET)
    assert_same_bits(found, table)
    assert np.isfinite(table["rms_m"]).all() and len(set(table["rms_m"])) == 8


def test_provenance_is_apart_and_names_what_computed(by_loop):
    table = serial(jobs.squared, [{"x": 1}, {"x": 2}])
    assert list(table) == ["x", "square", "word", "error"]
    assert list(table.provenance) == ["seed", "version", "commit", "machine", "seconds"]
    assert (table.provenance["seconds"] > 0.0).all()
    assert all(table.provenance["machine"]) and all(table.provenance["commit"])
    # Frozen: results that are kept belong to these seeds.
    assert table.provenance["seed"].tolist() == [1234797308, 778162986]
    assert serial(jobs.squared, [{"x": 1}], seed=7).provenance["seed"][0] != 1234797308


def test_a_row_gets_its_seed_and_a_worker_has_one_thread():
    found = sweep(jobs.where, {"x": [1, 2, 3]}, workers=1, seed=5, **QUIET)
    assert found["threads"].tolist() == [1, 1, 1] and len(set(found["pid"])) == 1
    assert found["pid"][0] != os.getpid()
    given = serial(jobs.squared, {"x": [1, 2], "seed": [9, 9]})
    assert given["seed"].tolist() == given.provenance["seed"].tolist() == [9, 9]


def test_a_second_call_runs_what_is_missing_or_changed(tmp_path):
    folder, out = tmp_path / "marks", tmp_path / "out"
    folder.mkdir()
    rows = [{"x": x, "folder": str(folder)} for x in range(4)]
    first = sweep(jobs.counted, rows[:3], workers=1, out=out, **QUIET)
    again = sweep(jobs.counted, rows[:3], workers=1, out=out, **QUIET)
    assert_same_bits(first, again)
    assert jobs.marks(folder) == [0, 1, 2]
    # A file that is damaged, such as by a full disk, does not count.
    next((out / "jobs").iterdir()).write_text('{"values": {')
    changed = [*rows[:2], {"x": 7, "folder": str(folder)}, rows[3]]
    last = sweep(jobs.counted, changed, workers=1, out=out, **QUIET)
    assert len(jobs.marks(folder)) in (5, 6) and last["square"].tolist() == [0, 1, 49, 9]
    assert (out / "results.csv").read_text().startswith("x,folder,square,word,error,seed,version")


def test_a_sweep_that_is_killed_goes_on_to_the_same_bits(tmp_path):
    folder, out = tmp_path / "marks", tmp_path / "out"
    folder.mkdir()
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
    rows = [{"x": x, "folder": str(folder)} for x in range(60)]
    assert len(list((out / "jobs").iterdir())) > 0
    found = sweep(jobs.counted, rows, workers=1, out=out, **QUIET)
    assert_same_bits(found, serial(jobs.squared, rows))


def test_failures_are_rows_and_only_what_may_end_otherwise_is_run_again(tmp_path):
    how = ["well", "input", "diverged", "bug", "killed", "text", "leaves", "no file"]
    found = sweep(jobs.bad, {"how": how}, workers=2, out=tmp_path, **QUIET)
    assert found["how"].tolist() == how
    assert np.array_equal(found["x"], [1.0, *7 * [np.nan]], equal_nan=True)
    assert found["error"].tolist() == [
        "",
        "sand must be dry, got wet",
        "the run diverged at 1 s",
        "KeyError: 'not there'",
        "its process was lost 3 times, the last time by SIGKILL",
        "the function of a sweep must return a dict, got 'text'",
        "its process was lost 3 times, the last time by exit code 79",
        r"no file \udc80\0",
    ]
    assert len(list((tmp_path / "jobs").iterdir())) == 5


def test_no_exception_of_a_row_ends_its_process_or_the_others():
    found = sweep(jobs.bad, {"how": jobs.RAISED}, workers=1, **QUIET)
    assert found["error"].tolist() == jobs.SAID


def test_results_that_no_table_holds_are_sentences():
    found = serial(jobs.odd, {"how": ["list", "name", "key", "none"]})
    assert found["error"].tolist() == [
        "result x must be a number or text, got [1.0]",
        *(
            "a result must have a name that is no column of the table and none of error, version, "
            f"commit, machine, seconds, got {name}"
            for name in ("'how'", "1")
        ),
        "the function of a sweep must return a dict, got None",
    ]


def test_ctrl_c_keeps_what_is_finished(tmp_path):
    def interrupt(progress):
        if progress.done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(jobs.squared, {"x": range(50)}, workers=1, out=tmp_path, progress=interrupt)
    assert len(list((tmp_path / "jobs").iterdir())) == 2


def test_a_folder_that_fills_up_is_a_sentence_and_keeps_what_is_finished(tmp_path, monkeypatch):
    replace, written = os.replace, []

    def fills_up(source, target):
        if "jobs" in str(target):
            written.append(target)
            if len(written) == 3:
                raise OSError(errno.ENOSPC, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(files.os, "replace", fills_up)
    with pytest.raises(InputError, match=r"^cannot write .*: No space left on device; 2 finished"):
        sweep(jobs.squared, {"x": range(9)}, workers=1, out=tmp_path, **QUIET)
    assert len(list((tmp_path / "jobs").glob("*.json"))) == 2
    assert not list((tmp_path / "jobs").glob(".*"))


def test_a_folder_of_another_sweep_is_refused(tmp_path):
    Journal(tmp_path, "tests.sweeps.jobs:squared")
    with pytest.raises(InputError, match=r"of tests.sweeps.jobs:counted, got .*jobs:squared$"):
        sweep(jobs.counted, {"x": [1]}, workers=1, out=tmp_path, **QUIET)
    (tmp_path / "sweep.json").write_text("[]")
    with pytest.raises(InputError, match=r"sweep.json must say whose sweep the folder holds"):
        sweep(jobs.squared, {"x": [1]}, workers=1, out=tmp_path, **QUIET)


@pytest.mark.parametrize("value", [0, -1, 1.5, True, "2", 1025, None.__class__])
def test_workers_out_of_range_are_refused(value):
    with pytest.raises(InputError, match="workers must be a whole number from 1 to 1024"):
        sweep(jobs.squared, {"x": [1]}, workers=value, **QUIET)


def test_more_workers_than_processes_start_is_a_sentence_and_ends_those_that_run(monkeypatch):
    made, start = [], local.multiprocessing.context.SpawnProcess.start

    def full(process):
        if len(made) == 2:
            raise OSError(errno.EMFILE, "Too many open files")
        start(process)
        made.append(process)

    monkeypatch.setattr(local.multiprocessing.context.SpawnProcess, "start", full)
    with pytest.raises(InputError, match=r"^workers must be so few .*, got: Too many open files$"):
        sweep(jobs.squared, {"x": range(9)}, workers=5, **QUIET)
    assert len(made) == 2 and not any(process.is_alive() for process in made)


@pytest.mark.parametrize("seed", [-1, 2**63 + 1, 0.5, "0", None])
def test_seeds_out_of_range_are_refused(seed):
    with pytest.raises(InputError, match="seed must be a whole number from 0 to"):
        sweep(jobs.squared, {"x": [1]}, seed=seed, **QUIET)


def test_functions_that_processes_cannot_import_are_refused():
    def local(row):
        return {}

    for function in (local, lambda row: {}, functools.partial(jobs.squared), 3, None):
        with pytest.raises(InputError, match=r"^function must be .*, got "):
            sweep(function, {"x": [1]}, **QUIET)


def test_a_script_without_its_guard_ends_in_one_sentence(tmp_path):
    text = (
        "from taichi_dem import sweep\n\ndef f(row):\n    return {}\n\n"
        "try:\n    sweep(f, {'x': [1]}, workers=1)\nexcept ValueError as error:\n    print(error)\n"
    )
    (tmp_path / "script.py").write_text(text)
    line = [sys.executable, "script.py"]
    environment = users_environment(PYTHONPATH=ROOT)
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.stderr == "" and done.returncode == 0
    assert done.stdout == (
        'the call of sweep must stand below if __name__ == "__main__": in the script\n'
    )


def test_a_file_that_starts_taichi_when_it_is_imported_is_refused(tmp_path):
    text = (
        "from taichi_dem import runtime, sweep\n\nruntime.start(threads=2)\n\n"
        "def f(row):\n    return {}\n\nif __name__ == '__main__':\n    try:\n"
        "        sweep(f, {'x': [1]}, workers=1)\n"
        "    except ValueError as error:\n        print(error)\n"
    )
    (tmp_path / "script.py").write_text(text)
    line = [sys.executable, "script.py"]
    environment = users_environment(PYTHONPATH=ROOT)
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.stdout.startswith("Taichi must run on one thread in a worker of a sweep, got 2: ")


def test_table_writes_csv_and_gives_pandas(tmp_path):
    table = serial(jobs.squared, {"x": [1, 2]})
    table.write_csv(tmp_path / "a.csv", provenance=False)
    assert (tmp_path / "a.csv").read_text() == "x,square,word,error\n1,1,x is 1,\n2,4,x is 2,\n"
    assert "2 rows, 4 columns" in repr(table)
    pandas = pytest.importorskip("pandas")
    frame = table.to_pandas(provenance=True)
    assert isinstance(frame, pandas.DataFrame) and list(frame)[:5] == [*table, "seed"]
