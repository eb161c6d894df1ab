"""Contact of spheres with faces: geometry, energy, momentum, and sliding without interlocking."""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    ImplicitDashpots,
    Scene,
    Simulation,
    SimulationDiverged,
    Uniform,
    checked_mesh,
    effects,
)
from taichi_dem.mesh.shapes import single
from tests.faces import AtABlock, cracked, ring
from tests.sliding import GRAVITY, STEP, sliding, tetrahedron

EPS = np.finfo(float).eps
LOSSLESS = replace(CONCRETE, contact_damping=0.0)


@pytest.fixture(params=[cracked, ring], ids=lambda make: make.__name__)
def at_a_block(request):
    """A tetrahedron that is put at a block, without bonds' dashpots."""
    return AtABlock(request.param(), LOSSLESS)


def touching(scene, random, count):
    """Places and orientations in which some sphere touches, and none by most of its radius."""
    found = []
    while len(found) < count:
        drawn = scene.drawn(random)
        scene.put(*drawn)
        gaps, within = scene.gaps()
        if -1e-3 < gaps.min() < -1e-5 and not within:
            found.append(drawn)
    return found


def test_an_intact_block_does_not_touch_itself(at_a_block):
    at_a_block.put((1.0, 1.0, 1.0), (1.0, 0.0, 0.0, 0.0))
    # Spheres of different faces of bodies touch their own planes to a rounding of 0.1 m.
    count = at_a_block.simulation.contacts.store.sphere_count[None]
    assert at_a_block.energy() <= 0.5 * CONCRETE.contact_stiffness * (8 * EPS * 0.1) ** 2 * count


def test_energy_is_that_of_the_nearest_free_faces_of_every_body(at_a_block):
    """A sphere and a body touch at one point, in whichever order faces and bodies are numbered."""
    random = np.random.default_rng(1)
    for drawn in touching(at_a_block, random, 12):
        at_a_block.put(*drawn)
        overlap = np.maximum(0.0, -at_a_block.gaps()[0])
        wanted = 0.5 * CONCRETE.contact_stiffness * (overlap**2).sum()
        # Distances of 0.1 m are known to some roundings.
        error = CONCRETE.contact_stiffness * (overlap * 100 * EPS * 0.1).sum()
        assert at_a_block.energy() == pytest.approx(wanted, abs=error)


def test_energy_changes_continuously(at_a_block):
    """No distance changes by more than the way h, so that each contact adds at most k (o + h) h.

    Over edges, corners that are not convex, and closed cracks.
    """
    random, h = np.random.default_rng(3), 1e-9
    for place, orientation in touching(at_a_block, random, 10):
        way = random.standard_normal(3)
        found = []
        for sign in (-1.0, 1.0):
            at_a_block.put(place + 0.5 * sign * h * way / np.linalg.norm(way), orientation)
            found.append(at_a_block.energy())
        overlap = np.maximum(0.0, h - at_a_block.gaps()[0])
        assert abs(found[1] - found[0]) <= CONCRETE.contact_stiffness * h * overlap.sum()


def test_the_force_is_the_gradient_of_the_energy_and_conserves_momentum(at_a_block):
    """Central differences are off by h times the sum of stiffnesses, where contacts begin."""
    random, h, dt = np.random.default_rng(2), 1e-9, 1e-9
    for place, orientation in touching(at_a_block, random, 4):
        slope = np.zeros(3)
        for axis in range(3):
            for sign in (-1.0, 1.0):
                at_a_block.put(place + sign * h * np.eye(3)[axis], orientation)
                slope[axis] += sign * at_a_block.energy() / (2.0 * h)
        at_a_block.simulation.reset()
        at_a_block.put(place, orientation)
        at_a_block.simulation.start()
        at_a_block.simulation.advance_to(1)
        velocity, mass = at_a_block.state.motion()["velocity"], at_a_block.model.body_mass
        own = mass[-1] * velocity[at_a_block.model.body_count - 1]
        # A run begins half a step back: the first kick is of half a step.
        count = at_a_block.simulation.contacts.store.sphere_count[None]
        error = CONCRETE.contact_stiffness * h * count
        assert np.abs(own / (0.5 * dt) + slope).max() < error < 0.2 * np.linalg.norm(slope)
        # Sums of some hundred impulses at arms of 0.1 m.
        rows = at_a_block.simulation.readings.momentum()
        linear, angular = rows[:, :3].sum(axis=0), rows[:, 3:6].sum(axis=0)
        assert np.abs(linear).max() < 100 * EPS * np.linalg.norm(own)
        assert np.abs(angular).max() < 100 * EPS * np.linalg.norm(own) * 0.1


