"""Blows on a container that recoils: restitution, and the impact damper against its closed form."""

import numpy as np
import pytest

from ca_damper import Batch, SceneTable, Spheres
from ca_damper.excitation import sines
from tests.ca_spheres.impact_damper import drawn

HEIGHT = 0.03


@pytest.mark.parametrize("damping", ["tsuji", "printed"])
@pytest.mark.parametrize("wall", [-1.0, 1.0])
@pytest.mark.parametrize("excitation", [None, sines(5.0, 0.0, 1.0)], ids=["sine", "signal"])
def test_a_sphere_parts_from_a_free_container_with_its_restitution(damping, wall, excitation):
    """A blow of m on M, both free: the speeds of parting and of approach have the ratio e.

    The printed law has it at its reference speed, that of the blow here. A step of 1e-6 s is less
    than a hundredth of the contact, whose restitution errs by its square. With the damping of
    an immovable wall, m / M = 0.1 gives 0.486 instead of 0.5.
    """
    ratio, speed = np.array([0.01, 0.1, 1.0, 10.0]), 0.5
    options = {"wall_restitution": 0.5, "damping": damping, "height": HEIGHT, "gravity": 0.0}
    filling = Spheres(start=[(0.03, 0.5 * HEIGHT)], particle_mass=8.6e-3, **options)
    # A spring so soft that it does nothing in the 30 ms of flight and blow.
    table = SceneTable(1, 1, 1e-6, 5.0, 0.0, 8.6e-3 / ratio, 1e-9, 0.0)
    batch = Batch(filling, table, excitation=excitation)
    batch.start()
    bodies = batch.device.bodies
    for s in range(4):
        bodies.velocity[s * bodies.stride] = [0.0, wall * speed]
    batch.advance(30_000)
    grain = np.array([batch.snapshot(s)["velocity"][0, 1] for s in range(4)])
    parting = -wall * (grain - batch.sample()["v"]) / speed
    assert parting == pytest.approx(0.5, abs=2e-4)


def test_one_grain_responds_as_the_impact_damper():
    """24 cases drawn from m/M = 0.02 to 0.1 and e = 0.3 to 0.75, within 0.5 % in RMS.

    With a wall that does not recoil in the damping, or sudden blows, most are off by 1 to 3 %.
    """
    for case, speed in drawn(24, seed=22):
        lasting, alone = case.lasting(speed)
        container, grain = lasting.start(alone)
        place, velocity = grain - container
        filling = case.filling(start=[(0.03, 0.5 * (case.clearance + 6e-3) + place)])
        table = SceneTable(1, 1, 2e-5, case.frequency, 0.6e-3)
        batch = Batch(filling, table, measured_cycles=10)
        batch.start()
        batch.engine.coupling.start(container[None])
        batch.device.bodies.velocity[0] = [0.0, velocity]
        found = batch.run(60, 10).rms[0]
        assert found == pytest.approx(lasting.rms(alone), rel=5e-3)
