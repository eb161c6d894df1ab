"""Friction of spheres: sliding, rolling, what holds on a slope, and the springs of its history."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ca_damper.spheres import Spheres
from ca_damper.spheres.contact_law import shear_ratio, wall_numbers
from tests.ca_spheres.rig import Rig

G, MU, DT, RADIUS, MASS = 9.8, 0.5, 2e-5, 3e-3, 0.2e-3
HISTORY = {"friction_law": "history"}
#: Elastic blows of spheres that never slip.
ROUGH = {"restitution": 1.0, "wall_restitution": 1.0, "friction": 100.0, "wall_friction": 100.0}
# Overlap of a sphere at rest on the floor, (m g / k)^(2/3), over its radius: 7e-5.
SINKS = 1e-4


def sliding(**law):
    """A sphere thrown along the floor it lies on."""
    return Rig(Spheres(**law), 1, DT).put((0.005, RADIUS), (0.5, 0.0))


def test_sliding_sphere_stops_after_v2_over_2_mu_g_and_never_turns_round():
    rig, before = sliding(), 0.5
    for _ in range(150):
        across = rig.run(40).state()[1][0, 0]
        assert 0.0 <= across <= before
        before = across
    # It stops after 5100 steps; then every step leaves three quarters of the slip: 0.75^900.
    assert before < 1e-100
    # The overlap swings about its mean, so the mean pressure is the weight; each end of the way is
    # known to a step at the speed there.
    way = rig.state()[0][0, 0] - 0.005
    assert way == pytest.approx(0.5**2 / (2 * MU * G), abs=0.5 * DT)


@pytest.mark.parametrize("law", ["viscous", "history"])
def test_sliding_sphere_ends_rolling_at_five_sevenths_of_its_speed(law):
    # Angular momentum about a point of the floor: m v0 r = m v r + (2/5) m r^2 (v / r).
    rig = sliding(rotation=True, friction_law=law).run(3000)
    _, velocity = rig.state()
    assert velocity[0, 0] == pytest.approx(5 / 7 * 0.5, rel=SINKS)
    assert -rig.spin()[0] * RADIUS == pytest.approx(velocity[0, 0], rel=SINKS)


@pytest.mark.parametrize("law", ["viscous", "history"])
def test_blow_that_slides_takes_mu_times_the_normal_impulse(law):
    # Friction is mu times the push in every step, so the impulses have that ratio to round-off.
    places = [(0.03, 0.0035), (0.03, 0.0925), (0.0035, 0.05), (0.0565, 0.05)]
    normals = np.array([(0, -1), (0, 1), (-1, 0), (1, 0)], dtype=float)
    tangents = np.column_stack([-normals[:, 1], normals[:, 0]])
    before = 0.5 * normals + 2.0 * tangents
    rig = Rig(Spheres(gravity=0.0, friction_law=law), [1] * 4, DT)
    for s in range(4):
        rig.put(places[s], before[s], s)
    change = rig.run(200).states()[1][:, 0] - before
    push = (change * normals).sum(axis=1)
    assert (push < -0.5).all()
    assert (change * tangents).sum(axis=1) == pytest.approx(MU * push, rel=1e-12)


def test_ratio_of_stiffnesses_is_mindlins():
    assert shear_ratio(1e9, 0.3, 1e9, 0.3) == pytest.approx(2.0 * 0.7 / 1.7)
    # A rigid partner counts in neither direction.
    assert shear_ratio(1e9, 0.3, 1e30, 0.0) == pytest.approx(2.0 * 0.7 / 1.7)


def test_a_pile_of_three_stands():
    """What moves it at rest is rounding: of places, 2e-18 m in each of 50,000 steps.

    Springs carry what is left of slip in the first half second, e^-10 and less of it. Friction by
    slip lets the pile sink by 80 um a second, and collapse in 3 s with rotation.
    """
    half = RADIUS + 0.5e-3
    top = RADIUS + np.sqrt(4.0 * RADIUS**2 - half**2)
    places = [(0.03 - half, RADIUS), (0.03 + half, RADIUS), (0.03, top)]
    rig = Rig(Spheres(rotation=True, **HISTORY), 3, DT).put(places, np.zeros((3, 2))).run(25_000)
    before = rig.state()[0]
    place, velocity = rig.run(50_000).state()
    assert np.abs(place - before).max() < 50_000 * 2e-18
    assert np.abs(velocity).max() < 1e-12


def sticking_blow(speed, across, **numbers):
    """Motion of a sphere in an elastic blow on a wall without slip, by the law in continuous time.

    F' = k_t s' while the overlap d grows, and F' = k_t s' + F d' / (2 d) while it shrinks.
    """
    k, shear = numbers["stiffness"], 1.5 * numbers["shear_ratio"] * numbers["stiffness"]

    def rates(_, y):
        d, rate, slip, force = y
        d = max(d, 1e-15)
        fade = 0.5 * force * min(rate, 0.0) / d
        return [rate, -k * d**1.5 / MASS, -force / MASS, shear * np.sqrt(d) * slip + fade]

    def parting(_, y):
        return y[0] - 1e-12 if y[1] < 0.0 else 1.0

    parting.terminal = True
    start, options = [1e-12, speed, across, 0.0], {"rtol": 1e-10, "atol": 1e-14}
    return solve_ivp(rates, (0.0, 1e-3), start, events=parting, **options).y[:, -1]


def error_of_a_blow(dt, *changed):
    """Of the speed across of a sphere that sticks in an elastic blow; changed: steps up to 4e-7."""
    filling = Spheres(gravity=0.0, **ROUGH, **HISTORY)
    rig = Rig(filling, 1, dt).put((0.03, RADIUS + 1e-4), (0.2, -0.5))
    for steps in changed:
        assert rig.run(steps).state()[0][0, 1] < RADIUS - 1e-5
        rig.drive(6.0, 4e-7)
    rig.run(1000 if changed else round(1e-3 / dt))
    return rig.state()[1][0, 0] - sticking_blow(0.5, 0.2, **wall_numbers(filling))[2]


def test_a_blow_that_sticks_follows_the_law():
    """At falling steps the error falls with them, and the law is that in continuous time."""
    errors = [abs(error_of_a_blow(dt)) for dt in (4e-6, 2e-6, 1e-6, 5e-7)]
    assert errors[-1] < 0.3 * errors[0]
    assert errors[-1] < 2e-3 * 0.2


@pytest.mark.parametrize("steps", [60, 74])
def test_a_change_of_step_within_a_blow_stretches_its_spring_by_the_way(steps):
    """The blow begins with steps of 4 us and ends with 0.4 us: errors between those of both.

    A way that is counted as if there were no change leaves these bounds, by up to twice.
    """
    assert 0.0 < error_of_a_blow(4e-6, steps) / error_of_a_blow(4e-6) < 1.0


def test_springs_only_keep_and_lose_energy():
    """Elastic blows of rough spheres: all of the motion's energy, and what springs hold, falls.

    The leapfrog errs by (w dt)^2 / 4 in a contact; the frequency w of the tangential spring is up
    to sqrt(0.82 x 7/2) times that of the normal one, half a period in 23 steps of 5e-6 s.
    """
    options = {"restitution": 1.0, "wall_restitution": 1.0, "friction": 0.3, "wall_friction": 0.3}
    rig = Rig(Spheres(gravity=0.0, rotation=True, **options, **HISTORY), 12, 5e-6)
    rig.put(rig.state()[0], np.random.default_rng(5).uniform(-0.5, 0.5, (12, 2)))
    energy = [rig.run(10).energy() for _ in range(2000)]
    bound = 0.25 * (np.pi / 23.0) ** 2 * 0.82 * 3.5
    assert np.maximum.accumulate(energy[::-1])[::-1][0] <= energy[0] * (1.0 + bound)
    lowest = np.minimum.accumulate(energy)
    assert ((energy - lowest) < bound * energy[0]).all()
    assert energy[-1] < 0.9 * energy[0]
    assert rig.divergence_code() == 0
