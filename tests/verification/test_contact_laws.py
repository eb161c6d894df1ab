"""Laws of contact: what one with memory gives back, takes and forgets; steps by the overlap."""

import math

import numpy as np
import pytest
import taichi as ti

from taichi_dem import (
    ImplicitDashpots,
    Material,
    Scene,
    StepControl,
    Uniform,
    effects,
    step_report,
)
from taichi_dem.kit.allocation import values
from taichi_dem.laws.contact_contracts import Push
from taichi_dem.mesh.shapes import placed_together, single
from taichi_dem.simulation import Simulation
from tests.verification.test_body_contact import mirrored
from tests.verification.test_contact_rebound import MU, slope, speeds

EDGE, RESTITUTION, STEP = 0.05, 0.5, 5e-8
AREA = 0.25 * 3**0.5 * EDGE**2
STIFF = Material.from_elastic(
    young=3e10,
    poisson=0.2,
    density=2400.0,
    damping_ratio=1.0,
    tensile_strength=1e7,
    fracture_energy=1e3,
    cohesion=1e7,
    friction_angle=0.0,
)


class Impact:
    """Two equal tetrahedra that fly face to face, mirror images of each other."""

    def __init__(self, method, geometry, stiffness):
        left, right = single(EDGE), mirrored(single(EDGE))
        apart = left.points.mean(axis=0) - right.points.mean(axis=0)
        parts = {"left": (left, (0.0,) * 3), "right": (right, [1e-9, *apart[1:]])}
        law = effects.WaltonBraun(RESTITUTION, stiffness, geometry)
        mesh = placed_together(parts, keep_coincident=True)
        self.scene, self.method = Scene(mesh, STIFF, [law]), method(STEP)
        self.stiffness = stiffness * (39 if geometry.by_face else AREA)

    def meet(self, speed):
        """Simulation in which they have met and parted, and the rate of loading [1/s]."""
        simulation = Simulation(self.scene, self.method)
        rate = math.sqrt(self.stiffness / (0.5 * simulation.model.body_mass[0]))
        way = np.outer([0.5, -0.5], [speed, 0.0, 0.0])
        simulation.state.set_motion(simulation.model.centre, [1.0, 0.0, 0.0, 0.0], way)
        # Quarter periods of loading and unloading, and the way out of what stays pressed in.
        contact = 0.5 * math.pi * (1.0 + RESTITUTION) + (1.0 - RESTITUTION**2) / RESTITUTION
        length = 1.2 * contact / rate + 1e-9 / speed
        simulation.advance_to(round(length / STEP))
        return simulation, rate


@pytest.mark.parametrize(
    ("method", "geometry", "stiffness"),
    [
        (Uniform, effects.BodyGeometry(), 1e13),
        (ImplicitDashpots, effects.BodyGeometry(), 1e13),
        (Uniform, effects.SphereGeometry(), 3e8),
    ],
    ids=["bodies", "solved", "spheres"],
)
def test_what_comes_back_does_not_depend_on_the_speed(method, geometry, stiffness):
    """e of the speed and 1 - e^2 of the energy come back; what has parted is forgotten.

    A step finds the largest overlap to (w dt)^2 / 8, and the end of the contact to a step, in which
    the spring of unloading, w / e, changes the speed by up to (w dt / e)^2 of its own.
    """
    impact = Impact(method, geometry, stiffness)
    for speed in (1e-3, 0.1, 1.0, 10.0, 30.0):
        simulation, rate = impact.meet(speed)
        near = (rate * STEP / RESTITUTION) ** 2
        velocity = simulation.motion()["velocity"][:, 0]
        taken = simulation.energy_balance.account()["hysteresis"]
        assert near < 0.01
        assert velocity[1] - velocity[0] == pytest.approx(RESTITUTION * speed, rel=near)
        given = 0.25 * simulation.model.body_mass[0] * speed**2
        assert taken == pytest.approx((1.0 - RESTITUTION**2) * given, rel=near)
        assert not values(simulation.tables.contact.largest).any()
        simulation.close()


