"""Momentum and energy of spheres in a container that moves as told, from their start on."""

import math

import numpy as np
import pytest

from ca_damper.spheres import Spheres
from tests.ca_spheres.rig import Rig

G, DT, MASS = 9.8, 2e-5, 0.2e-3
EPS = np.finfo(float).eps
TILTED = (G * np.sin(0.5), G * np.cos(0.5))
LAWS = [{}, {"friction_law": "history", "rotation": True, "gravity": TILTED}]


@pytest.mark.parametrize("law", LAWS)
def test_blows_on_the_container_are_the_particles_change_of_momentum(law):
    # p' = -impulse' - N m g; each of the steps rounds each momentum, of 2 m/s at most, once.
    steps, particles, filling = 10_000, [1, 50, 160], Spheres(**law)
    rig = Rig(filling, particles, DT, frequency=6.0, amplitude=0.02)
    rig.run(1)
    before = [rig.momentum(s) for s in range(3)]
    rig.impulse.fill(0.0)
    rig.run(steps)
    for s, count in enumerate(particles):
        fall = -count * MASS * filling.fall[1] * steps * DT
        change = rig.momentum(s) - before[s]
        assert abs(rig.impulse[s]) > 0.1 * abs(fall)
        bound = steps * EPS * count * MASS * 2.0
        assert change == pytest.approx(fall - rig.impulse[s], abs=bound)


@pytest.mark.parametrize("law", LAWS)
def test_energy_in_a_still_container_falls_until_the_spheres_rest(law):
    particles = [1, 30, 100, 160]
    rig = Rig(Spheres(**law), particles, DT, seed=[1, 2, 3, 4])
    energy = [[rig.energy(s) for s in range(4)]]
    for _ in range(100):
        rig.run(1000)
        energy.append([rig.energy(s) for s in range(4)])
    energy = np.array(energy)
    assert np.all(np.diff(energy, axis=0).max(axis=0) < 0.01 * energy[0])
    assert np.all(energy.min(axis=0) > 0.0)
    # At rest but for the creep of friction, at 4 g dt for the weight of one sphere: up to six
    # contacts share a sphere, and their grips, which take at most 6/4 of its slip in a step, do
    # not swing up; the lowest of the ten columns carry a tenth of all.
    for s, count in enumerate(particles):
        assert np.abs(rig.state(s)[1]).max() < 2.0 * 4.0 * G * DT * max(1.0, count / 10.0)


@pytest.mark.parametrize("gravity", [(3.0, 4.0), (1.0, -2.0), (0.0, 0.0)])
def test_a_sphere_in_flight_falls_along_gravity_and_keeps_its_energy(gravity):
    """Positions are exact but for g dt^2 / 8 at the start, where they get half a step ahead.

    The pull on a place in that time is the energy that may be missing.
    """
    steps, start, pull = 2000, np.array([0.03, 0.05]), np.array([gravity[0], -gravity[1]])
    throw = (0.1, -0.2)
    rig = Rig(Spheres(gravity=gravity), 1, DT).put(start, throw)
    before = rig.run(1).energy()
    (place,), (velocity,) = rig.run(steps - 1).state()
    time = steps * DT
    assert velocity == pytest.approx(throw + pull * time, abs=steps * 1e-16)
    off = np.abs(pull).max() * DT**2 + steps * 1e-17
    assert place == pytest.approx(start + np.array(throw) * time + 0.5 * pull * time**2, abs=off)
    assert rig.energy() == pytest.approx(before, abs=2.0 * MASS * np.abs(pull).max() * off)


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
