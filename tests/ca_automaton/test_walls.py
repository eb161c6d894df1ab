"""The container's walls on the move: who stays in the room, who is pushed, when the heap lifts."""

import numpy as np
import pytest

from ca_damper.automaton.lattice import DOWN, UP
from tests.ca_automaton.shaken import Shaken
from tests.paper import paper

WIDTH, MASS, GRAVITY, DT = 6e-3, 0.2e-3, 10.0, 1e-4
AMPLITUDE, OMEGA = 24e-3, 2 * np.pi * 6.0


def displacement(step):
    """Of the container at the beginning of a step [m]."""
    return AMPLITUDE * np.sin(OMEGA * DT * step)


def test_a_particle_in_mid_air_stays_in_the_room():
    """Without gravity a particle at rest moves against the staircase round(x / 6 mm), +-4 cells."""
    automaton = paper(accounting="landing+ejection", gravity=0.0, start=((4, 8),))
    box = Shaken(automaton, 1, amplitude=AMPLITUDE)
    start = box.device.snapshot(0)["position"][0]
    for _ in range(40):
        box.run(50)
        stair = np.floor(displacement(box.done - 1) / WIDTH + 0.5)
        moved = box.device.snapshot(0)["position"][0] - start
        assert moved == pytest.approx([0.0, -stair * WIDTH], abs=1e-12)


def test_the_floor_pushes_what_lies_on_it():
    """Without gravity the first step of the staircase gives the floor's velocity and feels it.

    A heap of two: the upper one touches the lower, and is pushed with it. They face upwards, away
    from the floor, so that no blow comes first.
    """
    step = int(np.ceil(np.arcsin(0.5 * WIDTH / AMPLITUDE) / OMEGA / DT))
    start = ((4, 0), (4, 1), (8, 5))
    automaton = paper(accounting="landing+ejection", gravity=0.0, start=start)
    box = Shaken(automaton, 3, amplitude=AMPLITUDE, traced=step + 1)
    kind = box.state()[0]
    kind[kind == DOWN] = UP
    box.put(box.device.cells.kind, kind)
    box.run(step + 1)
    given = 2 * MASS * AMPLITUDE * OMEGA * np.cos(OMEGA * DT * step)
    impulse, _, momentum, _ = box.traces()[step, 0]
    assert not box.traces()[:step, 0, :3].any()
    assert momentum == pytest.approx(given, rel=1e-9)
    assert impulse == pytest.approx(-given, rel=1e-9)


def test_the_heap_lifts_off_where_the_container_falls_faster():
    """All mass is carried until x w^2 exceeds g, none while it does; pressed heaps stay carried."""
    steps, amplitude = 6 * 1667, 10e-3
    dead = paper(restitution=0.0, wall_restitution=0.0)
    box = Shaken(dead, 20, amplitude=amplitude, traced=steps).run(steps)
    carried = box.traces()[:, 0, 1]
    lifted = amplitude * np.sin(OMEGA * DT * np.arange(steps)) * OMEGA**2 > GRAVITY
    assert not carried[lifted].any()
    # Without rebound the heap is together again whenever it is let go.
    releases = np.flatnonzero(np.diff(lifted.astype(int)) == 1)[2:]
    assert len(releases) >= 3
    assert carried[releases] == pytest.approx(20 * MASS, rel=1e-9)
