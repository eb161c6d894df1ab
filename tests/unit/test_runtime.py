"""Starting and stopping Taichi, each in a process of its own."""

import json
import os
import subprocess
import sys

from tests.scenes import ROOT

_SCRIPT = """
import json
from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, runtime
from taichi_dem.mesh_shapes import pair

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
runtime._cuda_present = lambda: False
refused("no cuda", lambda: runtime.start(arch="cuda"))
said["before"] = runtime.settings() is None
first = runtime.start(threads=1)
said["same"] = runtime.start(threads=1) is first
refused("other", lambda: runtime.start(threads=2))
simulation = Simulation(Scene(pair(), CONCRETE), Uniform())
said["generation"] = runtime.generation()
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
