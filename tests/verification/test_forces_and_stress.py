"""Forces of supports and loads against booked impulses; stress of bodies against closed forms.

Virial theorem: where each force acts at one point of both of its bodies, the sum of V sigma over
bodies is that of the forces from outside times their places, less m a times the centres.
"""

from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    ImplicitDashpots,
    Scene,
    Simulation,
    Uniform,
    effects,
    read_mesh,
)
from taichi_dem.mesh.mesh import volumes
from taichi_dem.mesh.shapes import bar, placed_together
from taichi_dem.mesh.tetrahedra import area_vectors
from taichi_dem.mesh.topology import face_vertices, faces_of_group
from taichi_dem.output.record import Recorder
from taichi_dem.state.model import column_of, names_of
from tests.made_result import made_result
from tests.scenes import matrix, paper_effects, quaternion
from tests.structures import POST, filled

EPS = np.finfo(float).eps
#: Relative error of what is in equilibrium, which the damped runs below reach.
STATIC = 1e-9


def symmetric(matrix):
    return 0.5 * (matrix + matrix.T)


def virial(model, stress, bodies=slice(None)):
    """Sum of V sigma over bodies [N m]."""
    return (volumes(model.mesh)[:, None, None] * stress)[bodies].sum(axis=0)


def faces_of(model, group):
    """Bodies of a group's faces, area vectors and middles at rest."""
    body, face = faces_of_group(model.mesh, model.topology, group)
    corners = face_vertices(model.mesh, body, face)
    points = model.mesh.points
    return body, area_vectors(points, corners), points[corners].mean(axis=1)


def pushed(model, frame, group, pressure):
    """Sum of a pressure's forces on a group times where its faces are [N m]."""
    body, area, middle = faces_of(model, group)
    turn, arm = frame.rotation[body], middle - model.centre[body]
    place = frame.position[body] + np.einsum("nij,nj->ni", turn, arm)
    return -pressure * np.einsum("nij,nj->ni", turn, area).T @ place


def test_forces_are_the_impulses_of_the_coming_step():
    """A leapfrog's impulse is force times step, on every body, of loads that change as well.

    Booked impulses are sums over the steps before, of which each rounds the last bit.
    """
    listed = [
        effects.BondDamping(),
        effects.Fixed("right"),
        effects.Roller("bottom", (0.0, 2.0, 0.0)),
        effects.PrescribedMotion("left", (0.3, 0.0, 0.1), frequency=2e4),
        effects.Gravity(),
        effects.Pressure("front", [0.0, 1e6, 0.0], [0.0, 5e-6, 2e-5]),
        effects.GasPressure("top", peak=1e6, rise=1e-5),
        effects.QuietBoundary("back"),
    ]
    step, listed = 2e-8, filled("supports", *listed)
    simulation = Simulation(Scene(bar(0.3, 0.1, (3, 1, 1)), CONCRETE, listed), Uniform(step))
    for k in (1, 400, 401):
        simulation.advance_to(k - 1)
        forces = simulation.forces.on_bodies()
        before = simulation.values(simulation.state.load_impulse)[:, :3]
        simulation.advance_to(k)
        after = simulation.values(simulation.state.load_impulse)[:, :3]
        size = np.abs(after).max()
        assert np.abs(step * forces.sum(axis=0) - (after - before)).max() < k * EPS * size
    weight, *others = forces
    mass, groups = simulation.model.body_mass, "front top back right bottom left".split()
    assert np.array_equal(weight, mass[:, None] * np.array([0.0, -9.81, 0.0]))
    for force, group in zip(others, groups, strict=True):
        acted = np.flatnonzero(force.any(axis=1))
        assert set(acted) <= set(faces_of(simulation.model, group)[0]) and len(acted)
    assert not others[groups.index("bottom")][:, [0, 2]].any()


def test_no_two_names_are_alike_whatever_groups_are_called():
    """A number, a space or the kind of another effect in the name of a group."""
    groups = "a", "a", "a 2", "a_2", "a", "pressure a"
    listed = [*map(effects.Fixed, groups), effects.Pressure("a", 1.0), effects.Gravity()]
    listed += [effects.Gravity(), effects.Softening().silent(), effects.ShearSlip().silent()]
    names = names_of(listed)
    assert names[-2:] == ["", ""] and names[0] == "fixed a" and names[6] == "pressure a"
    columns = [column_of(name) for name in names[:-2]]
    assert len({*columns}) == len(columns) == 9


def damped(seconds):
    """Concrete with dashpots of its springs times a time [s]: nothing slower swings."""
    rates = {"normal_damping": "normal_stiffness", "shear_damping": "shear_stiffness"}
    return replace(CONCRETE, **{a: seconds * getattr(CONCRETE, b) for a, b in rates.items()})