def test_a_block_rests_on_what_it_has_pressed_in():
    """Bonds damp what the contact, elastic below its largest overlap, does not."""
    scene = slope(0.67 * MU, 1.0)
    law = effects.WaltonBraun(RESTITUTION)
    own = [law if effect.role == "contact" else effect for effect in scene.effects]
    assert abs(speeds(Scene(scene.mesh, scene.material, own), [0.3])[0]) < 1e-6


def test_steps_are_judged_by_the_stiffness_of_unloading():
    """Four times that of loading: half the step of a law that gives all back."""
    laws = effects.BodyContact(), effects.WaltonBraun(1.0), effects.WaltonBraun(RESTITUTION)
    reports = (step_report(Scene(single(EDGE), STIFF, [law])) for law in laws)
    linear, lossless, lossy = (report.limits["contact_stiffness"][0] for report in reports)
    assert lossless == linear and lossy == pytest.approx(RESTITUTION * linear, rel=1e-12)


@ti.data_oriented
class Stiffening(effects.ContactLaw):
    """A spring whose force grows with the square of the overlap."""

    def numbers(self, material):
        """Force per square of the overlap [N/m^2]."""
        return (1e15,)

    @ti.func
    def push(self, m, k, touch):
        """Repulsion [N]."""
        return Push(elastic=self.law[m, 0] * touch.overlap * touch.overlap, spent=0.0)

    @ti.func
    def stored(self, m, k, touch):
        """Energy [J]."""
        return self.law[m, 0] * touch.overlap**3 / 3.0

    @ti.pyfunc
    def stiffness_at(self, numbers, overlap):
        """Slope [N/m]."""
        return 2.0 * numbers[0] * overlap


@ti.kernel
def _stiffness(limits: ti.template()) -> ti.f64:
    p = limits.store.near_slot[0]
    limits.count[p] = limits.count_within_margin(p)
    return limits.rates(0)[1]


def stiffening(gap):
    """Two tetrahedra face to face, a gap [m] apart, that meet by this law."""
    left, right = single(EDGE), mirrored(single(EDGE))
    apart = left.points.mean(axis=0) - right.points.mean(axis=0)
    parts = {"left": (left, (0.0,) * 3), "right": (right, [gap, *apart[1:]])}
    law = Stiffening(effects.SphereGeometry())
    return Scene(placed_together(parts, keep_coincident=True), STIFF, [law])


def test_controlled_steps_follow_the_stiffness_at_the_present_overlap():
    """Sixteen times as deep, at rest, is sixteen times as stiff; places of 0.05 m keep 1e-16."""
    simulation = Simulation(stiffening(1e-9), Uniform(1e-6, control=StepControl()))
    simulation.start()
    place, found = simulation.model.centre.copy(), []
    for depth in (1e-6, 1.6e-5):
        place[1, 0] = simulation.model.centre[1, 0] - depth - 1e-9
        simulation.state.set_motion(place)
        simulation.broad_phase.search()
        found.append(_stiffness(simulation.schedule.limits.contact_limits))
    simulation.close()
    assert found[1] == pytest.approx(16.0 * found[0], rel=1e-9) and found[0] > 0.0


def test_bodies_that_overlap_at_the_start_part_by_the_step_that_their_contact_asks_for():
    """The first kick was that of the longest step, which pressed them into each other."""
    controlled = Simulation(stiffening(-1e-6), Uniform(1e-6, control=StepControl()))
    controlled.advance_to(1)
    step = 1e-6 / 2.0 ** int(values(controlled.state.level)[0])
    velocity = controlled.motion()["velocity"]
    controlled.close()
    # Nothing asks for a shorter one.
    equal = Simulation(stiffening(-1e-6), Uniform(step, control=StepControl()))
    equal.advance_to(round(1e-6 / step))
    assert step < 1e-6 and values(equal.state.level)[0] == 0
    assert np.array_equal(equal.motion()["velocity"], velocity)
