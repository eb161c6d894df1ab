"""Contact of whole bodies: its energy, of which forces are the gradient; nothing from a break.

Contact of bodies of different sizes, that hit fast, or begin in each other.
"""

from dataclasses import replace

import numpy as np
import pytest
import taichi as ti

from taichi_dem import (
    CONCRETE,
    Scene,
    Simulation,
    Uniform,
    checked_mesh,
    effects,
)
from taichi_dem.kit.allocation import assign, values
from taichi_dem.mesh.shapes import bar, placed_together, single
from taichi_dem.physics.rotation import place_in
from taichi_dem.simulate import run_simulation
from tests.scenes import matrix, quaternion

LOSSLESS = replace(CONCRETE, normal_damping=0.0, shear_damping=0.0, friction=0.0)
STIFFNESS = CONCRETE.normal_stiffness
PARTS, MIRROR = ("normal", "shear"), np.array([-1.0, 1.0, 1.0])
EDGE, SPEED = 0.05, 200.0
X, DOWN = np.array([1.0, 0.0, 0.0]), quaternion([0.0, 0.0, 1.0], -0.5 * np.pi)
INRADIUS = EDGE / 24**0.5


def mirrored(body):
    """The mirror image of a tetrahedron at x = 0, where it has a face."""
    return checked_mesh(body.points * MIRROR, [[0, 2, 1, 3]], {})


class Placed:
    """Two solids that may be put anywhere, as if they had been apart before."""

    def __init__(self, first, second, dt=1e-9, parts=3):
        parts_of = {"first": (first, (0.0,) * 3), "second": (second, (1.0, 0.0, 0.0))}
        mesh = placed_together(parts_of, keep_coincident=True)
        listed = [effects.BodyContact(parts=parts)]
        self.simulation = Simulation(Scene(mesh, LOSSLESS, listed), Uniform(dt))
        self.model, self.state = self.simulation.model, self.simulation.state
        self.moving = np.arange(self.model.body_count) >= first.body_count
        self.simulation.start()
        self.middle = self.model.centre[self.moving].mean(axis=0)

    def put(self, place, orientation=(1.0, 0.0, 0.0, 0.0), apart_before=True):
        """Put the middle of the second solid at a place, and search."""
        position, turned = self.model.centre.copy(), np.tile([1.0, 0, 0, 0], (len(self.moving), 1))
        arms = (position[self.moving] - self.middle) @ matrix(np.array(orientation)).T
        position[self.moving] = place + arms
        turned[self.moving] = orientation
        self.state.set_motion(position, turned)
        self.simulation.broad_phase.search()
        rest = self.simulation.contacts.geometry.rest
        if apart_before:
            assign(rest, np.tile([0.0, 1.0], (len(values(rest)), 1)))

    def energy(self):
        """Elastic energy of all contacts [J]."""
        return self.simulation.energy_balance.account()["sphere_strain"]


def test_flat_sides_that_overlap_have_the_energy_of_their_bond():
    """k A d^2 / 2, less what pyramids are narrower at a depth d below the face: (1 - d / r)^2."""
    body = single(0.05)
    placed = Placed(body, mirrored(body))
    law = placed.simulation.contacts.geometry
    volume, area = values(law.volume)[0], values(law.face_area)[0]
    radius = 3.0 * volume / (4.0 * area)
    for depth in (1e-6, 1e-4):
        placed.put(placed.model.centre[0] * MIRROR - [depth, 0.0, 0.0])
        flat = 0.5 * STIFFNESS * area * depth**2
        assert (1.0 - depth / radius) ** 2 * flat <= placed.energy() <= (1.0 + 1e-9) * flat


def test_an_overlap_at_the_start_is_at_rest_until_it_shrinks():
    """Nothing is injected, and what the bodies part by counts when they come back."""
    body, depth = single(0.05), 1e-5
    placed = Placed(body, mirrored(body))
    area, found = values(placed.simulation.contacts.geometry.face_area)[0], []
    image = placed.model.centre[0] * MIRROR
    for step, share in enumerate((1.0, 0.5, 1.0)):
        placed.simulation.advance_to(step)
        placed.put(image - [share * depth, 0.0, 0.0], apart_before=False)
        found.append(placed.energy())
    flat = 0.5 * STIFFNESS * area * (0.5 * depth) ** 2
    assert found[:2] == [0.0, 0.0]
    assert found[2] == pytest.approx(flat, rel=0.01)


@ti.kernel
def _gap(geometry: ti.template(), state: ti.template()) -> ti.f64:
    branch = state.position[1] - state.position[0]
    turn, offset = place_in(state.rotation(0), state.rotation(1), branch)
    return geometry.outside(0, 1, turn, offset, 0.0)


