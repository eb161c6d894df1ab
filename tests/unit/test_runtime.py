"""Starting and stopping Taichi, each in a process of its own."""

import os
import subprocess
import sys

import pytest

from tests.scenes import ROOT

PRELUDE = """
import os
from taichi_dem import InputError, Simulation, Scene, CONCRETE, Uniform, runtime
from taichi_dem.mesh_shapes import pair
def refused(call):
    try:
        call()
    except InputError as error:
        print(error)
    else:
        raise SystemExit("not refused")
"""


def run(code, **environment):
    """Standard output of a fresh Python that runs the code; fails on any other noise."""
    variables = {**os.environ, "PYTHONPATH": ROOT, **environment}
    variables = {name: value for name, value in variables.items() if value is not None}
    path = [sys.executable, "-c", PRELUDE + code]
    done = subprocess.run(path, capture_output=True, text=True, env=variables, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def test_import_and_start_print_nothing_even_without_home():
    assert run("runtime.start(threads=1)", HOME=None) == ""


def test_starting_twice_is_fine_with_the_same_settings_and_refused_with_others():
    out = run(
        "first = runtime.start(threads=1)\n"
        "assert runtime.start(threads=1) == first\n"
        "refused(lambda: runtime.start(threads=2))"
    )
    assert "threads=1" in out
    assert "threads=2" in out


def test_nothing_is_built_before_the_start():
    out = run("refused(lambda: Simulation(Scene(pair(), CONCRETE), Uniform()))")
    assert "runtime.start()" in out


def test_a_simulation_of_a_stopped_session_says_so():
    out = run(
        "runtime.start(threads=1)\n"
        "old = Simulation(Scene(pair(), CONCRETE), Uniform())\n"
        "runtime.stop()\n"
        "runtime.start(threads=1)\n"
        "refused(lambda: old.advance_to(1))"
    )
    assert "stopped" in out


@pytest.mark.parametrize(
    ("call", "word"),
    [
        ("runtime.start(arch='metal')", "'metal'"),
        ("runtime.start(threads=0)", "got 0"),
        ("runtime.start(threads=1.5)", "got 1.5"),
    ],
)
def test_unknown_settings_are_refused(call, word):
    assert word in run(f"refused(lambda: {call})")


def test_cuda_is_refused_where_there_is_none():
    """Taichi itself would fall back to the CPU without a word."""
    if os.path.exists("/dev/nvidia0"):
        pytest.skip("there is a CUDA device here")
    done = subprocess.run(
        [sys.executable, "-c", PRELUDE + "refused(lambda: runtime.start(arch='cuda'))"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": ROOT},
        cwd=ROOT,
    )
    assert done.returncode == 0
    assert "no CUDA device" in done.stdout


def test_the_environment_does_not_choose_the_architecture():
    """TI_ARCH overrules the argument of ti.init; the package takes it away."""
    out = run("print(runtime.start(threads=1).arch)", TI_ARCH="vulkan")
    assert out.strip() == "cpu"
