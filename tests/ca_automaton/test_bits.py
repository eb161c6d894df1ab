"""No bit depends on the order of the scan, on threads, launches or what else is in a batch."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest
import taichi as ti

from ca_damper.automaton import ACCOUNTINGS
from tests.ca_automaton.shaken import Shaken
from tests.paper import paper

SHAKEN = {"amplitude": 24e-3, "traced": 1200}


def equal(one, other, scene=slice(None), other_scene=slice(None)):
    """Whether state and trace of two runs agree to the last bit."""
    pairs = zip(
        [*one.state(), one.traces().swapaxes(0, 1)], [*other.state(), other.traces().swapaxes(0, 1)]
    )
    return all(np.array_equal(a[scene], b[other_scene]) for a, b in pairs)


@pytest.mark.parametrize("accounting", ACCOUNTINGS)
def test_list_and_scan_agree(accounting):
    """Impulses, carried mass, momentum, energy and state, at every step."""
    particles = [1, 20, 60, 159]
    runs = [
        Shaken(paper(accounting=accounting, traversal=name), particles, **SHAKEN).run(1200)
        for name in ("list", "scan")
    ]
    assert equal(*runs)


@ti.kernel
def shuffle(cells: ti.template(), number: ti.template(), order: ti.types.ndarray(ti.i32, ndim=1)):
    for k in order:
        cells[0, k] = ti.cast(order[k], ti.i16)
        number[0, order[k]] = ti.cast(k, ti.i16)


def test_order_of_the_particles_changes_nothing():
    """The list shuffled every 100 steps."""
    straight = Shaken(paper(), 60, **SHAKEN).run(1200)
    mixed = Shaken(paper(), 60, **SHAKEN)
    draw = np.random.default_rng(1)
    listed = mixed.device.cells.traversal
    for _ in range(12):
        order = draw.permutation(mixed.in_use(listed.cells)[0, :60]).astype(np.int32)
        shuffle(listed.cells, listed.number, order)
        mixed.run(100)
    assert equal(straight, mixed)


def test_neighbours_in_the_batch_change_nothing():
    """A scene alone, and the same row as the third of five other scenes."""
    alone = Shaken(paper(), 40, seed=7, **SHAKEN).run(1200)
    among = Shaken(paper(), [10, 159, 40, 40, 80], seed=[7, 7, 7, 8, 9], dt=1e-4, **SHAKEN).run(
        1200
    )
    assert equal(alone, among, scene=0, other_scene=2)
    assert not equal(alone, among, scene=0, other_scene=3)


def test_length_of_launches_changes_nothing():
    """1200 steps at once, and in pieces."""
    whole = Shaken(paper(), [30, 90], **SHAKEN).run(1200)
    pieces = Shaken(paper(), [30, 90], **SHAKEN)
    for steps in (1, 2, 397, 800):
        pieces.run(steps)
    assert equal(whole, pieces)


def digest():
    """Of the state of eight shaken scenes."""
    box = Shaken(paper(), [5, 20, 35, 50, 65, 80, 120, 160], amplitude=24e-3).run(1500)
    return hashlib.sha256(b"".join(part.tobytes() for part in box.state())).hexdigest()


def test_threads_change_nothing():
    """One, two and three threads in processes of their own."""
    script = (
        "from taichi_dem import runtime; runtime.start(threads={}); "
        "from tests.ca_automaton.test_bits import digest; print(digest())"
    )
    seen = {
        subprocess.run(
            [sys.executable, "-c", script.format(threads)],
            capture_output=True,
            text=True,
            timeout=300,
            check=True,
        ).stdout
        for threads in (1, 2, 3)
    }
    assert seen == {digest() + "\n"}