def settled(mesh, listed, material, until, step=3e-6):
    """A scene with solved dashpots after a time [s]: simulation and recorder, with one sample."""
    simulation = Simulation(Scene(mesh, material, listed), ImplicitDashpots(step))
    simulation.advance_to(round(until / step))
    recorder = Recorder(simulation)
    recorder.sample()
    return simulation, recorder


#: Load, its direction and force [N].
CANTILEVERS = {
    "pulled": (effects.Pressure("right", -1e6), 0, 1e6 / 16.0),
    "bent": (effects.Pressure("top", 1e4), 1, -1e4 / 4.0),
}


@pytest.mark.parametrize("name", CANTILEVERS)
def test_a_support_bears_the_load_and_both_make_the_stress(name):
    """Equilibrium: their forces add up to zero. Virial: sum V sigma = sum F x.

    A support's force is at the middles of its faces, which do not move. A section that is pulled
    has the mean stress F / A: of the volume between two sections F times their distance, which
    grows with the strain, here below 1e-4, over the volume at rest.
    """
    load, axis, force = CANTILEVERS[name]
    own = effects.BondDamping(), effects.Fixed("left"), load
    listed = filled("supports", *own, group="post_base")
    mesh = placed_together({"bar": (bar(1.0, 0.25, (6, 1, 1)), (0.0, 0.0, 0.0))} | POST)
    simulation, recorder = settled(mesh, listed, damped(1e-3), 7e-2)
    loads, held = (
        np.array([recorder.rows[0][f"{one}_force_{k}_N"] for k in "xyz"])
        for one in (f"pressure_{load.group}", "fixed_left")
    )
    assert np.abs(loads + held).max() < STATIC * abs(force)
    # The pressure turns with the faces, by less than 1e-4: a cosine of 1 - 5e-9.
    assert loads[axis] == pytest.approx(force, rel=1e-8)

    model, frame = simulation.model, recorder.frame()
    body, _, middle = faces_of(model, "left")
    # Supports come last: a roller and a motion after the fixed end.
    borne = simulation.forces.on_bodies()[-3][body].T @ middle
    expected = symmetric(pushed(model, frame, load.group, load.values[0]) + borne)
    found = virial(model, frame.stress)
    assert np.abs(found - expected).max() < STATIC * np.abs(expected).max()
    if name == "pulled":
        for cell in range(6):
            cells = slice(6 * cell, 6 * cell + 6)
            pulled = virial(model, frame.stress, cells)[0, 0] / (0.25**2 / 6.0)
            assert pulled == pytest.approx(1e6, rel=1e-4)


def test_a_pressed_block_has_the_stress_of_what_presses_it():
    """Contact of whole bodies: sigma = -p in the mean of a block, which no bond joins to another.

    The virial of a block is F times the distance of the faces that press it. Strain below 1e-4.
    The other block is held where they meet, so that its support bears the force of the contact.
    """
    block = bar(0.25, 0.25, (1, 1, 1))
    parts = {"first": (block, (0.0, 0.0, 0.0)), "second": (block, (0.25, 0.0, 0.0))}
    gas = effects.GasPressure("second_right", peak=1e6, rise=1e-4, decay_ratio=1e12)
    own = effects.BondDamping(), effects.BodyContact(), effects.Fixed("first_right"), gas
    listed = filled("bodies", *own)
    mesh = placed_together(parts, keep_coincident=True)
    smooth = replace(damped(2e-4), friction=0.0)
    simulation, recorder = settled(mesh, listed, smooth, 3e-2)
    borne = recorder.rows[0]["fixed_first_right_force_x_N"]
    assert borne == pytest.approx(1e6 / 16.0, rel=STATIC)
    stress = virial(simulation.model, recorder.frame().stress, slice(6, 12)) / 0.25**3
    assert stress[0, 0] == pytest.approx(-1e6, rel=1e-4)
    # Sheared by no more than the square of the strain.
    assert np.abs(stress - np.diag([stress[0, 0], 0.0, 0.0])).max() < (5e-5) ** 2 * 1e6


