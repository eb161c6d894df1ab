"""Costs of effects are those of the same states: what is frozen goes on as its run would."""

import numpy as np
import pytest

from _effects import WARM, FrozenScene
from _threads import thread_job
from taichi_dem import CONCRETE, Scene, Simulation, Uniform, effects
from taichi_dem.mesh.shapes import bar

pytestmark = pytest.mark.experiment


def test_a_frozen_scene_goes_on_with_the_bits_of_its_run_as_often_as_it_is_asked():
    """A bar whose end is pulled until it breaks."""
    drive = effects.PrescribedMotion("right", (2.0, 1.0, 0.0), 900.0)
    laws = effects.Softening(), effects.ShearSlip(), effects.BondDamping()
    scene = Scene(bar(0.2, 0.1, (2, 1, 1)), CONCRETE, [*laws, effects.Fixed("left"), drive])
    method, starts = Uniform(1e-7), (500, 3000)
    states = FrozenScene(scene, method).states_of_run([n * method.dt0 for n in starts])
    frozen = FrozenScene(scene, method, states, substeps=5)
    run = Simulation(scene, method)
    for k, start in enumerate(starts):
        run.advance_to(start + WARM + 5)
        for _ in range(2):
            assert frozen.seconds(k) > 0.0
            for name, values in run.state.motion().items():
                assert np.array_equal(frozen.simulation.state.motion()[name], values), name
            broken = run.state.broken()
            assert np.array_equal(frozen.simulation.state.broken(), broken)
    assert run.report().broken_faces > 0


def test_a_block_is_stepped_by_one_method_after_another():
    """All fields are cleared between two, those of the copy in memory too."""
    found = thread_job("", (2, 1, 1), ["explicit_limited", "implicit"], 1, steps=2, repeats=1)
    for one in found.values():
        assert one["bodies"] == 12 and one["bandwidth"] > 0.0
