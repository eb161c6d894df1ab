"""Starting and stopping Taichi, each in a process of its own."""

import json
import os
import subprocess
import sys
import time

import pytest

from tests.scenes import ROOT

_SCRIPT = """
import json
from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, runtime
from taichi_dem.mesh.shapes import pair

said = {}

def refused(name, call):
    try:
        call()
        said[name] = ""
    except InputError as error:
        said[name] = str(error)

refused("not started", lambda: Simulation(Scene(pair(), CONCRETE), Uniform()))
refused("unknown", lambda: runtime.start(arch="gpu"))
refused("no threads", lambda: runtime.start(threads=0))
refused("threads text", lambda: runtime.start(threads="2"))
runtime.cuda_present = lambda: False
refused("no cuda", lambda: runtime.start(arch="cuda"))
said["before"] = runtime.settings() is None
first = runtime.start(threads=1)
said["same"] = runtime.start(threads=1) is first
refused("other", lambda: runtime.start(threads=2))
simulation = Simulation(Scene(pair(), CONCRETE), Uniform())
said["session"] = runtime.session() is not None
runtime.stop()
said["after"] = runtime.settings() is None
refused("stopped", lambda: simulation.advance_to(1))
second = runtime.start(threads=2)
said["threads"] = [first.threads, second.threads]
refused("older session", lambda: simulation.advance_to(1))
again = Simulation(Scene(pair(), CONCRETE), Uniform())
again.advance_to(1)
said["time"] = again.time_s
print(json.dumps(said))
"""


def answers(tmp_path, text=_SCRIPT, **environment):
    """What a script says as JSON, run without HOME and with a misleading TI_ARCH."""
    script = tmp_path / "script.py"
    script.write_text(text)
    variables = {k: v for k, v in os.environ.items() if k != "HOME"}
    variables.update(PYTHONPATH=ROOT, TI_ARCH="cuda", **environment)
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, cwd=tmp_path, env=variables
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return json.loads(done.stdout.splitlines()[-1])


def test_sessions_start_once_and_say_why_they_refuse(tmp_path):
    said = answers(tmp_path)
    assert "call runtime.start() first" in said["not started"]
    assert "arch must be one of cpu, cuda, got 'gpu'" in said["unknown"]
    assert "from 1 to 1024, got 0" in said["no threads"]
    assert "from 1 to 1024, got '2'" in said["threads text"]
    assert "no CUDA device answers here" in said["no cuda"]
    assert said["before"] and said["same"] and said["after"]
    assert "already runs" in said["other"] and "call stop()" in said["other"]
    assert "not started" in said["stopped"] or "has been stopped" in said["stopped"]
    assert "has been stopped" in said["older session"]
    assert said["threads"] == [1, 2]
    assert said["time"] == 1e-8


_SILENT_START = """
import json
from taichi_dem import CONCRETE, Scene, Simulation, Uniform, runtime
from taichi_dem.mesh.shapes import pair

runtime.start(threads=1)
Simulation(Scene(pair(), CONCRETE), Uniform()).advance_to(1)
print(json.dumps("done"))
"""


@pytest.mark.parametrize("age_s, removed", [(3600.0, True), (0.0, False)])
def test_only_a_lock_left_by_a_killed_process_is_removed(tmp_path, age_s, removed):
    lock = tmp_path / "ticache.lock"
    lock.touch()
    left_at = time.time() - age_s
    os.utime(lock, (left_at, left_at))
    answers(tmp_path, _SILENT_START, TI_OFFLINE_CACHE_FILE_PATH=str(tmp_path))
    assert lock.exists() != removed
    # With the lock free, the next process finds this one's kernels compiled.
    assert bool(list(lock.parent.glob("*.tic"))) == removed


def test_kernels_reach_the_cache_though_a_class_that_has_them_is_still_referred_to(tmp_path):
    held = "from typing import Optional\nfrom taichi_dem.stability.step_control import FixedStep\n"
    script = held + "kept = Optional[FixedStep]\n" + _SILENT_START
    answers(tmp_path, script, TI_OFFLINE_CACHE_FILE_PATH=str(tmp_path))
    assert list(tmp_path.glob("*.tic"))


_THREADS = """
import json, sys, threading
from taichi_dem import runtime
from taichi_dem.kit.runtime import ti

begun, got, init, stdout = [], [], ti.init, sys.stdout
ti.init = lambda *given, **more: (begun.append(1), init(*given, **more))
together = threading.Barrier(4)

def start():
    together.wait()
    got.append(runtime.start(threads=1))

threads = [threading.Thread(target=start) for _ in range(4)]
[one.start() for one in threads]
[one.join() for one in threads]
assert sys.stdout is stdout
print(json.dumps([len(begun), len(got), len(set(map(id, got)))]))
"""


def test_threads_that_start_it_at_once_start_it_once(tmp_path):
    assert answers(tmp_path, _THREADS) == [1, 4, 1]