def test_stress_of_each_body_is_that_of_the_forces_of_its_units():
    """V sigma = sum f x, with every unit's force by its own stiffness and opening.

    To the angle between bodies, here some 1e-6. Openings of 1e-7 m round to 1e-9 of themselves.
    """
    scene = Scene(bar(0.3, 0.1, (1, 1, 1)), CONCRETE, filled("bonds"))
    simulation = Simulation(scene, Uniform(1e-8))
    model, random = simulation.model, np.random.default_rng(3)
    turns, place = small_turns(random, 6), model.centre + 1e-7 * random.normal(size=(6, 3))
    simulation.state.set_motion(place, turns)
    simulation.start()
    found = Recorder(simulation).frame().stress
    expected = np.zeros((6, 3, 3))
    turns = np.array([matrix(turn) for turn in turns])
    top, bonds = model.topology, model.bonds
    for b, (i, j) in enumerate(zip(top.master, top.slave)):
        axes = bonds["frame"][b] @ turns[i].T
        normal, shear = model.bond_stiffness[b]
        for master, slave in zip(bonds["on_master"][b], bonds["on_slave"][b]):
            point = place[j] + turns[j] @ slave
            opening = axes @ (point - place[i]) - master
            force = -bonds["area"][b] * axes.T @ (np.array([normal, shear, shear]) * opening)
            expected[j] += np.outer(force, point - place[j])
            expected[i] -= np.outer(force, point - place[i])
    expected = np.array([symmetric(one) for one in expected])
    expected /= volumes(model.mesh)[:, None, None]
    assert np.abs(found - expected).max() < 1e-5 * np.abs(expected).max()


def small_turns(random, count):
    """Unit quaternions of turns of about 1e-6."""
    turns = np.column_stack([np.ones(count), 5e-7 * random.normal(size=(count, 3))])
    return turns / np.linalg.norm(turns, axis=1)[:, None]


def test_stress_of_a_breaking_block_is_the_virial_of_gas_and_inertia():
    """With broken bonds and contacts, to rounding: sum V sigma = sum F x - sum m a x.

    m a is what the coming step of a leapfrog changes in momentum over the step.
    """
    step, steps = 2e-8, 1500
    soft = replace(CONCRETE, contact_damping=1e-3 * CONCRETE.contact_damping)
    listed = paper_effects(peak=3 * 575e6, rise=4e-5)
    simulation = Simulation(Scene(read_mesh(PAPER_BLOCK), soft, listed), Uniform(step))
    simulation.advance_to(steps)
    assert simulation.readings.contacts_now()["on_second"].any()
    model, frame = simulation.model, Recorder(simulation).frame()
    forces = simulation.forces.on_bodies()[0]
    before = simulation.values(simulation.state.velocity)
    simulation.advance_to(steps + 1)
    after = simulation.values(simulation.state.velocity)
    inertia = (model.body_mass / step)[:, None] * (after - before)
    body, area, _ = faces_of(model, "hole")
    turned = np.einsum("nij,nj->ni", frame.rotation[body], area)
    pressure = -forces[body[0]] @ turned[0] / (turned[0] @ turned[0])
    boundary = pushed(model, frame, "hole", pressure)
    expected = symmetric(boundary - inertia.T @ frame.position)
    size = np.abs(volumes(model.mesh)[:, None, None] * frame.stress).sum()
    assert np.abs(virial(model, frame.stress) - expected).max() < STATIC * size


def test_a_crack_is_as_open_as_its_faces_have_been_moved_apart():
    """Aperture d of a slave that is moved by d along the normal and turned about its face's middle.

    By a move across as well, and for a pair that is turned as a whole. Places round to 1e-16 m.
    """
    made = made_result(mesh=bar(0.3, 0.1, (1, 1, 1)), frames=1)
    model, random, bond, opened = made.model, np.random.default_rng(4), 2, 3e-4
    normal = model.bonds["frame"][bond, 0]
    j = model.topology.slave[bond]
    middle = model.mesh.points[model.topology.vertices[bond]].mean(axis=0)
    whole, own = (matrix(quaternion(random.normal(size=3), angle)) for angle in (0.7, 0.02))
    across = np.cross(normal, random.normal(size=3))
    rotation = np.tile(whole, (model.body_count, 1, 1))
    position = model.centre @ whole.T
    rotation[j] = whole @ own
    moved = middle + opened * normal + 0.01 * across + own @ (model.centre[j] - middle)
    position[j] = whole @ moved
    frame = replace(made.frames[0], position=position, rotation=rotation)
    broken = np.full(model.bond_count, np.nan)
    broken[bond] = 0.0
    cracks = replace(made, frames=(frame,), broken_time=broken).cracks()
    assert cracks["bond"].tolist() == [bond]
    assert cracks["aperture_m"][0] == pytest.approx(opened, abs=1e-15)
    assert np.isnan(replace(made, frames=(), broken_time=broken).cracks()["aperture_m"][0])
    still = np.setdiff1d(np.arange(model.bond_count), model.topology.body_bond[j])
    assert np.abs(replace(made, frames=(frame,)).apertures()[still]).max() < 1e-15
