"""A batch of fillings of several sizes: each scene is as in a batch of its own."""

import re
from dataclasses import dataclass, field

import numpy as np
import pytest

from ca_damper import Automaton, Batch, Place, RigidMass, SceneTable, Spheres, film
from ca_damper.errors import InputError
from tests.damper import expected, paper

DT = {"Spheres": 2e-5}
SMALL = {"columns": 6, "rows": 9, "width": 4e-3, "particle_mass": 0.08e-3, "restitution": 0.5}
LARGE = {"columns": 13, "rows": 30, "particle_mass": 0.5e-3, "gravity": 9.0, "static_threshold": 2}
FLAT = {"width": 0.05, "height": 0.03, "diameter": 4e-3, "particle_mass": 0.1e-3, "young": 2e8}
HIGH = {"width": 0.07, "height": 0.2, "gravity": 7.0, "restitution": 0.9, "wall_friction": 0.1}
#: Three fillings, and the particles of each.
THREE = {
    "place": (
        [
            Automaton(Place(friction=0.1), **SMALL, start=((0, 0), (3, 8))),
            Automaton(start=((5, 2),)),
            Automaton(**LARGE, start=((12, 29), (0, 3), (7, 7))),
        ],
        [2, 1, 3],
    ),
    "paper": ([paper(**SMALL), paper(), paper(**LARGE)], [11, 50, 90]),
    "sizes": (
        [
            Spheres(**FLAT, sizes=((5, 4e-3), (4, 3e-3)), rotation=True),
            Spheres(sizes=((10, 5e-3), (20, 6e-3)), rotation=True),
            Spheres(**HIGH, sizes=((30, 4e-3), (20, 7e-3)), rotation=True),
        ],
        [9, 30, 50],
    ),
    "placed spheres": (
        [
            Spheres(**FLAT, start=((0.01, 0.01), (0.03, 0.02))),
            Spheres(start=((0.03, 0.02),)),
            Spheres(**HIGH, start=((0.01, 0.1), (0.02, 0.05), (0.05, 0.01))),
        ],
        [2, 1, 3],
    ),
    "rigid": ([RigidMass(), RigidMass(1e-3, gravity=3.0), RigidMass(1e-5)], [3, 20, 90]),
}


def started(name, rows):
    """A batch of scenes of these rows of THREE."""
    fillings, particles = THREE[name]
    number, amplitude = [particles[k] for k in rows], [(3e-3, 8e-3, 12e-3)[k] for k in rows]
    filling = fillings[rows[0]] if len(rows) == 1 else [fillings[k] for k in rows]
    dt = DT.get(type(fillings[0]).__name__, 1e-4)
    batch = Batch(filling, SceneTable(number, rows, dt, 6.0, amplitude), measured_cycles=1)
    with expected(batch):
        batch.start("rigid")
    return batch


def now_of(batch):
    """All that scenes show, a list a scene."""
    now = batch.sample()
    of_all = [batch.attempts(), *(now[name] for name in sorted(now))]
    shots = [batch.snapshot(s) for s in range(batch.count)]
    return [[*(one[s] for one in of_all), *shot.values()] for s, shot in enumerate(shots)]


def run(name, rows):
    """What scenes of these rows, shaken by three cycles, measure and end with, a list a scene."""
    batch = started(name, rows)
    record = batch.run(2, 1).record
    assert batch.report().momentum_error < 1e-9
    return [[mine, *shown] for mine, shown in zip(record, now_of(batch))]


def same_bits(one, other):
    return all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("name", THREE)
def test_each_scene_is_as_in_a_batch_of_its_filling_and_momentum_closes(name):
    together = run(name, [2, 0, 1])
    for mine, k in zip(together, (2, 0, 1)):
        assert same_bits(mine, *run(name, [k]))


def test_batches_that_live_at_once_have_an_engine_each_and_their_bits_as_alone(compilations):
    """Two batches in turns of 37 steps; of those that run alone a second one compiles nothing."""
    alone = []
    for k in (0, 1):
        compilations.clear()
        batch = started("placed spheres", [k])
        batch.advance(10 * 37)
        alone += now_of(batch)
        del batch
    assert compilations == []
    both = [started("placed spheres", [k]) for k in (0, 1)]
    for _ in range(10):
        for batch in both:
            batch.advance(37)
    assert both[0].engine is not both[1].engine
    assert all(same_bits(*now_of(batch), wanted) for batch, wanted in zip(both, alone))


def test_a_report_names_the_scene_nearest_to_its_bound_and_all_that_is_outside():
    fillings = [Automaton(), Automaton(width=2e-3, restitution=0.95, columns=60, rows=7)]
    batch = Batch(fillings, SceneTable([5, 60], 1, 1e-4, 6.0, 20e-3), mount="base")
    report = batch.report()
    assert report.step_bound == fillings[1].step_bound
    assert report.bound_taken == pytest.approx(1e-4 / 4e-4, rel=0.05)
    found = report.checked.outside
    assert any("60 grains" in one for one in found) and any("0.95" in one for one in found)


def table(count):
    return SceneTable(3, [*range(count)], 1e-4)


@pytest.mark.parametrize(
    ("fillings", "count", "words"),
    [
        ([Automaton()] * 2, 3, "filling must be one, or one for each of 3 scenes, got 2 fillings"),
        ([Automaton(), Spheres()], 2, "filling must be of one class, .* got Automaton and Spheres"),
        ([Automaton(), Automaton(gravity=(1.0, 9.8))], 2, "filling must .* that differ in gravity"),
        ([RigidMass(), 3], 2, "filling must be one such as Automaton()"),
        ([Automaton(), Automaton(columns=1, rows=2)], 2, "particles must .* from 0 to 2, got 3"),
    ],
)
def test_fillings_that_cannot_run_together_are_refused_in_a_sentence(fillings, count, words):
    with pytest.raises(InputError, match="^" + words.replace("()", re.escape("()"))):
        Batch(fillings, table(count))


def test_effects_that_are_negligible_in_some_scenes_alone_are_refused_in_a_sentence():
    some = [Spheres(), Spheres(friction=1e-7, wall_friction=1e-7)]
    with pytest.raises(InputError, match=r'^effects must be "listed" where "auto" finds other'):
        Batch(some, table(2), effects="auto")


@dataclass(frozen=True)
class Bounded(RigidMass):
    """A mass with an option that has no hash, and a bound of the step of its own."""

    option: object = field(default_factory=lambda: np.zeros(3))
    step_bound: object = None


@pytest.mark.parametrize("place", [0, 1])
def test_a_bound_that_one_of_the_fillings_has_is_told(place):
    fillings = [Bounded(), Bounded()]
    fillings[place] = Bounded(step_bound=(1e-3, "it says so"))
    assert Batch(fillings, table(2)).report().step_bound == (1e-3, "it says so")


def test_a_film_of_several_fillings_is_refused_before_it_runs():
    batch = Batch([RigidMass(), RigidMass(gravity=0.0)], table(2))
    batch.start()
    with pytest.raises(InputError, match=r"^filling must be the same in .* got 2 different ones"):
        film(batch, 3)
    assert batch.scene_steps == 0


def test_a_state_of_several_fillings_goes_on_to_the_same_bits():
    """Put aside while a batch of the same fillings in another order uses the engine."""
    first = started("place", [0, 1, 2])
    first.run(0, 1)
    aside, straight = first.aside(), first.run(0, 1).record
    del first
    started("place", [2, 1, 0]).run(0, 1)
    again = started("place", [0, 1, 2])
    again.take_up(aside)
    assert np.array_equal(again.run(0, 1).record, straight)
