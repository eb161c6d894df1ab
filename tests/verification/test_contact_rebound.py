"""Restitution and stiffness of bodies that meet; blocks on slopes rest, slide, or are told to hop.

A slope is a plate of 96 bodies under inclined gravity, with a cube of 48 bodies on it.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Material,
    Scene,
    SimulationDiverged,
    StepControl,
    Uniform,
    effects,
    simulate,
    step_report,
)
from taichi_dem.kit.allocation import values
from taichi_dem.laws.contact import damping_ratio
from taichi_dem.mesh.shapes import bar, placed_together, single
from taichi_dem.simulate import run_simulation
from taichi_dem.simulation import Simulation
from tests.structures import POST, filled
from tests.verification.test_body_contact import mirrored

EDGE, G, MU, STEP = 0.05, 9.81, 0.4, 4e-5
AREA = 0.25 * 3**0.5 * EDGE**2


class Pair:
    """A tetrahedron that flies face first onto the face of a larger one, centre onto centre."""

    def __init__(self, size, step, method=Uniform, **contact):
        first, second = single(size), mirrored(single(EDGE))
        apart = first.points.mean(axis=0) - second.points.mean(axis=0)
        parts = {"first": (first, (0.0,) * 3), "second": (second, [1e-9, *apart[1:]])}
        mesh = placed_together(parts | POST, keep_coincident=True)
        law = effects.BodyContact(**contact)
        laws = filled("bodies", law, group="post_base")
        #: The same with nothing that could rub.
        self.smooth = Scene(mesh, CONCRETE, [law])
        scene = Scene(mesh, replace(CONCRETE, friction=0.0), laws)
        self.simulation = Simulation(scene, method(step))
        self.mass = self.simulation.model.body_mass[:2]
        stiffness = contact.get("stiffness") or CONCRETE.normal_stiffness
        self.pair_mass = self.mass.prod() / self.mass.sum()
        self.rate = math.sqrt(stiffness * AREA / self.pair_mass)

    def rebound(self, speed=1.0):
        """Speed of parting over that of meeting, after two half periods of the contact."""
        share = self.mass[::-1] / self.mass.sum()
        meets = np.outer([*(speed * share * [1.0, -1.0]), 0.0], [1.0, 0.0, 0.0])
        centre = self.simulation.model.centre
        self.simulation.state.set_motion(centre, [1.0, 0.0, 0.0, 0.0], meets)
        self.simulation.advance_to(round(2.0 * math.pi / self.rate / self.simulation.method.dt0))
        return np.diff(self.simulation.motion()["velocity"][:2, 0])[0] / speed


@pytest.mark.parametrize("method", [Uniform, ImplicitDashpots])
@pytest.mark.parametrize("restitution", [1.0, 0.5, 0.1])
@pytest.mark.parametrize("size", [EDGE, 0.2])
def test_two_bodies_part_at_the_stated_share_of_their_speed(size, restitution, method):
    """m x'' = -max(0, k A x + 2 z sqrt(k A m) x'), which ends at -ln e = 2 z acos(z) / sqrt(1-z^2).

    A step knows the speed of half a step before, and the end of the contact to a step: both change
    the momentum by the share 2 z w dt that the dashpot takes in one, the springs by (w dt)^2.
    """
    pair, ratio = Pair(size, 1e-7, method, restitution=restitution), damping_ratio(restitution)
    way = pair.rate * pair.simulation.method.dt0
    assert pair.rebound() == pytest.approx(restitution, rel=(2.0 * ratio + way) * way)


@pytest.mark.parametrize("restitution", [1.0, 0.7, math.exp(-2.0), 0.05, 0.01])
def test_the_damping_ratio_gives_its_restitution(restitution):
    """By the closed form, from z = cos(t) or cosh(t): critical damping rebounds by exp(-2)."""
    ratio = damping_ratio(restitution)
    t = np.emath.arccos(ratio)
    lost = 2.0 * t / np.tan(t) if abs(ratio - 1.0) > 1e-12 else 2.0
    assert math.exp(-np.real(lost)) == pytest.approx(restitution, rel=1e-9)


def test_a_stiffness_of_its_own_is_that_of_the_contact_and_of_its_limits():
    """Four times that of the bond: half the time of contact, and half the stable steps."""
    reports = {}
    for factor in (1.0, 4.0):
        pair = Pair(EDGE, 1e-7, stiffness=factor * CONCRETE.normal_stiffness)
        assert pair.rebound() == pytest.approx(0.1, rel=3.0 * pair.rate * 1e-7)
        reports[factor] = step_report(pair.simulation.scene).limits
        pair.simulation.close()
    for name in ("contact_stiffness", "contact_dashpot"):
        assert reports[1.0][name] == pytest.approx(2.0 * reports[4.0][name], rel=1e-12)


def test_a_dashpot_kicks_back_from_the_reported_limit_on():
    """Head on a pair of equal bodies changes its speed by 1 - 2 c dt / m in a step.

    With c = 2 z sqrt(k A m / 2) that is -1 from dt = m / c on, the limit without friction.
    """
    pair = Pair(EDGE, 1e-7, restitution=0.05)
    dashpot = (
        2.0 * damping_ratio(0.05) * math.sqrt(CONCRETE.normal_stiffness * AREA * pair.pair_mass)
    )
    known = step_report(pair.smooth).limits["contact_dashpot"]
    assert known[:2].min() == pytest.approx(pair.mass[0] / dashpot, rel=1e-9)


def test_controlled_steps_know_the_dashpot_of_the_pair():
    """Face to face and centre to centre without friction, the rate of each is c over its mass."""
    pair = Pair(0.2, 1e-7, restitution=0.05)
    dashpot = 2.0 * damping_ratio(0.05) * pair.rate * pair.pair_mass
    simulation = Simulation(pair.smooth, Uniform(1e-7, control=StepControl()))
    simulation.state.set_motion(
        simulation.model.centre, velocity=np.outer([0.1, -0.1, 0.0], [1.0, 0.0, 0.0])
    )
    simulation.advance_to(3)
    known = values(simulation.schedule.limits.contact_damping, slice(2))
    assert known == pytest.approx(dashpot / pair.mass, rel=1e-9)


def test_one_controlled_step_is_from_the_start_the_shortest_that_a_body_needs():
    """One of three turns by 0.1 rad in the largest step, where 0.02 are borne: an eighth of it."""
    simulation = Simulation(Pair(0.2, 1e-7).smooth, Uniform(1e-7, control=StepControl()))
    spin = np.outer([0.0, 1.0, 0.0], [1e6, 0.0, 0.0])
    simulation.state.set_motion(simulation.model.centre, spin=spin)
    simulation.start()
    assert values(simulation.state.level, slice(3)).tolist() == [3, 3, 3]


def test_a_body_that_sinks_in_is_advised_of_the_stiffness_of_contact():
    """And not of a constant that all bonds share."""
    soft = Pair(EDGE, 1e-6, stiffness=1e6)
    with pytest.raises(SimulationDiverged) as diverged:
        soft.rebound(200.0)
    assert list(diverged.value.advice) == ["stiffness"]
    assert diverged.value.advice["stiffness"] > 1e6 and "BodyContact(" in str(diverged.value)


def slope(tangent, damping, **contact):
    """A cube on a plate under gravity at an angle of a tangent, and the way down."""
    elastic = {"young": 3e7, "poisson": 0.2, "density": 2400.0, "damping_ratio": damping}
    strong = {"tensile_strength": 1e6, "fracture_energy": 1e6, "cohesion": 1e6}
    rough = math.degrees(math.atan(MU))
    material = Material.from_elastic(**elastic, **strong, friction_angle=rough)
    plate, cube = bar(0.05, 0.4, (1, 4, 4)), bar(0.1, 0.1, (2, 2, 2))
    parts = {"plate": (plate, (-0.05, -0.2, -0.2)), "cube": (cube, (1e-9, -0.05, -0.05))}
    angle = math.atan(tangent)
    weight = effects.Gravity((-G * math.cos(angle), G * math.sin(angle), 0.0))
    own = effects.BondDamping(), effects.BodyContact(**contact), effects.Fixed("plate_left")
    return Scene(placed_together(parts), material, filled("bodies", *own, weight))


def speeds(scene, times):
    """Mean velocity of the cube down the slope at some times [m/s]."""
    simulation, found = Simulation(scene, ImplicitDashpots(STEP)), []
    for time_s in times:
        simulation.advance_to(round(time_s / STEP))
        mass = simulation.model.body_mass[-48:]
        found.append(mass @ simulation.motion()["velocity"][-48:, 1] / mass.sum())
    return np.array(found)


@pytest.mark.parametrize("damping", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("share", [0.67, 0.94])
def test_a_block_below_its_friction_rests_however_its_bonds_are_damped(share, damping):
    """With the dashpots of its bonds it slid at 2 mm/s for ever."""
    assert abs(speeds(slope(share * MU, damping), [0.3])[0]) < 1e-5


@pytest.mark.parametrize(("damping", "contact"), [(0.1, {}), (1.0, {"restitution": 1.0})])
def test_a_block_above_its_friction_slides_as_coulomb_says(damping, contact):
    """g (sin - mu cos), but for what dashpots take of bodies that slide over edges between faces.

    That is a drag, at 0.06 m/s 0.2 % of the friction by default and none of it without a dashpot.
    """
    angle = math.atan(1.05 * MU)
    friction = 0.15 * G * MU * math.cos(angle)
    early, late = speeds(slope(1.05 * MU, damping, **contact), [0.15, 0.3])
    drag = (0.15 * G * math.sin(angle) - late + early) / friction - 1.0
    assert -1e-4 < drag < (1e-4 if contact else 3e-3)


@pytest.mark.parametrize(
    ("tangent", "restitution", "hops"),
    [(0.268, 0.8, True), (0.268, 0.1, False), (0.42, 0.8, False), (0.0, 0.8, False)],
)
def test_a_report_names_bodies_that_hop(tangent, restitution, hops):
    """A hop goes on at one speed: no block that rests, slides or comes to rest is one."""
    scene = slope(tangent, 0.01, restitution=restitution)
    report = simulate(scene, method=ImplicitDashpots(STEP), until=0.3, progress=None).report
    assert [words for words in report.unresolved if "hop" in words] == [*report.unresolved][:hops]
    assert bool(report.unresolved) == hops


def test_a_block_that_bounces_does_not_hop():
    """It falls by a millimetre, with a speed along the plate."""
    scene = slope(0.0, 0.01, restitution=0.9)
    simulation = Simulation(scene, ImplicitDashpots(STEP))
    place, moves = simulation.model.centre.copy(), np.zeros((144, 3))
    place[-48:, 0] += 1e-3
    moves[-48:] = [0.0, 0.1, 0.03]
    simulation.state.set_motion(place, velocity=moves)
    assert not run_simulation(simulation, until=0.3, progress=None).report.unresolved
