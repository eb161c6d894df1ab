"""Gravity across the columns: grains fall to a side wall, lie there, stick and slide."""

import math

import numpy as np
import pytest

from ca_damper import Automaton, damper_map
from ca_damper.automaton.accounting import QUANTUM
from ca_damper.errors import InputError
from tests.ca_automaton.shaken import Shaken
from tests.damper import paper

G, HZ, DT, FRICTION = 9.8, 10.0, 1e-4, 0.5
LYING = Automaton(gravity=(G, 0.0))


def slider(level):
    """Loss and mass share of a body that Coulomb friction drags, by peak acceleration / g.

    It sticks below mu g. Where it slides all the time its velocity is a triangle of the slope mu g,
    and the force changes its sign where the triangle, pi mu / (2 level) high, meets the sine.
    """
    if level <= FRICTION:
        return 0.0, 1.0
    size, meets = 4.0 * FRICTION / (math.pi * level), math.pi * FRICTION / (2.0 * level)
    return size * math.sqrt(1.0 - meets**2), size * meets


def test_a_bed_sticks_and_slides_as_a_body_with_coulomb_friction():
    """Each change of the force is one step late at most: its phase by w dt, its size by 2 w dt."""
    levels = np.array([0.3, 1.0, 1.5, 2.0])
    amplitudes = levels * G / (2.0 * np.pi * HZ) ** 2
    run = {"transient_cycles": 20, "measured_cycles": 10, "dt": DT, "progress": None}
    made = damper_map(LYING, amplitudes=amplitudes, frequencies=HZ, particles=8, seeds=1, **run)
    found = np.column_stack([made.loss[0, 0, :, 0, 0], made.mass_share[0, 0, :, 0, 0]])
    assert found == pytest.approx(np.array([slider(x) for x in levels]), abs=4.0 * np.pi * HZ * DT)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_grain_falls_to_the_wall_that_gravity_pulls_to(way):
    """A second is ten bounces, after each of which a grain that leaves half its speed mostly lies.

    Its rise is (1 + 1/3) / 4 of a diameter in the mean, and exp(-1/3) of all rise less than one.
    """
    lying = Automaton(gravity=(way * G, 0.0), wall_restitution=0.5, start=((4, 8),))
    box = Shaken(lying, 1).run(10000)
    kinds = box.in_use(box.device.cells.kind)[0][: box.geometry.cells]
    (cell,) = np.nonzero(kinds == 0)[0]
    assert box.geometry.column_and_row(cell)[0] == (9 if way > 0.0 else 0)
    assert not box.in_use(box.device.cells.across).any()


def test_what_the_bed_gets_the_container_gives():
    """Sliding, stuck and thrown; drag and blows of a step are rounded to half a quantum each."""
    particles, steps = np.array([1, 8, 30]), 1200
    box = Shaken(LYING, particles, amplitude=24e-3, traced=steps).run(steps)
    impulse, momentum = box.traces()[:, :, 0], box.traces()[-1, :, 2]
    assert np.all(abs(impulse).sum(axis=0) > 1e-5)
    tolerance = particles * LYING.particle_mass * steps * 1.5 * QUANTUM
    assert np.all(abs(momentum + impulse.sum(axis=0)) < tolerance)


def test_gravity_is_a_number_that_compiles_nothing():
    tilted = Automaton(gravity=(5.0, 8.0)).structure.key
    assert tilted == LYING.structure.key != Automaton().structure.key
    assert Automaton(gravity=(0.0, 9.8)).structure.key == Automaton().structure.key


def test_the_paper_s_lattice_stands_along_gravity():
    with pytest.raises(InputError, match="gravity must be one number with rules Paper"):
        paper(gravity=(9.8, 0.0))
