"""By the rules of place grains meet, fall and bounce where and when discs would."""

import numpy as np
import pytest
import taichi as ti

from ca_damper.automaton import Automaton
from ca_damper.automaton.device import PAIRS
from ca_damper.automaton.place.contacts import (
    common_velocity,
    dragged,
    most_drag,
)
from tests.ca_automaton.shaken import Shaken

GRAVITY, WIDTH, MASS, DT = 10.0, 6e-3, 0.2e-3, 1e-4
EPS = np.finfo(float).eps
NUMBERS = ti.types.ndarray(dtype=ti.f64, ndim=1)


def kick(box, cell, across=0.0, up=0.0):
    """Give a velocity to the grain in a cell, (column, row), in all scenes."""
    number = box.geometry.cell_of(*cell)
    for field, value in ((box.device.cells.speed, up), (box.device.cells.across, across)):
        rows = box.in_use(field)
        rows[:, number] = value
        box.put(field, rows)


@ti.kernel
def carried_out(grains: NUMBERS, container: ti.f64, recoil: ti.f64, e: ti.f64) -> ti.f64:
    """Blows of grains of these velocities on the container; returns its velocity."""
    total, count = 0.0, grains.shape[0]
    for _ in range(1):
        for k in range(count):
            total += grains[k] - container
    after = common_velocity(container, total, count, recoil, e)
    for k in range(count):
        grains[k] = after - e * (grains[k] - container)
    return after


@ti.kernel
def rubbed(grains: NUMBERS, container: ti.f64, recoil: ti.f64, most: ti.f64):
    """Friction of grains on the side walls of the container."""
    count = grains.shape[0]
    for k in range(count):
        slip = grains[k] - container
        grains[k] -= dragged(slip, ti.min(most, most_drag(slip, count * recoil)))


def test_a_heap_comes_to_rest():
    """Heaps of any height in a container at rest: every grain held, the force is the weight."""
    particles = np.array([5, 30, 100, 160])
    box = Shaken(Automaton(), particles, dt=2e-4, traced=12500).run(12500)
    assert np.array_equal(box.in_use(box.device.resting.held), particles)
    carried, momentum = box.traces()[-1, :, 1], box.traces()[-1, :, 2]
    assert carried == pytest.approx(MASS * particles, rel=1e-12)
    assert not momentum.any()


def energy(grains, container, recoil):
    """Of grains of mass 1 and a container of mass 1 / recoil, twice."""
    return float((grains**2).sum() + container**2 / recoil)


def test_energy_never_grows_at_blows_of_any_mass():
    """On floor and ceiling and on side walls, with m / M up to 10 and up to 50 blows at once."""
    draw = np.random.default_rng(1)
    for _ in range(300):
        recoil, e = 10.0 ** draw.uniform(-4, 1), draw.uniform(0, 1)
        grains, container = draw.normal(size=draw.integers(1, 51)), draw.normal()
        for work in ("blows", "friction"):
            after = grains.copy()
            if work == "blows":
                moved = carried_out(after, container, recoil, e)
            else:
                rubbed(after, container, recoil, draw.uniform(0, 3))
                moved = container - recoil * (after - grains).sum()
            before = energy(grains, container, recoil)
            assert energy(after, moved, recoil) <= before * (1 + 100 * EPS)
            momentum = [v.sum() + c / recoil for v, c in ((grains, container), (after, moved))]
            assert momentum[0] == pytest.approx(momentum[1], abs=1e-12 * (1 + 1 / recoil) * 50)


def test_relative_speeds_of_blows_have_the_restitution():
    """Whatever the mass of the container, and whatever else lands in the step."""
    grains = np.array([-1.0, -0.4, 2.0])
    after = grains.copy()
    moved = carried_out(after, 0.3, 0.7, 0.75)
    assert after - moved == pytest.approx(-0.75 * (grains - 0.3), rel=1e-14)


def test_a_bounce_lower_than_a_cell_lands_after_2_v_over_g():
    """At 0.1 m/s, half a millimetre high."""
    box = Shaken(Automaton(start=((4, 0),)), 1, dt=DT, traced=500)
    kick(box, (4, 0), up=0.1)
    blows = np.flatnonzero(box.run(500).traces()[:, 0, 0])
    assert blows[0] * DT == pytest.approx(2 * 0.1 / GRAVITY, abs=1.5 * DT)


def test_rebounds_follow_theory_to_a_step():
    """A fall of 15 cells, impacts by the closed form: a blow is carried to its own time.

    The trace knows an impact to a step; the time within it, found as if the speed were constant, is
    wrong by g dt^2 / (2 v), less than a tenth of a step at the speeds here (0.4 m/s and more).
    """
    box = Shaken(Automaton(start=((4, 15),)), 1, dt=DT, traced=9000).run(9000)
    first = np.sqrt(2 * 15 * WIDTH / GRAVITY)
    expected = first * (1 + np.concatenate([[0], np.cumsum(2 * 0.75 ** np.arange(1, 5))]))
    found = (np.flatnonzero(box.traces()[:, 0, 0])[:5] + 1) * DT
    assert found == pytest.approx(expected, abs=1.1 * DT)


def test_side_walls_take_grains_along():
    """A column between both walls, without gravity: grains at rest end at the walls' speed."""
    grains = Automaton(start=((0, 8),), gravity=0.0, columns=1, rows=16)
    box = Shaken(grains, [1] * 8, seed=np.arange(8), dt=DT, amplitude=1.0, frequency=0.05)
    kick(box, (0, 8), across=2.0)
    box.run(1000)
    speed = box.in_use(box.device.cells.speed).sum(axis=1)
    wall = 2 * np.pi * 0.05
    assert np.all(speed > 0.5 * wall)
    assert np.all(speed <= wall)


def passages(columns, seeds):
    """Whether two grains have met before, while and after one passes the other, (3, seeds)."""
    start = ((columns[0], 1), (columns[1], 10))
    box = Shaken(Automaton(start=start, gravity=0.0), [2] * len(seeds), seed=seeds, dt=DT)
    kick(box, start[0], up=1.0)
    heights = box.geometry.centres(WIDTH)[[box.geometry.cell_of(*cell) for cell in start], 1]
    rise, met = heights[1] - heights[0], []
    for way in (rise - WIDTH, rise + WIDTH, rise + 2.0 * WIDTH):
        box.run(round(way / DT) + (1 if met else -1) - box.done)
        met.append(box.in_use(box.device.event_counts.events)[:, PAIRS] > 0)
    return np.array(met)


@pytest.mark.parametrize("columns", [(4, 5), (5, 4), (5, 6)])
def test_passing_grains_meet_with_probability_one_half(columns):
    """Two grains of neighbouring columns, alone: 1024 passages, four standard deviations.

    Either column may be the higher one, on either side. They meet only while one is less than a
    diameter higher than the other.
    """
    seeds = np.arange(1024).reshape(16, 64)
    met = np.concatenate([passages(columns, few) for few in seeds], axis=1).mean(axis=1)
    assert met[0] == 0.0
    assert met[1] == met[2] == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(1024))
