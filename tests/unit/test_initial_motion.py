"""Initial velocities and spins as options of a scene: the bits of a motion that is set by hand."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import CONCRETE, Checkpoint, InputError, Scene, Simulation, Uniform, simulate
from taichi_dem.accuracy.job import Job
from taichi_dem.accuracy.runs import Runs
from taichi_dem.effects import SphereContact
from taichi_dem.goals import body_displacement
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.outcome import outcome_of
from taichi_dem.scene import outer_faces_warnings
from taichi_dem.simulate import run_simulation
from tests.bad_input.refusals import assert_refused
from tests.scenes import beside

BAR = bar(0.2, 0.1, (2, 1, 1))
CENTRE = BAR.points[BAR.tetrahedra].mean(axis=1)
COUNT, METHOD, UNTIL = BAR.body_count, Uniform(1e-7), 2e-6
ROWS = np.random.default_rng(3).uniform(-1.0, 1.0, (2, COUNT, 3))


def scene(**options):
    return Scene(BAR, CONCRETE, [], **options)


def grouped(**options):
    groups = {"a": [0, 1], "b": [1, 2]}
    return Scene(replace(BAR, body_groups=groups), CONCRETE, [], **options)


@pytest.fixture(scope="module")
def by_hand(taichi_session):
    """Result of a run whose motion was set before it."""
    simulation = Simulation(scene(), METHOD)
    simulation.state.set_motion(simulation.model.centre, velocity=ROWS[0], spin=ROWS[1])
    return run_simulation(simulation, until=UNTIL, samples=2, frames=1, progress=None)


def assert_same(result, other):
    for name in ("position", "velocity", "rotation"):
        first, second = (getattr(one.frames[-1], name) for one in (result, other))
        assert first.tobytes() == second.tobytes(), name
    for name, column in result.history.items():
        assert column.tobytes() == other.history[name].tobytes(), name


def test_a_moving_scene_has_the_bits_of_a_motion_set_by_hand(by_hand):
    moving = scene(velocity=lambda x: ROWS[0], spin=ROWS[1])
    options = {"method": METHOD, "until": UNTIL, "samples": 2, "frames": 1, "progress": None}
    assert_same(simulate(moving, **options), by_hand)
    again = simulate(pickle.loads(pickle.dumps(moving)), **options)
    assert_same(again, by_hand)
    assert again.report.energy_residual_fraction < 1e-3


def test_a_reset_begins_with_the_motion_of_its_scene(by_hand):
    simulation = Simulation(scene(), METHOD)
    simulation.advance_to(3)
    simulation.reset(scene(velocity=ROWS[0], spin=ROWS[1]))
    options = {"until": UNTIL, "samples": 2, "frames": 1, "progress": None}
    assert_same(run_simulation(simulation, **options), by_hand)
    simulation.reset(scene())
    assert not simulation.state.motion()["velocity"].any()


def test_a_checkpoint_belongs_to_the_motion_it_began_with(by_hand, tmp_path):
    moving, path = scene(velocity=ROWS[0], spin=ROWS[1]), tmp_path / "half.npz"
    options = {"method": METHOD, "samples": 2, "frames": 1, "progress": None}
    simulate(moving, until=UNTIL / 2, checkpoint=Checkpoint(path), **options)
    resumed = simulate(moving, until=UNTIL, resume=path, **options)
    assert resumed.frames[-1].position.tobytes() == by_hand.frames[-1].position.tobytes()
    for other in (scene(), scene(velocity=ROWS[0]), scene(velocity=-ROWS[0], spin=ROWS[1])):
        with pytest.raises(InputError, match="is of another initial motion"):
            simulate(other, until=UNTIL, resume=path, **options)


def test_twins_move_as_the_scene_does(by_hand):
    moving = scene(velocity=ROWS[0], spin=ROWS[1])
    job = Job(moving, UNTIL, body_displacement(0), 0.01, 0.95)
    runs = Runs(job, job.methods(), None)
    assert runs.value(0, twin=1) == pytest.approx(runs.value(0), rel=1e-6)
    alone = outcome_of(moving, METHOD, UNTIL)
    disturbed = outcome_of(moving, METHOD, UNTIL, disturbance=1e-12)
    np.testing.assert_allclose(disturbed.moved, alone.moved, rtol=1e-4, atol=1e-11)


def test_one_spin_turns_all_bodies_as_one_rigid_body():
    spin = np.array([0.0, 3.0, -4.0])
    motion = scene(velocity=(1.0, 0.0, 0.0), spin=spin).initial_motion
    expected = np.array([1.0, 0.0, 0.0]) + np.cross(spin, CENTRE - [0.1, 0.05, 0.05])
    np.testing.assert_allclose(motion["velocity"], expected, atol=1e-15)
    assert (motion["spin"] == spin).all()
    rows = scene(spin=np.tile(spin, (COUNT, 1))).initial_motion
    assert not rows["velocity"].any() and (rows["spin"] == spin).all()


def test_body_groups_move_and_turn_each_for_itself():
    two = placed_together({"a": (BAR, (0, 0, 0)), "b": (BAR, (1.0, 0, 0))})
    spin = np.array([0.0, 0.0, 5.0])
    made = Scene(two, CONCRETE, [], velocity={"a": (1, 0, 0)}, spin={"b": spin})
    expected = [1.0, 0.0, 0.0], np.cross(spin, CENTRE - [0.1, 0.05, 0.05])
    motion = made.initial_motion
    assert (motion["velocity"][:COUNT] == expected[0]).all() and not motion["spin"][:COUNT].any()
    np.testing.assert_allclose(motion["velocity"][COUNT:], expected[1], atol=1e-14)
    rows = np.repeat([[1.0, 0, 0], [0, 0, 0]], COUNT, axis=0)
    alike = Scene(two, CONCRETE, [], velocity=rows, spin={"b": spin}).initial_motion
    assert alike["velocity"].tobytes() == motion["velocity"].tobytes()


def test_a_scene_keeps_its_motion_for_another_mesh_and_at_rest_has_none():
    falls = scene(velocity=lambda x: np.stack([0 * x[:, 0], -x[:, 0], 0 * x[:, 0]], axis=1))
    longer = replace(falls, mesh=bar(0.4, 0.1, (4, 1, 1)))
    assert longer.initial_motion["velocity"].shape == (2 * COUNT, 3)
    assert not scene().initial_motion and not scene(velocity=(0, 0, 0)).initial_motion
    assert not falls.initial_motion["velocity"].flags.writeable


REFUSED = {
    "number": (lambda: scene(velocity=3.0), "velocity must be three numbers", "3.0"),
    "words": (lambda: scene(velocity="fast"), "velocity must be", "'fast'"),
    "two": (lambda: scene(spin=(1.0, 2.0)), "spin must be", "(1.0, 2.0)"),
    "NaN": (lambda: scene(velocity=(0.0, np.nan, 0.0)), "velocity must be", "nan"),
    "flags": (lambda: scene(velocity=(True, False, True)), "velocity must be", "True"),
    "other rows": (lambda: scene(velocity=np.ones((5, 3))), f"each of {COUNT} bodies", "1."),
    "function": (lambda: scene(spin=lambda x: x[0]), "spin must be", f"{COUNT} bodies"),
    "no group": (lambda: scene(velocity={"a": (1, 0, 0)}), "mesh has no body group 'a'"),
    "group of faces": (lambda: scene(velocity={"left": (1, 0, 0)}), "'left' (left is a group of"),
    "no vector": (lambda: grouped(spin={"a": 3.0}), "spin['a'] must be three finite", "3.0"),
    "in two": (lambda: grouped(spin={"a": (1, 0, 0), "b": (1, 0, 0)}), "got body 1 in a and in b"),
    "fast": (lambda: scene(velocity=(2e4, 0, 0)), "velocity must be at most max_speed", "20000"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_motion_that_is_none_is_refused(case):
    call, *words = REFUSED[case]
    assert_refused(call, *words)


@pytest.mark.parametrize(
    ("first", "second", "shift", "expected"),
    [
        ((5, 0, 0), (0, 0, 0), [3.0, 0, 0], True),
        ((5, 0, 0), (-5, 0, 0), [3.0, 0, 0], True),
        ((-5, 0, 0), (0, 0, 0), [3.0, 0, 0], False),
        ((5, 0, 0), (5, 0, 0), [3.0, 0, 0], False),
        ((5, 0, 0), (0, 0, 0), [3.0, 1.0, 0], False),
        ((0, 0, 0), (0, 0, 0), [3.0, 0, 0], False),
    ],
)
def test_parts_that_fly_towards_each_other_are_told_that_they_may_meet(
    first, second, shift, expected
):
    rows = np.repeat([first, second], COUNT, axis=0)
    made = Scene(beside(BAR, BAR, shift), CONCRETE, [], velocity=rows)
    assert bool(outer_faces_warnings(made)) == expected
    touching = Scene(made.mesh, CONCRETE, [SphereContact()], velocity=rows)
    assert not outer_faces_warnings(touching)
