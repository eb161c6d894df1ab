"""Spheres and the container on its spring: recoil, a floor that moves, steps that are too long."""

import numpy as np
import pytest

from ca_damper import Batch, SceneTable, Spheres
from ca_damper.spheres.contact_law import wall_numbers
from tests.ca_spheres.rig import put

G, MASS = 9.8, 0.2e-3


def started(filling, table, **options):
    """A batch at its start."""
    batch = Batch(filling, table, **options)
    batch.start()
    return batch


def test_a_sphere_parts_from_a_free_container_with_its_restitution():
    """A blow of m on M, both free: the speeds of parting and of approach have the ratio e.

    From the floor and from the lid. A step of 1e-6 s is less than a hundredth of the contact, whose
    restitution errs by its square. With the damping of an immovable wall, m / M = 0.1 gives 0.486
    instead of 0.5.
    """
    ratio, wall = np.repeat([0.01, 0.1, 1.0, 10.0], 2), np.tile([-1.0, 1.0], 4)
    speed, box = 0.5, {"height": 0.03, "gravity": 0.0}
    filling = Spheres(particle_mass=8.6e-3, wall_restitution=0.5, **box)
    # A spring so soft that it does nothing in the 30 ms of flight and blow.
    batch = started(filling, SceneTable(1, 1, 1e-6, 5.0, 0.0, 8.6e-3 / ratio, 1e-9, 0.0))
    for s in range(8):
        put(batch.device, (0.03, 0.015), (0.0, wall[s] * speed), s)
    batch.advance(30_000)
    grain = np.array([batch.snapshot(s)["velocity"][0, 1] for s in range(8)])
    parting = -wall * (grain - batch.sample()["v"]) / speed
    assert parting == pytest.approx(0.5, abs=2e-4)


def test_a_sphere_at_rest_on_a_moving_floor_neither_lags_nor_leads():
    # Driven at 2 mm and 6 Hz, below g. A force late by half a step would have the apparent damping
    # m w^2 dt / 2; one out by less than a thousandth of a step has less than 1/500 of that. The
    # sphere rests on a spring whose frequency W = sqrt(3 g / (2 d)), d = (m g / k)^(2/3) = 2e-7 m,
    # lets its mass appear larger by (w / W)^2 = 2e-5.
    table = SceneTable(1, 1, 2e-5, 6.0, 2e-3)
    cycles = started(Spheres(), table, mount="base", measured_cycles=20).run(15, 20)
    (omega,), (damping,), (mass,) = cycles.omega, cycles.apparent_damping, cycles.apparent_mass
    assert abs(damping) < MASS * omega**2 * 2e-5 / 2.0 / 500.0
    k = wall_numbers(Spheres())["stiffness"]
    spring = np.sqrt(1.5 * G / (MASS * G / k) ** (2.0 / 3.0))
    # 2 mm w^2 is 0.29 g: the spring of d^(3/2) is as much softer and stiffer in turn.
    assert mass / MASS - 1.0 == pytest.approx((omega / spring) ** 2, rel=0.29)


# Frequency [Hz] and amplitude of the base [m]: drawn scenes in which a check fell on a landing.
LANDINGS = np.array(
    [(5.97066538709373, 5.352711049774064e-3), (6.106328791200859, 5.743200113844745e-3)]
)


@pytest.mark.parametrize(("count", "restitution"), [(6, 0.75), (1, 1.0)])
def test_spheres_that_land_together_do_not_diverge(count, restitution):
    """Six beside each other, thrown by the structure, and one that loses no energy."""
    places = [(0.0035 + 0.0066 * k, 0.003) for k in range(count)]
    spheres = Spheres(restitution=restitution, wall_restitution=restitution)
    batch = started(spheres, SceneTable(count, 1, 2e-5, *LANDINGS.T))
    for s in range(2):
        put(batch.device, places, np.zeros((count, 2)), s)
    batch.run(4, 0)
    assert batch.sample()["energy"].max() < count * 2e-3
