"""Friction that sticks: a tetrahedron on a slope, and the spring between two spheres alone.

The ground is one tetrahedron so large that a sphere behind its face is a plane: 4.9 km of radius,
under which the face of the body, 0.1 m wide, lies flat to 2e-7 m, while weight presses it in by
1e-5 m. Gravity is inclined, not the ground.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
import taichi as ti

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    InputError,
    Multirate,
    Scene,
    Simulation,
    Uniform,
    checked_mesh,
    effects,
)
from taichi_dem.effects.base import Effect
from taichi_dem.mesh.shapes import single
from tests.slow import slow_but

EPS = np.finfo(float).eps
GROUND, EDGE, G, MU = 2e4, 0.1, 9.81, 0.3
STEP = 1e-4
#: The body shakes at 1.2e3 rad/s on its contacts; their dashpots, near critical, end that in this.
SETTLED = 0.5
METHODS = {
    "uniform": Uniform(STEP),
    "multirate": Multirate(STEP, 1e-7),
    "implicit": ImplicitDashpots(STEP),
}


def slope(tangent, friction):
    """The body at rest just above the ground, with gravity at an angle of a tangent."""
    touching = [0.0, 0.1 * GROUND / math.sqrt(3.0), -0.1 * GROUND]
    body = single(EDGE).points * [-1.0, 1.0, 1.0] + touching + [1e-6, 0.0, 0.0]
    points = np.vstack([single(GROUND).points, body])
    mesh = checked_mesh(points, [[0, 1, 2, 3], [4, 5, 7, 6]], {"ground": [[1, 2, 3]]})
    material = replace(CONCRETE, contact_stiffness=1e4, contact_damping=5.0, friction=MU)
    angle = math.atan(tangent)
    gravity = effects.Gravity((-G * math.cos(angle), G * math.sin(angle), 0.0))
    contact = effects.SphereContact(outer_faces=True)
    return Scene(mesh, material, [gravity, effects.Fixed("ground"), contact, friction])


class Slope:
    """A run on a slope; heights and ways are those of the body since its start."""

    def __init__(self, tangent, friction, method):
        self.simulation = Simulation(slope(tangent, friction), method)

    def go(self, time_s):
        """Way down the slope [m] and speed [m/s] at a time."""
        self.simulation.advance_to(round(time_s / STEP))
        motion = self.simulation.state.motion()
        way = motion["position"][1] - self.simulation.model.centre[1]
        return way[1], motion["velocity"][1, 1]

    @property
    def account(self):
        """Terms of the energy balance [J]."""
        return self.simulation.energy_balance.account()


def stays(method, until):
    """The way between being settled and a time, and how well the account closes."""
    run = Slope(0.2, effects.StickingFriction(), method)
    first, _ = run.go(SETTLED)
    account = run.account
    last, speed = run.go(until)
    return abs(last - first), abs(speed), account, run.account


def check_rest(way, speed, settled, account):
    """It stays to what its place, 2 km from the origin, is known to; a thousandfold at most.

    The stretch of the springs before was 1e-5 m. Nothing is spent at rest. Velocities are half a
    step old: the account of the shaking before is as good as w dt / 2 = 0.06 of what it lost, here
    better by ten.
    """
    assert way < 1000 * EPS * GROUND and speed < 1000 * EPS * GROUND / STEP
    assert account["friction"] == pytest.approx(settled["friction"], rel=1e-6)
    assert abs(account["residual"]) < 0.006 * account["load_work"]


@pytest.mark.parametrize("name", slow_but(METHODS, "implicit"))
def test_a_body_below_the_friction_angle_stays(name):
    check_rest(*stays(METHODS[name], 2.0))


@pytest.mark.slow
@pytest.mark.parametrize("name", METHODS)
def test_a_body_below_the_friction_angle_stays_for_a_million_steps(name):
    check_rest(*stays(METHODS[name], 1e6 * STEP))


@pytest.mark.slow
def test_friction_without_a_spring_creeps():
    """So the tests above would fail: weight drives it against 39 dashpots."""
    run = Slope(0.2, effects.Friction(), METHODS["uniform"])
    first, _ = run.go(SETTLED)
    way, speed = run.go(2.0)
    assert way - first == pytest.approx(speed * (2.0 - SETTLED), rel=0.01)
    assert speed > 1e-3


@pytest.mark.parametrize("name", METHODS)
def test_a_body_above_the_friction_angle_slides_as_coulomb_says(name):
    """g (sin - mu cos), and friction takes mu m g cos times the way.

    The normal force still swings by 1e-3 of the weight at 0.1 s, about a mean of none.
    """
    tangent, times = 0.5, (0.1, 0.2)
    run = Slope(tangent, effects.StickingFriction(), METHODS[name])
    _, slow = run.go(times[0])
    last, fast = run.go(times[1])
    angle = math.atan(tangent)
    wanted = G * (math.sin(angle) - MU * math.cos(angle))
    assert (fast - slow) / (times[1] - times[0]) == pytest.approx(wanted, rel=1e-3)
    account, mass = run.account, run.simulation.model.body_mass[1]
    heat = MU * mass * G * math.cos(angle) * last
    assert account["friction"] == pytest.approx(heat, rel=0.01)
    assert abs(account["residual"]) < 1e-3 * account["load_work"]


@ti.data_oriented
class Spring:
    """The spring of one sphere pair, moved by hand."""

    def __init__(self, ratio=0.5):
        scene = slope(0.2, effects.StickingFriction(ratio))
        self.simulation = Simulation(scene, METHODS["uniform"])
        self.law = self.simulation.tables.friction
        self.stiffness = ratio * scene.material.contact_stiffness

    def move(self, normal, way, bound):
        """Stretch by a way [m], slip to a bound [N]; force (3,) [N], stored and spent [J]."""
        found = np.zeros(5)
        self.simulation.loan.activate()
        self._move(ti.Vector(list(normal)), ti.Vector(list(way)), bound, found)
        return found[:3], found[3], found[4]

    @ti.kernel
    def _move(
        self,
        normal: ti.types.vector(3, ti.f64),
        way: ti.types.vector(3, ti.f64),
        bound: ti.f64,
        found: ti.types.ndarray(dtype=ti.f64, ndim=1),
    ):
        for _ in range(1):
            self.law.follow(0, normal, way)
            found[4] = self.law.slip(0, 0, bound, way)
            force = self.law.spring(0, 0)
            for c in ti.static(range(3)):
                found[c] = force[c]
            found[3] = self.law.stored(0, 0)


@pytest.fixture(scope="module")
def spring():
    """One for the tests of the law alone."""
    return Spring()


def test_work_is_what_the_spring_stores_and_slipping_takes(spring):
    """On a winding way in the plane, the bound rising and falling, by the mean of two forces.

    Each of the n sums rounds by eps of the work done.
    """
    random, steps = np.random.default_rng(4), 400
    before, _, _ = spring.move((1, 0, 0), (0, 0, 0), 0.0)
    work = heat = slipped = 0.0
    for step in range(steps):
        way = np.array([0.0, *(1e-5 * random.standard_normal(2))])
        bound = 0.05 * (1.2 + math.sin(0.1 * step))
        force, stored, spent = spring.move((1, 0, 0), way, bound)
        assert np.linalg.norm(force) <= bound * (1 + 4 * EPS)
        work -= 0.5 * (before + force) @ way
        heat, before = heat + spent, force
        slipped += spent > 0.0
    assert 0.2 * steps < slipped < steps
    assert work == pytest.approx(stored + heat, rel=steps * EPS)


def test_the_spring_is_linear_and_turns_with_the_contact(spring):
    """Its force is stiffness times way; in another plane it is as long, at right angles to that."""
    spring.move((1, 0, 0), (0, 0, 0), 0.0)
    force, stored, _ = spring.move((1, 0, 0), (0, 3e-6, 4e-6), 1e9)
    assert force == pytest.approx([0.0, -3e-6 * spring.stiffness, -4e-6 * spring.stiffness])
    normal = np.array([1.0, 2.0, 2.0]) / 3.0
    turned, still, spent = spring.move(normal, (0, 0, 0), 1e9)
    assert turned @ normal == pytest.approx(0.0, abs=8 * EPS * np.linalg.norm(force))
    assert still == pytest.approx(stored, rel=8 * EPS) and spent == 0.0


@pytest.mark.parametrize("ratio", [0.0, -1.0, 1.5, math.nan, "stiff"])
def test_a_ratio_out_of_range_is_refused(ratio):
    with pytest.raises(InputError, match="stiffness_ratio must be a number from 1e-06 to 1, got"):
        effects.StickingFriction(ratio)


def test_two_kinds_of_friction_are_refused():
    both = [effects.SphereContact(), effects.Friction(), effects.StickingFriction()]
    with pytest.raises(InputError, match="friction and sticking_friction both take the role"):
        Scene(single(), CONCRETE, both)


class Unbounded(Effect):
    """A friction law of one's own that names no limit."""

    role, name = "friction", "unbounded"


def test_friction_without_a_limit_is_refused():
    with pytest.raises(InputError, match="effect Unbounded must have a member limit, as its role"):
        slope(0.2, Unbounded())