def facing(gap):
    """Two tetrahedra, mirror images, whose faces are a gap [m] apart along x."""
    left = single()
    right = left.points * [-1.0, 1.0, 1.0] + [gap, 0.0, 0.0]
    return checked_mesh(np.vstack([left.points, right]), [[0, 1, 2, 3], [4, 5, 7, 6]], {})


def test_a_centre_behind_a_face_is_pushed_back():
    """Energy of a face pressed into another grows until centres are behind by nearly a radius."""
    simulation = Simulation(Scene(facing(1e-9), LOSSLESS, [effects.FaceContact()]), Uniform(1e-9))
    simulation.start()
    model = simulation.model
    still, energies = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)), []
    for depth in np.linspace(0.0, 1.9 * model.spheres.radius[0, 0].min(), 30):
        simulation.state.set_motion(model.centre - [[0.0] * 3, [depth, 0.0, 0.0]], still)
        simulation.broad_phase.search()
        energies.append(simulation.energy_balance.account()["sphere_strain"])
    assert energies[0] < 1e-9 * energies[-1]
    assert (np.diff(energies) > 0.0).all()


def test_a_sphere_inside_a_body_is_named_as_such():
    simulation = Simulation(Scene(facing(1e-9), LOSSLESS, [effects.FaceContact()]), Uniform(1e-9))
    model = simulation.model
    depth = [[0.0] * 3, [1.1 * model.spheres.radius[0, 0].min(), 0.0, 0.0]]
    simulation.state.set_motion(model.centre - depth, np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)))
    with pytest.raises(SimulationDiverged, match=r"a contact sphere inside body \d .* % of its"):
        simulation.advance_to(1)


def test_faces_that_meet_leave_as_fast_as_they_came():
    """Thirty springs: 30 k D^2 / 2 = m v^2; kicks and drifts change the speed by (w dt)^2.

    Six spheres of each body lie behind its face, and nine behind the others touch it too.
    """
    gap, speed, dt = 1e-6, 1.0, 1e-7
    simulation = Simulation(Scene(facing(gap), LOSSLESS, [effects.FaceContact()]), Uniform(dt0=dt))
    model = simulation.model
    still = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    simulation.state.set_motion(model.centre, still, [[speed, 0, 0], [-speed, 0, 0]])
    distance, residual = [], []
    for step in range(1, 801):
        simulation.advance_to(step)
        motion = simulation.state.motion()
        distance.append(motion["position"][1, 0] - motion["position"][0, 0])
        residual.append(abs(simulation.energy_balance.account()["residual"]))
    mass = model.body_mass[0]
    rate = np.sqrt(2.0 * 30.0 * CONCRETE.contact_stiffness / mass)
    deepest = model.centre[1, 0] - model.centre[0, 0] - gap - min(distance)
    expected = speed * np.sqrt(mass / (15.0 * CONCRETE.contact_stiffness))
    assert 800 * dt > np.pi / rate + 2.0 * gap / speed
    # Samples are up to half a step from the deepest point, where the overlap is a parabola.
    assert deepest == pytest.approx(expected, rel=(rate * dt) ** 2)
    assert motion["velocity"][1, 0] == pytest.approx(speed, rel=(rate * dt) ** 2)
    assert residual[-1] < (rate * dt) ** 2 * mass * speed**2


def braking(friction):
    """Braking of a tetrahedron at 5 m/s over faces of the plate, over the impulse of the plate.

    The impulse along the normal is that of the weight and of what the body bounces.
    """
    speed, time, method = 5.0, 0.01, ImplicitDashpots(0.5 * STEP)
    simulation, way = sliding(tetrahedron(), speed, 0.4, friction, method)
    dt, ends = simulation.method.dt0, []
    for part in (0.1, 1.0):
        simulation.advance_to(round(part * time / dt))
        velocity = simulation.values(simulation.state.velocity)[simulation.model.body_count - 1]
        ends.append((velocity @ way, velocity[1]))
    (first, up), (last, higher) = ends
    return (first - last) / (GRAVITY * 0.9 * time + higher - up), simulation


@pytest.mark.slow
def test_a_face_slides_over_many_unbraked_but_for_coulomb_friction():
    """What a step adds to the braking falls with its square: by 4 from 2e-6 s to 1e-6 s."""
    assert abs(braking(0.0)[0]) < 1e-4
    found, simulation = braking(CONCRETE.friction)
    account = simulation.energy_balance.account()
    assert found == pytest.approx(CONCRETE.friction, rel=1e-4)
    assert abs(account["residual"]) < 1e-2 * account["friction"]
