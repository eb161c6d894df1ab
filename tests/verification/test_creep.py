"""Bodies that creep where friction would hold them are told, and no others are.

A tetrahedron on a slope, of which ``test_sticking_friction`` says how the ground is made: friction
of 0.4 holds it up to 21.8 degrees.
"""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    ImplicitDashpots,
    Scene,
    checked_mesh,
    effects,
    goals,
    read_mesh,
    simulate,
    solve,
)
from taichi_dem.diagnostics.creep import Creep
from taichi_dem.mesh.shapes import single

GROUND, EDGE, G, MU = 2e4, 0.1, 9.81, 0.4
METHOD = ImplicitDashpots(1e-4)


def slope(degrees, above=1e-6, velocity=0.0):
    """The body above the ground [m], with gravity at an angle and a velocity along it [m/s]."""
    touching = [above, 0.1 * GROUND / math.sqrt(3.0), -0.1 * GROUND]
    body = single(EDGE).points * [-1.0, 1.0, 1.0] + touching
    points = np.vstack([single(GROUND).points, body])
    mesh = checked_mesh(points, [[0, 1, 2, 3], [4, 5, 7, 6]], {"ground": [[1, 2, 3]]})
    material = replace(CONCRETE, contact_stiffness=1e4, contact_damping=5.0, friction=MU)
    angle = math.radians(degrees)
    gravity = effects.Gravity((-G * math.cos(angle), G * math.sin(angle), 0.0))
    moves = [[0.0, 0.0, 0.0], [0.0, velocity, 0.0]]
    return Scene(mesh, material, "auto", loads=[gravity, effects.Fixed("ground")], velocity=moves)


@pytest.mark.parametrize("samples", [4, 200])
@pytest.mark.parametrize(
    ("case", "creeps"),
    [
        ({"degrees": 15.0}, True),
        ({"degrees": 20.0}, True),
        ({"degrees": 15.0, "above": 0.005}, True),
        ({"degrees": 22.5}, False),
        ({"degrees": 30.0}, False),
        ({"degrees": 0.0}, False),
        ({"degrees": 0.0, "above": 0.02}, False),
        ({"degrees": 0.0, "velocity": 1.0}, False),
    ],
)
def test_a_body_creeps_below_the_angle_of_friction_and_slides_or_rests_elsewhere(
    case, creeps, samples
):
    found = simulate(slope(**case), method=METHOD, until=0.3, samples=samples, progress=None)
    assert [one.effect for one in found.report.missing_effects] == ["StickingFriction"] * creeps
    assert found.certificate.holds == (not creeps)
    if creeps:
        share = 100.0 * math.tan(math.radians(case["degrees"])) / MU
        assert f"it takes {share:.2g} % of the friction" in found.report.needs[0]
        assert str(found.certificate).endswith("would hold them: list StickingFriction")


def test_an_answer_of_a_body_that_creeps_is_not_reached():
    asked = {"until": 0.2, "goal": goals.body_displacement(1), "tolerance": 0.1}
    answer = solve(slope(15.0), **asked)
    assert not answer.reached and "list StickingFriction" in answer.shortfall
    assert solve(slope(30.0), **asked).reached


@pytest.mark.slow
def test_fragments_of_a_blast_do_not_creep():
    """They are pressed together for 2 ms, by contacts that give way so slowly."""
    gas = effects.GasPressure("hole", peak=575e6, rise=1.33e-4, decay_ratio=2.75)
    scene = Scene(read_mesh(PAPER_BLOCK), CONCRETE, "auto", loads=[gas])
    found = simulate(scene, method=ImplicitDashpots(4e-7), until=1e-3)
    assert found.certificate.holds and not found.report.missing_effects


class MadeUp:
    """Two bodies of 1 kg of which the second slides along x, without a simulation."""

    def __init__(self):
        self.place, self.pair = np.zeros((2, 3)), (0.0, 1.0, 0.0)
        top = SimpleNamespace(master=np.zeros(0, int), slave=np.zeros(0, int))
        constants = {"contact_stiffness": 1e6, "contact_damping": 1e2}
        model = SimpleNamespace(
            body_count=2,
            bond_count=0,
            body_mass=np.ones(2),
            topology=top,
            materials=SimpleNamespace(of_contacts=constants.get),
        )
        position = SimpleNamespace(to_numpy=lambda: self.place)
        broken = SimpleNamespace(to_numpy=lambda: np.zeros(0, int))
        state = SimpleNamespace(position=position, broken_tick=broken)
        self.creep = Creep(model, state, self)

    def rubbing(self):
        force, bound, speed = self.pair
        return np.array([[0, 1]]), np.array([[force], [bound], [force * speed]])

    def looks(self, speeds, force, bound=1.0, dt=1e-2, first=0.0):
        """Numbers of bodies that creep, at looks between which the body moves at some speeds."""
        found = []
        for k, speed in enumerate(speeds):
            self.place[1, 0] += dt * speed * (k > 0)
            self.pair = force(speed), bound, abs(speed)
            found.append(len(self.creep.sample(first + k * dt)))
        return found


def test_a_drag_that_stops_a_body_is_no_creep():
    """Of 10 N s/m: its speed falls by a tenth a look, and its impulse is its momentum at most."""
    speeds = 0.09 * 0.9 ** np.arange(100)
    assert not any(MadeUp().looks(speeds, lambda v: 10.0 * v))


def test_a_body_that_goes_to_and_fro_or_slips_does_not_creep():
    turning = 0.05 * (-1.0) ** np.arange(200)
    assert not any(MadeUp().looks(turning, lambda v: 10.0 * abs(v)))
    assert not any(MadeUp().looks(np.full(200, 0.05), lambda v: 1.0))


def test_a_body_that_slides_on_creeps_once_the_drag_would_have_stopped_it_ten_times():
    """0.5 N at 0.05 m/s: its momentum is 0.05 N s, which the drag gives in 0.1 s, or 10 looks."""
    found = MadeUp().looks(np.full(200, 0.05), lambda v: 0.5)
    assert found == [2 * (k > 100) for k in range(200)]


def test_a_checkpoint_goes_on_as_if_nothing_were():
    straight, first, second = MadeUp(), MadeUp(), MadeUp()
    speeds = np.full(120, 0.05)
    whole = straight.looks(speeds, lambda v: 0.5)
    first.looks(speeds[:60], lambda v: 0.5)
    second.creep.resume(first.creep.saved())
    second.place[:] = first.place
    second.place[1, 0] += 5e-4
    assert second.looks(speeds[60:], lambda v: 0.5, first=0.6) == whole[60:]
    assert second.creep.words() == straight.creep.words()