def test_bodies_that_move_less_than_their_gap_do_not_touch():
    """The gap bounds how far any point of one may go before a ray of one is in the other."""
    placed, random = Placed(single(0.05), single(0.06)), np.random.default_rng(3)
    geometry, state, tried = placed.simulation.contacts.geometry, placed.state, 0
    while tried < 60:
        orientation = random.standard_normal(4)
        orientation /= np.linalg.norm(orientation)
        place = placed.model.centre[0] + random.standard_normal(3) * 0.03
        placed.put(place, orientation)
        gap = _gap(geometry, state)
        if gap > 1e-5:
            tried += 1
            for way in (*np.eye(3), *-np.eye(3)):
                placed.put(place + 0.999 * gap * way, orientation)
                assert placed.energy() == 0.0


def touching(placed, random, count):
    """Places and orientations in which two tetrahedra overlap by less than a fifth."""
    found = []
    while len(found) < count:
        orientation = random.standard_normal(4)
        orientation /= np.linalg.norm(orientation)
        place = placed.model.centre[0] + random.standard_normal(3) * 0.02
        placed.put(place, orientation)
        if 1e-3 < placed.energy() < 1e4:
            found.append((place, orientation))
    return found


def test_the_force_is_the_gradient_of_the_energy_and_conserves_momentum():
    """Central differences of the way h are off by h / depth squared of themselves."""
    placed, random = Placed(single(0.05), single(0.06)), np.random.default_rng(2)
    h = 1e-9
    for place, orientation in touching(placed, random, 6):
        slope = np.zeros(3)
        for axis in range(3):
            for sign in (-1.0, 1.0):
                placed.put(place + sign * h * np.eye(3)[axis], orientation)
                slope[axis] += sign * placed.energy() / (2.0 * h)
        placed.put(place, orientation)
        # Impulses and moments in half a step on the first body, then on the second.
        (table,) = placed.simulation.readings.contacts_now()
        pushed = np.stack([table["on_first"], table["on_second"]]).reshape(2, 2, 3) / (
            0.5 * placed.simulation.method.dt0
        )
        size = np.linalg.norm(slope)
        assert pushed[1, 0] == pytest.approx(-slope, rel=0, abs=1e-6 * size)
        assert np.abs(pushed[:, 0].sum(axis=0)).max() < 1e-12 * size
        arms = placed.simulation.motion()["position"]
        turning = pushed[:, 1].sum(axis=0) + np.cross(arms, pushed[:, 0]).sum(axis=0)
        assert np.abs(turning).max() < 1e-12 * size
        # Forces on the second times arms from the first, of which stresses are made: but for a
        # twist about the normal, their skew part is the moment.
        skew = table["leverage"] - table["leverage"].T
        apart = pushed[0, 1] + [skew[2, 1], skew[0, 2], skew[1, 0]]
        assert np.abs(np.cross(apart, slope)).max() < 1e-6 * size * np.abs(pushed[0, 1]).max()


@pytest.mark.parametrize("size", [0.1, 1.0])
def test_a_small_body_on_a_large_face_has_the_energy_of_its_own_face(size):
    """Wherever it lies: the rays of the large body are far apart."""
    placed, depth = Placed(bar(size, size, (1, 1, 1)), single(EDGE)), 1e-5
    flat = 0.5 * CONCRETE.normal_stiffness * 0.25 * 3**0.5 * EDGE**2 * depth**2
    for x, z in np.random.default_rng(1).uniform(0.35, 0.65, (12, 2)):
        placed.put([x * size, size + INRADIUS - depth, z * size], DOWN)
        assert placed.energy() == pytest.approx(flat, rel=0.01)


def run(parts, until, turn=(1.0, 0.0, 0.0, 0.0), velocity=0.0):
    """Report of a run of bodies, and their motion at its end."""
    scene = Scene(placed_together(parts), LOSSLESS, [effects.BodyContact(restitution=1.0)])
    simulation = Simulation(scene, Uniform(1e-7))
    simulation.state.set_motion(simulation.model.centre, turn, velocity)
    return run_simulation(simulation, until=until, progress=None).report, simulation.motion()


def test_none_passes_another_that_it_hits_at_200_m_s():
    """Sixty aims at bodies of any orientation, most of them vertex or edge first."""
    random, parts = np.random.default_rng(0), {}
    turn = random.standard_normal((120, 4))
    turn /= np.linalg.norm(turn, axis=1)[:, None]
    for k in range(60):
        corners = single(EDGE).points - single(EDGE).points.mean(axis=0)
        aim = matrix(turn[2 * k]) @ (random.dirichlet(np.ones(4)) @ corners)
        at = np.array([0.0, 0.0, k])
        shot = at + aim * [0.0, 1.0, 1.0] - 1.25 * EDGE * X
        parts |= {f"at{k}": (single(EDGE), at), f"shot{k}": (single(EDGE), shot)}
    report, motion = run(parts, 3.0 * EDGE / SPEED, turn, np.outer(np.arange(120) % 2, SPEED * X))
    apart, away = (motion[name][1::2] - motion[name][::2] for name in ("position", "velocity"))
    assert 0.01 < report.interpenetration.share < 0.1
    assert abs(report.energy_residual_fraction) < 1e-3
    assert (np.einsum("ni,ni->n", apart, away) > 0.0).all()
