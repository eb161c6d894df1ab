"""Particles in a container at rest lose energy, come to rest, and know no left and right."""

import numpy as np
import pytest

from ca_damper.automaton import ACCOUNTINGS
from ca_damper.lattice import HELD
from tests.ca_automaton.shaken import Shaken
from tests.paper import paper

GRAVITY, MASS, WIDTH = 10.0, 0.2e-3, 6e-3
PARTICLES = [1, 10, 50, 100, 159]


@pytest.mark.parametrize("accounting", ACCOUNTINGS)
def test_energy_never_rises_by_more_than_a_hundredth(accounting):
    """From one step to the next, in shares of the energy at the start."""
    seeds = np.repeat([1, 2, 3], len(PARTICLES))
    box = Shaken(paper(accounting=accounting), PARTICLES * 3, seeds, traced=20000).run(20000)
    energy = box.traces()[:, :, 3]
    assert np.all(np.diff(energy, axis=0).max(axis=0) <= 0.01 * energy[0])
    assert np.all(energy[-1] < energy[0])


def test_with_static_contact_all_are_held_at_the_end():
    """Nothing moves, and every particle stands on the floor or on another."""
    box = Shaken(paper(), [*PARTICLES, 160], amplitude=0.0).run(30000)
    kind, speed, travelled = box.state()
    assert list((kind == HELD).sum(axis=1)) == [*PARTICLES, 160]
    assert not speed.any() and not travelled.any()
    for scene in kind:
        held = np.flatnonzero(scene == HELD)
        assert np.all(scene[held - 1] >= 7)


@pytest.mark.parametrize("accounting", ["landing", "landing+ejection"])
def test_without_static_contact_a_heap_only_trembles(accounting):
    """The energy in motion is below 2 % of the start's: what gravity adds, blows take again."""
    box = Shaken(paper(accounting=accounting), PARTICLES, traced=40000).run(40000)
    moving = 0.5 * MASS * (box.state()[1] ** 2).sum(axis=1)
    assert np.all(moving < 0.02 * box.traces()[0, :, 3])


@pytest.mark.parametrize("dt", [1.19e-3, 1e-3, 3e-4, 1e-5])
@pytest.mark.parametrize("accounting", ACCOUNTINGS)
def test_no_step_below_the_limit_blows_up(accounting, dt):
    """No particle gets faster than the fall through the box: v^2 = 2 g h, and g dt for each of the
    few steps by which a fall is seen late. Any dt < width / v_max.
    """
    box = Shaken(paper(accounting=accounting), PARTICLES, dt=dt)
    for _ in range(20):
        box.run(round(min(0.05, 500 * dt) / dt))
        assert box.state()[1].max() <= np.sqrt(2 * GRAVITY * 16 * WIDTH) + 4 * GRAVITY * dt


@pytest.mark.parametrize("accounting", ["landing+ejection", "all"])
def test_left_and_right_are_alike_in_the_mean(accounting):
    """Mean horizontal position over 400 seeds is the middle, within 4 of its standard errors.

    Shaken, so that pairs meet and deflect all the time; positions at the end of three cycles.
    """
    seeds = 400
    box = Shaken(paper(accounting=accounting), [40] * seeds, np.arange(seeds), amplitude=20e-3)
    kind = box.run(5000).state()[0][:, :-1]
    present = (kind != 6) & (kind != 7)
    columns = box.geometry.column_and_row(np.arange(kind.shape[1]))[0]
    means = (present * columns).sum(axis=1) / present.sum(axis=1)
    error = means.std() / np.sqrt(seeds)
    assert error < 0.05
    assert abs(means.mean() - 4.5) < 4 * error
