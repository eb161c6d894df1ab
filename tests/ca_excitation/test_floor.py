"""A container on a floor rebounds, rests and lifts as on a spring that only pushes."""

import math

import numpy as np
import pytest

from ca_damper import Batch, RigidMass, SceneTable

G = 9.8
MASS = 8e-3
#: Of the floor: natural frequency of the container on it [rad/s].
OMEGA = 2.0 * math.pi * 1000.0
STIFFNESS = MASS * OMEGA**2


def restitution(ratio):
    """Of a linear spring and dashpot that never pull, without gravity (Schwager, Poeschel 2007)."""
    turn = math.sqrt(1.0 - ratio**2)
    angle = math.pi - math.atan2(2.0 * ratio * turn, 1.0 - 2.0 * ratio**2)
    return math.exp(-ratio / turn * angle)


def box(particles=0, ratio=0.5, amplitude=0.0):
    """A batch of one box on the floor, of which every step is recorded."""
    damping = 2.0 * ratio * OMEGA * MASS
    table = SceneTable(particles, 1, 2e-5, 10.0, amplitude, MASS, STIFFNESS, damping)
    return Batch(RigidMass(gravity=G), table, mount="floor", recorded_samples=50_000)


def motion(batch, cycles):
    """Times, and place of the box and of the floor."""
    batch.run(cycles, 0, record_every=1)
    series = batch.time_series()
    return [series[name][:, 0] for name in ("time_s", "x", "y")]


def test_a_dropped_box_falls_and_rebounds_with_its_restitution():
    """From 20 mm; gravity matters in the blow by g / (w v), 0.25 %, of either speed."""
    height, batch = 0.02, box(ratio=0.2)
    batch.start(displacement=height)
    time, x, _ = motion(batch, 2)
    fall = math.sqrt(2.0 * height / G)
    flying = time < fall
    assert x[flying] == pytest.approx(height - 0.5 * G * time[flying] ** 2, abs=1e-9)
    after = x[time > fall + 1e-3]
    rise = after[: np.argmax(after < 0.0)].max()
    speed = math.sqrt(2.0 * G * height)
    gravity = 4.0 * G / (OMEGA * speed)
    assert math.sqrt(rise / height) == pytest.approx(restitution(0.2), rel=gravity)


def test_a_box_at_rest_lies_on_its_weight():
    """And on that of what it carries: x = -(M + m) g / K."""
    batch = box(particles=20)
    batch.start()
    batch.advance(20_000)
    heavy = MASS + 20 * RigidMass().particle_mass
    assert batch.sample()["x"][0] == pytest.approx(-heavy * G / STIFFNESS, rel=1e-6)


@pytest.mark.parametrize("share", [0.9, 1.2])
def test_it_lifts_once_the_floor_falls_faster_than_it(share):
    """A w^2 = g is the limit; below it, the box stays within its static sag or so."""
    batch = box(amplitude=share * G / (2.0 * math.pi * 10.0) ** 2)
    batch.start()
    _, x, y = motion(batch, 5)
    settled = (x - y)[len(x) // 5 :]
    assert (settled.max() > 1e-5) == (share > 1.0)
