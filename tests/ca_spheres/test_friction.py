"""Friction without chatter, and rotation: sliding, rolling, what is conserved in a blow."""

import numpy as np
import pytest
import taichi as ti

from ca_damper import runtime
from ca_damper.spheres import Spheres
from ca_damper.spheres.contact_law import ContactLaw
from tests.ca_spheres.rig import Rig

G, MU, DT, RADIUS, MASS = 9.8, 0.5, 2e-5, 3e-3, 0.2e-3
# Overlap of a sphere at rest on the floor, (m g / k)^(2/3), over its radius: 7e-5.
SINKS = 1e-4


def sliding(rotation, speed=0.5):
    """A sphere thrown along the floor it lies on."""
    rig = Rig(Spheres(rotation=rotation, start=[(0.005, RADIUS)]), 1, DT)
    rig.throw([speed, 0.0])
    return rig


def test_sliding_sphere_stops_after_v2_over_2_mu_g_and_never_turns_round():
    rig, before = sliding(rotation=False), 0.5
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


def test_friction_at_rest_creeps_and_does_not_chatter():
    # Up to six contacts share a sphere, and their grips take at most 6/4 of its slip in a step;
    # from 2 on slip would swing up. A contact carries a sphere's weight at a slip of 4 g dt, so a
    # heap creeps at about that speed and no faster.
    rig = Rig(Spheres(), 50, DT)
    rig.run(150_000)
    speeds = np.linalg.norm(rig.state()[1], axis=1)
    assert speeds.max() < 2.0 * 4.0 * G * DT


def test_sliding_sphere_ends_rolling_at_five_sevenths_of_its_speed():
    # Angular momentum about a point of the floor: m v0 r = m v r + (2/5) m r^2 (v / r).
    rig = sliding(rotation=True)
    rig.run(3000)
    _, velocity = rig.state()
    assert velocity[0, 0] == pytest.approx(5 / 7 * 0.5, rel=SINKS)
    spin = rig.device.snapshot(0)["spin"][0]
    assert -spin * RADIUS == pytest.approx(velocity[0, 0], rel=SINKS)


def test_sphere_slides_for_two_sevenths_of_v_over_mu_g():
    # Until then v = v0 - mu g t, as without rotation.
    rig, plain = sliding(rotation=True), sliding(rotation=False)
    steps = int(0.9 * 2 / 7 * 0.5 / (MU * G) / DT)
    rolling, still = (r.run(steps).state()[1][0, 0] for r in (rig, plain))
    assert rolling == still
    later = int(0.2 * 2 / 7 * 0.5 / (MU * G) / DT)
    assert rig.run(later).state()[1][0, 0] > 1.02 * plain.run(later).state()[1][0, 0]


@pytest.mark.parametrize("law", ["viscous", "history"])
@pytest.mark.parametrize(("normal", "wall"), [((0, -1), 0), ((0, 1), 1), ((-1, 0), 2), ((1, 0), 3)])
def test_blow_that_slides_takes_mu_times_the_normal_impulse(normal, wall, law):
    # Friction is mu times the push in every step, so the impulses have that ratio to round-off.
    places = [(0.03, 0.0035), (0.03, 0.0925), (0.0035, 0.05), (0.0565, 0.05)]
    normal = np.array(normal, dtype=float)
    tangent = np.array([-normal[1], normal[0]])
    rig = Rig(Spheres(gravity=0.0, start=[places[wall]], friction_law=law), 1, DT)
    before = 0.5 * normal + 2.0 * tangent
    rig.throw(before)
    change = rig.run(200).state()[1][0] - before
    assert change @ normal < -0.5
    assert change @ tangent == pytest.approx(MU * (change @ normal), rel=1e-12)


def test_container_feels_side_walls_drag():
    # A sphere that slides up the side wall pulls the container up by what it loses itself.
    rig = Rig(Spheres(gravity=0.0, start=[(0.0035, 0.05)]), 1, DT)
    rig.throw([-0.5, 1.0])
    loss = MASS * (1.0 - rig.run(200).state()[1][0, 1])
    assert loss > 0.1 * MASS
    assert rig.impulse[0] == pytest.approx(loss, rel=1e-12)


