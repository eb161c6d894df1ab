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

from taichi_dem import CONCRETE, ImplicitDashpots, Scene, Simulation, Uniform, checked_mesh, effects
from taichi_dem.mesh.shapes import single

EPS = np.finfo(float).eps
GROUND, EDGE, G, MU = 2e4, 0.1, 9.81, 0.3
STEP = 1e-4
#: The body shakes at 1.2e3 rad/s on its contacts; their dashpots, near critical, end that in this.
SETTLED = 0.5
METHODS = {"implicit": ImplicitDashpots(STEP), "uniform": Uniform(STEP)}


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


def test_a_body_below_the_friction_angle_stays():
    """It stays to what its place, 2 km from the origin, is known to; a thousandfold at most.

    The stretch of the springs before was 1e-5 m. Nothing is spent at rest. Velocities are half a
    step old: the account of the shaking before is as good as w dt / 2 = 0.06 of what it lost, here
    better by ten.
    """
    run = Slope(0.2, effects.StickingFriction(), METHODS["implicit"])
    first, _ = run.go(SETTLED)
    settled = run.account
    last, speed = run.go(2.0)
    assert abs(last - first) < 1000 * EPS * GROUND and abs(speed) < 1000 * EPS * GROUND / STEP
    assert run.account["friction"] == pytest.approx(settled["friction"], rel=1e-6)
    assert abs(run.account["residual"]) < 0.006 * run.account["load_work"]


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
        self.simulation = Simulation(scene, METHODS["implicit"])
        self.law = self.simulation.tables.friction
        self.stiffness = ratio * scene.material.contact_stiffness

    def move(self, normal, way, bound):
        """Stretch by a way [m], slip to a bound [N]; force (3,) [N], stored and spent [J]."""
        found = np.zeros(5)
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
