"""Momentum, energy, rebound and mean force of spheres in a container that moves as told."""

import numpy as np
import pytest

from ca_damper.spheres import Spheres
from ca_damper.spheres.contact_law import contact_duration, wall_numbers
from tests.ca_spheres.rig import Rig
from tests.slow import slow_but

G, DT, MASS, RADIUS = 9.8, 2e-5, 0.2e-3, 3e-3
EPS = np.finfo(float).eps


@pytest.mark.parametrize("search", ["cells", "all_pairs"])
@pytest.mark.parametrize("turning", [{}, {"rotation": True}, {"friction_law": "history"}])
def test_blows_on_the_container_are_the_particles_change_of_momentum(search, turning):
    # p' = -impulse' - N m g; each of the steps rounds each momentum, of 2 m/s at most, once.
    steps, particles = 15_000, [1, 50, 160]
    rig = Rig(Spheres(search=search, **turning), particles, DT, frequency=6.0, amplitude=0.02)
    rig.run(1)
    before = [rig.momentum(s) for s in range(3)]
    rig.impulse.fill(0.0)
    rig.run(steps)
    for s, count in enumerate(particles):
        fall = -count * MASS * G * steps * DT
        change = rig.momentum(s) - before[s]
        assert abs(rig.impulse[s]) > 0.1 * abs(fall)
        bound = steps * EPS * count * MASS * 2.0
        assert change == pytest.approx(fall - rig.impulse[s], abs=bound)


@pytest.mark.parametrize("damping", slow_but(["tsuji", "printed"], "tsuji"))
@pytest.mark.parametrize("rotation", [False, True])
@pytest.mark.parametrize("law", ["viscous", "history"])
def test_energy_in_a_still_container_falls_until_the_spheres_rest(damping, rotation, law):
    particles = [1, 30, 100, 160]
    filling = Spheres(damping=damping, rotation=rotation, friction_law=law)
    rig = Rig(filling, particles, DT, seed=[1, 2, 3, 4])
    energy = [[rig.energy(s) for s in range(4)]]
    for _ in range(150):
        rig.run(1000)
        energy.append([rig.energy(s) for s in range(4)])
    energy = np.array(energy)
    start = energy[0]
    assert np.all(np.diff(energy, axis=0).max(axis=0) < 0.01 * start)
    assert np.all(energy.min(axis=0) > 0.0)
    # At rest but for the creep of friction, at 4 g dt for the weight of one sphere (see
    # test_friction): the lowest of the ten columns carry a tenth of all.
    for s, count in enumerate(particles):
        assert np.abs(rig.state(s)[1]).max() < 2.0 * 4.0 * G * DT * max(1.0, count / 10.0)


def test_mean_force_of_a_heap_at_rest_is_its_weight():
    particles = np.array([1, 10, 50, 160])
    rig = Rig(Spheres(), particles, DT)
    rig.run(150_000)
    rig.impulse.fill(0.0)
    rig.run(25_000)
    force = rig.in_use(rig.impulse) / (25_000 * DT)
    # 1e-3 is asked for; a heap that creeps at 4 g dt could gain 8 g dt in half a second: 3e-4.
    assert force == pytest.approx(-particles * MASS * G, rel=8 * DT / 0.5)


def test_mean_force_of_shaken_spheres_is_their_weight():
    # What is left is the momentum kept at the ends: below 2 m/s against g times 30 s.
    rig = Rig(Spheres(), 20, 2e-5, frequency=6.0, amplitude=0.015)
    rig.run(1_500_000)
    force = rig.impulse[0] / 30.0
    assert force == pytest.approx(-20 * MASS * G, rel=2.0 / (G * 30.0))


def flight(rig):
    """Times [s] at which the sphere in flight left the floor and meets it again; its apex [m]."""
    (place,), (velocity,) = rig.state()
    height, speed, now = place[1] - RADIUS, velocity[1], rig.done * DT
    impact = np.sqrt(speed**2 + 2 * G * height)
    return now + np.array([speed - impact, speed + impact]) / G, height + speed**2 / (2 * G)


def test_rebound_from_the_top_of_the_container_follows_theory():
    """Impacts at t_1 (1 + 2 e + 2 e^2 + ...), apexes of h e^(2 k), to the fourth rebound.

    Theory knows no duration of contacts: each impact delays what follows (by 0.12 ms, growing like
    v^(-1/5)). The step errs by up to 0.01 in restitution at these speeds (see test_restitution),
    and flights are proportional to it. At most 2 ms are allowed.
    """
    options, fall = Spheres(start=[(0.03, 0.093)]), 0.09
    first, speed = np.sqrt(2 * fall / G), np.sqrt(2 * fall * G)
    numbers = wall_numbers(options)
    lasts = 1.3 * contact_duration(numbers["mass"], numbers["stiffness"], 0.75**4 * speed)
    rig = Rig(options, 1, DT)
    theory = first
    for k in range(1, 5):
        middle = theory + first * 0.75**k
        rig.run(round(middle / DT) - rig.done)
        (left, _), apex = flight(rig)
        error = theory * 0.01 * k + k * lasts
        assert left == pytest.approx(theory, abs=min(error, 2e-3))
        assert apex == pytest.approx(fall * 0.75 ** (2 * k), rel=2 * k * 0.01)
        theory += 2 * first * 0.75**k


def test_spheres_are_left_right_symmetric_in_the_mean_over_seeds():
    # Means of 64 seeds x 20 spheres scatter by the spread of one over sqrt(1280); 4 sigma.
    rig = Rig(Spheres(), 20, DT, seed=np.arange(64), frequency=6.0, amplitude=0.015)
    rig.run(20_000)
    place, velocity = (array[:, :20] for array in rig.states())
    across, drift = place[..., 0] - 0.03, velocity[..., 0]
    assert abs(across.mean()) < 4 * across.std() / np.sqrt(across.size)
    assert abs(drift.mean()) < 4 * drift.std() / np.sqrt(drift.size)
