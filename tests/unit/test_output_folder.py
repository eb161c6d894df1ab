"""Output folders: one run at a time, and nothing left of runs that were killed."""

import os
import platform
import signal
import subprocess
import sys
import time
from functools import partial

import numpy as np
import pytest

from taichi_dem import Checkpoint, ImplicitDashpots, Multirate, StepControl, Uniform, simulate
from taichi_dem.kit import files
from taichi_dem.kit.checkpoint import identity_of
from taichi_dem.kit.files import claiming, output_folder, renamed_when_done
from tests.bad_input.refusals import assert_refused
from tests.processes import users_environment
from tests.scenes import ROOT, brisk_scene

HOLD = """
import sys
from taichi_dem.kit.files import claiming, output_folder
with claiming():
    output_folder(sys.argv[1])
    print("held", flush=True)
    sys.stdin.read()
"""
KILLED = """
import os, sys
from taichi_dem.kit.files import renamed_when_done
with renamed_when_done(sys.argv[1]) as temporary:
    open(temporary, "w").write("half")
    os.kill(os.getpid(), 9)
"""


def program(text, *arguments):
    line = [sys.executable, "-c", text, *map(str, arguments)]
    options = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "cwd": ROOT}
    return subprocess.Popen(line, env=users_environment(), **options)


@pytest.fixture
def held(tmp_path):
    """A folder that another process has claimed, and the process."""
    other = program(HOLD, tmp_path / "out")
    assert other.stdout.readline() == "held\n"
    yield tmp_path / "out", other
    other.communicate()


def test_the_second_run_in_a_folder_is_refused_until_the_first_has_ended(held):
    folder, other = held
    job = {"method": Uniform(1e-8), "until": 2e-8, "samples": 1, "progress": None}
    for more in ({"output": folder}, {"checkpoint": Checkpoint(folder / "run.npz")}):
        call = lambda: simulate(brisk_scene(), **job, **more)  # noqa: B023, E731
        assert_refused(call, str(folder), "another one is writing there")
    assert os.listdir(folder) == []
    # However it ends.
    other.kill()
    other.wait()
    simulate(brisk_scene(), output=folder, **job)
    assert "report.json" in os.listdir(folder) or len(os.listdir(folder)) > 0


def test_runs_that_begin_at_once_do_not_take_each_others_test_file(held, monkeypatch):
    """The claim comes first: the second run writes nothing in the folder of the first."""
    monkeypatch.setattr("builtins.open", pytest.fail)
    with claiming():
        assert_refused(lambda: output_folder(held[0]), "another one is writing there")


def test_a_folder_that_may_be_written_to_and_not_be_read_will_do(tmp_path, monkeypatch):
    """An administrator may read everything, so the system's refusals are made here."""

    def refused(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.os, "open", refused)
    monkeypatch.setattr(files.os, "listdir", refused)
    with claiming():
        assert output_folder(tmp_path) == str(tmp_path)
        assert files._claims == {}


def test_a_folder_may_be_asked_for_again_by_its_own_run(tmp_path):
    with claiming(), claiming():
        assert output_folder(tmp_path / "a") == output_folder(tmp_path / "a")
        output_folder(tmp_path / "b")
        assert len(files._claims) == 2
    assert files._claims is None
    # Without a run nothing is claimed.
    output_folder(tmp_path / "a")
    assert files._claims is None


def test_what_a_killed_run_left_is_removed_and_nothing_else(tmp_path):
    killed = program(KILLED, tmp_path / "run.npz")
    killed.communicate()
    assert killed.returncode == -signal.SIGKILL
    assert len(os.listdir(tmp_path)) == 1
    # Those of a process that lives, and of another machine, may be at work.
    mine = [tmp_path / f".a.{files._HOST}-{os.getpid()}.part.csv", tmp_path / ".a.elsewhere-1.part"]
    for path in (*mine, tmp_path / ".part", tmp_path / "run.1.part"):
        path.write_text("x")
    before = set(os.listdir(tmp_path))
    output_folder(tmp_path)
    left = set(os.listdir(tmp_path))
    assert len(before - left) == 1 and {path.name for path in mine} <= left
    with renamed_when_done(tmp_path / "a.csv") as temporary:
        assert files._TEMPORARY.fullmatch(os.path.basename(temporary))
    assert platform.node()[:2] in temporary


NUMBERS = (
    (1e-7, np.float64(1e-7)),
    (2, 2.0),
    (np.int64(2), 2),
    (np.float32(0.5), 0.5),
    ((1, 2.0), [1.0, np.int8(2)]),
    (Uniform(1e-7), Uniform(np.float64(1e-7))),
    (ImplicitDashpots(1), ImplicitDashpots(1.0)),
    (Multirate(1e-8, 1), Multirate(np.float64(1e-8), 1.0)),
    ({"a": np.bool_(True)}, {"a": True}),
)
OTHERS = (1.0, np.nextafter(1.0, 2.0), True, None, "1.0", (1.0,), np.ones(1), np.ones(2), 2**60)
METHODS = (Uniform(1e-7), Uniform(1e-7, 1.0), Multirate(1e-7, 1.0), ImplicitDashpots(1e-7))


@pytest.mark.parametrize("pair", NUMBERS, ids=repr)
def test_an_equal_number_of_another_type_is_no_other_run(pair):
    assert identity_of(pair[0]) == identity_of(pair[1])


def test_what_differs_by_a_bit_is_another_run():
    made = (*OTHERS, 2**60 + 1, *METHODS, Uniform(1e-7, control=StepControl(safety=0.2)))
    assert len({identity_of(value) for value in made}) == len(made)


OTHERS = [pytest.param(name, marks=pytest.mark.slow) for name in ("SIGHUP", "SIGXCPU", "SIGUSR1")]


@pytest.mark.parametrize("name", ["SIGTERM", *OTHERS])
def test_a_batch_systems_signal_leaves_a_checkpoint_and_a_sentence(tmp_path, name):
    number = getattr(signal, name)
    line = [sys.executable, os.path.join(ROOT, "experiments", "blast_fracture.py")]
    line += ["--out", str(tmp_path), "--until", "1e-3", "--checkpoint-every", "50steps"]
    # A shell may have told it to ignore some, as nohup does.
    listens = partial(signal.signal, number, signal.SIG_DFL)
    options = {"stderr": subprocess.PIPE, "stdout": subprocess.DEVNULL, "text": True}
    run = subprocess.Popen(line, env=users_environment(), preexec_fn=listens, **options)
    started = time.time()
    while not (tmp_path / "checkpoint.npz").exists() and time.time() < started + 300:
        time.sleep(0.05)
    run.send_signal(number)
    said = run.communicate(timeout=300)[1]
    assert run.returncode == 128 + number, said
    assert len(said.splitlines()) == 1 and "interrupted at t =" in said and "--resume" in said
