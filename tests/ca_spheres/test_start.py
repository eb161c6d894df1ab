"""Where spheres start, how they board the container, a change of step, and how loss is noticed."""

import math

import numpy as np
import pytest

from ca_damper.spheres import Spheres
from tests.ca_spheres.rig import Rig

DT, NAN = 2e-5, math.nan


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


def test_random_starts_use_the_whole_box():
    # Means of 200 seeds x 20 sites scatter by the box / sqrt(12 x 4000): 4 sigma.
    place = np.concatenate([Rig(Spheres(), 20, DT, seed=seed).state()[0] for seed in range(200)])
    size = np.array([0.06, 0.096])
    assert np.all(np.abs(place.mean(axis=0) - 0.5 * size) < 4 * size / np.sqrt(12 * 4000))
    assert np.all(np.ptp(place, axis=0) > 0.95 * (size - 6e-3))


def test_given_places_and_velocities_are_taken_as_seen_from_the_container():
    places, velocities = [(0.01, 0.02), (0.03, 0.05)], [(0.1, 0.2), (-0.3, 0.0)]
    given = Spheres(start=places, start_velocity=velocities)
    place, velocity = Rig(given, 2, DT, seed=[1, 2]).states()
    assert place[1, :2] == pytest.approx(np.array(places), abs=1e-17)
    assert np.array_equal(velocity[1, :2], velocities)


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


UNWELL = (
    ("velocity", [NAN, 0.0], "finite"),
    ("velocity", [0.0, math.inf], "finite"),
    ("velocity", [0.0, 400.0], "radius in a step"),
    ("position", [0.031, 0.05], "outside"),
    ("position", [0.0, -0.001], "outside"),
    ("position", [0.01, 0.052], "overlap"),
    ("position", [0.0, 0.01], ""),
)


def test_what_is_lost_is_noticed():
    # One change a scene, to the first of two spheres so soft that they stay where they are put;
    # the second is at (0.01, 0.05) from the middle of the floor.
    filling = Spheres(young=1e3, wall_young=1e3)
    rig = Rig(filling, [2] * len(UNWELL), DT)
    for s in range(len(UNWELL)):
        rig.put([(0.02, 0.05), (0.04, 0.05)], np.zeros((2, 2)), s)
    bodies = rig.run(1).device.bodies
    for s, (name, value, _) in enumerate(UNWELL):
        assert rig.divergence_code(s) == 0
        getattr(bodies, name)[s * bodies.stride] = value
    # Spheres that were put elsewhere are not in the list of pairs; a change of dt makes it anew.
    rig.drive(6.0, 0.5 * DT)
    rig.run(1)
    for s, (_, _, word) in enumerate(UNWELL):
        code = rig.divergence_code(s)
        assert (code != 0) == bool(word)
        if word:
            words, dt = filling.divergence(code, 2, DT)
            assert word in words
            assert 0.0 < dt <= 0.5 * DT


def test_safe_step_is_near_the_papers():
    # A fifth of a contact of two spheres at the speed of a fall through the box; the paper's 2e-5.
    assert Spheres().safe_step() == pytest.approx(2e-5, rel=0.1)
    # Softer spheres stay in touch for longer: like E^(-2/5).
    ratio = Spheres(young=0.5e7).safe_step() / Spheres().safe_step()
    assert ratio == pytest.approx(100**0.4, rel=0.05)
