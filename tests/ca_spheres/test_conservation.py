"""Momentum and energy of spheres in a container that moves as told."""

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
