"""Scenes timed from the same states: the states are exact, and each scene keeps its own numbers."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, effects
from taichi_dem.kit.errors import InputError
from taichi_dem.mesh.shapes import bar
from taichi_dem.paired_cost import WARM, FrozenScene, paired_cost, states_of_run
from taichi_dem.timeline import NEVER
from tests.scenes import brisk_scene

METHOD = ImplicitDashpots(4e-7)
STEPS = (40, 75)


@pytest.fixture(scope="module")
def scene():
    return brisk_scene()


@pytest.fixture(scope="module")
def less(scene):
    """The scene without softening and contact."""
    gone = effects.Softening, effects.SphereContact, effects.Friction
    rest = [effect for effect in scene.effects if not isinstance(effect, gone)]
    return Scene(scene.mesh, scene.material, rest)


@pytest.fixture(scope="module")
def states(scene):
    return states_of_run(scene, METHOD, [n * METHOD.dt0 for n in STEPS])


def motion_of(frozen):
    return frozen.simulation.state.motion()


def test_a_frozen_scene_goes_on_with_the_bits_of_its_run_as_often_as_it_is_asked(scene, states):
    frozen = FrozenScene(scene, METHOD, states, substeps=5)
    run = Simulation(scene, METHOD)
    for k, start in enumerate(STEPS):
        run.advance_to(start + WARM)
        before = run.sweeps()
        run.advance_to(start + WARM + 5)
        assert frozen.counts[k][0] == (run.sweeps() - before) / 5
        for _ in range(2):
            assert frozen.seconds(k) > 0.0
            for name, values in run.state.motion().items():
                assert np.array_equal(motion_of(frozen)[name], values), name
            broken = run.state.broken_tick.to_numpy()
            assert np.array_equal(frozen.simulation.state.broken_tick.to_numpy(), broken)
    assert (broken != NEVER).sum() > 20


def test_a_scene_without_an_effect_begins_where_the_run_was(less, states):
    frozen = FrozenScene(less, METHOD, states, substeps=1)
    for begun, state in zip(frozen.states, states):
        frozen.memory.write(begun)
        for name in ("position", "velocity", "orientation", "angular_momentum"):
            found = motion_of(frozen)[name]
            assert np.array_equal(found, state.arrays[f"state.{name}"][: len(found)]), name
    assert not frozen.counts[:, 1:].any()


def test_parameters_of_a_scene_stay_its_own(scene, states):
    slippery = replace(CONCRETE, friction=0.0, contact_damping=1.0)
    frozen = FrozenScene(Scene(scene.mesh, slippery, scene.effects), METHOD, states, substeps=1)
    frozen.seconds(1)
    tables = frozen.simulation.tables
    assert tables.friction.law[0, 0] == 0.0 and tables.contact.law.to_numpy()[0, 1] == 1.0


def test_the_watch_for_missing_effects_is_that_of_the_scene(scene, less, states):
    """With all effects no limit is watched, without softening the tensile strength is."""
    limits = []
    for one in (scene, less):
        frozen = FrozenScene(one, METHOD, states, substeps=1)
        frozen.seconds(1)
        limits.append(frozen.simulation.state.limits.to_numpy()[0, 0])
    assert limits == [np.inf, CONCRETE.tensile_strength]


def test_costs_are_those_of_the_candidates_in_units_of_the_first(scene, less, states):
    candidates = {"all": scene, "less": less}
    found = paired_cost(candidates, states, METHOD, substeps=4, rounds=(3, 3))
    assert found["all"].timing.ratio == 1.0 and found["less"].timing.ratio > 0.0
    assert found["less"].pairs == found["less"].searches == 0.0 < found["all"].pairs
    assert found["less"].timing.rounds == 3
    by_name = {"all": states, "less": states[::-1]}
    again = paired_cost(candidates, by_name, METHOD, shares=(1, 3), substeps=4, rounds=(1, 1))
    # The mean over the states by their shares.
    frozen = FrozenScene(scene, METHOD, states, substeps=4)
    assert again["all"].pairs == pytest.approx((frozen.counts[0] + 3 * frozen.counts[1])[2] / 4)


def test_states_of_something_else_are_refused(scene, states):
    other = Scene(bar(0.1, 0.05, (3, 2, 2)), CONCRETE, [effects.BondDamping()])
    with pytest.raises(InputError, match="of the same mesh, got another size of"):
        FrozenScene(other, METHOD, states)
    surfaces = [effects.SphereContact(), effects.Friction()]
    with pytest.raises(InputError, match=r"with contact law sphere_contact .* own run"):
        FrozenScene(Scene(scene.mesh, CONCRETE, surfaces), METHOD, states)
    candidates = {"a": scene, "b": scene}
    with pytest.raises(InputError, match="states must be of"):
        paired_cost(candidates, {"a": states}, METHOD)
    with pytest.raises(InputError, match="as many for each candidate"):
        paired_cost(candidates, {"a": states, "b": states[:1]}, METHOD)


def test_a_scene_that_halts_is_refused(scene, states):
    slow = Scene(scene.mesh, CONCRETE, scene.effects, max_speed=1.0)
    with pytest.raises(InputError, match="must take 12 substeps from every state, took"):
        FrozenScene(slow, METHOD, states)
