"""Where spheres start, how they board the container, and a change of step."""

import math

import numpy as np
import pytest

from ca_damper.spheres import Spheres
from tests.ca_spheres.rig import Rig

DT = 2e-5


def test_random_starts_fill_the_box_without_overlap():
    counts = np.array([0, 1, 2, 30, 80, 120, 159, 160])
    rig = Rig(Spheres(), counts, DT, seed=counts + 1)
    for place, count in zip(rig.states()[0], counts):
        place = place[:count]
        room = np.minimum(place, [0.06, 0.096] - place)
        # Rows that fill the box touch; places are sums of a few roundings of 0.1 m.
        assert np.all(room > 3e-3 - 1e-16)
        gaps = np.linalg.norm(place[:, None] - place[None, :], axis=2)
        assert np.all(gaps[np.triu_indices(count, 1)] > 6e-3 - 1e-16)


def test_spheres_board_a_moving_container():
    # At the first step the container passes x = 0 at A w; spheres at rest in it move with it.
    rig = Rig(Spheres(gravity=0.0), 1, DT, frequency=6.0, amplitude=0.02)
    rig.put((0.03, 0.05), (0.0, 0.0)).run(1)
    assert rig.state()[1][0] == pytest.approx([0.0, 0.02 * 2 * math.pi * 6.0], rel=1e-15)
    assert rig.state()[0][0] == pytest.approx([0.03, 0.05], abs=1e-15)


def test_change_of_step_keeps_places_and_the_motion():
    # A sphere in free flight: the leapfrog is exact but for g dt^2 / 8 of its start, so the fall
    # shows any place lost at the change. Velocity 1 m/s times half a step would be 1e-5 m.
    rig = Rig(Spheres(), 1, DT).put((0.03, 0.09), (0.0, 0.0)).run(1000)
    place, velocity = rig.state()
    rig.drive(6.0, 2.5e-6)
    moved, now = rig.run(1).state()
    assert moved[0] - place[0] == pytest.approx(velocity[0] * 2.5e-6, abs=9.8 * DT**2)
    assert now[0, 1] - velocity[0, 1] == pytest.approx(-9.8 * 2.5e-6, rel=1e-9)