OBLIQUE = [(0.025, 0.05), (0.0315, 0.052)]


def oblique_pair(rotation, law="viscous"):
    options = {"gravity": 0.0, "rotation": rotation, "start": OBLIQUE}
    rig = Rig(Spheres(friction_law=law, **options), 2, DT)
    rig.throw([[0.5, 0.3], [-0.4, -0.1]])
    return rig


def angular_momentum(rig):
    """About the middle of the box, of places and of spins."""
    place, velocity = rig.state()
    place = place - [0.03, 0.048]
    orbital = MASS * (place[:, 0] * velocity[:, 1] - place[:, 1] * velocity[:, 0]).sum()
    return orbital + 0.4 * MASS * RADIUS**2 * rig.device.snapshot(0)["spin"].sum()


@pytest.mark.parametrize("law", ["viscous", "history"])
def test_oblique_blow_of_turning_spheres_keeps_momentum_and_angular_momentum(law):
    # Forces are opposite and act at one point: both are kept step by step, to a rounding each.
    rig, steps = oblique_pair(rotation=True, law=law), 300
    rig.run(1)
    angular, linear = angular_momentum(rig), rig.state()[1].sum(axis=0)
    rig.run(steps)
    assert np.abs(rig.device.snapshot(0)["spin"]).min() > 1.0
    assert angular_momentum(rig) == pytest.approx(angular, abs=steps * 1e-16 * MASS * 0.01)
    assert np.abs(rig.state()[1].sum(axis=0) - linear).max() < steps * 1e-16


def test_rotation_is_absent_unless_asked_for():
    plain, turning = oblique_pair(rotation=False), oblique_pair(rotation=True)
    assert "spin" not in plain.device.snapshot(0)
    assert not hasattr(plain.device.rotation, "spin")
    # The blow along the normal is the same, that along the contact is not.
    a, b = (rig.run(300).state()[1] for rig in (plain, turning))
    assert not np.array_equal(a, b)


def test_turning_spheres_keep_their_energy_without_friction():
    frictionless = {"friction": 0.0, "restitution": 1.0}
    options = Spheres(gravity=0.0, rotation=True, start=OBLIQUE, **frictionless)
    rig = Rig(options, 2, 1e-6)
    rig.throw([[0.5, 0.3], [-0.4, -0.1]])
    before = rig.energy()
    # After a contact the leapfrog is back at its energy but for the onset, d^(3/2): below h^2.
    assert rig.run(6000).energy() == pytest.approx(before, rel=(1e-6 / 4.6e-5) ** 2)
    assert np.all(rig.device.snapshot(0)["spin"] == 0.0)


@pytest.mark.slow
def test_smooth_spheres_compile_no_friction_and_keep_their_bits(monkeypatch):
    """The least coefficient there is computes friction that no place and no speed can feel."""
    runtime.clear()
    shaken = {"frequency": 8.0, "amplitude": 0.02}
    nearly = Rig(Spheres(friction=0.0, wall_friction=1e-60), 40, DT, **shaken)
    expected_states = nearly.run(5000).state()

    @ti.func
    def forbidden(self, contact, push, slip):
        ti.static_assert(False, "friction was compiled")

    monkeypatch.setattr(ContactLaw, "friction", forbidden)
    smooth = Rig(Spheres(friction=0.0, wall_friction=0.0), 40, DT, **shaken)
    states = smooth.run(5000).state()
    monkeypatch.undo()
    for given, expected in zip(states, expected_states):
        # Zeros alone may differ: forces of 1e-60 of a push, times dt / m and 5000 steps.
        assert given == pytest.approx(expected, rel=0.0, abs=1e-50)
    runtime.clear()
    with pytest.raises(ti.TaichiCompilationError, match="friction was compiled"):
        monkeypatch.setattr(ContactLaw, "friction", forbidden)
        Rig(Spheres(), 2, DT).run(1)
    runtime.clear()
