"""Particles in a container at rest lose energy, come to rest, and know no left and right."""

import numpy as np

from ca_damper.automaton.lattice import EMPTY, HELD, WALL
from tests.ca_automaton.shaken import Shaken
from tests.paper import paper

PARTICLES = [1, 10, 50, 100, 159]


def test_energy_never_rises_by_more_than_a_hundredth():
    """From one step to the next, in shares of the energy at the start."""
    seeds = np.repeat([1, 2, 3], len(PARTICLES))
    box = Shaken(paper(), PARTICLES * 3, seeds, traced=12000).run(12000)
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
        assert np.all(scene[held - 1] >= WALL)


def mean_columns(seeds):
    """Mean column of 40 particles after three cycles of shaking, in which pairs meet."""
    box = Shaken(paper(), [40] * len(seeds), seeds, amplitude=20e-3)
    kind = box.run(5000).state()[0][:, :-1]
    present = (kind != EMPTY) & (kind != WALL)
    columns = box.geometry.column_and_row(np.arange(kind.shape[1]))[0]
    return (present * columns).sum(axis=1) / present.sum(axis=1)


def test_left_and_right_are_alike_in_the_mean():
    """Mean horizontal position over 128 seeds is the middle, within 4 of its standard errors."""
    means = np.concatenate([mean_columns(seeds) for seeds in np.arange(128).reshape(2, 64)])
    error = means.std() / np.sqrt(len(means))
    assert error < 0.05
    assert abs(means.mean() - 4.5) < 4 * error
