"""No bit depends on the order of the scan or of the particles, or on what else is in a batch."""

import numpy as np
import pytest
import taichi as ti

from ca_damper import Automaton
from tests.ca_automaton.shaken import Shaken
from tests.damper import paper
from tests.equivalence.test_digests import digest

TRAVERSALS = "list", "scan"
SHAKEN = {"amplitude": 24e-3, "traced": 1200}
RULES = pytest.mark.parametrize("rules", [paper, Automaton], ids=["paper", "place"])


def bits(box, scene=slice(None)):
    """State and trace of a run."""
    return [rows[scene] for rows in (*box.state(), box.traces().swapaxes(0, 1))]


def equal(one, other):
    return all(map(np.array_equal, one, other))


def test_list_and_scan_agree():
    """Impulses, carried mass, momentum, energy and state, at every step."""
    particles = [1, 20, 60, 159]
    runs = [bits(Shaken(paper(traversal=t), particles, **SHAKEN).run(1200)) for t in TRAVERSALS]
    assert equal(*runs)


def test_rules_of_place_have_the_bits_that_they_had():
    """Before pairs that cannot meet were told apart without divisions and roots."""
    made = Shaken(Automaton(), [1, 20, 60, 159], **SHAKEN).run(1200)
    assert digest([*made.state(), made.traces()]) == "43ee53b492984f08"


@RULES
def test_neighbours_in_the_batch_change_nothing(rules):
    """A scene alone, and the same row as the third of five other scenes."""
    alone = bits(Shaken(rules(), 40, seed=7, **SHAKEN).run(1200), 0)
    among = Shaken(rules(), [10, 159, 40, 40, 80], seed=[7, 7, 7, 8, 9], **SHAKEN).run(1200)
    assert equal(alone, bits(among, 2))
    assert not equal(alone, bits(among, 3))


@ti.kernel
def shuffle(cells: ti.template(), number: ti.template(), order: ti.types.ndarray(ti.i32, ndim=1)):
    for k in order:
        cells[0, k] = ti.cast(order[k], ti.i16)
        number[0, order[k]] = ti.cast(k, ti.i16)


@RULES
def test_order_of_the_particles_changes_nothing(rules):
    """The list shuffled every 100 steps."""
    straight = bits(Shaken(rules(), 60, **SHAKEN).run(1200))
    mixed = Shaken(rules(), 60, **SHAKEN)
    draw = np.random.default_rng(1)
    listed = mixed.device.cells.traversal
    for _ in range(12):
        order = draw.permutation(mixed.in_use(listed.cells)[0, :60]).astype(np.int32)
        shuffle(listed.cells, listed.number, order)
        mixed.run(100)
    assert equal(straight, bits(mixed))
