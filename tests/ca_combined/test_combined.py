"""Flights in whole steps and short steps of spheres give what spheres alone give."""

import numpy as np
import pytest

from ca_damper import Batch, Combined, SceneTable, Spheres
from ca_damper.spheres.effect_activity import FLIGHTS

FREQUENCIES = [5.5, 5.9, 6.1, 8.0]


def shaken(filling, particles, dt, cycles=12):
    """A batch near resonance, some cycles after its start, and its record of the last three."""
    table = SceneTable(particles, [1, 2, 3, 4], dt, FREQUENCIES, 0.6e-3)
    batch = Batch(filling, table, measured_cycles=3)
    batch.start("empty")
    return batch, batch.run(cycles, 3).record


def flights_of(batch, s):
    """Whole steps of a scene in which all its grains flew."""
    return int(batch.device.effect_activity.events[s, FLIGHTS])


def differing(first, second):
    """Numbers of scenes whose record, places or velocities have different bits."""
    (one, one_record), (other, other_record) = first, second
    return [
        s
        for s in range(len(FREQUENCIES))
        if not np.array_equal(one_record[s], other_record[s])
        or any(
            not np.array_equal(one.snapshot(s)[key], other.snapshot(s)[key])
            for key in ("position", "velocity")
        )
    ]


def test_with_one_short_step_a_flight_changes_no_bit():
    """Flights skip only what cannot touch: a contact that one missed would show in the bits."""
    made = shaken(Combined(substeps=1), 10, 2e-5, cycles=3)
    assert differing(shaken(Spheres(), 10, 2e-5, cycles=3), made) == []
    assert all(flights_of(made[0], s) > 0 for s in range(len(FREQUENCIES)))


def deepest_after_flights(batch, s, steps):
    """Largest overlap of two grains, or of a grain and a wall [m], at the ends of flights."""
    overlaps, flights = [], flights_of(batch, s)
    for _ in range(steps):
        batch.advance(1)
        if flights_of(batch, s) > flights:
            flights += 1
            place = batch.snapshot(s)["position"]
            gaps = np.linalg.norm(place[:, None] - place[None], axis=2)
            room = np.minimum(place, [0.06, 0.096] - place) - 3e-3
            overlaps += [6e-3 - gaps[np.triu_indices(len(place), 1)].min(), -room.min()]
    assert len(overlaps) > 0.8 * steps
    return max(overlaps)


def test_no_flight_ends_in_a_contact():
    """Neither of grains nor with walls, but for rounding; 1 m/s is 100 um a step."""
    batch, _ = shaken(Combined(), 10, 1e-4)
    assert deepest_after_flights(batch, 1, 1000) < 1e-9
    report = batch.report()
    assert report.momentum_error < 1e-12
    assert report.certificate.audits[0].misses == 0


def test_a_grain_without_contact_flies_every_step_on_its_parabola():
    """Leapfrog is exact at constant acceleration, whatever the lengths of its steps."""
    filling = Combined(start=[(0.03, 0.03)], start_velocity=[(0.01, 0.5)])
    batch = Batch(filling, SceneTable(1, 1, 1e-4, 5.0))
    batch.start()
    batch.advance(400)
    time = 400 * batch.table.column("dt")[0]
    found = batch.snapshot(0)
    assert flights_of(batch, 0) == 399
    place = [0.03 + 0.01 * time, 0.03 + 0.5 * time - 0.5 * 9.8 * time**2]
    assert found["position"][0] == pytest.approx(place, rel=1e-12)
    assert found["velocity"][0] == pytest.approx([0.01, 0.5 - 9.8 * time], rel=1e-12)


def test_short_steps_see_the_container_recoil():
    """A blow of m on M, both free: the speeds of parting and of approach have the ratio e.

    Short steps of 1e-6 s are less than a hundredth of the contact, whose restitution errs by its
    square, and the ten of them in a whole step, for which the container waits, less than a tenth.
    """
    ratio, speed = np.array([0.01, 0.1, 1.0, 10.0]), 0.5
    grain = {"wall_restitution": 0.5, "particle_mass": 8.6e-3, "height": 0.03, "gravity": 0.0}
    filling = Combined(substeps=10, start=[(0.03, 0.015)], **grain)
    # A spring so soft that it does nothing in the 30 ms of flight and blow.
    batch = Batch(filling, SceneTable(1, 1, 1e-5, 5.0, 0.0, 8.6e-3 / ratio, 1e-9, 0.0))
    batch.start()
    bodies = batch.device.bodies
    for s in range(4):
        bodies.velocity[s * bodies.stride] = [0.0, speed]
    batch.advance(3000)
    after = np.array([batch.snapshot(s)["velocity"][0, 1] for s in range(4)])
    assert (batch.sample()["v"] - after) / speed == pytest.approx(0.5, abs=2e-4)


def test_the_response_is_that_of_spheres():
    """RMS of 30 grains near the peak, mean of seeds: within three standard errors of spheres."""
    found = []
    for filling, dt in ((Spheres(), 2e-5), (Combined(), 1e-4)):
        batch = Batch(filling, SceneTable(30, list(range(8)), dt, 5.9, 0.6e-3), measured_cycles=20)
        batch.start("empty")
        found.append(batch.run(20, 20).rms)
    error = np.hypot(*(rms.std(ddof=1) / np.sqrt(8) for rms in found))
    assert abs(found[0].mean() - found[1].mean()) < 3.0 * error
