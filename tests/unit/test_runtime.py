"""Taichi starts once in a process, stops, starts anew, and finds its compiled kernels again.

What a device lacks, refuses or loses is one sentence.
"""

import json
import os
import subprocess
import sys
import time

import pytest
import taichi as ti
from taichi._snode.fields_builder import FieldsBuilder

from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform
from taichi_dem.kit import backend
from taichi_dem.kit.allocation import CapacityError, FieldTree, assign, values
from taichi_dem.kit.taichi_patches.prepared_launch import PreparedLaunch
from taichi_dem.mesh.shapes import bar
from tests.scenes import ROOT

_SCRIPT = """
import gc, json, os, sys, weakref
before = dict(os.environ), sys.excepthook
from taichi_dem import CONCRETE, InputError, Scene, Simulation, Uniform, runtime
from taichi_dem.mesh.shapes import pair

said = {"untouched": (dict(os.environ), sys.excepthook) == before}
made = lambda: Simulation(Scene(pair(), CONCRETE), Uniform())

def refused(name, call):
    try:
        call()
    except InputError as error:
        said[name] = str(error)

refused("not started", made)
first = runtime.start(threads=1)
said["same"] = runtime.start(threads=1) is first
refused("other", lambda: runtime.start(threads=2))
engine = weakref.ref(made().engine)
gc.collect()
said["kept"] = [engine() is not None]
simulation = made()
runtime.stop()
second = runtime.start(threads=2)
said["threads"] = [first.threads, second.threads]
refused("older session", lambda: simulation.advance_to(1))
del simulation
gc.collect()
said["kept"].append(engine() is not None)
again = made()
again.advance_to(1)
said["time"] = again.time_s
print(json.dumps(said))
"""


def run(text, **environment):
    """A program in a process of its own."""
    variables = {**os.environ, "PYTHONPATH": ROOT, **environment}
    variables = {name: value for name, value in variables.items() if value is not None}
    line = [sys.executable, "-c", text]
    return subprocess.run(line, capture_output=True, text=True, env=variables)


def answers(text, **environment):
    """What a program says as JSON, run without HOME and with a misleading TI_ARCH."""
    done = run(text, **{"HOME": None, "TI_ARCH": "cuda", **environment})
    assert (done.returncode, done.stderr) == (0, "")
    return json.loads(done.stdout.splitlines()[-1])


def test_sessions_start_once_and_say_why_they_refuse():
    said = answers(_SCRIPT)
    assert "call runtime.start() first" in said["not started"]
    assert said["same"] and said["untouched"]
    assert "already runs" in said["other"] and "call stop()" in said["other"]
    assert "has been stopped" in said["older session"]
    assert said["kept"] == [True, False] and said["threads"] == [1, 2] and said["time"] == 1e-8


_SILENT_START = """
import json
from taichi_dem import runtime
from taichi_dem.kit.runtime import ti

runtime.start(threads=1)
ti.field(ti.f64, shape=1).fill(1.0)
print(json.dumps("done"))
"""


@pytest.mark.parametrize("age_s, removed", [(3600.0, True), (0.0, False)])
def test_only_a_lock_left_by_a_killed_process_is_removed(tmp_path, age_s, removed):
    lock = tmp_path / "ticache.lock"
    lock.touch()
    left_at = time.time() - age_s
    os.utime(lock, (left_at, left_at))
    answers(_SILENT_START, TI_OFFLINE_CACHE_FILE_PATH=str(tmp_path))
    assert lock.exists() != removed
    # With the lock free, the next process finds this one's kernels compiled.
    assert bool(list(lock.parent.glob("*.tic"))) == removed


@pytest.mark.parametrize("package", ["taichi_dem", "ca_damper"])
def test_importing_a_package_imports_nothing_that_few_runs_need(package):
    loaded = answers(f"import json, sys, {package}; print(json.dumps([*sys.modules]))")
    assert not {"scipy", "pandas", "matplotlib", "rich", "argparse"} & {*loaded}


@pytest.mark.skipif(backend.is_present("cuda"), reason="a CUDA device answers here")
def test_a_machine_without_a_device_is_told_what_it_lacks():
    """A loader of Vulkan that finds no driver stands for a machine without one."""
    program = 'from taichi_dem import runtime; runtime.start("gpu")'
    said = run(program, VK_ICD_FILENAMES=os.devnull).stderr.splitlines()[-1]
    assert "'gpu'" in said
    assert "no CUDA device and no Vulkan driver" in said


@pytest.mark.usefixtures("compiled_anew")
def test_a_scene_that_a_device_cannot_hold_is_refused_with_the_number_that_fits(monkeypatch):
    """Room for the whole tree, less a byte, is room for one body less."""
    scene = Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [])
    whole = Simulation(scene, Uniform(1e-8))
    most, bodies = whole.engine.tree.bytes - 1, whole.engine.capacity[0]
    monkeypatch.setattr(backend, "most_bytes", lambda: most)
    with pytest.raises(InputError, match=f"about {bodies - 1} bodies fit"):
        Simulation(scene, Uniform(1e-8))


class Lost:
    """A program, and a context of a launch, of a device that has gone."""

    def set_arg_int(self, place, value):
        """Take an argument."""

    def launch_kernel(self, compiled, context):
        """Find no device."""
        raise RuntimeError("CUDA_ERROR_LAUNCH_FAILED:\n unspecified launch failure")


def test_a_lost_device_is_told_with_what_to_do(monkeypatch):
    launch = PreparedLaunch(Lost(), None, Lost, [0], returns=True)
    monkeypatch.setattr(backend, "is_cpu", lambda: False)
    with pytest.raises(InputError, match=r"^the device no longer answers .*checkpoint, or"):
        launch([1])


def test_memory_that_a_device_refuses_is_told_with_its_size(monkeypatch):
    """Nothing of the tree is left: the next one is allocated."""

    def refuse(self, raise_warning):
        raise RuntimeError("out of memory")

    with monkeypatch.context() as change:
        change.setattr(FieldsBuilder, "finalize", refuse)
        with pytest.raises(CapacityError, match=r"^this needs .* GB, .*\(out of memory\): smaller"):
            with FieldTree("smaller"):
                ti.field(ti.f64, shape=1000)
    with FieldTree():
        field = ti.field(ti.f64, shape=3)
    assign(field, 2.0)
    assert values(field).tolist() == [2.0] * 3
