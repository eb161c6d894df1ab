"""No rule makes or loses a particle, puts two into a cell, or one into a wall."""

import itertools

import numpy as np
import pytest

from ca_damper.automaton import ACCOUNTINGS
from ca_damper.automaton.accumulator import READINGS
from ca_damper.lattice import DOWN_LEFT, DOWN_RIGHT, EMPTY, WALL
from tests.ca_automaton.shaken import Shaken
from tests.paper import paper

PARTICLES = [0, 1, 2, 10, 50, 120, 159, 160]
PAIRS = [("both", "random"), ("both", "pairs_first"), ("one_sided", "random")]
EVERY = list(itertools.product(ACCOUNTINGS, PAIRS, READINGS))


def shaken(accounting, pairs, accumulator, traversal):
    """Every number of particles, shaken by four cells at 6 Hz for a cycle and a half."""
    options = {"pair_rule": pairs[0], "priority": pairs[1], "accumulator": accumulator}
    automaton = paper(accounting=accounting, traversal=traversal, **options)
    return Shaken(automaton, PARTICLES, dt=2e-4, amplitude=24e-3).run(1250)


def check(accounting, pairs, accumulator):
    """Count; walls as they were; list = scan to the last bit; each listed cell once."""
    listed = shaken(accounting, pairs, accumulator, "list")
    scanned = shaken(accounting, pairs, accumulator, "scan")
    kind = listed.state()[0]
    blank = listed.geometry.blank()
    assert np.array_equal(kind == WALL, np.broadcast_to(blank == WALL, kind.shape))
    present = (kind != EMPTY) & (kind != WALL)
    assert list(present.sum(axis=1)) == PARTICLES
    cells = listed.in_use(listed.device.cells.traversal.cells)
    for s, count in enumerate(PARTICLES):
        assert sorted(cells[s, :count]) == list(np.flatnonzero(present[s]))
    for one, other in zip(listed.state(), scanned.state()):
        assert np.array_equal(one, other)


@pytest.mark.parametrize("accounting", ACCOUNTINGS)
def test_particles_stay(accounting):
    check(accounting, ("both", "random"), "signed")


@pytest.mark.slow
@pytest.mark.parametrize("accounting, pairs, accumulator", EVERY)
def test_particles_stay_in_every_combination_of_options(accounting, pairs, accumulator):
    check(accounting, pairs, accumulator)


def test_one_of_two_claimants_moves_and_each_as_often():
    """Fig. 5(b): two particles due for one cell in 2000 seeds; 5 sigma of a fair coin."""
    automaton = paper(accounting="landing", start=((3, 9), (5, 9)))
    box = Shaken(automaton, [2] * 2000, seed=np.arange(2000))
    geometry = box.geometry
    left, right = geometry.cell_of(3, 9), geometry.cell_of(5, 9)
    target = geometry.neighbours()[left, DOWN_RIGHT]
    assert target == geometry.neighbours()[right, DOWN_LEFT]
    kind, _, travelled = box.state()
    kind[:, left], kind[:, right] = DOWN_RIGHT, DOWN_LEFT
    travelled[:, [left, right]] = 6e-3
    box.put(box.device.cells.kind, kind)
    box.put(box.device.cells.travelled, travelled)
    stands = box.run(1).state()[0][:, [left, right, target]] != EMPTY
    assert np.all(stands.sum(axis=1) == 2) and np.all(stands[:, 2])
    assert abs(stands[:, 0].sum() - 1000) < 5 * np.sqrt(2000) / 2


def test_start_draws_every_number_of_cells():
    """N from 0 to 160 cells, all at rest; another seed draws others."""
    box = Shaken(paper(), list(range(161)) * 2, seed=[1] * 161 + [2] * 161)
    kind, speed, _ = box.state()
    present = (kind != EMPTY) & (kind != WALL)
    assert list(present.sum(axis=1)) == list(range(161)) * 2
    assert not speed.any()
    assert not np.array_equal(kind[50], kind[161 + 50])


def test_start_favours_no_cell():
    """40 of 160 cells: each taken in a quarter of 2000 seeds, within 5 sigma of a binomial."""
    box = Shaken(paper(), [40] * 2000, seed=np.arange(2000))
    kind, inner = box.state()[0], box.geometry.blank() == EMPTY
    taken = ((kind != EMPTY) & (kind != WALL)).sum(axis=0)[inner][:-1]
    assert abs(taken - 500).max() < 5 * np.sqrt(2000 * 0.25 * 0.75)
