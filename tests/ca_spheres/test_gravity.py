"""Gravity in any direction, velocities at the start: falls, weight, energy, momentum, refusals."""

import numpy as np
import pytest

from ca_damper import Automaton, Batch, InputError, RigidMass, SceneTable, Spheres
from tests.ca_spheres.rig import Rig

G, DT, MASS, RADIUS = 9.8, 2e-5, 0.2e-3, 3e-3
SHAKEN = {"dt": DT, "frequency": 6.0, "amplitude": 0.015}
TILTED = (G * np.sin(0.5), G * np.cos(0.5))


@pytest.mark.parametrize("gravity", [(3.0, 4.0), (-3.0, 4.0), (9.8, 0.0), (1.0, -2.0), (0.0, 0.0)])
def test_a_sphere_in_flight_falls_along_gravity_and_keeps_its_energy(gravity):
    """Positions are exact but for g dt^2 / 8 at the start, where they get half a step ahead.

    The pull on a place in that time is the energy that may be missing.
    """
    steps, start, pull = 2000, np.array([0.03, 0.05]), np.array([gravity[0], -gravity[1]])
    throw = (0.1, -0.2)
    rig = Rig(Spheres(gravity=gravity, start=[start], start_velocity=[throw]), 1, DT)
    before = rig.run(1).energy()
    (place,), (velocity,) = rig.run(steps - 1).state()
    time = steps * DT
    assert velocity == pytest.approx(throw + pull * time, abs=steps * 1e-16)
    off = np.abs(pull).max() * DT**2 + steps * 1e-17
    assert place == pytest.approx(start + np.array(throw) * time + 0.5 * pull * time**2, abs=off)
    assert rig.energy() == pytest.approx(before, abs=2.0 * MASS * np.abs(pull).max() * off)
    assert before > 0.0


def test_one_number_is_gravity_downwards():
    one, two = (Rig(Spheres(gravity=g), 30, **SHAKEN).run(5000) for g in (G, (0.0, G)))
    for found, expected in zip(one.state(), two.state()):
        assert np.array_equal(found, expected)
    assert one.energy() == two.energy()


def test_a_box_turned_about_gives_the_same_motion():
    """A square box at rest with gravity along each axis: the same fall, blow and rest."""
    size = {"width": 0.06, "height": 0.06, "friction_law": "history"}
    ways = {(0.0, G): (0, -1), (0.0, -G): (0, 1), (G, 0.0): (1, 0), (-G, 0.0): (-1, 0)}
    states = []
    for gravity, way in ways.items():
        start = 0.03 - 0.01 * np.array(way)
        rig = Rig(Spheres(gravity=gravity, start=[start], **size), 1, DT).run(8000)
        (place,), (velocity,) = rig.state()
        states.append([(place - 0.03) @ way, velocity @ way, rig.energy()])
    for state in states[1:]:
        # Horizontal places count from the middle, vertical ones from the floor: other roundings,
        # which the blow, whose force is 1e7 N/m steep, turns into speeds.
        assert state == pytest.approx(states[0], rel=1e-9, abs=1e-10)


@pytest.mark.parametrize("gravity", [TILTED, (G, 0.0), (0.0, -G), (-2.0, 1.0)])
@pytest.mark.parametrize("law", ["viscous", "history"])
def test_a_shaken_box_carries_the_part_of_the_weight_along_its_motion(gravity, law):
    """What is left is the momentum kept at the ends, below 2 m/s against the time of 10 s."""
    filling = Spheres(gravity=gravity, friction_law=law)
    batch = Batch(filling, SceneTable(20, 1, DT, 6.0, 0.6e-3), measured_cycles=60)
    batch.start("rigid")
    cycles = batch.run(10, 60)
    bound = 20 * MASS * 2.0 * 6.0 / 60
    assert cycles.mean_force[0] == pytest.approx(-20 * MASS * gravity[1], abs=bound)
    assert batch.report().momentum_error < 1e-12


@pytest.mark.parametrize("gravity", [TILTED, (G, 0.0), (0.0, 0.0)])
def test_energy_in_a_still_container_falls_under_any_gravity(gravity):
    rig = Rig(Spheres(gravity=gravity, friction_law="history"), 40, DT)
    energy = []
    for _ in range(60):
        energy.append(rig.run(1000).energy())
        assert rig.divergence_code() == 0
    assert np.diff(energy).max() < 0.01 * energy[0]
    assert min(energy) > 0.0


def test_no_step_that_is_too_long_hides_behind_gravity():
    filling = Spheres(gravity=TILTED)
    rig = Rig(filling, 30, 1e-4, frequency=6.0, amplitude=0.015)
    assert rig.run(5000).divergence_code() != 0


def test_start_velocity_is_seen_from_the_container():
    """Random places keep their seeds, and have the given velocities instead of small ones."""
    velocity = [(0.1, 0.2), (-0.3, 0.0)]
    given = Rig(Spheres(gravity=0.0, start_velocity=velocity), 2, **SHAKEN)
    free = Rig(Spheres(gravity=0.0), 2, **SHAKEN)
    assert np.array_equal(given.state()[0], free.state()[0])
    assert np.array_equal(given.state()[1], velocity)
    wall = 2.0 * np.pi * 6.0 * 0.015
    assert given.run(1).state()[1] == pytest.approx(velocity + np.array([0.0, wall]), rel=1e-14)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"gravity": (1.0, 2.0, 3.0)}, "gravity must be one number, or two"),
        ({"gravity": (1.0, np.nan)}, "gravity must be one number, or two"),
        ({"gravity": "down"}, "gravity must be zero or a positive"),
        ({"start_velocity": [(1.0,)]}, "start_velocity must hold two speeds"),
        ({"start_velocity": [(1.0, np.inf)]}, "start_velocity must hold finite speeds"),
        ({"start_velocity": "fast"}, "start_velocity must hold two speeds"),
        ({"start": [(0.03, 0.03)], "start_velocity": [(0, 0)] * 2}, "start_velocity must hold 1"),
        ({"height": 5e-3}, "height must be at least the diameter 0.006, got 0.005"),
    ],
)
def test_what_cannot_be_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        Spheres(**options)


@pytest.mark.parametrize("filling", [Automaton, RigidMass])
def test_fillings_that_know_one_direction_refuse_two(filling):
    with pytest.raises(InputError, match="gravity must be zero or a positive"):
        filling(gravity=(1.0, 2.0))


def test_number_of_spheres_must_be_that_of_the_velocities():
    filling = Spheres(start_velocity=[(0.0, 1.0)] * 3)
    filling.check(3, DT)
    with pytest.raises(InputError, match="particles must be 3, as many as velocities"):
        filling.check(2, DT)


@pytest.mark.parametrize(
    ("width", "height"), [(6e-3, 6e-3), (6.5e-3, 0.2), (0.2, 7e-3), (0.011, 0.0131)]
)
def test_boxes_of_odd_sizes_hold_what_fits(width, height):
    """A lid at any height: from a box for one grain to one of a single row or column."""
    filling = Spheres(width=width, height=height)
    count = filling.capacity
    assert count == int(width / 6e-3 + 1e-9) * int(height / 6e-3 + 1e-9)
    rig = Rig(filling, [1, count], DT, frequency=6.0, amplitude=0.002).run(20_000)
    for s in range(2):
        assert rig.divergence_code(s) == 0
        place, _ = rig.state(s)
        # Overlaps of blows at 1 m/s are below a hundredth of a radius.
        assert (place > 0.99 * RADIUS).all()
        assert (place < np.array([width, height]) - 0.99 * RADIUS).all()
