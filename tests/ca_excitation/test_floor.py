"""A container that lies on a floor and may lift."""

import math

import numpy as np
import pytest

from ca_damper import Batch, InputError, RigidMass, SceneTable, Spheres, shake
from ca_damper.excitation import sines

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


def table(particles=0, ratio=0.2, amplitude=0.0, frequency=10.0, dt=2e-5):
    damping = 2.0 * ratio * OMEGA * MASS
    return SceneTable(particles, 1, dt, frequency, amplitude, MASS, STIFFNESS, damping)


def dropped(filling, particles, height, seconds, ratio=0.2):
    """Displacement of a box dropped from a height, every step, (steps,)."""
    one = table(particles, ratio)
    batch = Batch(filling, one, mount="floor", measured_cycles=0, recorded_samples=200_000)
    batch.start(displacement=height)
    cycles = math.ceil(10.0 * seconds)
    batch.run(cycles, 0, record_every=1)
    series = batch.time_series()
    return series["time_s"][:, 0], series["x"][:, 0]


def test_a_dropped_box_falls_and_rebounds_with_its_restitution():
    """From 20 mm; gravity matters in the blow by g / (w v), 0.25 %, of either speed."""
    height = 0.02
    time, x = dropped(RigidMass(gravity=G), 0, height, 0.2)
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
    batch = Batch(RigidMass(gravity=G), table(20, ratio=0.5), mount="floor")
    batch.start()
    batch.advance(20_000)
    heavy = MASS + 20 * RigidMass().particle_mass
    assert batch.sample()["x"][0] == pytest.approx(-heavy * G / STIFFNESS, rel=1e-6)


@pytest.mark.parametrize("share", [0.9, 1.2])
def test_it_lifts_once_the_floor_falls_faster_than_it(share):
    """A w^2 = g is the limit; below it, the box stays within its static sag or so."""
    frequency = 10.0
    amplitude = share * G / (2.0 * math.pi * frequency) ** 2
    one = table(0, 0.5, amplitude, frequency)
    batch = Batch(RigidMass(gravity=G), one, mount="floor", recorded_samples=50_000)
    batch.start()
    batch.run(5, 0, record_every=1)
    series = batch.time_series()
    gap = (series["x"] - series["y"])[:, 0]
    settled = gap[len(gap) // 5 :]
    assert (settled.max() > 1e-5) == (share > 1.0)


def test_grains_keep_a_dropped_box_from_rebounding():
    """Those that meet the rising box carry down m v each; it rises with e M v.

    All at once, N m = e M would stop it. They come one after the other and bounce, so that what it
    rises, by what it does empty, e^2 h, falls steadily: 0.17 at N m = 1.5 e M and seeds 1 to 4.
    """
    height, ratio, seeds = 0.05, 0.2, [1, 2, 3, 4]
    shares, rises = (0.0, 0.5, 1.0, 1.5), []
    for share in shares:
        count = round(share * restitution(ratio) * MASS / Spheres().particle_mass)
        one = table(count, ratio)
        one = SceneTable(count, seeds, *(one.column(c)[0] for c in SceneTable.COLUMNS[2:]))
        batch = Batch(Spheres(), one, mount="floor", recorded_samples=30_000)
        batch.start(displacement=height)
        batch.run(3, 0, record_every=1)
        series = batch.time_series()
        after = series["time_s"][:, 0] > math.sqrt(2.0 * height / G) + 2e-3
        rises.append(series["x"][after].max(axis=0) / (restitution(ratio) ** 2 * height))
        assert batch.report().momentum_error < 1e-12
    assert rises[0] == pytest.approx(np.ones(4), rel=0.02)
    assert all((less < more).all() for more, less in zip(rises, rises[1:]))
    assert rises[3].max() < 0.25


def test_forces_and_signals_act_on_it_too():
    made = shake(RigidMass(), sines(10.0, 1e-3, 0.5), particles=0, seeds=1, mount="floor")
    assert np.isfinite(made.x).all()


def test_steady_starts_are_those_of_a_spring():
    batch = Batch(RigidMass(), table(), mount="floor")
    with pytest.raises(InputError, match="start must be one of rest"):
        batch.start("empty")
