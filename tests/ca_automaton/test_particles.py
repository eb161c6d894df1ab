"""No rule makes or loses a particle, puts two into a cell, or one into a wall."""

import numpy as np

from ca_damper.automaton.lattice import DOWN_LEFT, DOWN_RIGHT, EMPTY, WALL
from tests.ca_automaton.shaken import Shaken
from tests.paper import paper

PARTICLES = [0, 1, 2, 10, 50, 120, 159, 160]


def test_particles_stay():
    """Shaken by four cells at 6 Hz for a cycle and a half: walls as they were, each listed once."""
    box = Shaken(paper(), PARTICLES, dt=2e-4, amplitude=24e-3).run(1250)
    kind, geometry = box.state()[0], box.geometry
    inside = geometry.inside(*geometry.column_and_row(np.arange(geometry.cells)))
    assert np.array_equal(kind[:, :-1] == WALL, np.broadcast_to(~inside, kind[:, :-1].shape))
    present = (kind != EMPTY) & (kind != WALL)
    assert list(present.sum(axis=1)) == PARTICLES
    cells = box.in_use(box.device.cells.traversal.cells)
    for s, count in enumerate(PARTICLES):
        assert sorted(cells[s, :count]) == list(np.flatnonzero(present[s]))


def claimed(seeds):
    """Whether cells are taken, the left and the right and the one that both claim, (seeds, 3)."""
    automaton = paper(accounting="landing+ejection", start=((3, 9), (5, 9)))
    box = Shaken(automaton, [2] * len(seeds), seed=seeds)
    geometry = box.geometry
    left, right = geometry.cell_of(3, 9), geometry.cell_of(5, 9)
    target = geometry.neighbours()[left, DOWN_RIGHT]
    assert target == geometry.neighbours()[right, DOWN_LEFT]
    kind, _, travelled = box.state()
    kind[:, left], kind[:, right] = DOWN_RIGHT, DOWN_LEFT
    travelled[:, [left, right]] = 6e-3
    box.put(box.device.cells.kind, kind)
    box.put(box.device.cells.travelled, travelled)
    return box.run(1).state()[0][:, [left, right, target]] != EMPTY


def test_one_of_two_claimants_moves_and_each_as_often():
    """Fig. 5(b): two particles due for one cell in 1024 seeds; 5 sigma of a fair coin."""
    stands = np.concatenate([claimed(seeds) for seeds in np.arange(1024).reshape(16, 64)])
    assert np.all(stands.sum(axis=1) == 2) and np.all(stands[:, 2])
    assert abs(stands[:, 0].sum() - 512) < 5 * np.sqrt(1024) / 2
