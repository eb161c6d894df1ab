"""A CUDA device computes what a CPU does, up to rounding: it fuses products and sums."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from taichi_dem import runtime
from tests.scenes import ROOT

_RUN = """
import json, sys
from ca_damper import Automaton, Batch, SceneTable
from taichi_dem import ImplicitDashpots, Simulation, runtime
from tests.bar_blast import METHODS, bar_scene
runtime.start(sys.argv[1], threads=2)
said = {}
# The sweeps are counted: a residual beside its bound would make one more of them here or there.
METHODS["implicit"] = ImplicitDashpots(4e-7, sweeps=(10, 10))
for name, method in METHODS.items():
    simulation = Simulation(bar_scene(), method, "parallel")
    simulation.advance_to(int(2e-6 / method.dt0))
    said[name] = simulation.state.motion()["velocity"].ravel().tolist()
batch = Batch(Automaton(), SceneTable([50], 1, 1e-4, 6.0, 0.6e-3))
batch.start("empty")
# Before rounding decides another way of a grain: after 140 steps on an H200.
batch.advance(100)
said["automaton"] = batch.sample()["v"].tolist()
print(json.dumps(said))
"""
#: Of the largest velocity. Positions of 0.1 m are rounded by 1e-17 m, and the openings that drive
#: the bodies are a ten-millionth of a metre: a part in 1e10 of the force, in every step anew.
SAME = 1e-8


def velocities(arch):
    """Velocities [m/s] at the end of a run by every method, on an architecture."""
    line = [sys.executable, "-c", _RUN, arch]
    environment = {**os.environ, "PYTHONPATH": ROOT}
    done = subprocess.run(line, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.skipif(not runtime.cuda_present(), reason="no CUDA device answers here")
def test_cuda_computes_what_a_cpu_does():
    """|v_cuda - v_cpu| <= SAME max |v_cpu|, by every method and for the automaton."""
    here, there = velocities("cpu"), velocities("cuda")
    for name, expected in here.items():
        worst = np.abs(np.array(there[name]) - expected).max()
        assert worst <= SAME * np.abs(expected).max(), name
