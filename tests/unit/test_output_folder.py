"""One run at a time writes to a folder, and a run that is ended from outside leaves what it can."""

import os
import signal
import subprocess
import sys

import pytest

from taichi_dem import CONCRETE, At, Checkpoint, Collector, Scene, Uniform, simulate
from taichi_dem.kit.checkpoint import Interrupted
from taichi_dem.mesh.shapes import pair
from tests.bad_input.refusals import assert_refused
from tests.processes import users_environment
from tests.scenes import ROOT

HOLD = """
import sys
from taichi_dem.kit.files import claiming, output_folder
with claiming():
    output_folder(sys.argv[1])
    print("held", flush=True)
    sys.stdin.read()
"""


def program(text, *arguments):
    line = [sys.executable, "-c", text, *map(str, arguments)]
    options = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "cwd": ROOT}
    return subprocess.Popen(line, env=users_environment(), **options)


def test_the_second_run_in_a_folder_is_refused_until_the_first_has_been_killed(tmp_path):
    other, scene = program(HOLD, tmp_path), Scene(pair(), CONCRETE)
    assert other.stdout.readline() == "held\n"
    job = {"method": Uniform(1e-8), "until": 2e-8, "samples": 1, "progress": None}
    for more in ({"output": tmp_path}, {"checkpoint": Checkpoint(tmp_path / "run.npz")}):
        call = lambda: simulate(scene, **job, **more)  # noqa: B023, E731
        assert_refused(call, str(tmp_path), "another one is writing there")
    assert os.listdir(tmp_path) == []
    other.kill()
    other.communicate()
    simulate(scene, output=tmp_path, **job)
    assert "report.json" in os.listdir(tmp_path)


def test_a_signal_saves_the_run_which_goes_on_with_the_bits_of_one_never_stopped(tmp_path):
    def end(view):
        os.kill(os.getpid(), signal.SIGTERM)

    scene, path = (
        Scene(pair(), CONCRETE, [], velocity=(1, 0, 0), spin=(0, 0, 9)),
        tmp_path / "run.npz",
    )
    job = {"method": Uniform(1e-8), "until": 1e-6, "samples": 4, "progress": None}
    observers = [Collector(At((5e-7,)), end=end)]
    with pytest.raises(Interrupted, match="interrupted at t = "):
        simulate(scene, checkpoint=Checkpoint(path), observers=observers, **job)
    resumed, alone = simulate(scene, resume=path, **job), simulate(scene, **job)
    for name, column in alone.series.items():
        assert column.tobytes() == resumed.series[name].tobytes(), name
